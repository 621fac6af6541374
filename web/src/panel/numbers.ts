// Status, position and force, as large numbers.

import { need, setText } from "../dom";
import type { Snapshot } from "../model/snapshot";
import type { SampleRecord, SessionInfo } from "../protocol";
import { isPlane } from "../view/surface";
import { isPlaced, number, statusWords } from "../words";

export function writeNumbers({ session, sample }: Snapshot): void {
  const status = need("status");
  if (sample === null) {
    status.dataset.status = "none";
    setText(status, "—");
    setText(need("why"), session.locator === null ? "No locator yet." : "No reading yet.");
  } else {
    const { word, why } = statusWords(sample);
    status.dataset.status = sample.status;
    setText(status, word);
    setText(need("why"), why);
  }
  const placed = sample !== null && isPlaced(sample.status) ? sample : null;
  setText(need("position"), placed === null ? "—" : placeWords(session, placed));
  setText(need("position-95"), placed === null ? "" : intervalWords(placed));
  setText(need("force"), placed?.force_n === undefined ? "—" : number(placed.force_n, placed.sd_force_n));
  setText(need("force-95"), forceWords(session, placed));
}

function placeWords(session: SessionInfo, sample: SampleRecord): string {
  const x = number(sample.x_mm, sample.sd_mm);
  return isPlane(session) && sample.y_mm !== undefined ? `${x}, ${number(sample.y_mm, sample.sd_mm)}` : x;
}

function intervalWords(sample: SampleRecord): string {
  if (sample.x_95_mm === undefined) return "This locator gives no interval.";
  const ends = (interval: [number, number]) => interval.map((end) => number(end, sample.sd_mm)).join(" to ");
  if (sample.y_95_mm === undefined) return `95 %: ${ends(sample.x_95_mm)} mm`;
  return `95 %: x ${ends(sample.x_95_mm)}, y ${ends(sample.y_95_mm)} mm`;
}

function forceWords(session: SessionInfo, sample: SampleRecord | null): string {
  const known = session.force.known_n;
  if (known !== null) return `Known: every contact presses with ${known} N.`;
  if (sample?.force_n === undefined) return sample === null ? "" : "This locator does not estimate the force.";
  if (sample.force_95_n !== undefined) {
    const [low, high] = sample.force_95_n;
    return `95 %: ${number(low, sample.sd_force_n)} to ${number(high, sample.sd_force_n)} N`;
  }
  if (sample.sd_force_n === undefined) return "";
  const half = 1.96 * sample.sd_force_n;
  return `95 %: ± ${number(half, half / 10)} N`;
}
