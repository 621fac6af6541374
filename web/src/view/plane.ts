// A surface of two directions from above: sensors, and contacts with 95 % regions.

import type { ContactRecord, PlaceRecord } from "../protocol";
import { ofCovariance, ofIntervals, RADIUS_95, type Ellipse } from "../model/ellipse";
import { fit, linear, ticks } from "../model/scale";
import type { Snapshot } from "../model/snapshot";
import { isPlaced, number } from "../words";
import { disc, labelAbove, segment, textWithin, widest, type Frame } from "./canvas";
import { palette } from "./palette";
import { drawTargets } from "./targets";

/** Margins of the surface, in pixels; the numbers of the axis add to the left one. */
const MARGIN = { left: 12, right: 16, top: 14, bottom: 30 };

interface Place {
  x: (mm: number) => number;
  y: (mm: number) => number;
}

export function drawPlane({ ctx, width, height }: Frame, shown: Snapshot): void {
  const surface = shown.session.surface;
  if (surface === null || surface.width_mm === null) return;
  const [length, across] = [surface.length_mm, surface.width_mm];
  ctx.font = palette().font;
  const numbers = Math.max(widest(ctx, ["mm"]), widest(ctx, [number(0, 1), number(across, 1)]));
  const frame = {
    left: MARGIN.left + numbers,
    top: MARGIN.top,
    width: width - MARGIN.left - numbers - MARGIN.right,
    height: height - MARGIN.top - MARGIN.bottom,
  };
  const { left, top, perUnit } = fit({ length, width: across }, frame);
  // The y axis points up.
  const place = {
    x: linear([0, length], [left, left + length * perUnit]),
    y: linear([0, across], [top + across * perUnit, top]),
  };
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
    textWithin(ctx, number(mm, 1), x(mm), y(0) + 6, ctx.canvas.clientWidth);
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

function drawSensors(ctx: CanvasRenderingContext2D, shown: Snapshot, { x, y }: Place): void {
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

function drawTrail(ctx: CanvasRenderingContext2D, shown: Snapshot, { x, y }: Place): void {
  ctx.fillStyle = palette().contact;
  for (const point of shown.trail) {
    ctx.globalAlpha = 0.35 * (1 - point.age);
    disc(ctx, x(point.x_mm), y(point.y_mm ?? 0), 4);
    ctx.fill();
  }
  ctx.globalAlpha = 1;
}

/** Draws a contact with its probability density and its 95 % ellipse. */
function drawContact(ctx: CanvasRenderingContext2D, one: ContactRecord, place: Place, words: string, mark: "full" | "hollow"): void {
  const { contact, card, ink } = palette();
  const [px, py] = [place.x(one.x_mm), place.y(one.y_mm ?? 0)];
  const ellipse = ellipseOf(one);
  if (ellipse !== null) drawRegion(ctx, ellipse, place, mark);
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
  labelAbove(ctx, words, px, py - 10, ink, card);
}

/** Ellipse of the covariance, or of the intervals if there is none or if force and position trade off. */
function ellipseOf(one: ContactRecord): Ellipse | null {
  if (one.covariance_mm2 !== undefined && one.trade_off === undefined) return ofCovariance(one.x_mm, one.y_mm ?? 0, one.covariance_mm2);
  return one.x_95_mm !== undefined && one.y_95_mm !== undefined ? ofIntervals(one.x_95_mm, one.y_95_mm) : null;
}

function drawRegion(ctx: CanvasRenderingContext2D, { x_mm, y_mm, half_mm, angle }: Ellipse, { x, y }: Place, mark: "full" | "hollow"): void {
  const [cx, cy, perUnit] = [x(x_mm), y(y_mm), x(1) - x(0)];
  const [rx, ry] = half_mm.map((half) => Math.max(1, half * perUnit)) as [number, number];
  // Angles go clockwise on the page, counterclockwise on the surface.
  const turned = -angle;
  const colour = palette().contact;
  if (mark === "full") {
    ctx.save();
    ctx.translate(cx, cy);
    ctx.rotate(turned);
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
  ctx.ellipse(cx, cy, rx, ry, turned, 0, 2 * Math.PI);
  ctx.stroke();
  ctx.setLineDash([]);
}
