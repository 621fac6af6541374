// The list of events, and what is said aloud.

import { element, need } from "../dom";
import type { Live } from "../model/live";
import type { EventRecord } from "../protocol";
import { clock, eventWords } from "../words";

/** Events listed at most. */
const LISTED = 60;

export class Events {
  private written = -1;

  write(live: Live): void {
    if (live.eventCount === this.written) return;
    this.written = live.eventCount;
    const newest = live.events.slice(-LISTED).reverse();
    need("events").replaceChildren(
      ...newest.map((event) => element("li", "", element("time", "quiet", clock(event.time_s)), ` ${eventWords(event)}`)),
    );
  }
}

/** Says touch-down, lift-off and what else a person must know to a screen reader: the newest of a message. */
export function announce(events: EventRecord[]): void {
  const last = events.at(-1);
  if (last !== undefined) need("announcer").textContent = eventWords(last);
}
