// Presses of a calibration, and the check of its locator at new places.

import { element, need, setText } from "../dom";
import type { CheckRecord, PressRecord } from "../protocol";
import { size } from "../words";

/** A place in mm, to two decimals. */
export function mmWords(x_mm: number, y_mm?: number): string {
  const mm = (value: number) => String(Number(value.toFixed(2)));
  return y_mm === undefined ? `${mm(x_mm)} mm` : `${mm(x_mm)}, ${mm(y_mm)} mm`;
}

/** Points of a polyline of a trace in a box, time to the right and size upwards. */
export function tracePoints(trace: [number, number][], width: number, height: number): string {
  if (trace.length < 2) return "";
  const [from, to] = [trace[0]![0], trace[trace.length - 1]![0]];
  const most = Math.max(100, ...trace.map(([, percent]) => percent));
  const x = (time_s: number) => (width * (time_s - from)) / (to - from || 1);
  const y = (percent: number) => height * (1 - percent / most);
  return trace.map(([time_s, percent]) => `${x(time_s).toFixed(1)},${y(percent).toFixed(1)}`).join(" ");
}

const SVG = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT] = [120, 28];

function traceOf(press: PressRecord): Node {
  const points = tracePoints(press.trace, WIDTH, HEIGHT);
  if (points === "") return document.createTextNode("—");
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", `0 -1 ${WIDTH} ${HEIGHT + 2}`);
  svg.setAttribute("class", "trace");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", `Size of press ${press.press} in the seconds before it was taken`);
  const line = document.createElementNS(SVG, "polyline");
  line.setAttribute("points", points);
  svg.append(line);
  return svg;
}

/** Writes the presses, the last one first; a button deletes one. */
export function writePresses(presses: PressRecord[], canStrike: boolean, strike: (press: number) => void): void {
  const rows = [...presses].reverse().map((press) => {
    const name = element("th", "", String(press.press));
    name.scope = "row";
    const force = press.force_n === null ? "" : ` with ${Number(press.force_n.toPrecision(3))} N`;
    const off = press.deviation_percent === null ? "—" : `${size(press.deviation_percent)} %`;
    const error = press.held_out_mm === null ? "—" : `${size(press.held_out_mm)} mm`;
    const button = element("button", "", "Strike out");
    button.type = "button";
    button.disabled = !canStrike;
    button.setAttribute("aria-label", `Strike out press ${press.press}`);
    button.addEventListener("click", () => strike(press.press));
    const cells = [mmWords(press.x_mm, press.y_mm) + force, traceOf(press), off, error, button];
    return element("tr", "", name, ...cells.map((cell) => element("td", "", cell)));
  });
  need("calibration-press-list").replaceChildren(...rows);
}

export function checkWords(check: CheckRecord): string {
  const covered = check.covered === null ? "" : `; ${check.covered} of ${check.places.length} within their 95 % intervals`;
  const placement = check.placement_mm === null ? "" : ` Your placement of ${size(check.placement_mm)} mm is in it.`;
  return `Error ${size(check.median_mm)} mm (median), ${size(check.mean_mm)} mm (mean)${covered}.${placement} The presses are in ${check.presses}.`;
}

export function writeCheck(check: CheckRecord | null): void {
  need("calibration-checked").hidden = check === null;
  if (check === null) return;
  setText(need("calibration-checked-words"), checkWords(check));
  const rows = check.places.map((place) => {
    const name = element("th", "", mmWords(place.x_mm, place.y_mm));
    name.scope = "row";
    const covered = place.covered === null ? "—" : place.covered ? "covers it" : "does not cover it";
    const cells = [mmWords(place.estimate_x_mm, place.estimate_y_mm), `${size(place.error_mm)} mm`, covered];
    return element("tr", "", name, ...cells.map((cell) => element("td", "", cell)));
  });
  need("calibration-checked-places").replaceChildren(...rows);
}
