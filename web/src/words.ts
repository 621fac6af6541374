// Names of statuses, states and events, and numbers with units.

import type { ChannelState, ContactRecord, EstimateRecord, EventRecord, Status } from "./protocol";

export const PLAIN_MARK = "mark";

/** Returns true for a status with a meaningful position. */
export function isPlaced(status: Status): boolean {
  return status === "located" || status === "ambiguous";
}

export function statusWords(estimate: EstimateRecord): { word: string; why: string } {
  switch (estimate.status) {
    case "located": {
      const further = estimate.further?.length ?? 0;
      if (further > 0) {
        return { word: `${further + 1} contacts`, why: "The strongest is given in numbers; the others are marked." };
      }
      if (estimate.trade_off !== undefined) {
        return { word: "Located", why: `Near an end ${estimate.trade_off} trade off: other pairs of them read alike.` };
      }
      return { word: "Located", why: "One contact explains the reading." };
    }
    case "no_contact":
      return { word: "No contact", why: "The reading does not exceed its noise." };
    case "ambiguous": {
      const others = estimate.modes?.length ?? 0;
      const places = others === 1 ? "another place explains" : `${others} other places explain`;
      return { word: "Ambiguous", why: `The most probable place is given; ${places} the reading too.` };
    }
    case "outside_model":
      return {
        word: "Outside model",
        why: "No single contact explains the reading within the noise: a second contact, a patch, a damaged or exchanged channel, or drift. If the surface is untouched, tare.",
      };
    case "outside_surface":
      return { word: "Outside surface", why: "The position is beyond the surface's edge, which no contact can have." };
  }
}

export function channelWords(state: ChannelState): string {
  return { well: "reads", dead: "dead: one value", saturated: "saturated: at the end of its range" }[state];
}

const BAD_FRAMES: Record<string, string> = {
  too_long: "longer than any frame",
  channels: "another number of values than channels",
  missing_channel: "a channel is missing",
  not_a_number: "a value is not a number",
  encoding: "not text",
  checksum: "the checksum is wrong",
  malformed: "not a frame",
};

export function badFrameWords(cause: string): string {
  return BAD_FRAMES[cause] ?? cause.replaceAll("_", " ");
}

export function contactWords(contact: ContactRecord): string {
  const place =
    contact.y_mm === undefined
      ? `${number(contact.x_mm, contact.sd_mm)} mm`
      : `${number(contact.x_mm, contact.sd_mm)}, ${number(contact.y_mm, contact.sd_mm)} mm`;
  return contact.force_n === undefined ? place : `${place}, ${number(contact.force_n, contact.sd_force_n)} N`;
}

export function eventWords(event: EventRecord): string {
  switch (event.event) {
    case "source_opened":
      return `Source opened: ${event.name}`;
    case "source_lost":
      return `Source lost: ${event.why}`;
    case "source_ended":
      return "Source ended";
    case "gap": {
      const lost = event.lost_frames === undefined ? "" : `, ${event.lost_frames} frames lost`;
      return `Gap of ${seconds(event.seconds)}${lost}`;
    }
    case "clock_set":
      return `Clock set ${event.by_s < 0 ? "back" : "forward"} by ${seconds(Math.abs(event.by_s))}`;
    case "touch_down":
      return `Touch-down at ${contactWords(event)}`;
    case "move":
      return `Moved to ${contactWords(event)}`;
    case "second_contact":
      return `Second contact at ${contactWords(event)}`;
    case "lift_off":
      return `Lift-off after ${seconds(event.seconds)}`;
    case "outside_model":
      return "Outside model: no single contact explains the readings";
    case "channel":
      return `Channel ${event.name}: ${channelWords(event.state)}`;
    case "tared":
      return "Tared: the baseline was measured again";
    case "trouble":
      return `Trouble: ${event.text}`;
    case "alarm":
      return `Alarm: ${event.text} (${event.name})`;
    case "mark":
      return event.text === PLAIN_MARK ? "Mark" : `Mark: ${event.text}`;
  }
}

/**
 * A number with as many decimals as the standard deviation justifies: the first digit of the latter is
 * the last.
 */
export function number(value: number, sd?: number): string {
  if (!Number.isFinite(value)) return "—";
  return fixed(value, decimals(sd ?? Math.abs(value) / 100));
}

/** A number with fixed decimals; a number that rounds to 0 has no sign. */
export function fixed(value: number, places: number): string {
  const digits = value.toFixed(places);
  return Number(digits) === 0 ? digits.replace("-", "") : digits.replace("-", "−");
}

/** Values of an axis with ticks `step` apart, all with as many digits as distinguish them. */
export function axisNumbers(values: readonly number[], step: number): string[] {
  const largest = Math.max(...values.map(Math.abs), 0);
  // Small values all along the axis have a power of ten.
  if (largest > 0 && largest < SMALL) {
    const power = Math.floor(Math.log10(largest) + 1e-9);
    const digits = decimalsOf(step / 10 ** power);
    return values.map((value) => (value === 0 ? "0" : `${fixed(value / 10 ** power, digits)}e${fixed(power, 0)}`));
  }
  return values.map((value) => grouped(fixed(Math.abs(value) < step / 2 ? 0 : value, decimalsOf(step))));
}

/** Decimals of multiples of a step, 12 at most. */
function decimalsOf(step: number): number {
  let places = 0;
  const isWhole = (scaled: number) => Math.abs(scaled - Math.round(scaled)) <= 1e-6 * scaled;
  while (places < 12 && !isWhole(step * 10 ** places)) places += 1;
  return places;
}

/** Largest value of an axis with a power of ten. */
const SMALL = 1e-3;

/** Groups five or more digits before the point by threes. */
function grouped(text: string): string {
  const [, sign, whole, rest] = /^(−?)(\d+)(.*)$/.exec(text) ?? ["", "", text, ""];
  return whole!.length < 5 ? text : `${sign}${whole!.replace(/\B(?=(\d{3})+$)/g, ",")}${rest}`;
}

/** A standard deviation or other size, to two digits. */
export function size(value: number): string {
  if (!Number.isFinite(value)) return "—";
  if (value === 0) return "0";
  const places = Math.max(0, Math.min(9, 1 - Math.floor(Math.log10(Math.abs(value)))));
  return fixed(value, places);
}

function decimals(sd: number): number {
  if (!(sd > 0)) return 2;
  return Math.max(0, Math.min(6, -Math.floor(Math.log10(sd))));
}

export function seconds(value: number): string {
  if (value < 1) return `${Math.round(value * 1000)} ms`;
  if (value < 60) return `${value.toFixed(1)} s`;
  const whole = Math.round(value);
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (part: number) => String(part).padStart(2, "0");
  return hours > 0 ? `${hours}:${two(minutes)}:${two(rest)} h` : `${minutes}:${two(rest)} min`;
}

export function bytes(value: number): string {
  const units = ["B", "kB", "MB", "GB"];
  let power = 0;
  while (value >= 1000 && power < units.length - 1) {
    value /= 1000;
    power += 1;
  }
  return `${power === 0 ? value : value.toFixed(1)} ${units[power]}`;
}

export function hertz(value: number): string {
  return value < 10 ? `${value.toFixed(1)} Hz` : `${Math.round(value).toLocaleString("en-GB")} Hz`;
}

/** Time of day, to the tenth of a second. */
export function clock(time_s: number): string {
  const date = new Date(time_s * 1000);
  const two = (part: number) => String(part).padStart(2, "0");
  const tenth = Math.floor(date.getMilliseconds() / 100);
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}.${tenth}`;
}

/** Date and time of an instant, or "empty". */
export function begun(time_s: number | null): string {
  if (time_s === null) return "empty";
  return `${new Date(time_s * 1000).toLocaleDateString("en-GB")} ${clock(time_s)}`;
}

export function unit(symbol: string): string {
  return symbol.replace(/^u(?=[a-z])/, "µ");
}
