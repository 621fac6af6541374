// Description of a chart in a sentence, and its rows as a file.

import type { SessionInfo } from "../protocol";
import { number, unit } from "../words";
import * as columns from "./history";
import type { History } from "./history";
import type { Span } from "./snapshot";

export function summary(history: History, span: Span, name: string, column: number, unit: string): string {
  let [low, high, last] = [Infinity, -Infinity, NaN];
  const end = history.firstFrom(span.to_s + 1e-9);
  for (let row = history.firstFrom(span.from_s); row < end; row++) {
    const value = history.at(column, row);
    last = value;
    if (Number.isNaN(value)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return `${name}: no value.`;
  const sd = (high - low) / 100 || undefined;
  const words = (value: number) => `${number(value, sd)}${unit === "" ? "" : ` ${unit}`}`;
  const now = Number.isNaN(last) ? "none now" : `${words(last)} now`;
  return `${name}: ${words(low)} to ${words(high)}, ${now}.`;
}

/** Rows of a span as CSV: time, position, force, their intervals, and the channels. */
export function csv(session: SessionInfo, history: History, span: Span): string {
  const plane = session.surface?.width_mm != null && !["beam", "digit"].includes(session.surface.kind);
  const heads: [string, number][] = [
    ["time_s", columns.TIME],
    ["x_mm", columns.X],
    ["x_95_low_mm", columns.X_LOW],
    ["x_95_high_mm", columns.X_HIGH],
    ...(plane ? ([["y_mm", columns.Y], ["y_95_low_mm", columns.Y_LOW], ["y_95_high_mm", columns.Y_HIGH]] as [string, number][]) : []),
    ["force_n", columns.FORCE],
    ["force_95_low_n", columns.FORCE_LOW],
    ["force_95_high_n", columns.FORCE_HIGH],
    ...session.channels.map((channel, i): [string, number] => [
      channel.unit === "" ? channel.name : `${channel.name} (${unit(channel.unit)})`,
      columns.FIRST_CHANNEL + i,
    ]),
  ];
  const lines = [heads.map(([head]) => quoted(head)).join(",")];
  const end = history.firstFrom(span.to_s + 1e-9);
  for (let row = history.firstFrom(span.from_s); row < end; row++) {
    lines.push(heads.map(([, column]) => valueWords(history.at(column, row), column)).join(","));
  }
  return `${lines.join("\n")}\n`;
}

function valueWords(value: number, column: number): string {
  if (Number.isNaN(value)) return "";
  return column === columns.TIME ? value.toFixed(6) : String(value);
}

function quoted(text: string): string {
  return /[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
