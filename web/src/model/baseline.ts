// Baseline of the channels, from which deflections are drawn.

import type { SampleRecord } from "../protocol";

const MEAN_OF = 100;

/** Mean of the untouched readings; follows a drift between contacts. */
export class Baseline {
  mean: number[] | null = null;
  private count = 0;

  push(sample: SampleRecord): void {
    if (sample.status !== "no_contact") return;
    this.count += 1;
    const weight = 1 / Math.min(this.count, MEAN_OF);
    this.mean = sample.reading.map((value, i) => {
      const mean = this.mean?.[i] ?? value;
      return mean + weight * (value - mean);
    });
  }

  clear(): void {
    this.mean = null;
    this.count = 0;
  }

  /** Subtracts the baseline; null without a baseline. */
  deflections(reading: number[]): number[] | null {
    const mean = this.mean;
    return mean === null ? null : reading.map((value, i) => value - (mean[i] ?? NaN));
  }
}
