// Log of events, its search, and announcements.

import { element, need, setText } from "../dom";
import type { Snapshot } from "../model/snapshot";
import type { EventRecord } from "../protocol";
import { clock, eventWords } from "../words";

const LISTED = 200;

const KINDS: Record<string, string> = {
  touch_down: "contact",
  lift_off: "contact",
  second_contact: "contact",
  outside_model: "contact",
  move: "contact",
  source_opened: "source",
  source_lost: "source",
  source_ended: "source",
  gap: "source",
  clock_set: "source",
  channel: "source",
  trouble: "source",
  tared: "source",
  alarm: "alarm",
  mark: "mark",
};

export class Events {
  private written = "";

  constructor() {
    // The next snapshot is a quarter of a second away.
    need("events-search").oninput = need("events-kind").onchange = () => (this.written = "");
  }

  write({ events, eventCount }: Snapshot): void {
    const search = need<HTMLInputElement>("events-search").value;
    const kind = need<HTMLSelectElement>("events-kind").value;
    const written = JSON.stringify([eventCount, search, kind]);
    if (written === this.written) return;
    this.written = written;
    const found = findEvents(events, search, kind);
    const listed = found.slice(-LISTED).reverse();
    const all = search === "" && kind === "" && found.length <= LISTED;
    setText(need("events-count"), all ? "" : `${listed.length} of ${events.length}`);
    need("events").replaceChildren(
      ...listed.map((event) => element("li", event.event === "alarm" ? "alarmed" : "", element("time", "quiet", clock(event.time_s)), ` ${eventWords(event)}`)),
    );
  }
}

/** Events of a kind that contain every word of a search, in any case. */
export function findEvents(events: readonly EventRecord[], search: string, kind: string): EventRecord[] {
  const words = search.toLowerCase().split(/\s+/).filter((word) => word !== "");
  return events.filter((event) => {
    if (kind !== "" && KINDS[event.event] !== kind) return false;
    const text = `${clock(event.time_s)} ${eventWords(event)}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

/**
 * Announces the newest event of a message to a screen reader: touch-down, lift-off and other important
 * events.
 */
export function announce(events: EventRecord[]): void {
  const last = events.at(-1);
  if (last !== undefined) need("announcer").textContent = eventWords(last);
}
