// The ellipse that holds 95 % of a normal distribution in the plane.

/** The radius that holds 95 % of a normal distribution in the plane, in standard deviations: √(−2 ln 0.05). */
export const RADIUS_95 = 2.4477;
/** The same of an interval on a line. */
const HALF_95 = 1.96;

/** An ellipse about a centre: half axes in mm, and the angle of the first from x to y, in radians. */
export interface Ellipse {
  x_mm: number;
  y_mm: number;
  half_mm: [number, number];
  angle: number;
}

/** The ellipse of a covariance xx, xy, yy in mm², by its eigenvalues. */
export function ofCovariance(x_mm: number, y_mm: number, [xx, xy, yy]: [number, number, number]): Ellipse {
  const [mean, apart] = [(xx + yy) / 2, Math.hypot((xx - yy) / 2, xy)];
  const half = (variance: number) => RADIUS_95 * Math.sqrt(Math.max(0, variance));
  return { x_mm, y_mm, half_mm: [half(mean + apart), half(mean - apart)], angle: 0.5 * Math.atan2(2 * xy, xx - yy) };
}

/** The ellipse of the 95 % intervals of both directions, taken for those of a normal distribution whose directions are independent. */
export function ofIntervals(x_95: [number, number], y_95: [number, number]): Ellipse {
  const middle = ([low, high]: [number, number]) => (low + high) / 2;
  const half = ([low, high]: [number, number]) => (((high - low) / 2) * RADIUS_95) / HALF_95;
  return { x_mm: middle(x_95), y_mm: middle(y_95), half_mm: [half(x_95), half(y_95)], angle: 0 };
}
