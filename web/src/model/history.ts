// Readings of the last ten minutes for charts: recent ones complete, older ones thinned.

import type { SampleRecord } from "../protocol";
import { isPlaced } from "../words";

/** Columns of a history: time, position, its interval, force, its interval, then one per channel. */
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

const Z_95 = 1.96;

export const KEPT_S = 600;
/** Duration of a bucket of two older rows, in seconds. */
const BUCKET_S = 0.1;
/** Rows of the older part: two per bucket, and as many gaps at most. */
const OLD_ROWS = Math.ceil((3 * KEPT_S) / BUCKET_S);

/**
 * Rows by time, the oldest first; unknown values are NaN. The newest rows are complete. Older rows go
 * into buckets of 0.1 s, which keep the lowest and the highest value of every column, so that no peak
 * is lost.
 */
export class History {
  private readonly recent: Ring;
  private readonly old: Ring;
  private bucket: Bucket;

  constructor(
    readonly channels: number,
    capacity: number,
  ) {
    const columns = FIRST_CHANNEL + channels;
    this.recent = new Ring(columns, capacity);
    this.old = new Ring(columns, OLD_ROWS);
    this.bucket = new Bucket(columns);
  }

  get length(): number {
    return this.old.count + this.recent.count;
  }

  push(sample: SampleRecord): void {
    this.add(this.row(sample));
  }

  /** Adds a row without values, so that no line is drawn over a gap. */
  pushGap(time_s: number): void {
    this.add(gap(time_s, FIRST_CHANNEL + this.channels));
  }

  /** Adds samples from before the first row; other samples are ignored. */
  pushBefore(samples: readonly SampleRecord[], gaps: readonly number[]): void {
    if (this.old.count > 0) return;
    const first = this.recent.count === 0 ? Infinity : this.recent.at(TIME, 0);
    const rows = [...samples.map((sample) => this.row(sample)), ...gaps.map((time_s) => gap(time_s, FIRST_CHANNEL + this.channels))];
    rows.sort((one, other) => one[TIME]! - other[TIME]!);
    for (const row of rows) if (row[TIME]! < first) this.old.push(row);
  }

  clear(): void {
    this.recent.clear();
    this.old.clear();
    this.bucket.clear();
  }

  /** Time of the newest row; NaN for an empty history. */
  lastTime(): number {
    return this.length === 0 ? NaN : this.at(TIME, this.length - 1);
  }

  at(column: number, row: number): number {
    const old = this.old.count;
    return row < old ? this.old.at(column, row) : this.recent.at(column, row - old);
  }

  /** Index of the first row that is not before a time. */
  firstFrom(time_s: number): number {
    let low = 0;
    let high = this.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.at(TIME, middle) < time_s) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  private row(sample: SampleRecord): Float64Array {
    const row = new Float64Array(FIRST_CHANNEL + this.channels);
    const set = (column: number, value: number | undefined) => {
      row[column] = value ?? NaN;
    };
    set(TIME, sample.time_s);
    const placed = isPlaced(sample.status);
    set(X, placed ? sample.x_mm : NaN);
    set(X_LOW, placed ? sample.x_95_mm?.[0] : NaN);
    set(X_HIGH, placed ? sample.x_95_mm?.[1] : NaN);
    set(Y, placed ? sample.y_mm : NaN);
    set(Y_LOW, placed ? sample.y_95_mm?.[0] : NaN);
    set(Y_HIGH, placed ? sample.y_95_mm?.[1] : NaN);
    // The force of an unexplained reading is unknown; 0 would look like a release.
    const force = placed ? sample.force_n : sample.status === "no_contact" ? 0 : NaN;
    const half = Z_95 * (sample.sd_force_n ?? NaN);
    set(FORCE, force);
    // Contacts press, so the interval of a positive force has no negative part.
    const low = (force ?? NaN) - half;
    set(FORCE_LOW, placed ? (sample.force_95_n?.[0] ?? ((force ?? NaN) >= 0 ? Math.max(low, 0) : low)) : NaN);
    set(FORCE_HIGH, placed ? (sample.force_95_n?.[1] ?? (force ?? NaN) + half) : NaN);
    for (let i = 0; i < this.channels; i++) set(FIRST_CHANNEL + i, sample.reading[i]);
    return row;
  }

  private add(row: Float64Array): void {
    const evicted = this.recent.push(row);
    if (evicted !== null) this.bucket.add(evicted, this.old);
    const oldest = this.lastTime() - KEPT_S;
    while (this.old.count > 0 && this.old.at(TIME, 0) < oldest) this.old.shift();
  }
}

function gap(time_s: number, columns: number): Float64Array {
  const row = new Float64Array(columns).fill(NaN);
  row[TIME] = time_s;
  return row;
}

class Ring {
  private readonly columns: Float64Array[];
  private readonly evicted: Float64Array;
  private start = 0;
  count = 0;

  constructor(
    columns: number,
    private readonly capacity: number,
  ) {
    this.columns = Array.from({ length: columns }, () => new Float64Array(capacity));
    this.evicted = new Float64Array(columns);
  }

  /** Adds a row; returns the row that it replaces, valid until the next call. */
  push(row: ArrayLike<number>): Float64Array | null {
    const full = this.count === this.capacity;
    const place = (this.start + this.count) % this.capacity;
    this.columns.forEach((column, i) => {
      if (full) this.evicted[i] = column[place]!;
      column[place] = row[i]!;
    });
    if (full) this.start = (this.start + 1) % this.capacity;
    else this.count += 1;
    return full ? this.evicted : null;
  }

  shift(): void {
    this.start = (this.start + 1) % this.capacity;
    this.count -= 1;
  }

  at(column: number, row: number): number {
    return this.columns[column]![(this.start + row) % this.capacity]!;
  }

  clear(): void {
    this.start = this.count = 0;
  }
}

/** Lowest and highest values of one stretch of time, in order of time. */
class Bucket {
  private number = NaN;
  private readonly first: Float64Array;
  private readonly second: Float64Array;
  /** Columns with the highest value first. */
  private readonly falls: Uint8Array;

  constructor(columns: number) {
    this.first = new Float64Array(columns);
    this.second = new Float64Array(columns);
    this.falls = new Uint8Array(columns);
  }

  /** Adds a row; writes a finished stretch to `into`. A row without values ends the stretch. */
  add(row: Float64Array, into: Ring): void {
    const number = Math.floor(row[TIME]! / BUCKET_S);
    const isGap = row.every((value, i) => i === TIME || Number.isNaN(value));
    if (number !== this.number || isGap) {
      this.end(into);
      if (isGap) return void into.push(row);
      this.number = number;
      this.first.set(row);
      this.second.set(row);
      this.falls.fill(0);
      return;
    }
    this.second[TIME] = row[TIME]!;
    for (let i = 0; i < row.length; i++) if (i !== TIME) this.widen(i, row[i]!);
  }

  clear(): void {
    this.number = NaN;
  }

  private widen(i: number, value: number): void {
    if (Number.isNaN(value)) return;
    const [low, high] = this.falls[i] === 1 ? [this.second[i]!, this.first[i]!] : [this.first[i]!, this.second[i]!];
    if (Number.isNaN(low)) {
      this.first[i] = this.second[i] = value;
    } else if (value > high) {
      [this.first[i], this.second[i], this.falls[i]] = [low, value, 0];
    } else if (value < low) {
      [this.first[i], this.second[i], this.falls[i]] = [high, value, 1];
    }
  }

  private end(into: Ring): void {
    if (Number.isNaN(this.number)) return;
    into.push(this.first);
    if (this.second[TIME]! > this.first[TIME]!) into.push(this.second);
    this.number = NaN;
  }
}
