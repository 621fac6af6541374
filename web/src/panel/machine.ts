// The machine of a calibration: planned moves, position, and the stop.

import { api } from "../api";
import { element, need, setText } from "../dom";
import type { Axis, CalibrationRecord, MachineRecord, MovesRecord } from "../protocol";
import { fixed, seconds, size } from "../words";

/** Milliseconds between two attempts to stop it, and attempts before the page reports a failure. */
const AGAIN_MS = 250;
const TRIES = 8;

export class MachinePanel {
  private runs = false;
  private stopping = false;
  private asked = false;

  constructor(jog: (axis: Axis, by_mm: number) => void, touchOff: () => void) {
    for (const button of need("machine-jogs").querySelectorAll<HTMLButtonElement>("button[data-axis]")) {
      button.addEventListener("click", () => jog(button.dataset.axis as Axis, Number(button.dataset.sign) * stepOf()));
    }
    need("machine-touch-off").addEventListener("click", touchOff);
    need("machine-stop").addEventListener("click", () => void this.stop());
    // With any focus, and with single keys on or off.
    document.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !this.runs) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      void this.stop();
    }, true);
  }

  /** Marks that a machine is about to run; from now on it can be stopped. */
  begins(): void {
    this.runs = true;
    this.asked = false;
  }

  /** Marks that it runs, and repeats an earlier stop. */
  begun(): void {
    if (this.asked) void this.stop();
  }

  write(state: CalibrationRecord): void {
    const machine = state.machine;
    const moves = need("machine-moves");
    moves.hidden = machine === null || machine.runs || state.left === 0 || state.phase !== "ready";
    if (machine !== null) {
      const found = machine.found_touch_mm === null ? [] : [foundWords(machine.found_touch_mm)];
      const items = [...movesWords(machine.moves, state.left), ...found].map((words) => element("li", "", words));
      const list = need("machine-moves-list");
      if (list.textContent !== items.map((item) => item.textContent).join("")) list.replaceChildren(...items);
    }
    this.runs = machine?.runs ?? false;
    need("machine").hidden = !this.runs;
    const setsUp = this.runs && state.phase === "setting_up";
    need("machine-set-up").hidden = !setsUp;
    need("machine-run").hidden = setsUp;
    if (machine === null || !this.runs) return;
    for (const button of need("machine-jogs").querySelectorAll("button")) button.disabled = machine.motion !== "up";
    setText(need("machine-at"), machine.at_mm === null ? "—" : atWords(machine.at_mm));
    const force = machine.force_n === null ? (state.next?.force_n ?? null) : machine.force_n;
    setText(need("machine-position"), positionWords(machine) ?? "—");
    setText(need("machine-depth"), depthWords(machine));
    setText(need("machine-force"), force === null ? "—" : `${fixed(force, 3)} N`);
    setText(need("machine-force-note"), machine.force_n === null ? "by the rig" : "at the load cell");
    setText(need("machine-left"), machine.left_s === null ? "—" : seconds(Math.max(machine.left_s, 1)));
  }

  /** Stops the machine: repeats the request until the server answers, and reports failures. */
  async stop(): Promise<void> {
    this.asked = true;
    if (this.stopping) return;
    this.stopping = true;
    const words = need("machine-stop-words");
    setText(words, "Stopping…");
    words.hidden = false;
    let stopped = false;
    for (let i = 0; i < TRIES && !stopped; i++) {
      if (i > 0) await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
      stopped = await api.emergencyStop().then(() => true, () => false);
    }
    setText(words, stopped ? "" : "The server has not confirmed the stop: switch the machine off.");
    words.hidden = stopped;
    this.stopping = false;
  }
}

function stepOf(): number {
  return Number(need<HTMLSelectElement>("machine-step").value);
}

export function atWords([x, y, z]: [number, number, number]): string {
  const place = (at: number) => String(Number(at.toFixed(3))).replace("-", "−");
  return `x ${place(x)}, y ${place(y)}, z ${place(z)} mm`;
}

export function foundWords(z_mm: number): string {
  return `The untouched surface is at z ${Number(z_mm.toFixed(3))} mm, as the touch-off found it; the rig keeps that as touch = "${Number(z_mm.toFixed(3))} mm".`;
}

/** Planned moves, their speed, and ways to stop them. */
export function movesWords(moves: MovesRecord, presses: number): string[] {
  const [below, z] = [moves.depths_mm, moves.depths_mm.map((depth) => moves.touch_z_mm - depth)];
  const limit = moves.force_limit_n === null ? "" : `more than ${size(moves.force_limit_n)} N at the load cell ${moves.load_cell}, `;
  return [
    "It searches for its end stops first: its path there must be free.",
    `It travels over ${spanWords("x", moves.x_mm)} and ${spanWords("y", moves.y_mm)} of its own axes, at z ${mm(moves.travel_z_mm)} mm with ${mm(moves.travel_mm_per_s)} mm/s.`,
    `It presses ${presses} times, down to z ${list(z)} mm (${list(below)} mm below the untouched surface) with ${mm(moves.press_mm_per_s)} mm/s.`,
    `The button or Escape stops it at once, and so does ${limit}a channel at the end of its range, or 2 s without readings.`,
    "When no page has been open for 5 s, it lifts its finger and ends.",
  ];
}

/** Step of the machine, for the announced line. */
export function machineStep(machine: MachineRecord, state: CalibrationRecord): string {
  switch (machine.motion) {
    case null:
      return "Greeting the machine…";
    case "blind":
      return "Waiting for readings";
    case "homing":
      return "The machine searches for its end stops";
    default: {
      if (state.waiting === "nothing") return "Lifting the finger";
      const at = positionWords(machine);
      if (at === null) return "Leave the surface alone";
      const depth = machine.depth_mm === null ? "" : `, ${mm(machine.depth_mm)} mm deep`;
      return `Pressing at ${at}${depth}`;
    }
  }
}

export function setUpStep(machine: MachineRecord, state: CalibrationRecord): string {
  switch (machine.motion) {
    case "up":
      return "Jog the machine, or find the touch";
    case "down":
    case "pressing":
      return "The finger goes down in search of the touch";
    case "travelling":
      return "The finger travels, lifted";
    default:
      return machineStep(machine, state);
  }
}

export function motionWords(machine: MachineRecord, state: CalibrationRecord): string {
  switch (machine.motion) {
    case null:
      return `at ${machine.url}`;
    case "blind":
      return `Nothing moves before a reading has come${machine.stopping === null ? "" : `; ${machine.stopping}`}.`;
    case "homing":
      return machine.stopping === null ? "Keep your hands away." : `Keep your hands away: ${machine.stopping}.`;
    case "travelling":
      return "The finger travels, lifted.";
    case "pressing":
      return "The finger is on its way.";
    case "lifting":
      return "The finger is being lifted.";
    case "down":
      return state.waiting === "press" ? "The finger presses; no reading shows it yet." : "The finger presses; its reading comes to rest.";
    case "up":
      return state.waiting === "untouched" ? "The noise and the untouched reading are learnt." : "The finger is lifted; the surface comes to rest.";
  }
}

function positionWords(machine: MachineRecord): string | null {
  if (machine.x_mm === null) return null;
  const across = machine.y_mm === null ? "" : `, ${machine.y_mm.toFixed(1)}`;
  return `${machine.x_mm.toFixed(1)}${across} mm`;
}

function depthWords(machine: MachineRecord): string {
  if (machine.motion === "down" && machine.depth_mm !== null) return `${mm(machine.depth_mm)} mm`;
  return { travelling: "lifted", pressing: "going down", lifting: "lifting", up: "lifted" }[machine.motion as string] ?? "—";
}

function spanWords(axis: string, [from, to]: [number, number]): string {
  return from === to ? `${axis} ${mm(from)} mm` : `${axis} ${mm(from)} to ${mm(to)} mm`;
}

function list(values: number[]): string {
  const words = values.map(mm);
  return words.length < 2 ? words.join("") : `${words.slice(0, -1).join(", ")} and ${words.at(-1)}`;
}

/** Millimetres without trailing zeros. */
function mm(value: number): string {
  return String(Number(value.toFixed(2))).replace("-", "−");
}
