import { describe, expect, test, vi } from "vitest";
import { findEvents } from "../src/panel/events";
import { pill } from "../src/panel/pill";
import type { EventRecord, SessionInfo, StateRecord } from "../src/protocol";

// The address of the page is read as the module of requests is loaded.
vi.stubGlobal("location", { search: "", href: "http://127.0.0.1/" });
const { alarmsSet, ruleText } = await import("../src/panel/alarms");
const { sensorPlaces, tracePoints } = await import("../src/panel/bring_up");
const { fieldProblem } = await import("../src/panel/field_problems");

const SESSION = { source: "serial:///dev/ttyACM0", calibrates: false, brings_up: false } as SessionInfo;
const STATE = { source: "/dev/ttyACM0", counters: { readings: 5 } } as StateRecord;

describe("pill", () => {
  test("follows the source", () => {
    const words = (session: Partial<SessionInfo>, state: Partial<StateRecord> | null, silent_s = 0) =>
      pill("open", { ...SESSION, ...session }, state === null ? null : { ...STATE, ...state }, silent_s).words;
    expect(words({}, {})).toBe("Live");
    expect(words({}, {}, 3)).toBe("Source silent");
    expect(words({}, { source: null })).toBe("Source lost");
    expect(words({}, null)).toBe("Waiting for the source");
    expect(words({}, { source: null, counters: { ...STATE.counters, readings: 0 } })).toBe("Waiting for the source");
    expect(words({}, { counters: { ...STATE.counters, readings: 0 } }, 3)).toBe("Waiting for readings");
    expect(words({ source: null }, {})).toBe("No source");
    expect(words({ source: "simulated" }, {})).toBe("Simulated");
    expect(words({ source: "simulated:rig.toml?rate=100" }, {})).toBe("Simulated");
    expect(words({ source: "simulated" }, {}, 3)).toBe("Source silent");
    expect(words({ source: "file:a.mcap?speed=1" }, {})).toBe("Recording");
    expect(words({ brings_up: true, source: null }, null)).toBe("No rig yet");
    expect(words({ calibrates: true, source: null }, null)).toBe("Calibration");
    expect(pill("lost", SESSION, STATE, 0)).toEqual({ state: "bad", words: "Connection lost" });
    expect(pill("open", null, null, 0).words).toBe("Connecting…");
  });
});

describe("log of events", () => {
  const events: EventRecord[] = [
    { time_s: 0, event: "touch_down", x_mm: 12, force_n: 3 },
    { time_s: 1, event: "mark", text: "Nut fell" },
    { time_s: 2, event: "alarm", name: "clamp", text: "too near" },
    { time_s: 3, event: "source_lost", why: "unplugged" },
  ];

  test("is searched by all words in any case, and by kind", () => {
    const found = (search: string, kind = "") => findEvents(events, search, kind).map((event) => event.event);
    expect(found("")).toEqual(["touch_down", "mark", "alarm", "source_lost"]);
    expect(found("fell NUT")).toEqual(["mark"]);
    expect(found("near clamp")).toEqual(["alarm"]);
    expect(found("near mark")).toEqual([]);
    expect(found("", "source")).toEqual(["source_lost"]);
    expect(found("nut", "alarm")).toEqual([]);
  });
});

describe("rules of alarms", () => {
  const rule = { name: "near", when: "contact", x_mm: ["0", "50"], force_n: ["", ""], hold_ms: "20", text: "back" } as const;

  test("are text of a rule file", () => {
    const filled = { ...rule, x_mm: ["0", "50"] as [string, string], force_n: ["2", ""] as [string, string] };
    expect(ruleText(filled)).toBe('[[rule]]\nname = "near"\nx = ["0 mm", "50 mm"]\nforce = ["2 N", "1000000 N"]\nhold = "20 ms"\nalarm = "back"\n');
    const event = { ...filled, when: "gap", name: 'a "b" \\ c' };
    expect(ruleText(event)).toBe('[[rule]]\nname = "a \\"b\\" \\\\ c"\nevent = "gap"\nalarm = "back"\n');
  });
});

describe("alarms that are set", () => {
  test("are kept in a file, or end with the server", () => {
    expect(alarmsSet(0, "strip.alarms.toml")).toBe("No alarms are set.");
    expect(alarmsSet(1, "strip.alarms.toml")).toBe("1 alarm is set, and kept in strip.alarms.toml.");
    expect(alarmsSet(2, null)).toBe("2 alarms are set until the server ends.");
  });
});

describe("form of a rig", () => {
  test("takes the places of sensors, or none", () => {
    expect(sensorPlaces(["", " "])).toBeNull();
    expect(sensorPlaces(["50", "", "250.5"])).toEqual([[50], [], [250.5]]);
    expect(sensorPlaces(["50, 20", "250 100"])).toEqual([[50, 20], [250, 100]]);
  });

  test("says what is wrong with a field", () => {
    const field = { value: "", disabled: false, min: "0.001", max: "100", title: "digits", validationMessage: "other", validity: {} };
    const words = (validity: Partial<ValidityState>, more = {}) => fieldProblem({ ...field, ...more, validity });
    expect(words({ valid: true })).toBeNull();
    expect(words({ valueMissing: true }, { disabled: true })).toBeNull();
    expect(words({ valueMissing: true })).toBe("This is needed.");
    expect(words({ badInput: true })).toBe("This is not a number.");
    expect(words({ rangeUnderflow: true })).toBe("This must be greater than 0.");
    expect(words({ rangeUnderflow: true }, { min: "2" })).toBe("This must be at least 2.");
    expect(words({ rangeOverflow: true })).toBe("This must be at most 100.");
    expect(words({ stepMismatch: true })).toBe("This must be a whole number.");
    expect(words({ patternMismatch: true })).toBe("This must have digits.");
    expect(words({ tooLong: true })).toBe("other");
  });
});

describe("curve of a channel", () => {
  test("lies within its box, also where all values are one", () => {
    expect(tracePoints([5, 5])).toBe("98,12.00 99,12.00");
    expect(tracePoints([-8388608, 8388607])).toBe("98,22.00 99,2.00");
    expect(tracePoints([])).toBe("");
  });
});
