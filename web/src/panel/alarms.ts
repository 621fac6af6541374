// Alarms: rules of the user, and the banner of a raised alarm.

import { api, ApiError } from "../api";
import { need, save, setText } from "../dom";
import type { EventRecord } from "../protocol";
import { clock } from "../words";

/** A rule of the form; bands are numbers as text, or empty. */
export interface AlarmRule {
  name: string;
  when: string;
  x_mm: [string, string];
  force_n: [string, string];
  hold_ms: string;
  text: string;
}

/** Ends of half-open bands: beyond any surface and any force. */
const FAR_MM = 1e6;
const FAR_N = 1e6;

export function ruleText(rule: AlarmRule): string {
  const lines = ["[[rule]]", `name = ${quoted(rule.name)}`];
  if (rule.when === "contact") {
    lines.push(...band("x", rule.x_mm, "mm", FAR_MM), ...band("force", rule.force_n, "N", FAR_N));
    if (Number(rule.hold_ms) > 0) lines.push(`hold = "${Number(rule.hold_ms)} ms"`);
  } else {
    lines.push(`event = ${quoted(rule.when)}`);
  }
  lines.push(`alarm = ${quoted(rule.text)}`);
  return `${lines.join("\n")}\n`;
}

/** Words about the set alarms and their lifetime. */
export function alarmsSet(count: number, file: string | null): string {
  if (count === 0) return "No alarms are set.";
  const are = `${count} ${count === 1 ? "alarm is" : "alarms are"} set`;
  return file === null ? `${are} until the server ends.` : `${are}, and kept in ${file}.`;
}

function band(key: string, [low, high]: [string, string], unit: string, far: number): string[] {
  if (low === "" && high === "") return [];
  const [from, to] = [low === "" ? -far : Number(low), high === "" ? far : Number(high)];
  return [`${key} = ["${from} ${unit}", "${to} ${unit}"]`];
}

/** A basic string of TOML, with the escapes of JSON. */
function quoted(text: string): string {
  return JSON.stringify(text).replaceAll("\u007f", "\\u007f");
}

export class Alarms {
  private raised = 0;

  constructor() {
    const dialog = need<HTMLDialogElement>("alarms-dialog");
    need("alarms").addEventListener("click", () => void this.open());
    need("alarms-close").addEventListener("click", () => dialog.close());
    need("alarm-when").addEventListener("change", () => this.showBands());
    need("alarm-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.add();
    });
    need("alarm-set").addEventListener("click", () => void this.set());
    need("alarm-save").addEventListener("click", () => save("alarms.toml", new Blob([this.file.value], { type: "application/toml" })));
    need("alarm-dismiss").addEventListener("click", () => {
      this.raised = 0;
      need("alarm").hidden = true;
    });
  }

  private get file(): HTMLTextAreaElement {
    return need<HTMLTextAreaElement>("alarm-file");
  }

  /** Shows the alarms among new events until they are dismissed. */
  take(events: readonly EventRecord[]): void {
    const alarms = events.filter((event) => event.event === "alarm");
    const last = alarms.at(-1);
    if (last === undefined) return;
    this.raised += alarms.length;
    const others = this.raised === 1 ? "" : ` (${this.raised} alarms)`;
    setText(need("alarm-words"), `Alarm at ${clock(last.time_s)}: ${last.text}, by rule “${last.name}”${others}`);
    need("alarm").hidden = false;
  }

  private async open(): Promise<void> {
    this.complain(null);
    setText(need("alarm-done"), "");
    this.showBands();
    need<HTMLDialogElement>("alarms-dialog").showModal();
    try {
      this.file.value = (await api.alarms()).text;
    } catch (error) {
      this.complain(error);
    }
  }

  private showBands(): void {
    need("alarm-bands").hidden = need<HTMLSelectElement>("alarm-when").value !== "contact";
  }

  private add(): void {
    const value = (id: string) => need<HTMLInputElement>(id).value.trim();
    const rule = ruleText({
      name: value("alarm-name"),
      when: value("alarm-when"),
      x_mm: [value("alarm-x-low"), value("alarm-x-high")],
      force_n: [value("alarm-force-low"), value("alarm-force-high")],
      hold_ms: value("alarm-hold"),
      text: value("alarm-text"),
    });
    const before = this.file.value.trimEnd();
    this.file.value = before === "" ? rule : `${before}\n\n${rule}`;
    this.file.scrollTop = this.file.scrollHeight;
    void this.set();
  }

  private async set(): Promise<void> {
    setText(need("alarm-done"), "");
    try {
      const { text, file } = await api.setAlarms(this.file.value);
      this.complain(null);
      const count = text.split("\n").filter((line) => line.trim().startsWith("[[rule]]")).length;
      setText(need("alarm-done"), alarmsSet(count, file));
    } catch (error) {
      this.complain(error);
    }
  }

  private complain(error: unknown): void {
    const problem = need("alarm-problem");
    problem.hidden = error === null;
    setText(problem, error === null ? "" : error instanceof ApiError ? error.message : "The server does not answer.");
  }
}
