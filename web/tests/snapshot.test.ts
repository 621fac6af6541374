import { describe, expect, test } from "vitest";
import { Live } from "../src/model/live";
import { takeSnapshot } from "../src/model/snapshot";
import { csv, summary } from "../src/model/summary";
import { FIRST_CHANNEL, X } from "../src/model/history";
import { envelope } from "../src/model/envelope";
import type { SampleRecord, SessionInfo, StateRecord } from "../src/protocol";
import { budgetWords } from "../src/view/budget";
import { describe as surfaceWords } from "../src/view/surface";

const SESSION: SessionInfo = {
  version: "0",
  locator: { name: "l", kind: "influence", description: [] },
  surface: { kind: "beam", length_mm: 400, width_mm: null, supports: [] },
  channels: ["a", 'b "x", y'].map((name) => ({ name, label: name, unit: "", measure: "raw", x_mm: null })),
  force: { known_n: 3, unknown: false },
  tare: { available: true, follows: true },
  limit: { positions_mm: [0, 400], sd_mm: [1, 1], force_n: 3 },
  source: "simulated",
  recording: null,
  has_simulated: true,
  calibrates: false,
  brings_up: false,
};
const STATE: StateRecord = { source: "x", rate_hz: 1, touched: true, counters: { readings: 1, bad_frames: {}, lost_frames: 0, gaps: 0 }, channels: [] };

function sample(number: number, x_mm: number): SampleRecord {
  return { number, time_s: number, reading: [x_mm, -x_mm], status: "located", x_mm, sd_mm: x_mm / 100, x_95_mm: [x_mm - 1, x_mm + 1], force_n: 3 };
}

function scene(live: Live) {
  return { session: SESSION, live, player: null, calibration: null, window_s: 10, showsTrail: true };
}

describe("snapshot", () => {
  test("shows one estimate in every view, and later readings do not change it", () => {
    const live = new Live(2);
    live.take({ state: STATE, samples: [sample(1, 100), sample(2, 156.7)], events: [], missed: 0 });
    const shown = takeSnapshot(scene(live));
    live.take({ state: { ...STATE, rate_hz: 9 }, samples: [sample(3, 169.1), sample(4, 180)], events: [{ time_s: 4, event: "tared" }], missed: 7 });
    expect(Object.isFrozen(shown)).toBe(true);
    expect(surfaceWords(shown)).toContain("157 mm");
    expect(budgetWords(shown.session, shown.sample)).toContain("this estimate has 1.6 mm");
    expect([shown.sample?.x_mm, shown.live?.x_mm, shown.trail.at(-1)?.x_mm]).toEqual([156.7, 156.7, 156.7]);
    const [times, positions] = envelope(shown.history, [X], shown.span.from_s, shown.span.to_s, 100);
    expect([times?.at(-1), positions?.at(-1)]).toEqual([2, 156.7]);
    expect([shown.state?.rate_hz, shown.missed, shown.events.length]).toEqual([1, 0, 0]);
    expect(takeSnapshot(scene(live)).sample?.x_mm).toBe(180);
  });

  test("a page that was loaded again has the past of the session, and its events", () => {
    const live = new Live(2);
    live.take({ state: STATE, samples: [sample(50, 10)], events: [{ time_s: 50, event: "mark", text: "new" }], missed: 0 });
    const past = Array.from({ length: 50 }, (_, i) => sample(i, i));
    live.takePast({ samples: [...past, sample(50, 10)], events: [{ time_s: 3, event: "mark", text: "old" }, { time_s: 50, event: "mark", text: "new" }] });
    expect(live.history.length).toBe(51);
    expect(live.events.map((event) => (event.event === "mark" ? event.text : ""))).toEqual(["old", "new"]);
    expect(live.sample?.number).toBe(50);
  });
});

describe("charts in words and as a file", () => {
  const live = new Live(2);
  live.take({ state: STATE, samples: [sample(1, 5), sample(2, 20), { ...sample(3, 1), status: "no_contact" }], events: [], missed: 0 });
  const { history, span } = takeSnapshot(scene(live));

  test("say lowest, highest and present value", () => {
    expect(summary(history, span, "a", FIRST_CHANNEL, "N")).toBe("a: 1.0 N to 20.0 N, 1.0 N now.");
    expect(summary(history, span, "Position", X, "mm")).toBe("Position: 5.0 mm to 20.0 mm, none now.");
    expect(summary(history, { ...span, to_s: 0 }, "a", FIRST_CHANNEL, "N")).toBe("a: no value.");
  });

  test("CSV has every row of the span, and names of any characters", () => {
    const lines = csv(SESSION, history, span).split("\n");
    expect(lines[0]).toBe('time_s,x_mm,x_95_low_mm,x_95_high_mm,force_n,force_95_low_n,force_95_high_n,a,"b ""x"", y"');
    expect(lines.slice(1)).toEqual(["1.000000,5,4,6,3,,,5,-5", "2.000000,20,19,21,3,,,20,-20", "3.000000,,,,0,,,1,-1", ""]);
  });
});
