// The readings of the last minute, for charts.

import type { SampleRecord } from "../protocol";
import { isPlaced } from "../words";

/** Columns of a history: time, position, its interval, force, its interval, then one a channel. */
export const TIME = 0;
export const X = 1;
export const X_LOW = 2;
export const X_HIGH = 3;
export const FORCE = 4;
export const FORCE_LOW = 5;
export const FORCE_HIGH = 6;
export const Y = 7;
export const Y_LOW = 8;
export const Y_HIGH = 9;
export const FIRST_CHANNEL = 10;

/** Half the width of a 95 % interval, in standard deviations. */
const Z_95 = 1.96;

/** A ring of rows. What is not known is NaN. */
export class History {
  private readonly columns: Float64Array[];
  private start = 0;
  private count = 0;
  private gone = 0;

  constructor(
    readonly channels: number,
    readonly capacity: number,
  ) {
    this.columns = Array.from({ length: FIRST_CHANNEL + channels }, () => new Float64Array(capacity));
  }

  get length(): number {
    return this.count;
  }

  /** Number of the oldest row, counted from the first that ever was. */
  get oldest(): number {
    return this.gone;
  }

  /** Adds a sample; the oldest row gives way when all are taken. */
  push(sample: SampleRecord): void {
    const row = this.next();
    const set = (column: number, value: number | undefined) => {
      this.columns[column]![row] = value ?? NaN;
    };
    set(TIME, sample.time_s);
    const placed = isPlaced(sample.status);
    set(X, placed ? sample.x_mm : NaN);
    set(X_LOW, placed ? sample.x_95_mm?.[0] : NaN);
    set(X_HIGH, placed ? sample.x_95_mm?.[1] : NaN);
    set(Y, placed ? sample.y_mm : NaN);
    set(Y_LOW, placed ? sample.y_95_mm?.[0] : NaN);
    set(Y_HIGH, placed ? sample.y_95_mm?.[1] : NaN);
    // Of a reading that no contact explains nothing is known of the force; 0 would look like a release.
    const force = placed ? sample.force_n : sample.status === "no_contact" ? 0 : NaN;
    const half = Z_95 * (sample.sd_force_n ?? NaN);
    set(FORCE, force);
    set(FORCE_LOW, placed ? (sample.force_95_n?.[0] ?? (force ?? NaN) - half) : NaN);
    set(FORCE_HIGH, placed ? (sample.force_95_n?.[1] ?? (force ?? NaN) + half) : NaN);
    for (let i = 0; i < this.channels; i++) set(FIRST_CHANNEL + i, sample.reading[i]);
  }

  /** Adds a row without values, so that no line is drawn over a stretch without readings. */
  pushGap(time_s: number): void {
    const row = this.next();
    this.columns.forEach((column) => (column[row] = NaN));
    this.columns[TIME]![row] = time_s;
  }

  clear(): void {
    this.count = 0;
    this.start = 0;
    this.gone = 0;
  }

  /** The time of the newest row; NaN of an empty history. */
  lastTime(): number {
    return this.count === 0 ? NaN : this.at(TIME, this.count - 1);
  }

  at(column: number, row: number): number {
    return this.columns[column]![(this.start + row) % this.capacity]!;
  }

  /** The first row that is not before a time. */
  firstFrom(time_s: number): number {
    let low = 0;
    let high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.at(TIME, middle) < time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  private next(): number {
    if (this.count < this.capacity) return (this.start + this.count++) % this.capacity;
    const row = this.start;
    this.start = (this.start + 1) % this.capacity;
    this.gone += 1;
    return row;
  }
}
