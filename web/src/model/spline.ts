// Curve through measured deflections.

/**
 * Natural cubic spline through points of rising x: piecewise cubic, twice continuously differentiable,
 * without curvature at the ends, like a beam between its supports (C. de Boor, A Practical Guide to
 * Splines, 1978, chapter IV). Beyond the ends it is straight.
 */
export function naturalSpline(points: { x: number; y: number }[]): (x: number) => number {
  const n = points.length;
  if (n === 0) return () => 0;
  const x = points.map((point) => point.x);
  const y = points.map((point) => point.y);
  const curvature = curvatures(x, y);
  return (at) => {
    if (n === 1) return y[0]!;
    let i = x.findIndex((right) => at < right) - 1;
    if (i < 0) i = at < x[0]! ? 0 : n - 2;
    const h = x[i + 1]! - x[i]!;
    const slope = (y[i + 1]! - y[i]!) / h;
    if (at < x[0]!) return y[0]! + (at - x[0]!) * (slope - (h * curvature[1]!) / 6);
    if (at > x[n - 1]!) return y[n - 1]! + (at - x[n - 1]!) * (slope + (h * curvature[n - 2]!) / 6);
    const right = (at - x[i]!) / h;
    const left = 1 - right;
    const bend = (left ** 3 - left) * curvature[i]! + (right ** 3 - right) * curvature[i + 1]!;
    return left * y[i]! + right * y[i + 1]! + (bend * h * h) / 6;
  };
}

/** Second derivatives at the points, from the tridiagonal system of continuous slopes (Thomas's algorithm). */
function curvatures(x: number[], y: number[]): number[] {
  const n = x.length;
  const out = new Array<number>(n).fill(0);
  const share = new Array<number>(n).fill(0);
  for (let i = 1; i < n - 1; i++) {
    const [before, after] = [x[i]! - x[i - 1]!, x[i + 1]! - x[i]!];
    const jump = (y[i + 1]! - y[i]!) / after - (y[i]! - y[i - 1]!) / before;
    const pivot = 2 * (before + after) - before * share[i - 1]!;
    share[i] = after / pivot;
    out[i] = (6 * jump - before * out[i - 1]!) / pivot;
  }
  for (let i = n - 2; i > 0; i--) out[i]! -= share[i]! * out[i + 1]!;
  return out;
}
