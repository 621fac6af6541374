// Raw readings before a calibration: values, rate and a chart, which show that the board works.

import { element, need, setText } from "../dom";
import type { CalibrationRecord } from "../protocol";
import { begin } from "../view/canvas";
import { channelStroke, palette } from "../view/palette";
import { hertz } from "../words";

/** Duration of the chart and of the rate, in seconds. */
const SHOWN_S = 10;

interface Seen {
  at_s: number;
  readings: number;
  reading: number[];
}

/** Rate of readings in Hz between the first and the last request; null before the second. */
export function rateOf(seen: { at_s: number; readings: number }[]): number | null {
  const [first, last] = [seen[0], seen[seen.length - 1]];
  if (first === undefined || last === undefined || last.at_s <= first.at_s) return null;
  return (last.readings - first.readings) / (last.at_s - first.at_s);
}

export class Preview {
  private seen: Seen[] = [];

  write(state: CalibrationRecord, now_s: number): void {
    const shows = state.phase === "ready" && state.machine === null && state.readings > 0;
    need("calibration-raw").hidden = !shows;
    if (!shows) {
      this.seen = [];
      return;
    }
    if (state.readings < (this.seen[this.seen.length - 1]?.readings ?? 0)) this.seen = [];
    this.seen.push({ at_s: now_s, readings: state.readings, reading: state.reading });
    this.seen = this.seen.filter((seen) => now_s - seen.at_s <= SHOWN_S);
    const rate = rateOf(this.seen);
    const source = state.source === null ? "" : ` from ${state.source}`;
    setText(need("calibration-rate"), `${state.readings}${source}${rate === null ? "" : `, ${hertz(rate)}`}`);
    const values = state.reading.map((value, i) => element("div", "", element("dt", "", String(i + 1)), element("dd", "", String(Number(value.toPrecision(6))))));
    need("calibration-values").replaceChildren(...values);
    this.draw(now_s);
  }

  private draw(now_s: number): void {
    const frame = begin(need<HTMLCanvasElement>("calibration-chart"));
    if (frame === null) return;
    const { ctx, width, height } = frame;
    ctx.strokeStyle = palette().line;
    ctx.strokeRect(0.5, 0.5, width - 1, height - 1);
    const channels = this.seen[this.seen.length - 1]?.reading.length ?? 0;
    for (let channel = 0; channel < channels; channel++) {
      const values = this.seen.map((seen) => seen.reading[channel] ?? NaN);
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const { stroke, dash } = channelStroke(channel);
      ctx.strokeStyle = stroke;
      ctx.setLineDash(dash);
      ctx.beginPath();
      this.seen.forEach((seen, i) => {
        const x = width * (1 - (now_s - seen.at_s) / SHOWN_S);
        const y = high > low ? height * (0.95 - (0.9 * (values[i]! - low)) / (high - low)) : height / 2;
        if (i === 0) ctx.moveTo(x, y);
        else ctx.lineTo(x, y);
      });
      ctx.stroke();
    }
    ctx.setLineDash([]);
  }
}
