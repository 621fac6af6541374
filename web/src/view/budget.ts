// Error budget: the limit over the surface, and the present estimate.

import { forceFactor, limitAt } from "../model/limit";
import { fit, linear, ticks } from "../model/scale";
import type { Snapshot } from "../model/snapshot";
import type { SampleRecord, SessionInfo } from "../protocol";
import { axisNumbers, isPlaced, number, size } from "../words";
import { need, setText } from "../dom";
import { begin, disc, segment, textWithin, widest, type Frame } from "./canvas";
import { palette } from "./palette";
import { isPlane } from "./surface";

/** Margins of the curve, in pixels; the numbers of the axis add to the left one. */
const MARGIN = { left: 8, right: 12, top: 12, bottom: 30 };

export class Budget {
  private canvas = document.createElement("canvas");

  constructor(private session: SessionInfo) {
    this.canvas.setAttribute("role", "img");
    need("budget").replaceChildren(this.canvas);
    need("budget").classList.toggle("plane", isPlane(session));
    need("budget").hidden = session.limit === null;
  }

  draw({ sample }: Snapshot): void {
    const words = budgetWords(this.session, sample);
    setText(need("budget-words"), words);
    this.canvas.setAttribute("aria-label", words);
    const frame = this.session.limit === null ? null : begin(this.canvas);
    if (frame === null) return;
    frame.ctx.font = palette().font;
    if (isPlane(this.session)) drawMap(frame, this.session, sample);
    else drawCurve(frame, this.session, sample);
  }
}

/** The budget in words: over the surface, and at the contact. */
export function budgetWords(session: SessionInfo, sample: SampleRecord | null): string {
  const limit = session.limit;
  if (limit === null) return "The limit is known of surfaces that have a model; this one has none.";
  const factor = forceFactor(session, sample !== null && isPlaced(sample.status) ? sample.force_n : undefined);
  const sds = limit.sd_mm.filter((sd) => sd !== null);
  if (sds.length === 0) return "No position is identifiable on this surface: every limit is infinite.";
  const [best, worst] = [factor * Math.min(...sds), factor * Math.max(...sds)];
  const force_n = limit.force_n / factor;
  const over = `Limit for ${number(force_n)} N: ${size(best)} to ${size(worst)} mm over the surface.`;
  if (sample === null || !isPlaced(sample.status)) return over;
  const here = limitAt(limit, sample.x_mm, sample.y_mm);
  if (here === null) return `${over} At the contact it is infinite.`;
  if (sample.sd_mm === undefined) return `${over} At the contact: ${size(factor * here)} mm.`;
  const ratio = sample.sd_mm / (factor * here);
  return `${over} At the contact: ${size(factor * here)} mm; this estimate has ${size(sample.sd_mm)} mm, ${size(ratio)}\u00a0× the limit.`;
}

function drawCurve({ ctx, width, height }: Frame, session: SessionInfo, sample: SampleRecord | null): void {
  const [limit, surface] = [session.limit!, session.surface!];
  const { quiet, line, accent, contact } = palette();
  const placed = sample !== null && isPlaced(sample.status);
  const factor = forceFactor(session, placed ? sample.force_n : undefined);
  const sds = limit.sd_mm.flatMap((sd) => (sd === null || sd <= 0 ? [] : [sd * factor]));
  if (sds.length === 0) return;
  // At least a decade: the ends of a beam are far worse than the middle.
  const lowest = Math.floor(Math.log10(Math.min(...sds)));
  const highest = Math.max(lowest + 1, Math.ceil(Math.log10(Math.max(...sds))));
  const [top, bottom] = [MARGIN.top, height - MARGIN.bottom];
  const powers = Array.from({ length: highest - lowest + 1 }, (_, i) => lowest + i);
  const numbers = powers.map((power) => axisNumbers([10 ** power], 10 ** power)[0]!);
  const left = MARGIN.left + 6 + widest(ctx, numbers);
  const x = linear([0, surface.length_mm], [left, width - MARGIN.right]);
  const log = linear([lowest, highest], [bottom, top]);
  const y = (sd_mm: number) => log(Math.min(highest, Math.max(lowest, Math.log10(sd_mm))));
  ctx.fillStyle = quiet;
  ctx.strokeStyle = line;
  ctx.lineWidth = 1;
  ctx.textAlign = "right";
  ctx.textBaseline = "middle";
  powers.forEach((power, i) => {
    segment(ctx, x(0), log(power), width - MARGIN.right, log(power));
    ctx.fillText(numbers[i]!, x(0) - 6, log(power));
  });
  ctx.textAlign = "center";
  ctx.textBaseline = "top";
  for (const mm of ticks(surface.length_mm, Math.max(2, Math.floor(width / 80)))) textWithin(ctx, number(mm, 1), x(mm), bottom + 6, width);
  ctx.textAlign = "left";
  ctx.fillText("sd, mm", 2, height - 14);
  ctx.strokeStyle = accent;
  ctx.lineWidth = 2;
  ctx.beginPath();
  let drawing = false;
  limit.positions_mm.forEach((at, i) => {
    const sd = limit.sd_mm[i] ?? null;
    if (sd === null) {
      drawing = false;
      return;
    }
    if (drawing) ctx.lineTo(x(at as number), y(sd * factor));
    else ctx.moveTo(x(at as number), y(sd * factor));
    drawing = true;
  });
  ctx.stroke();
  if (!placed || sample.sd_mm === undefined) return;
  ctx.fillStyle = ctx.strokeStyle = contact;
  ctx.lineWidth = 1;
  ctx.setLineDash([2, 3]);
  segment(ctx, x(sample.x_mm), top, x(sample.x_mm), bottom);
  ctx.setLineDash([]);
  disc(ctx, x(sample.x_mm), y(sample.sd_mm), 5);
  ctx.fill();
}

function drawMap({ ctx, width, height }: Frame, session: SessionInfo, sample: SampleRecord | null): void {
  const [limit, surface] = [session.limit!, session.surface!];
  const { accent, contact, card, ink } = palette();
  const frame = { left: 8, top: 8, width: width - 16, height: height - 40 };
  const [length, across] = [surface.length_mm, surface.width_mm ?? 1];
  const { left, top, perUnit } = fit({ length, width: across }, frame);
  const x = linear([0, length], [left, left + length * perUnit]);
  const y = linear([0, across], [top + across * perUnit, top]);
  const places = limit.positions_mm as [number, number][];
  const columns = new Set(places.map(([px]) => px)).size;
  const rows = new Set(places.map(([, py]) => py)).size;
  const [w, h] = [(length * perUnit) / Math.max(1, columns), (across * perUnit) / Math.max(1, rows)];
  const sds = limit.sd_mm.flatMap((sd) => (sd === null ? [] : [sd]));
  if (sds.length === 0) return;
  const [best, worst] = [Math.min(...sds), Math.max(...sds)];
  const shade = linear([Math.log(best), Math.log(Math.max(worst, best * 1.001))], [8, 85]);
  ctx.save();
  ctx.beginPath();
  ctx.rect(x(0), y(across), length * perUnit, across * perUnit);
  ctx.clip();
  places.forEach(([px, py], i) => {
    const sd = limit.sd_mm[i] ?? null;
    ctx.fillStyle = sd === null ? ink : `color-mix(in srgb, ${accent} ${Math.round(shade(Math.log(sd)))}%, ${card})`;
    ctx.fillRect(x(px) - w / 2 - 0.5, y(py) - h / 2 - 0.5, w + 1, h + 1);
  });
  ctx.restore();
  ctx.strokeStyle = ink;
  ctx.lineWidth = 1;
  ctx.strokeRect(x(0), y(across), length * perUnit, across * perUnit);
  const placed = sample !== null && isPlaced(sample.status);
  const factor = forceFactor(session, placed ? sample.force_n : undefined);
  drawShades(ctx, `${size(best * factor)} mm`, `${size(worst * factor)} mm`, width, height - 8);
  if (!placed) return;
  ctx.fillStyle = contact;
  ctx.strokeStyle = card;
  ctx.lineWidth = 2;
  disc(ctx, x(sample.x_mm), y(sample.y_mm ?? 0), 5);
  ctx.fill();
  ctx.stroke();
}

function drawShades(ctx: CanvasRenderingContext2D, best: string, worst: string, width: number, bottom: number): void {
  const { quiet, accent, card, line } = palette();
  ctx.fillStyle = quiet;
  ctx.textBaseline = "bottom";
  ctx.textAlign = "left";
  ctx.fillText(best, 8, bottom);
  ctx.textAlign = "right";
  ctx.fillText(worst, width - 8, bottom);
  const left = 16 + ctx.measureText(best).width;
  const right = width - 16 - ctx.measureText(worst).width;
  const shades = ctx.createLinearGradient(left, 0, right, 0);
  shades.addColorStop(0, `color-mix(in srgb, ${accent} 8%, ${card})`);
  shades.addColorStop(1, `color-mix(in srgb, ${accent} 85%, ${card})`);
  ctx.fillStyle = shades;
  ctx.fillRect(left, bottom - 12, right - left, 10);
  ctx.strokeStyle = line;
  ctx.strokeRect(left, bottom - 12, right - left, 10);
}
