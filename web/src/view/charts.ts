// Charts over time: position, force, channels.

import uPlot from "uplot";
import { envelope } from "../model/envelope";
import * as column from "../model/history";
import type { Snapshot } from "../model/snapshot";
import { summary } from "../model/summary";
import type { SessionInfo } from "../protocol";
import { axisNumbers, clock, seconds, unit } from "../words";
import { element, need } from "../dom";
import { segment, widest } from "./canvas";
import { channelStroke, onTheme, palette } from "./palette";
import { isPlane } from "./surface";

/** Largest number of points of a chart: two per pixel of a wide screen. */
const MOST_POINTS = 2_000;

const SECONDS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200];

/** Milliseconds between two updates of a chart's text alternative. */
const TEXT_MS = 2_000;

export class Charts {
  private position: Chart;
  private force: Chart;
  private channels: Chart;
  private hidden = new Set<number>();
  private shown: Snapshot | null = null;
  private texted_ms = -Infinity;

  constructor(private session: SessionInfo) {
    const plane = isPlane(session);
    const x = banded("x", () => palette().contact, [column.X, column.X_LOW, column.X_HIGH]);
    const y = banded("y", () => palette().accent, [column.Y, column.Y_LOW, column.Y_HIGH], [6, 3]);
    this.position = new Chart("chart-position", plane ? [...x, ...y] : x, plane ? 2 : 1);
    this.force = new Chart("chart-force", banded("F", () => palette().accent, [column.FORCE, column.FORCE_LOW, column.FORCE_HIGH]), 1);
    this.channels = new Chart("chart-channels", this.channelLines(), 0);
    this.writeButtons();
    const units = [...new Set(session.channels.map((channel) => unit(channel.unit)))];
    need("chart-channels-title").textContent = units.length === 1 && units[0] !== "" ? `Channels in ${units[0]}` : "Channels";
    const known = session.force.known_n;
    need("chart-force-title").textContent = known === null ? "Force in N, with its 95 % interval" : `Force in N: known to be ${known} N of every contact`;
    need("zeroed").onchange = () => this.again();
    onTheme(() => {
      this.all.forEach((chart) => chart.rebuild());
      this.writeButtons();
      this.again();
    });
  }

  private get all(): Chart[] {
    return [this.position, this.force, this.channels];
  }

  draw(shown: Snapshot): void {
    this.shown = shown;
    if (Number.isNaN(shown.span.to_s)) return;
    this.position.draw(shown);
    this.force.draw(shown);
    const zeroed = need<HTMLInputElement>("zeroed").checked;
    this.channels.draw(shown, zeroed ? (i) => shown.untouched?.[i] ?? 0 : undefined);
    this.writeTexts(shown);
  }

  /** Redraws the snapshot after a change of theme or selection while paused. */
  private again(): void {
    if (this.shown !== null) this.draw(this.shown);
  }

  /** Texts of the charts for screen readers; they change slowly enough to be read. */
  private writeTexts(shown: Snapshot): void {
    const now = performance.now();
    if (now - this.texted_ms < TEXT_MS) return;
    this.texted_ms = now;
    const { history, span } = shown;
    const across = isPlane(this.session);
    const position = [summary(history, span, across ? "x" : "Position", column.X, "mm"), across ? summary(history, span, "y", column.Y, "mm") : ""];
    this.position.describe(`Position over ${seconds(span.to_s - span.from_s)}. ${position.join(" ").trim()}`);
    this.force.describe(`Force over ${seconds(span.to_s - span.from_s)}. ${summary(history, span, "Force", column.FORCE, "N")}`);
    const channels = this.session.channels.map((channel, i) => summary(history, span, channel.name, column.FIRST_CHANNEL + i, unit(channel.unit)));
    this.channels.describe(`Readings of ${channels.length} channels over ${seconds(span.to_s - span.from_s)}. ${channels.join(" ")}`);
  }

  png(): HTMLCanvasElement {
    const titles = ["Position in mm", need("chart-force-title").textContent, need("chart-channels-title").textContent];
    return stacked(this.all.map((chart, i) => ({ title: titles[i] ?? "", canvas: chart.canvas })), this.legend());
  }

  private legend(): { name: string; stroke: string; dash: number[] }[] {
    return this.session.channels.flatMap((channel, i) => (this.hidden.has(i) ? [] : [{ name: channel.name, ...channelStroke(i) }]));
  }

  private channelLines(): Line[] {
    return this.session.channels.map((channel, i) => ({
      label: channel.name,
      column: column.FIRST_CHANNEL + i,
      stroke: () => channelStroke(i).stroke,
      dash: channelStroke(i).dash,
      width: 1.5,
      shown: () => !this.hidden.has(i),
    }));
  }

  private writeButtons(): void {
    const buttons = this.session.channels.map((channel, i) => {
      const { stroke, dash } = channelStroke(i);
      const swatch = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      const stroked = document.createElementNS("http://www.w3.org/2000/svg", "path");
      swatch.setAttribute("viewBox", "0 0 24 8");
      swatch.setAttribute("aria-hidden", "true");
      stroked.setAttribute("d", "M0 4h24");
      stroked.setAttribute("stroke", stroke);
      stroked.setAttribute("stroke-width", "2.5");
      stroked.setAttribute("stroke-dasharray", dash.join(" "));
      swatch.append(stroked);
      const button = element("button", "channel", swatch, channel.name);
      button.type = "button";
      button.setAttribute("aria-pressed", String(!this.hidden.has(i)));
      button.addEventListener("click", () => {
        if (!this.hidden.delete(i)) this.hidden.add(i);
        button.setAttribute("aria-pressed", String(!this.hidden.has(i)));
        this.channels.showLines();
      });
      return button;
    });
    need("channel-buttons").replaceChildren(...buttons);
  }
}

interface Line {
  label: string;
  column: number;
  stroke: () => string;
  dash?: number[];
  width: number;
  shown?: () => boolean;
}

function banded(label: string, stroke: () => string, [value, low, high]: [number, number, number], dash: number[] = []): Line[] {
  return [
    { label, column: value, stroke, dash, width: 2 },
    { label: `${label} low`, column: low, stroke, width: 0 },
    { label: `${label} high`, column: high, stroke, width: 0 },
  ];
}

class Chart {
  private host: HTMLElement;
  private plot: uPlot;
  private head_s: number | null = null;
  /** Selected range of the values; null for an automatic range. */
  private range: [number, number] | null = null;

  constructor(
    id: string,
    private lines: Line[],
    private bandCount: number,
  ) {
    this.host = need(id);
    this.host.setAttribute("role", "img");
    this.host.replaceChildren();
    this.plot = this.build();
    this.bindZoom(need(`${id}-zoom`));
    new ResizeObserver(() => {
      this.plot.setSize({ width: this.host.clientWidth, height: this.host.clientHeight });
    }).observe(this.host);
  }

  get canvas(): HTMLCanvasElement {
    return this.plot.ctx.canvas;
  }

  describe(words: string): void {
    this.host.setAttribute("aria-label", words);
  }

  private bindZoom(group: HTMLElement): void {
    const factors: Record<string, number | null> = { in: 0.5, out: 2, all: null };
    group.querySelectorAll("button").forEach((button) => {
      button.onclick = () => this.zoom(factors[button.value] ?? null);
    });
  }

  /** Scales the range of the values about its middle; null resets it. */
  private zoom(factor: number | null): void {
    const { min, max } = this.plot.scales.y!;
    if (factor === null || min == null || max == null) return this.setRange(null);
    const [middle, half] = [(min + max) / 2, (factor * (max - min)) / 2];
    // A range below the resolution of doubles has no axis.
    if (half > 1e-12 * Math.abs(middle) && half < 1e300) this.setRange([middle - half, middle + half]);
  }

  private setRange(range: [number, number] | null): void {
    this.range = range;
    this.host.classList.toggle("zoomed", range !== null);
    this.plot.redraw(false, true);
    this.plot.setData(this.plot.data, false);
    const { min, max } = this.plot.scales.x!;
    if (min != null && max != null) this.plot.setScale("x", { min, max });
  }

  /**
   * Selects a rectangle: its height is the range of the values, its width that of the times while the
   * page is paused.
   */
  private select(plot: uPlot): void {
    const { left, top, width, height } = plot.select;
    const [whole_w, whole_h] = [plot.over.clientWidth, plot.over.clientHeight];
    if (width > 0 && height > 0 && height < whole_h) this.setRange([plot.posToVal(top + height, "y"), plot.posToVal(top, "y")]);
    if (width > 0 && width < whole_w) plot.setScale("x", { min: plot.posToVal(left, "x"), max: plot.posToVal(left + width, "x") });
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  }

  rebuild(): void {
    this.plot.destroy();
    this.plot = this.build();
  }

  showLines(): void {
    this.lines.forEach((line, i) => this.plot.setSeries(i + 1, { show: line.shown?.() ?? true }));
  }

  /** Draws the span of a snapshot; offsets are subtracted from the columns. */
  draw({ history, span }: Snapshot, offset?: (line: number) => number): void {
    this.head_s = span.head_s;
    const columns = this.lines.map((line) => line.column);
    const data = envelope(history, columns, span.from_s, span.to_s, MOST_POINTS);
    if (offset !== undefined) {
      for (let i = 1; i < data.length; i++) {
        const off = offset(i - 1);
        data[i] = data[i]!.map((value) => (value === null ? null : value - off));
      }
    }
    this.plot.batch(() => {
      this.plot.setData(data as uPlot.AlignedData, false);
      this.plot.setScale("x", { min: span.from_s, max: span.to_s });
    });
  }

  private build(): uPlot {
    const colours = palette();
    const axis = { stroke: colours.quiet, font: colours.font, grid: { stroke: colours.line, width: 1 }, ticks: { stroke: colours.line, width: 1 } };
    const bands = Array.from({ length: this.bandCount }, (_, i) => ({
      series: [3 * i + 3, 3 * i + 2] as [number, number],
      fill: translucent(this.lines[3 * i]!.stroke()),
    }));
    const options: uPlot.Options = {
      width: Math.max(1, this.host.clientWidth),
      height: Math.max(1, this.host.clientHeight),
      legend: { show: false },
      padding: [6, (plot) => Math.ceil(widthOf(plot, ["00:00:00"]) / 2) + 2, 0, 0],
      cursor: { y: false, points: { size: 5 }, drag: { x: true, y: true, uni: 20, setScale: false } },
      scales: { x: { time: true }, y: { range: (_, low, high) => this.range ?? roomy(low, high) } },
      axes: [
        { ...axis, size: 28, space: 84, values: (_, times) => times.map((time) => clock(time).slice(0, 8)), incrs: SECONDS },
        { ...axis, size: widthOfNumbers, space: 30, incrs: STEPS, values: (_, values, _axis, _space, step) => axisNumbers(values, step) },
      ],
      series: [
        {},
        ...this.lines.map((line) => ({
          label: line.label,
          stroke: line.stroke(),
          width: line.width,
          dash: line.dash ?? [],
          points: { show: false },
          show: line.shown?.() ?? true,
        })),
      ],
      bands,
      hooks: { draw: [(plot) => this.drawHead(plot)], setSelect: [(plot) => this.select(plot)] },
    };
    return new uPlot(options, [[], ...this.lines.map(() => [])], this.host);
  }

  private drawHead(plot: uPlot): void {
    if (this.head_s === null) return;
    const x = plot.valToPos(this.head_s, "x", true);
    const { left, top, width, height } = plot.bbox;
    if (x < left || x > left + width) return;
    plot.ctx.save();
    plot.ctx.strokeStyle = palette().ink;
    plot.ctx.setLineDash([]);
    plot.ctx.lineWidth = 2 * (window.devicePixelRatio || 1);
    plot.ctx.beginPath();
    plot.ctx.moveTo(x, top);
    plot.ctx.lineTo(x, top + height);
    plot.ctx.stroke();
    plot.ctx.restore();
  }
}

/** Steps between two numbers of an axis: 1, 2, 2.5 or 5 times a power of ten. */
const STEPS = Array.from({ length: 64 }, (_, i) => i - 32).flatMap((power) => [1, 2, 2.5, 5].map((step) => Number(`${step}e${power}`)));
/** Least width of an axis, and room beside its numbers, in pixels. */
const AXIS_LEAST = 40;
const AXIS_ROOM = 18;

function widthOfNumbers(plot: uPlot, numbers: string[] | null): number {
  if (numbers === null || numbers.length === 0) return AXIS_LEAST;
  return Math.max(AXIS_LEAST, Math.ceil(widthOf(plot, numbers)) + AXIS_ROOM);
}

function widthOf(plot: uPlot, texts: string[]): number {
  const ratio = window.devicePixelRatio || 1;
  plot.ctx.save();
  plot.ctx.font = palette().font.replace(/^[\d.]+/, (px) => String(Number(px) * ratio));
  const width = widest(plot.ctx, texts) / ratio;
  plot.ctx.restore();
  return width;
}

function stacked(charts: { title: string; canvas: HTMLCanvasElement }[], legend: { name: string; stroke: string; dash: number[] }[]): HTMLCanvasElement {
  const ratio = window.devicePixelRatio || 1;
  const out = document.createElement("canvas");
  const line = 22 * ratio;
  out.width = Math.max(...charts.map(({ canvas }) => canvas.width)) + 16 * ratio;
  const ctx = out.getContext("2d")!;
  const font = `${13 * ratio}px system-ui, sans-serif`;
  ctx.font = font;
  const rows: { name: string; stroke: string; dash: number[]; x: number; row: number }[] = [];
  let [x, row] = [8 * ratio, 0];
  for (const entry of legend) {
    const width = 40 * ratio + ctx.measureText(entry.name).width;
    if (x + width > out.width && x > 8 * ratio) [x, row] = [8 * ratio, row + 1];
    rows.push({ ...entry, x, row });
    x += width;
  }
  const charted = charts.reduce((sum, { canvas }) => sum + canvas.height + line, 0);
  out.height = charted + (rows.length === 0 ? 0 : (row + 1) * line) + 8 * ratio;
  const { ink, card } = palette();
  ctx.fillStyle = card;
  ctx.fillRect(0, 0, out.width, out.height);
  ctx.font = font;
  ctx.textBaseline = "middle";
  let top = 0;
  for (const { title, canvas } of charts) {
    ctx.fillStyle = ink;
    ctx.fillText(title, 8 * ratio, top + line / 2);
    ctx.drawImage(canvas, 8 * ratio, top + line);
    top += line + canvas.height;
  }
  for (const { name, stroke, dash, x, row } of rows) {
    const y = top + (row + 0.5) * line;
    ctx.strokeStyle = stroke;
    ctx.lineWidth = 2 * ratio;
    ctx.setLineDash(dash.map((length) => length * ratio));
    segment(ctx, x, y, x + 24 * ratio, y);
    ctx.fillStyle = ink;
    ctx.fillText(name, x + 30 * ratio, y);
  }
  return out;
}

/** Range of an axis: the values with a margin of a tenth, or some room around a single value. */
function roomy(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const room = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

function translucent(colour: string): string {
  return `color-mix(in srgb, ${colour} 25%, transparent)`;
}
