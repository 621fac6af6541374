// Controls of a replay.

import { api } from "../api";
import { need, setText } from "../dom";
import { Player } from "../model/player";
import type { RecordingInfo } from "../protocol";
import { seconds } from "../words";

/** Requested samples of a replay; the server thins longer recordings evenly. */
const POINTS = 8_000;

export class Replay {
  player: Player | null = null;

  constructor(private closed: () => void) {
    const scrubber = need<HTMLInputElement>("scrubber");
    scrubber.addEventListener("input", () => {
      this.player?.seek(Number(scrubber.value));
      this.write();
    });
    need("replay-play").addEventListener("click", () => this.toggle());
    need("replay-close").addEventListener("click", () => this.close());
    const speed = need<HTMLSelectElement>("replay-speed");
    speed.addEventListener("change", () => {
      if (this.player !== null) this.player.speed = Number(speed.value);
    });
  }

  async open(name: string): Promise<void> {
    const [content, all] = await Promise.all([api.recording(name, POINTS), api.recordings()]);
    const player = new Player(name, content);
    player.speed = Number(need<HTMLSelectElement>("replay-speed").value);
    player.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.player = player;
    const scrubber = need<HTMLInputElement>("scrubber");
    scrubber.max = String(player.seconds);
    // A step would make the end of the recording unreachable; keys step by a hundredth.
    scrubber.step = "any";
    setText(need("replay-title"), `Replay of ${name}`);
    setText(need("replay-note"), thinnedWords(player, all.find((one) => one.name === name)));
    need("replay").hidden = false;
    this.write();
    scrubber.focus();
  }

  close(): void {
    if (this.player === null) return;
    this.player = null;
    need("replay").hidden = true;
    this.closed();
  }

  toggle(): void {
    this.player?.toggle();
    this.write();
  }

  write(): void {
    const player = this.player;
    if (player === null) return;
    const scrubber = need<HTMLInputElement>("scrubber");
    scrubber.value = String(player.head_s);
    scrubber.setAttribute("aria-valuetext", `${player.head_s.toFixed(1)} of ${player.seconds.toFixed(1)} seconds`);
    setText(need("replay-time"), `${player.head_s.toFixed(2)} / ${seconds(player.seconds)}`);
    setText(need("replay-play"), player.playing ? "Stop" : "Play");
  }
}

function thinnedWords(player: Player, recording: RecordingInfo | undefined): string {
  const readings = recording?.readings ?? player.length;
  if (readings <= player.length) return "Every reading of the recording.";
  return `${player.length.toLocaleString("en-GB")} of ${readings.toLocaleString("en-GB")} readings, evenly thinned; the file has all.`;
}
