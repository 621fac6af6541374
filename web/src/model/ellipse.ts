// 95 % ellipse of a normal distribution in the plane.

/** Radius of the 95 % ellipse in standard deviations: √(−2 ln 0.05). */
export const RADIUS_95 = 2.4477;
/** Half width of a 95 % interval on a line, in standard deviations. */
const HALF_95 = 1.96;

/** An ellipse: half axes in mm, and the angle of the first from x to y, in radians. */
export interface Ellipse {
  x_mm: number;
  y_mm: number;
  half_mm: [number, number];
  angle: number;
}

/** Ellipse of a covariance xx, xy, yy in mm², by eigenvalues. */
export function ofCovariance(x_mm: number, y_mm: number, [xx, xy, yy]: [number, number, number]): Ellipse {
  const [mean, apart] = [(xx + yy) / 2, Math.hypot((xx - yy) / 2, xy)];
  const half = (variance: number) => RADIUS_95 * Math.sqrt(Math.max(0, variance));
  return { x_mm, y_mm, half_mm: [half(mean + apart), half(mean - apart)], angle: 0.5 * Math.atan2(2 * xy, xx - yy) };
}

/** Ellipse of two 95 % intervals, for a normal distribution with independent directions. */
export function ofIntervals(x_95: [number, number], y_95: [number, number]): Ellipse {
  const middle = ([low, high]: [number, number]) => (low + high) / 2;
  const half = ([low, high]: [number, number]) => (((high - low) / 2) * RADIUS_95) / HALF_95;
  return { x_mm: middle(x_95), y_mm: middle(y_95), half_mm: [half(x_95), half(y_95)], angle: 0 };
}
