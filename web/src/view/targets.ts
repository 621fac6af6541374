// Places of a calibration.

import type { CalibrationRecord, PlaceRecord } from "../protocol";
import { disc } from "./canvas";
import { palette } from "./palette";

/** Draws the places: hollow before the last press, then full. `at` maps a place to pixels. */
export function drawTargets(ctx: CanvasRenderingContext2D, calibration: CalibrationRecord, at: (place: PlaceRecord) => [number, number]): void {
  const { accent, card } = palette();
  ctx.strokeStyle = accent;
  ctx.lineWidth = 1.5;
  for (const place of calibration.places) {
    ctx.fillStyle = place.left === 0 ? accent : card;
    disc(ctx, ...at(place), 4);
    ctx.fill();
    ctx.stroke();
  }
}
