import { describe, expect, test, vi } from "vitest";
import type { CalibrationRecord, MachineRecord } from "../src/protocol";

// The panel's module looks at the page's address as it is loaded.
vi.stubGlobal("location", { search: "", href: "http://127.0.0.1/" });
const { stepWords, weightWords } = await import("../src/panel/calibration");
const { checkWords, mmWords, tracePoints } = await import("../src/panel/presses");
const { rateOf } = await import("../src/panel/preview");

const { atWords, foundWords, movesWords } = await import("../src/panel/machine");

const PRESSING: CalibrationRecord = {
  phase: "pressing",
  waiting: "press",
  next: { x_mm: 40, force_n: 3, taken: 0, left: 2, spread_percent: null },
  taken: 0,
  left: 12,
  places: [],
  last_percent: null,
  source: "a board",
  readings: 100,
  reading: [],
  bad_frames: 0,
  presses: "presses.csv",
  placement_mm: null,
  single_weight_n: null,
  problem: null,
  hint: null,
  machine: null,
  outcome: null,
  check: null,
  can_check: false,
  can_set_up: false,
};

describe("words of a calibration", () => {
  test("say where to press, on a line and on a plane, with the force that is known", () => {
    expect(stepWords(PRESSING)).toBe("Press at 40 mm with 3 N");
    const next = { x_mm: 40, y_mm: 12.25, taken: 0, left: 1, spread_percent: null };
    expect(stepWords({ ...PRESSING, next })).toBe("Press at 40, 12.25 mm");
  });

  test("do not ask for a press while there are no readings", () => {
    expect(stepWords({ ...PRESSING, source: null })).toBe("Waiting for readings");
  });

  test("tell a calibration that is gone on with from one that begins", () => {
    expect(stepWords({ ...PRESSING, phase: "ready" })).toBe("Ready to calibrate");
    expect(stepWords({ ...PRESSING, phase: "ready", taken: 3 })).toBe("Ready to go on");
    expect(stepWords({ ...PRESSING, phase: "ready", taken: 12, left: 0 })).toBe("All presses are taken");
  });

  test("say what a machine will move and how far before it does, and what it does then", () => {
    const moves = {
      x_mm: [60, 260] as [number, number],
      y_mm: [110, 110] as [number, number],
      travel_z_mm: 27,
      touch_z_mm: 22,
      depths_mm: [1, 2],
      travel_mm_per_s: 50,
      press_mm_per_s: 2,
      load_cell: "F",
      force_limit_n: 3,
    };
    const words = movesWords(moves, 54).join(" ");
    expect(words).toContain("over x 60 to 260 mm and y 110 mm of its own axes, at z 27 mm with 50 mm/s");
    expect(words).toContain("presses 54 times, down to z 21 and 20 mm (1 and 2 mm below the untouched surface) with 2 mm/s");
    expect(words).toContain("more than 3.0 N at the load cell F");
    const machine: MachineRecord = {
      url: "gcode:tcp://printer:23",
      firmware: "Marlin",
      stopping: null,
      runs: true,
      motion: "homing",
      x_mm: null,
      y_mm: null,
      depth_mm: null,
      force_n: null,
      left_s: null,
      at_mm: null,
      found_touch_mm: null,
      moves,
    };
    expect(stepWords({ ...PRESSING, machine })).toBe("The machine searches for its end stops");
    const down: MachineRecord = { ...machine, motion: "down", x_mm: 40, depth_mm: 2 };
    expect(stepWords({ ...PRESSING, machine: down })).toBe("Pressing at 40.0 mm, 2 mm deep");
    expect(stepWords({ ...PRESSING, machine: { ...machine, motion: null } })).toBe("Greeting the machine…");
    expect(stepWords({ ...PRESSING, phase: "checking", machine: down })).toBe("Pressing at 40.0 mm, 2 mm deep");
    expect(stepWords({ ...PRESSING, phase: "setting_up", machine })).toBe("The machine searches for its end stops");
    expect(stepWords({ ...PRESSING, phase: "setting_up", machine: { ...machine, motion: "up" } })).toBe("Jog the machine, or find the touch");
    expect(atWords([60.1, -2, 27])).toBe("x 60.1, y −2, z 27 mm");
    expect(foundWords(21.97)).toContain('touch = "21.97 mm"');
  });

  test("end with the error at held-out positions", () => {
    const outcome = { locator: "a.json", presses: 12, folds: 5, median_mm: 0.0412, mean_mm: 0.06, gain_percent: 4, stop_percent: 5, remarks: [] };
    const words = stepWords({ ...PRESSING, phase: "done", outcome });
    expect(words).toBe("Fitted to 12 presses: error at held-out positions 0.041 mm (median), 0.060 mm (mean)");
    expect(stepWords({ ...PRESSING, phase: "done", outcome: { ...outcome, median_mm: null } })).toBe("Fitted to 12 presses.");
  });
});

describe("presses and checks", () => {
  test("places have the digits that say something", () => {
    expect(mmWords(14)).toBe("14 mm");
    expect(mmWords(13.63636)).toBe("13.64 mm");
    expect(mmWords(4.5, 100)).toBe("4.5, 100 mm");
  });

  test("a trace fills its box, and one point is none", () => {
    expect(tracePoints([[-4, 0], [-2, 50], [0, 100]], 100, 20)).toBe("0.0,20.0 50.0,10.0 100.0,0.0");
    expect(tracePoints([[0, 100]], 100, 20)).toBe("");
    // An overshoot stays within.
    expect(tracePoints([[-1, 200], [0, 100]], 100, 20)).toBe("0.0,0.0 100.0,10.0");
  });

  test("a check says error, coverage and what the hand adds", () => {
    const check = { presses: "presses-check.csv", places: [], median_mm: 0.5, mean_mm: 0.75, covered: 4, placement_mm: 2 };
    const places = Array.from({ length: 5 }, () => ({ x_mm: 10, estimate_x_mm: 10.5, error_mm: 0.5, covered: true }));
    const words = checkWords({ ...check, places });
    expect(words).toContain("(median)");
    expect(words).toContain("4 of 5 within their 95 % intervals");
    expect(words).toContain("presses-check.csv");
    expect(words).toContain("placement");
    expect(checkWords({ ...check, places, covered: null, placement_mm: null })).not.toMatch(/interval|placement/);
  });

  test("a check asks for its places", () => {
    expect(stepWords({ ...PRESSING, phase: "checking" })).toBe("Press at 40 mm with 3 N");
    expect(stepWords({ ...PRESSING, phase: "checking", source: null })).toBe("Waiting for readings");
  });

  test("a second weight is asked for with the reason", () => {
    expect(weightWords(2)).toContain("All presses have 2 N, and the force in use is unknown");
  });

  test("the rate needs two looks", () => {
    expect(rateOf([{ at_s: 1, readings: 5 }])).toBeNull();
    expect(rateOf([{ at_s: 1, readings: 5 }, { at_s: 3, readings: 205 }])).toBe(100);
  });
});
