// The surface view and its description.

import type { Snapshot } from "../model/snapshot";
import type { SessionInfo } from "../protocol";
import { contactWords, isPlaced, number, statusWords } from "../words";

/** Returns true for a surface of two directions. */
export function isPlane(session: SessionInfo): boolean {
  const surface = session.surface;
  return surface !== null && surface.width_mm !== null && surface.kind !== "beam" && surface.kind !== "digit";
}

export function describe(shown: Snapshot): string {
  const { session, sample } = shown;
  const surface = session.surface;
  if (surface === null) return "No surface yet: the rig does not exist yet.";
  const across = isPlane(session) ? ` by ${number(surface.width_mm ?? 0, 1)}` : "";
  const what = `${surface.kind} of ${number(surface.length_mm, 1)}${across} mm with ${session.channels.length} sensors`;
  const next = shown.calibration?.next ?? null;
  if (next !== null) return `A ${what}. To be pressed at ${contactWords({ ...next, sd_mm: 0.1 })}.`;
  if (sample === null) return `A ${what}. No reading yet.`;
  const place = isPlaced(sample.status) ? ` at ${contactWords(sample)}` : "";
  return `A ${what}. ${statusWords(sample).word}${place}.`;
}
