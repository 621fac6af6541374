// Positions of the contact in the last second.

import type { SampleRecord } from "../protocol";
import { isPlaced } from "../words";

export const TRAIL_S = 1;

export interface TrailPoint {
  time_s: number;
  x_mm: number;
  y_mm: number | undefined;
}

/** Positions of the last second of a contact; a lift-off ends it. */
export class Trail {
  private points: TrailPoint[] = [];

  push(sample: SampleRecord): void {
    if (isPlaced(sample.status)) {
      this.points.push({ time_s: sample.time_s, x_mm: sample.x_mm, y_mm: sample.y_mm });
    } else if (sample.status === "no_contact") {
      this.points = [];
    }
    const oldest = this.points.findIndex((point) => point.time_s > sample.time_s - TRAIL_S);
    if (oldest > 0) this.points.splice(0, oldest);
    else if (oldest < 0) this.points = [];
  }

  clear(): void {
    this.points = [];
  }

  /** Points, oldest first, with their ages as shares of the trail: 0 now, 1 at the end. */
  aged(): (TrailPoint & { age: number })[] {
    const now = this.points.at(-1)?.time_s ?? 0;
    return this.points.map((point) => ({ ...point, age: (now - point.time_s) / TRAIL_S }));
  }
}
