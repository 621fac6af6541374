// What the page knows of the session, from its messages.

import type { EventRecord, PastRecord, SampleRecord, StateRecord, StreamMessage } from "../protocol";
import { Baseline } from "./baseline";
import { History } from "./history";
import { Trail } from "./trail";

/** Events that are kept; moves are many, and only in the recording. */
const EVENTS = 1_000;
/** Rows of a history that are kept as they came: a minute of 1,000 readings a second, ten minutes of 100. */
const ROWS = 60_000;

/** The session by its messages. */
export class Live {
  readonly history: History;
  readonly trail = new Trail();
  readonly baseline = new Baseline();
  readonly events: EventRecord[] = [];
  state: StateRecord | null = null;
  sample: SampleRecord | null = null;
  /** Messages that this browser was too slow for. */
  missed = 0;
  /** Grows with every event, so that a list knows when to be written anew. */
  eventCount = 0;

  constructor(readonly channels: number) {
    this.history = new History(channels, ROWS);
  }

  /** Takes a message; gives the events that a person should be told. */
  take(message: StreamMessage): EventRecord[] {
    this.state = message.state;
    this.missed += message.missed;
    const told = message.events.filter((event) => event.event !== "move");
    let next = 0;
    for (const sample of message.samples) {
      // A gap lies before the first reading after it.
      while (next < told.length && told[next]!.time_s <= sample.time_s) this.note(told[next++]!);
      this.add(sample);
    }
    while (next < told.length) this.note(told[next++]!);
    return told;
  }

  /** Takes what the server kept of the session from before the first message. */
  takePast(past: PastRecord): void {
    const firstEvent = this.events[0]?.time_s ?? Infinity;
    const events = past.events.filter((event) => event.time_s < firstEvent);
    const gaps = events.flatMap((event) => (event.event === "gap" ? [event.time_s - event.seconds / 2] : []));
    this.history.pushBefore(past.samples, gaps);
    this.events.unshift(...events.slice(-Math.max(0, EVENTS - this.events.length)));
    this.eventCount += events.length;
    if (this.baseline.mean === null) past.samples.forEach((sample) => this.baseline.push(sample));
  }

  private add(sample: SampleRecord): void {
    // Another session began: of a server that was started anew.
    if (this.sample !== null && sample.number < this.sample.number) {
      this.history.clear();
      this.trail.clear();
      this.baseline.clear();
    }
    this.sample = sample;
    this.history.push(sample);
    this.trail.push(sample);
    this.baseline.push(sample);
  }

  private note(event: EventRecord): void {
    if (event.event === "gap") {
      this.history.pushGap(event.time_s - event.seconds / 2);
      this.trail.clear();
    }
    if (event.event === "tared") this.baseline.clear();
    this.events.push(event);
    if (this.events.length > EVENTS) this.events.shift();
    this.eventCount += 1;
  }
}
