// Extremes of many readings by stretch of time, for charts of few pixels, so that no peak is lost.

import { TIME, type History } from "./history";

/** Times, then values by column; null for a missing value. */
export type Series = (number | null)[][];

/** Shortest stretch, in seconds; longer ones are this times a power of two. */
const SHORTEST_S = 2 ** -12;

/**
 * Returns the rows of a history in a span of time. Beyond `most` rows, a stretch gives the lowest and
 * the highest value of each column, in order of time. Stretches begin at multiples of their length, so
 * that points stay while the window moves.
 */
export function envelope(history: History, columns: number[], from_s: number, to_s: number, most: number): Series {
  const first = Math.max(0, history.firstFrom(from_s) - 1);
  const end = history.firstFrom(to_s + 1e-9);
  const out: Series = [[], ...columns.map(() => [])];
  if (end - first <= most) {
    for (let row = first; row < end; row++) {
      out[0]!.push(history.at(TIME, row));
      columns.forEach((column, i) => out[i + 1]!.push(orNull(history.at(column, row))));
    }
    return out;
  }
  let stretch_s = SHORTEST_S;
  while (2 * (to_s - from_s) > most * stretch_s) stretch_s *= 2;
  for (let from = first; from < end; ) {
    const next = (Math.floor(history.at(TIME, from) / stretch_s) + 1) * stretch_s;
    const to = Math.max(from + 1, Math.min(end, history.firstFrom(next)));
    out[0]!.push(history.at(TIME, from), history.at(TIME, (from + to - 1) >> 1));
    columns.forEach((column, i) => out[i + 1]!.push(...extremes(history, column, from, to)));
    from = to;
  }
  return out;
}

function extremes(history: History, column: number, begin: number, end: number): [number | null, number | null] {
  let [low, high] = [NaN, NaN];
  let [lowAt, highAt] = [0, 0];
  for (let row = begin; row < end; row++) {
    const value = history.at(column, row);
    if (Number.isNaN(value)) continue;
    if (!(value >= low)) [low, lowAt] = [value, row];
    if (!(value <= high)) [high, highAt] = [value, row];
  }
  return lowAt <= highAt ? [orNull(low), orNull(high)] : [orNull(high), orNull(low)];
}

function orNull(value: number): number | null {
  return Number.isNaN(value) ? null : value;
}
