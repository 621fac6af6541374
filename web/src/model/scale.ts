// Scales: millimetres to pixels, and the numbers of an axis.

export function linear(from: [number, number], to: [number, number]): (value: number) => number {
  const factor = (to[1] - to[0]) / (from[1] - from[0]);
  return (value) => to[0] + (value - from[0]) * factor;
}

/** Smallest number 1, 2 or 5 × 10ⁿ that is at least `least`. */
export function roundUp(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  const share = least / power;
  // Ten to a negative power is rounded, so a share may be above a step by the last bit.
  const step = [1, 2, 5].find((step) => share <= step * (1 + 1e-9)) ?? 10;
  return step * power;
}

/** Round numbers from 0 to `end`, at most `most` + 1. */
export function ticks(end: number, most: number): number[] {
  const step = roundUp(end / most);
  return Array.from({ length: Math.floor(end / step + 1e-9) + 1 }, (_, i) => i * step);
}

/** Rectangle of a surface, to scale and centred in a frame. */
export function fit(
  surface: { length: number; width: number },
  frame: { left: number; top: number; width: number; height: number },
): { left: number; top: number; perUnit: number } {
  const perUnit = Math.min(frame.width / surface.length, frame.height / surface.width);
  return {
    perUnit,
    left: frame.left + (frame.width - surface.length * perUnit) / 2,
    top: frame.top + (frame.height - surface.width * perUnit) / 2,
  };
}
