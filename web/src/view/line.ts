// A surface of one direction from the side: supports, sensors, deflected shape, contact.

import type { ContactRecord, PlaceRecord, SurfaceInfo } from "../protocol";
import { linear, roundUp, ticks } from "../model/scale";
import { naturalSpline } from "../model/spline";
import type { Snapshot } from "../model/snapshot";
import { isPlaced, number } from "../words";
import { disc, labelAbove, segment, textWithin, type Frame } from "./canvas";
import { palette } from "./palette";
import { drawTargets } from "./targets";

/** Millimetres of the units of deflections. */
const MM: Record<string, number> = { nm: 1e-6, um: 1e-3, "µm": 1e-3, mm: 1, cm: 10, m: 1000, in: 25.4 };
const MARGIN = 26;
const AXIS = 24;
const DEFLECTION = 0.26;

/** Draws surfaces of one direction, with a constant exaggeration that does not jump with every touch. */
export class LineView {
  private largest_mm = 0;
  /** Exaggeration of the deflections; null if none are drawn. */
  exaggeration: number | null = null;

  draw(frame: Frame, shown: Snapshot): void {
    const { ctx, width, height } = frame;
    const surface = shown.session.surface;
    if (surface === null) return;
    const x = linear([0, surface.length_mm], [MARGIN, width - MARGIN]);
    const level = height * 0.46;
    ctx.font = palette().font;
    drawAxis(ctx, surface, x, height);
    const shape = this.shape(shown, surface, height, x);
    drawSupports(ctx, surface, x, level);
    drawBeam(ctx, x(0), x(surface.length_mm), level, shape);
    drawSensors(ctx, shown, x, level, shape);
    if (shown.calibration !== null) {
      drawTargets(ctx, shown.calibration, (place) => [x(place.x_mm), level - 10]);
      if (shown.calibration.next !== null) drawNext(ctx, shown.calibration.next, x, level);
    }
    drawContact(frame, shown, x, level, shape);
  }

  /** Deflection in pixels at a pixel along the surface, from the deflection sensors. */
  private shape(shown: Snapshot, surface: SurfaceInfo, height: number, x: (mm: number) => number): (px: number) => number {
    const { session, deflections } = shown;
    const measured = session.channels.flatMap((channel, i) => {
      const mm = MM[channel.unit];
      const value = deflections?.[i];
      const usable = channel.measure === "deflection" && channel.x_mm !== null && mm !== undefined;
      // Deflections are negative downward, pixels positive.
      return usable && value !== undefined && Number.isFinite(value) ? [{ x: channel.x_mm!, y: -value * mm }] : [];
    });
    this.exaggeration = null;
    if (measured.length < 2) return () => 0;
    // Readings outside the model may be invalid: they do not set the scale.
    if (isPlaced(shown.sample!.status)) {
      this.largest_mm = Math.max(this.largest_mm, ...measured.map((point) => Math.abs(point.y)));
    }
    if (this.largest_mm === 0) return () => 0;
    const perMm = (x(surface.length_mm) - x(0)) / surface.length_mm;
    // Next round number below the one that fills the room.
    const most = (DEFLECTION * height) / (this.largest_mm * perMm);
    this.exaggeration = 1 / roundUp(1 / most);
    // A rigid support has no deflection.
    const held = surface.supports.filter((support) => support.kind === "simple" || support.kind === "clamped");
    const points = [...measured, ...held.map((support) => ({ x: support.at_mm, y: 0 }))]
      .sort((one, other) => one.x - other.x)
      .filter((point, i, all) => i === 0 || point.x > all[i - 1]!.x);
    const curve = naturalSpline(points);
    const factor = this.exaggeration * perMm;
    const room = 1.5 * DEFLECTION * height;
    return (px) => Math.min(room, Math.max(-room, factor * curve((px - MARGIN) / perMm)));
  }
}

function drawAxis(ctx: CanvasRenderingContext2D, surface: SurfaceInfo, x: (mm: number) => number, height: number): void {
  const { quiet, line } = palette();
  const [left, right, y] = [x(0), x(surface.length_mm), height - AXIS];
  ctx.strokeStyle = line;
  ctx.lineWidth = 1;
  segment(ctx, left, y, right, y);
  ctx.fillStyle = quiet;
  ctx.textAlign = "center";
  ctx.textBaseline = "top";
  for (const mm of ticks(surface.length_mm, Math.max(2, Math.floor((right - left) / 70)))) {
    segment(ctx, x(mm), y, x(mm), y + 4);
    textWithin(ctx, number(mm, surface.length_mm >= 50 ? 1 : 0.1), x(mm), y + 7, ctx.canvas.clientWidth);
  }
  ctx.textAlign = "right";
  ctx.textBaseline = "bottom";
  ctx.fillText("mm", right, y - 3);
}

function drawSupports(ctx: CanvasRenderingContext2D, surface: SurfaceInfo, x: (mm: number) => number, level: number): void {
  ctx.strokeStyle = ctx.fillStyle = palette().quiet;
  ctx.lineWidth = 1.5;
  for (const support of surface.supports) {
    const at = x(support.at_mm);
    if (support.kind === "clamped" || support.kind === "guided") {
      const inner = support.at_mm < surface.length_mm / 2 ? -1 : 1;
      segment(ctx, at, level - 22, at, level + 22);
      for (let y = level - 22; y <= level + 16; y += 8) segment(ctx, at, y + 6, at + 8 * inner, y);
    } else if (support.kind === "elastic") {
      ctx.beginPath();
      for (let i = 0; i <= 8; i++) ctx.lineTo(at + (i === 0 || i === 8 ? 0 : i % 2 === 0 ? -6 : 6), level + 4 + i * 3);
      ctx.stroke();
      segment(ctx, at - 9, level + 29, at + 9, level + 29);
    } else if (support.kind !== "free") {
      ctx.beginPath();
      ctx.moveTo(at, level + 3);
      ctx.lineTo(at - 9, level + 20);
      ctx.lineTo(at + 9, level + 20);
      ctx.closePath();
      ctx.stroke();
      segment(ctx, at - 13, level + 23, at + 13, level + 23);
    }
  }
}

function drawBeam(ctx: CanvasRenderingContext2D, left: number, right: number, level: number, shape: (px: number) => number): void {
  const { line, ink } = palette();
  ctx.strokeStyle = line;
  ctx.lineWidth = 1;
  ctx.setLineDash([4, 4]);
  segment(ctx, left, level, right, level);
  ctx.setLineDash([]);
  ctx.strokeStyle = ink;
  ctx.lineWidth = 4;
  ctx.lineCap = "round";
  ctx.beginPath();
  for (let px = left; px < right; px += 3) ctx.lineTo(px, level + shape(px));
  ctx.lineTo(right, level + shape(right));
  ctx.stroke();
  ctx.lineCap = "butt";
}

function drawSensors(ctx: CanvasRenderingContext2D, shown: Snapshot, x: (mm: number) => number, level: number, shape: (px: number) => number): void {
  const { sensor, card, quiet } = palette();
  const placed = shown.session.channels.filter((channel) => channel.x_mm !== null);
  const apart = placed.length > 1 ? (x(shown.session.surface!.length_mm) - x(0)) / placed.length : Infinity;
  ctx.textAlign = "center";
  ctx.textBaseline = "top";
  for (const channel of placed) {
    const px = x(channel.x_mm!);
    const y = level + shape(px);
    ctx.fillStyle = sensor;
    ctx.strokeStyle = card;
    ctx.lineWidth = 1.5;
    ctx.beginPath();
    ctx.rect(px - 4, y + 4, 8, 8);
    ctx.fill();
    ctx.stroke();
    ctx.fillStyle = quiet;
    const wide = ctx.measureText(channel.name).width;
    if (wide >= apart - 4) continue;
    // Below the sign of a support, and within the picture at its ends.
    const isHeld = shown.session.surface!.supports.some((support) => support.kind !== "free" && support.at_mm === channel.x_mm);
    const middle = Math.min(Math.max(px, wide / 2), ctx.canvas.clientWidth - wide / 2);
    ctx.fillText(channel.name, middle, y + (isHeld ? 34 : 15));
  }
}

function drawNext(ctx: CanvasRenderingContext2D, next: PlaceRecord, x: (mm: number) => number, level: number): void {
  const px = x(next.x_mm);
  drawArrow(ctx, px, level - 16, 36);
  labelAbove(ctx, `${next.x_mm.toFixed(1)} mm`, px, level - 56, palette().ink, palette().card);
}

function drawContact({ ctx, height }: Frame, shown: Snapshot, x: (mm: number) => number, level: number, shape: (px: number) => number): void {
  const { contact, card, ink } = palette();
  const sample = shown.sample;
  ctx.fillStyle = contact;
  for (const point of shown.trail) {
    ctx.globalAlpha = 0.35 * (1 - point.age);
    const px = x(point.x_mm);
    disc(ctx, px, level + shape(px) - 7, 4);
    ctx.fill();
  }
  ctx.globalAlpha = 1;
  if (sample === null || !isPlaced(sample.status)) return;
  for (const mode of sample.modes ?? []) {
    drawInterval(ctx, mode, x, level, 0.5, shape);
    const px = x(mode.x_mm);
    ctx.strokeStyle = contact;
    ctx.lineWidth = 2;
    ctx.setLineDash([3, 2]);
    disc(ctx, px, level + shape(px) - 9, 7);
    ctx.stroke();
    ctx.setLineDash([]);
    labelAbove(ctx, `${Math.round(100 * mode.probability)} %`, px, level + shape(px) - 22, ink, card);
  }
  [...(sample.further ?? []), sample].forEach((one) => {
    const main = one === sample;
    drawInterval(ctx, one, x, level, 1, shape);
    drawOnAxis(ctx, one, x, height);
    const px = x(one.x_mm);
    const y = level + shape(px) - 9;
    drawArrow(ctx, px, y - 10, main ? 30 : 20);
    ctx.fillStyle = contact;
    ctx.strokeStyle = card;
    ctx.lineWidth = 2;
    disc(ctx, px, y, main ? 8 : 6);
    ctx.fill();
    ctx.stroke();
    const force = one.force_n === undefined ? "" : `  ${number(one.force_n, one.sd_force_n)} N`;
    labelAbove(ctx, `${number(one.x_mm, one.sd_mm)} mm${force}`, px, y - (main ? 44 : 34), ink, card);
  });
}

/** Draws the 95 % interval as a bar with ends, at least as wide as the ends. */
function drawInterval(ctx: CanvasRenderingContext2D, one: ContactRecord, x: (mm: number) => number, level: number, alpha: number, shape: (px: number) => number): void {
  if (one.x_95_mm === undefined) return;
  const [left, right] = one.x_95_mm.map(x) as [number, number];
  const y = level + shape(x(one.x_mm)) - 9;
  ctx.globalAlpha = alpha;
  ctx.strokeStyle = palette().contact;
  ctx.lineWidth = 3;
  segment(ctx, left, y, right, y);
  ctx.lineWidth = 2;
  segment(ctx, left, y - 7, left, y + 7);
  segment(ctx, right, y - 7, right, y + 7);
  ctx.globalAlpha = 1;
}

/** Draws the interval again at the axis, where no dot covers a short one. */
function drawOnAxis(ctx: CanvasRenderingContext2D, one: ContactRecord, x: (mm: number) => number, height: number): void {
  if (one.x_95_mm === undefined) return;
  const [left, right] = one.x_95_mm.map(x) as [number, number];
  ctx.fillStyle = palette().contact;
  ctx.fillRect(left, height - AXIS - 4, Math.max(2, right - left), 7);
}

function drawArrow(ctx: CanvasRenderingContext2D, px: number, y: number, length: number): void {
  ctx.strokeStyle = ctx.fillStyle = palette().contact;
  ctx.lineWidth = 2.5;
  segment(ctx, px, y - length, px, y - 6);
  ctx.beginPath();
  ctx.moveTo(px, y);
  ctx.lineTo(px - 5, y - 9);
  ctx.lineTo(px + 5, y - 9);
  ctx.fill();
}
