// The charts over time: position, force, channels.

import uPlot from "uplot";
import { envelope } from "../model/envelope";
import * as column from "../model/history";
import type { History } from "../model/history";
import type { SessionInfo } from "../protocol";
import { clock, unit } from "../words";
import { element, need } from "../dom";
import { channelStroke, onTheme, palette } from "./palette";
import { isPlane } from "./surface";

/** Points of a chart at most: two a pixel of a wide screen. */
const MOST_POINTS = 2_000;

/** Seconds between two times that are written at the axis. */
const SECONDS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200];

/** What of a history the charts show. */
export interface Span {
  from_s: number;
  to_s: number;
  /** Instant that a line marks: that of a replay. */
  head_s: number | null;
}

/** What each channel reads untouched, where that is known. */
export type Untouched = number[] | null;

export class Charts {
  private position: Chart;
  private force: Chart;
  private channels: Chart;
  private hidden = new Set<number>();
  private shown: { history: History; span: Span; untouched: Untouched } | null = null;

  constructor(private session: SessionInfo) {
    const plane = isPlane(session);
    const x = banded("x", () => palette().contact, [column.X, column.X_LOW, column.X_HIGH]);
    const y = banded("y", () => palette().accent, [column.Y, column.Y_LOW, column.Y_HIGH], [6, 3]);
    this.position = new Chart("chart-position", plane ? [...x, ...y] : x, plane ? 2 : 1, "Position over time");
    this.force = new Chart("chart-force", banded("F", () => palette().accent, [column.FORCE, column.FORCE_LOW, column.FORCE_HIGH]), 1, "Force over time");
    this.channels = new Chart("chart-channels", this.channelLines(), 0, "Readings over time");
    this.writeButtons();
    const units = [...new Set(session.channels.map((channel) => unit(channel.unit)))];
    need("chart-channels-title").textContent = units.length === 1 && units[0] !== "" ? `Channels in ${units[0]}` : "Channels";
    const known = session.force.known_n;
    need("chart-force-title").textContent = known === null ? "Force in N, with its 95 % interval" : `Force in N: known to be ${known} N of every contact`;
    const zeroed = need<HTMLInputElement>("zeroed");
    zeroed.addEventListener("change", () => this.again());
    onTheme(() => {
      this.position.rebuild();
      this.force.rebuild();
      this.channels.rebuild();
      this.writeButtons();
      this.again();
    });
  }

  /** Draws a stretch of a history. */
  draw(history: History, span: Span, untouched: Untouched): void {
    this.shown = { history, span, untouched };
    this.position.draw(history, span);
    this.force.draw(history, span);
    const zeroed = need<HTMLInputElement>("zeroed").checked;
    this.channels.draw(history, span, zeroed ? (i) => untouched?.[i] ?? 0 : undefined);
  }

  /** Draws what is shown once more: after a change of theme or choice while paused. */
  private again(): void {
    if (this.shown !== null) this.draw(this.shown.history, this.shown.span, this.shown.untouched);
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

/** A value and the ends of its interval. */
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

  constructor(
    id: string,
    private lines: Line[],
    private bandCount: number,
    label: string,
  ) {
    this.host = need(id);
    this.host.setAttribute("role", "img");
    this.host.setAttribute("aria-label", label);
    this.host.replaceChildren();
    this.plot = this.build();
    new ResizeObserver(() => {
      this.plot.setSize({ width: this.host.clientWidth, height: this.host.clientHeight });
    }).observe(this.host);
  }

  rebuild(): void {
    this.plot.destroy();
    this.plot = this.build();
  }

  showLines(): void {
    this.lines.forEach((line, i) => this.plot.setSeries(i + 1, { show: line.shown?.() ?? true }));
  }

  /** Draws a stretch of a history, each column less an offset where one is asked for. */
  draw(history: History, span: Span, offset?: (line: number) => number): void {
    this.head_s = span.head_s;
    const data = envelope(history, this.lines.map((line) => line.column), span.from_s, MOST_POINTS);
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
      padding: [6, 8, 0, 0],
      cursor: { y: false, points: { size: 5 } },
      scales: { x: { time: true }, y: { range: (_, low, high) => roomy(low, high) } },
      axes: [
        { ...axis, size: 28, space: 84, values: (_, times) => times.map((time) => clock(time).slice(0, 8)), incrs: SECONDS },
        { ...axis, size: 52, space: 30 },
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
      hooks: { draw: [(plot) => this.drawHead(plot)] },
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

/** The range of an axis: a tenth more than the values take, and some where they take none. */
function roomy(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const room = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

function translucent(colour: string): string {
  return `color-mix(in srgb, ${colour} 25%, transparent)`;
}
