// A guided calibration: the next place, agreement of presses, and steps of the user.

import { api } from "../api";
import { element, need, setText } from "../dom";
import type { CalibrationOutcome, CalibrationRecord, CalibrationStep, PlaceRecord, StepDetails } from "../protocol";
import { size } from "../words";
import { machineStep, MachinePanel, motionWords, setUpStep } from "./machine";
import { mmWords, writeCheck, writePresses } from "./presses";
import { Preview } from "./preview";

/** Milliseconds between two requests in a running and in a waiting calibration. */
const LOOK_MS = 150;
const IDLE_MS = 1_000;
const PREVIEW_MS = 200;

type ButtonStep = Exclude<CalibrationStep, "strike" | "jog" | "touch_off">;

/** Steps after which a machine moves. */
const MOVING: CalibrationStep[] = ["begin", "check", "dry_run", "set_up"];

const BUTTONS: { id: string; step: ButtonStep }[] = [
  { id: "calibration-begin", step: "begin" },
  { id: "calibration-redo", step: "redo" },
  { id: "calibration-skip", step: "skip" },
  { id: "calibration-untouched", step: "untouched" },
  { id: "calibration-stop", step: "stop" },
  { id: "calibration-finish", step: "finish" },
  { id: "calibration-check", step: "check" },
  { id: "calibration-dry-run", step: "dry_run" },
  { id: "calibration-set-up", step: "set_up" },
];

export class CalibrationPanel {
  state: CalibrationRecord | null = null;
  private machine = new MachinePanel(
    (axis, by_mm) => this.act("jog", { axis, by_mm }),
    () => this.act("touch_off"),
  );
  private preview = new Preview();
  /** Listed presses: their number, and true if they can be deleted. */
  private listed = "";
  private looks = false;
  private closed = false;

  constructor(
    private changed: () => void,
    private failed: (error: unknown) => void,
  ) {
    for (const { id, step } of BUTTONS) need(id).addEventListener("click", () => this.act(step));
    need("calibration-close").addEventListener("click", () => this.close());
    need("calibration-statements").addEventListener("submit", (event) => {
      event.preventDefault();
      this.act("begin");
    });
    need("calibration-presses").addEventListener("toggle", () => void this.list(true));
  }

  follow(): void {
    if (this.looks || this.closed) return;
    this.looks = true;
    void this.look();
  }

  /** Returns true while a user is guided, without an estimate. */
  get guides(): boolean {
    return this.state !== null && !["assessing", "done"].includes(this.state.phase);
  }

  /** Takes a step by key, if its button is enabled. */
  key(step: ButtonStep): void {
    const button = BUTTONS.find((button) => button.step === step);
    if (button !== undefined && !need<HTMLButtonElement>(button.id).hidden) this.act(step);
  }

  private act(step: CalibrationStep, details: StepDetails = {}): void {
    const moves = MOVING.includes(step) && this.state?.machine != null;
    if (moves) this.machine.begins();
    const stated = step === "begin" ? statements() : details;
    void api.calibrate(step, stated).then(
      (state) => {
        if (moves) this.machine.begun();
        this.take(state);
        this.follow();
        void this.list(true);
      },
      (error: unknown) => this.failed(error),
    );
  }

  private async look(): Promise<void> {
    try {
      this.take(await api.calibration());
    } catch {
      // The page reports that the server does not respond; the panel asks again.
      if (this.state?.machine?.runs === true) this.writeProblem("The server does not answer: if the machine goes on, switch it off.");
    }
    const phase = this.state?.phase;
    if (this.closed || phase === "done") {
      this.looks = false;
      return;
    }
    const previews = phase === "ready" && (this.state?.readings ?? 0) > 0;
    setTimeout(() => void this.look(), previews ? PREVIEW_MS : phase === "ready" || phase === undefined ? IDLE_MS : LOOK_MS);
  }

  private close(): void {
    this.closed = true;
    this.state = null;
    need("calibration").hidden = true;
    this.changed();
  }

  private take(state: CalibrationRecord): void {
    if (this.closed) return;
    this.state = state;
    this.write(state);
    this.changed();
  }

  private write(state: CalibrationRecord): void {
    need("calibration").hidden = false;
    setText(need("calibration-step"), stepWords(state));
    setText(need("calibration-why"), whyWords(state));
    this.writeProblem(state.problem);
    this.machine.write(state);
    const planned = state.taken + state.left;
    setText(need("calibration-progress"), `${state.taken} of ${planned} presses, in ${state.presses}`);
    const bar = need<HTMLProgressElement>("calibration-bar");
    bar.max = Math.max(1, planned);
    bar.value = state.taken;
    const checking = state.phase === "checking";
    const pressing = state.phase === "pressing" || checking;
    const waits = state.phase === "ready" || state.phase === "pressed";
    const shown: Record<ButtonStep, boolean> = {
      begin: (state.phase === "ready" && state.left > 0) || state.phase === "pressed",
      check: state.can_check,
      redo: (pressing || state.phase === "pressed") && state.taken > 0 && state.machine === null,
      skip: pressing && state.machine === null,
      untouched: pressing && state.machine === null,
      stop: pressing || state.phase === "setting_up",
      dry_run: state.can_set_up,
      set_up: state.can_set_up,
      finish: waits && state.taken > 0,
    };
    for (const { id, step } of BUTTONS) need(id).hidden = !shown[step];
    need("calibration-begin").firstChild!.textContent = beginWords(state);
    need("calibration-stop").firstChild!.textContent = state.phase === "setting_up" ? "End the set-up " : "Stop early ";
    need("calibration-close").hidden = state.phase !== "done";
    writeStatements(state);
    this.preview.write(state, performance.now() / 1000);
    writeCheck(state.check);
    this.writePlaces(state);
    void this.list(false);
  }

  /** Lists the presses if the list is open and they have changed, or with `anew`. */
  private async list(anew: boolean): Promise<void> {
    const state = this.state;
    if (state === null || state.phase === "checking" || !need<HTMLDetailsElement>("calibration-presses").open) return;
    const canStrike = state.machine?.runs !== true && !["fitting", "assessing"].includes(state.phase);
    const listed = `${state.taken} ${state.phase} ${canStrike}`;
    if (listed === this.listed && !anew) return;
    this.listed = listed;
    try {
      writePresses(await api.presses(), canStrike, (press) => this.act("strike", { press }));
    } catch (error) {
      this.failed(error);
    }
  }

  private writeProblem(words: string | null): void {
    const problem = need("calibration-problem");
    setText(problem, words ?? "");
    problem.hidden = words === null;
  }

  private writePlaces(state: CalibrationRecord): void {
    const rows = state.places.map((place) => {
      const name = element("th", "", placeWords(place));
      name.scope = "row";
      const isNext = state.next !== null && state.next.x_mm === place.x_mm && state.next.y_mm === place.y_mm;
      const spread = place.spread_percent === null ? "—" : `${size(place.spread_percent)} %`;
      const cells = [`${place.taken} of ${place.taken + place.left}`, spread, isNext ? "next" : place.left === 0 ? "taken" : ""];
      return element("tr", isNext ? "next" : "", name, ...cells.map((text) => element("td", "", text)));
    });
    const body = need("calibration-places");
    const html = rows.map((row) => row.outerHTML).join("");
    if (body.innerHTML !== html) body.replaceChildren(...rows);
  }
}

function inputNumber(id: string): number | undefined {
  const value = need<HTMLInputElement>(id).valueAsNumber;
  return Number.isFinite(value) ? value : undefined;
}

function statements(): StepDetails {
  const details: StepDetails = {};
  const [placement_mm, second_force_n] = [inputNumber("calibration-placement"), inputNumber("calibration-second")];
  if (placement_mm !== undefined) details.placement_mm = placement_mm;
  if (need<HTMLInputElement>("calibration-known").checked) details.force_is_known = true;
  else if (second_force_n !== undefined) details.second_force_n = second_force_n;
  return details;
}

/** Asks for unknown statements before the first press of a run by hand. */
function writeStatements(state: CalibrationRecord): void {
  const asks = state.phase === "ready" && state.machine === null && state.left > 0;
  need("calibration-placement-row").hidden = state.placement_mm !== null;
  need("calibration-weights").hidden = state.single_weight_n === null;
  need("calibration-statements").hidden = !asks || (state.placement_mm !== null && state.single_weight_n === null);
  if (state.single_weight_n !== null) setText(need("calibration-weights-why"), weightWords(state.single_weight_n));
}

/** Reason for a second weight. */
export function weightWords(force_n: number): string {
  return `All presses have ${Number(force_n.toPrecision(3))} N, and the force in use is unknown: one weight does not determine how readings grow with the force.`;
}

function beginWords(state: CalibrationRecord): string {
  if (state.machine !== null) return state.taken === 0 ? "Press by machine " : "Go on by machine ";
  return state.taken === 0 ? "Begin " : "Go on ";
}

export function stepWords(state: CalibrationRecord): string {
  switch (state.phase) {
    case "ready":
      if (state.left === 0) return "All presses are taken";
      return state.taken === 0 ? "Ready to calibrate" : "Ready to go on";
    case "pressing":
      if (state.machine?.runs === true) return machineStep(state.machine, state);
      if (state.source === null) return "Waiting for readings";
      return waitingWords(state);
    case "checking":
      if (state.machine?.runs === true) return machineStep(state.machine, state);
      return state.source === null ? "Waiting for readings" : waitingWords(state);
    case "setting_up":
      return state.machine === null ? "" : setUpStep(state.machine, state);
    case "pressed":
      return "No more presses are asked for";
    case "fitting":
      return "Fitting the locator…";
    case "assessing":
      return "The locator is in use; its error is estimated…";
    case "done":
      return state.outcome === null ? "Calibrated" : errorWords(state.outcome);
  }
}

function waitingWords(state: CalibrationRecord): string {
  switch (state.waiting) {
    case "untouched":
      return "Leave the surface alone";
    case "press":
      return state.next === null ? "Press" : `Press at ${placeWords(state.next)}${forceWords(state.next)}`;
    case "rest":
      return "Hold still";
    case "release":
      return "Let go";
    case "nothing":
      return "All presses are taken";
  }
}

function whyWords(state: CalibrationRecord): string {
  switch (state.phase) {
    case "ready":
      if (state.hint !== null) return state.hint;
      if (state.machine !== null && state.taken === 0) return `${state.left} presses, one after the other as the surface shows them. Each is taken once its reading is at rest.`;
      return state.taken === 0
        ? `The places to press are shown on the surface, one after the other: ${state.left} presses. Each is taken by itself once its reading is at rest.`
        : `${state.taken} presses are on disk; ${state.left} are left. Go on, or fit those that there are.`;
    case "pressing":
      if (state.machine?.runs === true) return motionWords(state.machine, state);
      if (state.hint !== null) return state.hint;
      if (state.waiting === "rest") return "The reading comes to rest; then it is taken by itself.";
      if (state.waiting === "untouched") return "The noise and the untouched reading are learnt.";
      if (state.last_percent === null) return state.waiting === "release" ? "The press is on disk." : "";
      return `The last press is ${size(state.last_percent)} % off the others of its place.`;
    case "checking":
      return `Check: ${state.taken} of ${state.taken + state.left} fresh places, which the calibration has not pressed.`;
    case "setting_up":
      return state.hint ?? (state.machine === null ? "" : motionWords(state.machine, state));
    case "pressed":
      return "Take the last press back, go on with those that were left out, or fit the locator.";
    case "done":
      return state.outcome === null ? "" : gainWords(state.outcome);
    default:
      return "";
  }
}

function errorWords(outcome: CalibrationOutcome): string {
  const fitted = `Fitted to ${outcome.presses} presses`;
  if (outcome.median_mm === null || outcome.mean_mm === null) return `${fitted}.`;
  return `${fitted}: error at held-out positions ${size(outcome.median_mm)} mm (median), ${size(outcome.mean_mm)} mm (mean)`;
}

function gainWords(outcome: CalibrationOutcome): string {
  const { gain_percent, stop_percent } = outcome;
  const gain =
    gain_percent === null || stop_percent === null
      ? ""
      : gain_percent < stop_percent
        ? `More presses would lower the error by less than ${stop_percent} %.`
        : `Endlessly many more presses would lower the expected error by ${gain_percent.toFixed(0)} %.`;
  return [`The locator is in ${outcome.locator}.`, gain, ...outcome.remarks].filter((words) => words !== "").join(" ");
}

function placeWords(place: PlaceRecord): string {
  return mmWords(place.x_mm, place.y_mm);
}

function forceWords(place: PlaceRecord): string {
  return place.force_n === undefined ? "" : ` with ${Number(place.force_n.toPrecision(3))} N`;
}
