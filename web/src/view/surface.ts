// What the surface view shows at an instant, and the words for it.

import type { CalibrationRecord, SampleRecord, SessionInfo } from "../protocol";
import { contactWords, isPlaced, number, statusWords } from "../words";
import type { TrailPoint } from "../model/trail";

/** An instant as it is drawn. */
export interface Shown {
  session: SessionInfo;
  sample: SampleRecord | null;
  trail: (TrailPoint & { age: number })[];
  /** Readings less what they are untouched, in the units of the channels; null while nothing touches, or before anything was read untouched. */
  deflections: number[] | null;
  /** The calibration that goes on; null without one. */
  calibration: CalibrationRecord | null;
}

/** True of a surface that is located in two directions. */
export function isPlane(session: SessionInfo): boolean {
  const surface = session.surface;
  return surface !== null && surface.width_mm !== null && surface.kind !== "beam" && surface.kind !== "digit";
}

/** The picture in a sentence. */
export function describe(shown: Shown): string {
  const { session, sample } = shown;
  const surface = session.surface;
  if (surface === null) return "No surface: there is no locator.";
  const across = isPlane(session) ? ` by ${number(surface.width_mm ?? 0, 1)}` : "";
  const what = `${surface.kind} of ${number(surface.length_mm, 1)}${across} mm with ${session.channels.length} sensors`;
  const next = shown.calibration?.next ?? null;
  if (next !== null) return `A ${what}. To be pressed at ${contactWords({ ...next, sd_mm: 0.1 })}.`;
  if (sample === null) return `A ${what}. No reading yet.`;
  const place = isPlaced(sample.status) ? ` at ${contactWords(sample)}` : "";
  return `A ${what}. ${statusWords(sample).word}${place}.`;
}
