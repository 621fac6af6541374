// A surface of two directions from above: sensors, and contacts with their 95 % regions.

import type { ContactRecord, PlaceRecord } from "../protocol";
import { fit, linear, ticks } from "../model/scale";
import { isPlaced, number } from "../words";
import { disc, segment, type Frame } from "./canvas";
import { palette } from "./palette";
import type { Shown } from "./surface";
import { drawTargets } from "./targets";

const MARGIN = { left: 44, right: 16, top: 14, bottom: 30 };
/** The radius that holds 95 % of a normal distribution in the plane, in standard deviations: √(−2 ln 0.05). */
const RADIUS_95 = 2.4477;
/** The same of an interval. */
const HALF_95 = 1.96;

interface Place {
  x: (mm: number) => number;
  y: (mm: number) => number;
}

export function drawPlane({ ctx, width, height }: Frame, shown: Shown): void {
  const surface = shown.session.surface;
  if (surface === null || surface.width_mm === null) return;
  const [length, across] = [surface.length_mm, surface.width_mm];
  const frame = {
    left: MARGIN.left,
    top: MARGIN.top,
    width: width - MARGIN.left - MARGIN.right,
    height: height - MARGIN.top - MARGIN.bottom,
  };
  const { left, top, perUnit } = fit({ length, width: across }, frame);
  // The y axis goes up, as in every drawing.
  const place = {
    x: linear([0, length], [left, left + length * perUnit]),
    y: linear([0, across], [top + across * perUnit, top]),
  };
  ctx.font = palette().font;
  drawFrame(ctx, place, length, across, perUnit);
  drawSensors(ctx, shown, place);
  if (shown.calibration !== null) {
    drawTargets(ctx, shown.calibration, (target) => [place.x(target.x_mm), place.y(target.y_mm ?? 0)]);
    if (shown.calibration.next !== null) drawNext(ctx, shown.calibration.next, place);
  }
  drawTrail(ctx, shown, place);
  const sample = shown.sample;
  if (sample === null || !isPlaced(sample.status)) return;
  for (const mode of sample.modes ?? []) drawContact(ctx, mode, place, `${Math.round(100 * mode.probability)} %`, "hollow");
  for (const further of sample.further ?? []) drawContact(ctx, further, place, forceWords(further), "full");
  drawContact(ctx, sample, place, forceWords(sample), "full");
}

function forceWords(contact: ContactRecord): string {
  return contact.force_n === undefined ? "" : `${number(contact.force_n, contact.sd_force_n)} N`;
}

function drawFrame(ctx: CanvasRenderingContext2D, { x, y }: Place, length: number, across: number, perUnit: number): void {
  const { line, quiet, ink } = palette();
  ctx.fillStyle = quiet;
  ctx.strokeStyle = line;
  ctx.lineWidth = 1;
  const count = (side: number) => Math.max(2, Math.floor((side * perUnit) / 55));
  ctx.textAlign = "center";
  ctx.textBaseline = "top";
  for (const mm of ticks(length, count(length))) {
    segment(ctx, x(mm), y(0), x(mm), y(across));
    ctx.fillText(number(mm, 1), x(mm), y(0) + 6);
  }
  ctx.textAlign = "right";
  ctx.textBaseline = "middle";
  for (const mm of ticks(across, count(across))) {
    segment(ctx, x(0), y(mm), x(length), y(mm));
    ctx.fillText(number(mm, 1), x(0) - 6, y(mm));
  }
  ctx.textAlign = "left";
  ctx.textBaseline = "top";
  ctx.fillText("mm", Math.max(2, x(0) - 40), y(0) + 6);
  ctx.strokeStyle = ink;
  ctx.lineWidth = 2;
  ctx.strokeRect(x(0), y(across), x(length) - x(0), y(0) - y(across));
}

function drawSensors(ctx: CanvasRenderingContext2D, shown: Shown, { x, y }: Place): void {
  const { sensor, quiet } = palette();
  ctx.textAlign = "left";
  ctx.textBaseline = "bottom";
  for (const channel of shown.session.channels) {
    if (channel.x_mm === null || channel.y_mm === null || channel.y_mm === undefined) continue;
    const [px, py] = [x(channel.x_mm), y(channel.y_mm)];
    ctx.fillStyle = sensor;
    ctx.fillRect(px - 4, py - 4, 8, 8);
    ctx.fillStyle = quiet;
    ctx.fillText(channel.name, px + 6, py - 2);
  }
}

/** A cross in a ring at the place to be pressed next. */
function drawNext(ctx: CanvasRenderingContext2D, next: PlaceRecord, { x, y }: Place): void {
  const { contact, ink } = palette();
  const [px, py] = [x(next.x_mm), y(next.y_mm ?? 0)];
  ctx.strokeStyle = contact;
  ctx.lineWidth = 2.5;
  disc(ctx, px, py, 12);
  ctx.stroke();
  segment(ctx, px - 18, py, px + 18, py);
  segment(ctx, px, py - 18, px, py + 18);
  ctx.fillStyle = ink;
  ctx.textAlign = px > ctx.canvas.clientWidth / 2 ? "right" : "left";
  ctx.textBaseline = "bottom";
  ctx.fillText(`${next.x_mm.toFixed(1)}, ${(next.y_mm ?? 0).toFixed(1)} mm`, px + (ctx.textAlign === "right" ? -16 : 16), py - 12);
}

function drawTrail(ctx: CanvasRenderingContext2D, shown: Shown, { x, y }: Place): void {
  ctx.fillStyle = palette().contact;
  for (const point of shown.trail) {
    ctx.globalAlpha = 0.35 * (1 - point.age);
    disc(ctx, x(point.x_mm), y(point.y_mm ?? 0), 4);
    ctx.fill();
  }
  ctx.globalAlpha = 1;
}

/** A contact with the heat of its probability and the ellipse that holds 95 % of it. */
function drawContact(ctx: CanvasRenderingContext2D, one: ContactRecord, place: Place, words: string, mark: "full" | "hollow"): void {
  const { contact, card, ink } = palette();
  const [px, py] = [place.x(one.x_mm), place.y(one.y_mm ?? 0)];
  if (one.x_95_mm !== undefined && one.y_95_mm !== undefined) drawRegion(ctx, one.x_95_mm, one.y_95_mm, place, mark);
  ctx.lineWidth = 2;
  disc(ctx, px, py, 6);
  if (mark === "full") {
    ctx.fillStyle = contact;
    ctx.strokeStyle = card;
    ctx.fill();
  } else {
    ctx.strokeStyle = contact;
    ctx.setLineDash([3, 2]);
  }
  ctx.stroke();
  ctx.setLineDash([]);
  const half = ctx.measureText(words).width / 2 + 4;
  ctx.fillStyle = ink;
  ctx.textAlign = "center";
  ctx.textBaseline = "bottom";
  ctx.fillText(words, Math.min(Math.max(px, half), ctx.canvas.clientWidth - half), Math.max(py - 10, 14));
}

/** The 95 % intervals of both directions, taken for those of a normal distribution whose directions are independent. */
function drawRegion(ctx: CanvasRenderingContext2D, x_95: [number, number], y_95: [number, number], { x, y }: Place, mark: "full" | "hollow"): void {
  const [left, right] = x_95.map(x) as [number, number];
  const [bottom, top] = y_95.map(y) as [number, number];
  const [cx, cy] = [(left + right) / 2, (top + bottom) / 2];
  const grow = RADIUS_95 / HALF_95;
  const [rx, ry] = [Math.max(1, ((right - left) / 2) * grow), Math.max(1, ((bottom - top) / 2) * grow)];
  const colour = palette().contact;
  if (mark === "full") {
    ctx.save();
    ctx.translate(cx, cy);
    ctx.scale(rx, ry);
    const heat = ctx.createRadialGradient(0, 0, 0, 0, 0, 1.4);
    for (let share = 0; share <= 1; share += 0.125) {
      const density = Math.exp(-0.5 * (share * 1.4 * RADIUS_95) ** 2);
      heat.addColorStop(share, `color-mix(in srgb, ${colour} ${Math.round(60 * density)}%, transparent)`);
    }
    ctx.fillStyle = heat;
    disc(ctx, 0, 0, 1.4);
    ctx.fill();
    ctx.restore();
  }
  ctx.strokeStyle = colour;
  ctx.lineWidth = 1.5;
  if (mark === "hollow") ctx.setLineDash([3, 2]);
  ctx.beginPath();
  ctx.ellipse(cx, cy, rx, ry, 0, 0, 2 * Math.PI);
  ctx.stroke();
  ctx.setLineDash([]);
}
