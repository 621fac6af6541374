// A recording with a playhead.

import type { RecordingContent, SampleRecord } from "../protocol";
import { Baseline } from "./baseline";
import { History } from "./history";
import { Trail, TRAIL_S } from "./trail";

/** A recording with a playhead, in seconds from its start. */
export class Player {
  readonly history: History;
  readonly baseline = new Baseline();
  readonly start_s: number;
  readonly seconds: number;
  private at_s = 0;
  playing = false;
  speed = 1;

  constructor(
    readonly name: string,
    private content: RecordingContent,
  ) {
    const { samples, events } = content;
    this.start_s = samples[0]?.time_s ?? content.start_s ?? 0;
    this.seconds = Math.max(0, (samples.at(-1)?.time_s ?? this.start_s) - this.start_s);
    this.history = new History(content.channels.length, Math.max(1, samples.length + events.length));
    const gaps = events.filter((event) => event.event === "gap");
    for (const sample of samples) {
      while (gaps.length > 0 && gaps[0]!.time_s <= sample.time_s) {
        const gap = gaps.shift()!;
        this.history.pushGap(gap.time_s - gap.seconds / 2);
      }
      this.history.push(sample);
      this.baseline.push(sample);
    }
  }

  get head_s(): number {
    return this.at_s;
  }

  seek(at_s: number): void {
    this.at_s = Math.min(Math.max(at_s, 0), this.seconds);
  }

  advance(by_s: number): void {
    if (!this.playing) return;
    this.seek(this.at_s + by_s * this.speed);
    if (this.at_s >= this.seconds) this.playing = false;
  }

  /** Starts or stops playing; restarts at the end. */
  toggle(): void {
    this.playing = !this.playing;
    if (this.playing && this.at_s >= this.seconds) this.at_s = 0;
  }

  /** Last sample that is not after the playhead, or the first one. */
  sample(): SampleRecord | null {
    return this.content.samples[this.index()] ?? null;
  }

  trail(): Trail {
    const trail = new Trail();
    const now = this.start_s + this.at_s;
    let first = this.index();
    while (first > 0 && this.content.samples[first - 1]!.time_s > now - TRAIL_S) first -= 1;
    this.content.samples.slice(first, this.index() + 1).forEach((sample) => trail.push(sample));
    return trail;
  }

  get length(): number {
    return this.content.samples.length;
  }

  private index(): number {
    const samples = this.content.samples;
    // A time as a double has steps of 0.2 µs since 1970.
    const now = this.start_s + this.at_s + 1e-6;
    let [low, high] = [0, samples.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (samples[middle]!.time_s <= now) low = middle + 1;
      else high = middle;
    }
    return Math.max(0, low - 1);
  }
}
