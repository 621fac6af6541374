// State of the session, from its messages.

import type { EventRecord, PastRecord, SampleRecord, StateRecord, StreamMessage } from "../protocol";
import { Baseline } from "./baseline";
import { History } from "./history";
import { Trail } from "./trail";

/** Largest number of events; moves are many, and only in the recording. */
const EVENTS = 1_000;
/** Complete rows of a history: a minute of 1,000 readings a second, ten minutes of 100. */
const ROWS = 60_000;

/** State of the session. */
export class Live {
  readonly history: History;
  readonly trail = new Trail();
  readonly baseline = new Baseline();
  readonly events: EventRecord[] = [];
  state: StateRecord | null = null;
  sample: SampleRecord | null = null;
  /** Messages that this browser was too slow for. */
  missed = 0;
  /** Grows with every event, so that lists are rewritten. */
  eventCount = 0;

  constructor(readonly channels: number) {
    this.history = new History(channels, ROWS);
  }

  /** Processes a message; returns the events for announcement. */
  take(message: StreamMessage): EventRecord[] {
    this.state = message.state;
    this.missed += message.missed;
    const told = message.events.filter((event) => event.event !== "move");
    let next = 0;
    for (const sample of message.samples) {
      // A gap precedes the first reading after it.
      while (next < told.length && told[next]!.time_s <= sample.time_s) this.note(told[next++]!);
      this.add(sample);
    }
    while (next < told.length) this.note(told[next++]!);
    return told;
  }

  /** Processes the server's record of the session before the first message. */
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
    // Another session of a restarted server.
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
