// What a chart of few pixels shows of many readings: the lowest and the highest in each stretch, so that no peak is lost.

import { TIME, type History } from "./history";

/** Times, then values by column; null where there is none. */
export type Series = (number | null)[][];

/**
 * The rows of a history from a time on, of the columns asked for. Beyond `most` rows, each stretch of 2ⁿ rows gives two points: its lowest and
 * its highest value, in the order in which they came. Stretches begin at multiples of their length, counted from the first row that ever was:
 * points stay where they are while the window moves over them.
 */
export function envelope(history: History, columns: number[], from_s: number, most: number): Series {
  const first = Math.max(0, history.firstFrom(from_s) - 1);
  const out: Series = [[], ...columns.map(() => [])];
  let stretch = 1;
  while (2 * (history.length - first) > most * stretch) stretch *= 2;
  if (stretch <= 2) {
    for (let row = first; row < history.length; row++) {
      out[0]!.push(history.at(TIME, row));
      columns.forEach((column, i) => out[i + 1]!.push(orNull(history.at(column, row))));
    }
    return out;
  }
  let begin = first - ((history.oldest + first) % stretch);
  for (; begin < history.length; begin += stretch) {
    const [from, to] = [Math.max(begin, 0), Math.min(begin + stretch, history.length)];
    out[0]!.push(history.at(TIME, from), history.at(TIME, (from + to - 1) >> 1));
    columns.forEach((column, i) => out[i + 1]!.push(...extremes(history, column, from, to)));
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
