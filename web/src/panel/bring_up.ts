// A board without a rig: its output, and the form that makes a rig.

import { api, ApiError } from "../api";
import { element, need, setText } from "../dom";
import type { BringUpRecord, RigForm } from "../protocol";
import { badFrameWords, hertz } from "../words";
import { FieldProblems } from "./field_problems";

const LOOK_MS = 200;
/** Requests of the curve of a channel: 20 s. */
const TRACED = 100;
/** Newtons of a gram: standard gravity. */
const NEWTONS = { g: 9.80665e-3, kg: 9.80665, N: 1 };

/** Elements of the fields that the server names. */
const FIELDS: Record<string, string> = {
  file: "rig-file",
  channels: "rig-channels",
  length_mm: "rig-length",
  width_mm: "rig-width",
  places: "rig-places",
  repeats: "rig-repeats",
  force_n: "rig-force",
  second_force_n: "rig-second-force",
  placement_mm: "rig-placement",
  sensor_places_mm: "rig-channels",
};

export class BringUpPanel {
  private looks = false;
  private looking: Promise<void> = Promise.resolve();
  private channels = "";
  private ports = "";
  private traces: number[][] = [];
  private asked = 0;
  private problems = new FieldProblems(need<HTMLFormElement>("rig-form"));

  constructor(private made: () => void) {
    need("bring-up-open").addEventListener("click", () => void this.choose());
    need("bring-up-baud").addEventListener("keydown", (event) => {
      if (event.key === "Enter") void this.choose();
    });
    const form = need<HTMLFormElement>("rig-form");
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      if (this.problems.check()) void this.make();
    });
    form.addEventListener("input", () => this.changed());
  }

  follow(): void {
    if (this.looks) return;
    this.looks = true;
    need("bring-up").hidden = false;
    document.body.classList.add("bringing-up");
    this.looking = this.look();
  }

  /** Stops once there is a rig. */
  end(): void {
    this.looks = false;
    need("bring-up").hidden = true;
    document.body.classList.remove("bringing-up");
  }

  private async look(): Promise<void> {
    try {
      this.write(await api.bringUp());
    } catch (error) {
      // Another user made the rig; the page itself reports a server that does not respond.
      if (error instanceof ApiError && error.status === 409) return this.made();
    }
    if (this.looks) setTimeout(() => (this.looking = this.looks ? this.look() : this.looking), LOOK_MS);
  }

  private async choose(): Promise<void> {
    const port = need<HTMLSelectElement>("bring-up-port").value;
    const baud = Number(need<HTMLInputElement>("bring-up-baud").value);
    try {
      this.ports = this.channels = "";
      this.write(await api.choosePort(port === "" ? null : port, Number.isInteger(baud) && baud >= 0 ? baud : 0));
    } catch (error) {
      this.complain("bring-up-problem", error);
    }
  }

  private write(seen: BringUpRecord): void {
    setText(need("bring-up-rate"), seen.readings === 0 ? "no readings" : hertz(seen.rate_hz));
    setText(need("bring-up-source"), seen.source ?? `${seen.from}: not there, looked for again`);
    this.writePorts(seen);
    const problem = need("bring-up-problem");
    problem.hidden = seen.problem === null;
    setText(problem, seen.problem ?? "");
    const bad = Object.entries(seen.bad_frames).map(([cause, count]) => `${count.toLocaleString("en-GB")} ${badFrameWords(cause)}`);
    setText(need("bring-up-bad"), bad.length === 0 ? "" : `Lines that are not readings: ${bad.join("; ")}`);
    this.writeValues(seen);
    this.writeLines(seen);
    const channels = JSON.stringify([seen.channels.map((channel) => channel.name), seen.named]);
    if (channels === this.channels) return;
    this.channels = channels;
    this.traces = seen.channels.map(() => []);
    this.writeChannels(seen);
    this.changed();
  }

  private writePorts(seen: BringUpRecord): void {
    need("bring-up-serial").hidden = seen.port === null;
    const names = [...new Set([seen.port ?? "", ...seen.ports.map((port) => port.name)])];
    const ports = JSON.stringify([names, seen.port, seen.baud]);
    const active = document.activeElement?.id ?? "";
    if (ports === this.ports || active.startsWith("bring-up-port") || active.startsWith("bring-up-baud")) return;
    this.ports = ports;
    const options = names.map((name) => {
      const device = seen.ports.find((port) => port.name === name)?.device ?? null;
      const option = element("option", "", device === null ? name : `${name} (${device})`);
      option.value = name;
      option.selected = name === seen.port;
      return option;
    });
    need("bring-up-port").replaceChildren(...options);
    need<HTMLInputElement>("bring-up-baud").value = String(seen.baud ?? "");
  }

  private writeValues(seen: BringUpRecord): void {
    const body = need("bring-up-channels");
    if (body.childElementCount !== seen.channels.length) {
      body.replaceChildren(
        ...seen.channels.map(() => {
          const name = element("th", "name", element("span", ""));
          name.scope = "row";
          const trace = document.createElementNS("http://www.w3.org/2000/svg", "svg");
          trace.setAttribute("viewBox", `0 0 ${TRACED} 24`);
          trace.setAttribute("preserveAspectRatio", "none");
          trace.setAttribute("aria-hidden", "true");
          trace.append(document.createElementNS("http://www.w3.org/2000/svg", "polyline"));
          return element("tr", "", name, element("td", "amount"), element("td", "trace", trace), element("td", "amount"), element("td", "amount"));
        }),
      );
    }
    seen.channels.forEach((channel, i) => {
      const row = body.children[i]!;
      const [name, now, trace, low, high] = [...row.children] as HTMLElement[];
      setText(name!.firstElementChild as HTMLElement, channel.name);
      name!.title = channel.name;
      setText(now!, words(channel.now));
      setText(low!, words(channel.range?.[0] ?? null));
      setText(high!, words(channel.range?.[1] ?? null));
      const values = (this.traces[i] ??= []);
      if (channel.now !== null) values.push(channel.now);
      if (values.length > TRACED) values.shift();
      trace!.querySelector("polyline")!.setAttribute("points", tracePoints(values));
    });
  }

  private writeLines(seen: BringUpRecord): void {
    const list = need("bring-up-lines");
    const atEnd = list.scrollTop + list.clientHeight >= list.scrollHeight - 4;
    list.replaceChildren(...seen.lines.map((line) => element("li", line.reads ? "" : "unread-line", line.text)));
    if (atEnd) list.scrollTop = list.scrollHeight;
  }

  private writeChannels(seen: BringUpRecord): void {
    const rows = seen.channels.map((channel, i) => {
      const use = element("input", "use");
      use.type = "checkbox";
      use.checked = true;
      use.setAttribute("aria-label", `Use ${channel.name}`);
      const name = element("input", "channel-name");
      name.id = `rig-channel-${i}`;
      name.value = channel.name;
      name.maxLength = 60;
      name.required = true;
      name.readOnly = seen.named;
      name.setAttribute("aria-label", `Name of channel ${i + 1}`);
      const place = element("input", "sensor-place");
      place.id = `rig-sensor-place-${i}`;
      place.pattern = "\\s*[0-9.]+([,; ]+[0-9.]+)?\\s*";
      place.title = "a number, on a plane two, as in 50, 20";
      place.placeholder = "at, mm";
      place.maxLength = 40;
      place.setAttribute("aria-label", `Place of sensor ${i + 1} in mm, which may be left out`);
      use.addEventListener("change", () => (name.disabled = place.disabled = !use.checked));
      return element("div", "channel-row", use, name, place);
    });
    need("rig-channels").replaceChildren(...(rows.length === 0 ? [element("p", "quiet", "Waiting for readings.")] : rows));
  }

  private form(write: boolean): RigForm {
    const text = (id: string) => need<HTMLInputElement>(id).value;
    const plane = text("rig-directions") === "2";
    const rows = [...need("rig-channels").querySelectorAll(".channel-row")];
    const unit = text("rig-force-unit") as keyof typeof NEWTONS;
    const number = (id: string) => (text(id).trim() === "" ? null : Number(text(id)));
    const newtons = (id: string) => {
      const weight = number(id);
      return weight === null ? null : Number((weight * NEWTONS[unit]).toPrecision(7));
    };
    const forceIsUnknown = need<HTMLInputElement>("rig-force-unknown").checked;
    return {
      file: text("rig-file").trim(),
      channels: rows.map((row) => {
        const [use, name] = [...row.querySelectorAll("input")];
        return use!.checked ? name!.value.trim() : "";
      }),
      length_mm: Number(text("rig-length")),
      width_mm: plane ? Number(text("rig-width")) : null,
      places: plane ? [Number(text("rig-places")), Number(text("rig-across"))] : [Number(text("rig-places"))],
      repeats: Number(text("rig-repeats")),
      force_n: forceIsUnknown ? null : newtons("rig-force"),
      second_force_n: forceIsUnknown ? null : newtons("rig-second-force"),
      placement_mm: number("rig-placement"),
      sensor_places_mm: sensorPlaces(rows.map((row) => row.querySelector<HTMLInputElement>(".sensor-place")!.value)),
      force_is_known: need<HTMLInputElement>("rig-known").checked && !forceIsUnknown,
      overwrite: need<HTMLInputElement>("rig-overwrite").checked,
      write,
    };
  }

  /** Shows the text of the rig, once the form is complete. */
  private changed(): void {
    const plane = need<HTMLSelectElement>("rig-directions").value === "2";
    for (const id of ["rig-width-label", "rig-across-label"]) need(id).hidden = !plane;
    need<HTMLInputElement>("rig-width").required = need<HTMLInputElement>("rig-across").required = plane;
    const forceIsUnknown = need<HTMLInputElement>("rig-force-unknown").checked;
    for (const id of ["rig-force", "rig-force-unit", "rig-second-force", "rig-known"]) {
      need<HTMLInputElement>(id).disabled = forceIsUnknown;
    }
    this.problems.showInvalid();
    const ready = need<HTMLFormElement>("rig-form").checkValidity() && need("rig-channels").querySelector("input") !== null;
    if (!ready) return setText(need("rig-text"), "Fill in length and weight first.");
    const asked = ++this.asked;
    api.makeRig(this.form(false)).then(
      (made) => {
        if (asked !== this.asked) return;
        setText(need("rig-text"), made.text);
        this.askToReplace(made.exists);
        this.complainOfRig(null);
      },
      (error: unknown) => {
        if (asked === this.asked) this.complainOfRig(error);
      },
    );
  }

  private askToReplace(files: string[]): void {
    need("rig-overwrite-label").hidden = files.length === 0;
    need<HTMLInputElement>("rig-overwrite").required = files.length > 0;
    setText(need("rig-overwrite-words"), `Replace ${files.join(" and ")}, which ${files.length === 1 ? "is" : "are"} there already`);
  }

  private async make(): Promise<void> {
    const button = need<HTMLButtonElement>("rig-make");
    button.disabled = true;
    this.asked += 1;
    // The server has no board without a rig any longer.
    this.looks = false;
    await this.looking;
    try {
      await api.makeRig(this.form(true));
      this.end();
      this.made();
    } catch (error) {
      this.follow();
      this.complainOfRig(error);
      if (error instanceof ApiError && error.status === 409) this.changed();
    } finally {
      button.disabled = false;
    }
  }

  /** Shows a refusal beside the field, or else above the button. */
  private complainOfRig(error: unknown): void {
    const id = error instanceof ApiError && error.field !== null ? FIELDS[error.field] : undefined;
    for (const other of new Set(Object.values(FIELDS))) {
      if (other !== id) this.problems.set(need(other), null);
    }
    if (id === undefined) return this.complain("rig-problem", error);
    this.complain("rig-problem", null);
    this.problems.set(need(id), (error as ApiError).message);
  }

  private complain(id: string, error: unknown): void {
    const problem = need(id);
    problem.hidden = error === null;
    setText(problem, error === null ? "" : error instanceof ApiError ? error.message : "The server does not answer.");
  }
}

/** Parses places of sensors such as `50` or `50, 20`; null for empty input. */
export function sensorPlaces(typed: readonly string[]): number[][] | null {
  if (typed.every((text) => text.trim() === "")) return null;
  return typed.map((text) =>
    text
      .trim()
      .split(/[\s,;]+/)
      .filter((part) => part !== "")
      .map(Number),
  );
}

function words(value: number | null): string {
  return value === null ? "—" : value.toLocaleString("en-GB", { maximumSignificantDigits: 7 }).replace("-", "−");
}

export function tracePoints(values: readonly number[]): string {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const scale = high > low ? 20 / (high - low) : 0;
  const left = TRACED - values.length;
  return values.map((value, i) => `${left + i},${(high > low ? 22 - (value - low) * scale : 12).toFixed(2)}`).join(" ");
}
