// Error budget: the limit of the setup and the uncertainty of an estimate.

import type { LimitInfo, SessionInfo } from "../protocol";

/** Kinds of surface with readings in proportion to the force, so that the limit falls as 1 / force. */
const LINEAR = ["beam", "plate"];

/**
 * Factor from the given limit to that at a contact's force. Readings are influence × force, so the
 * Cramér–Rao bound of the position is proportional to 1 / force. For a known force or a nonlinear
 * surface the factor is 1.
 */
export function forceFactor(session: SessionInfo, force_n: number | undefined): number {
  const scales = session.force.unknown && LINEAR.includes(session.surface?.kind ?? "");
  if (!scales || session.limit === null || force_n === undefined || force_n <= 0) return 1;
  return session.limit.force_n / force_n;
}

/**
 * Limit at a place in mm: interpolated on a line, of the nearest position on a plane; null without a
 * limit.
 */
export function limitAt(limit: LimitInfo, x_mm: number, y_mm: number | undefined): number | null {
  const along = limit.positions_mm;
  if (along.length === 0) return null;
  if (typeof along[0] !== "number") return nearest(limit, x_mm, y_mm ?? 0);
  const xs = along as number[];
  const right = xs.findIndex((x) => x >= x_mm);
  if (right < 0) return null;
  if (xs[right] === x_mm) return limit.sd_mm[right] ?? null;
  if (right === 0) return null;
  const [low, high] = [limit.sd_mm[right - 1] ?? null, limit.sd_mm[right] ?? null];
  if (low === null || high === null) return null;
  const share = (x_mm - xs[right - 1]!) / (xs[right]! - xs[right - 1]!);
  return low + share * (high - low);
}

function nearest(limit: LimitInfo, x_mm: number, y_mm: number): number | null {
  let [best, least] = [-1, Infinity];
  (limit.positions_mm as [number, number][]).forEach(([x, y], i) => {
    const squared = (x - x_mm) ** 2 + (y - y_mm) ** 2;
    if (squared < least) [best, least] = [i, squared];
  });
  return limit.sd_mm[best] ?? null;
}
