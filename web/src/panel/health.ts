// Health of channels and source, in words.

import { element, need, setText } from "../dom";
import type { Snapshot } from "../model/snapshot";
import type { SessionInfo } from "../protocol";
import { badFrameWords, channelWords, hertz, number, seconds, size, unit } from "../words";

export class Health {
  private rows: HTMLTableCellElement[][];
  private facts = new Map<string, HTMLElement>();

  constructor(private session: SessionInfo) {
    const cells = session.channels.map((channel) => {
      const name = element("th", "", channel.name);
      name.scope = "row";
      if (channel.label !== channel.name) name.title = `The board calls it ${channel.label}`;
      return [name, ...Array.from({ length: 4 }, () => element("td", ""))];
    });
    this.rows = cells.map((row) => row.slice(1));
    need("health").replaceChildren(...cells.map((row) => element("tr", "", ...row)));
    need("source").replaceChildren();
  }

  writeChannels(shown: Snapshot): void {
    this.rows.forEach((row, i) => this.writeChannel(row, shown, i));
  }

  writeFacts(shown: Snapshot): void {
    const state = shown.state;
    const counters = state?.counters;
    const bad = Object.entries(counters?.bad_frames ?? {});
    this.fact("Source", this.sourceWords(shown));
    this.fact("Readings a second", state === null ? "—" : hertz(state.rate_hz));
    this.fact("Age of the last reading", ageWords(shown));
    this.fact("Readings located", (counters?.readings ?? 0).toLocaleString("en-GB"));
    this.fact("Frames lost", (counters?.lost_frames ?? 0).toLocaleString("en-GB"));
    this.fact("Gaps", String(counters?.gaps ?? 0));
    this.fact("Bad frames", bad.length === 0 ? "none" : bad.map(([cause, n]) => `${n} ${badFrameWords(cause)}`).join("; "));
    this.fact("Messages this browser missed", String(shown.missed));
    this.fact("Baseline", tareWords(this.session));
  }

  private writeChannel(row: HTMLTableCellElement[], shown: Snapshot, i: number): void {
    const channel = shown.state?.channels[i];
    const [state, now, noise, range] = row;
    if (channel === undefined || !state || !now || !noise || !range) return;
    const symbol = unit(this.session.channels[i]?.unit ?? "");
    const value = shown.live?.reading[i];
    state.dataset.state = channel.state;
    setText(state, channel.range === null ? "no reading yet" : channelWords(channel.state));
    setText(now, value === undefined ? "—" : `${number(value, channel.noise_sd)} ${symbol}`);
    setText(noise, channel.range === null ? "—" : `${size(channel.noise_sd)} ${symbol}`);
    setText(range, channel.range === null ? "—" : channel.range.map((end) => number(end, channel.noise_sd)).join("\nto "));
  }

  private sourceWords(shown: Snapshot): string {
    if (shown.state?.source != null) return shown.state.source;
    return this.session.source === null ? "none" : `${this.session.source}: not there, looked for again`;
  }

  private fact(name: string, words: string): void {
    let value = this.facts.get(name);
    if (value === undefined) {
      value = element("dd", "");
      need("source").append(element("dt", "", name), value);
      this.facts.set(name, value);
    }
    setText(value, words);
  }
}

function ageWords(shown: Snapshot): string {
  if (shown.live === null) return "—";
  const age_s = Date.now() / 1000 - shown.live.time_s;
  // The reading has the time of the server, the page that of the browser.
  return age_s < -0.05 ? "unknown: the server's clock is ahead of this browser's" : seconds(Math.max(0, age_s));
}

function tareWords(session: SessionInfo): string {
  if (!session.tare.available) return session.tare.why ?? "this locator cannot be tared";
  return session.tare.follows ? "tracked while the surface is untouched" : "stays until somebody tares";
}
