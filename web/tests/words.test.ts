import { describe, expect, test } from "vitest";
import type { EstimateRecord, EventRecord } from "../src/protocol";
import { axisNumbers, badFrameWords, begun, bytes, contactWords, eventWords, hertz, number, seconds, size, statusWords, unit } from "../src/words";

describe("numbers", () => {
  test("a standard deviation says how many decimals mean something", () => {
    expect(number(123.456, 0.3)).toBe("123.5");
    expect(number(123.456, 0.03)).toBe("123.46");
    expect(number(123.456, 3)).toBe("123");
    expect(number(-0.5, 0.1)).toBe("−0.5");
    expect(number(-0.004, 0.1)).toBe("0.0");
    expect(number(NaN, 1)).toBe("—");
    expect(number(3)).toBe("3.00");
  });

  test("sizes have two digits", () => {
    expect([0, 0.0123, 0.5, 1.26, 47.3, 5123].map(size)).toEqual(["0", "0.012", "0.50", "1.3", "47", "5123"]);
  });

  test("durations, sizes of files, rates and units", () => {
    expect([0.0123, 2.34, 75, 3723].map(seconds)).toEqual(["12 ms", "2.3 s", "1:15 min", "1:02:03 h"]);
    expect([999, 1500, 2_340_000].map(bytes)).toEqual(["999 B", "1.5 kB", "2.3 MB"]);
    expect([1.5, 99.7, 20_000].map(hertz)).toEqual(["1.5 Hz", "100 Hz", "20,000 Hz"]);
    expect(["um", "mm", "N", "u", ""].map(unit)).toEqual(["µm", "mm", "N", "u", ""]);
  });
});

describe("numbers of an axis", () => {
  test("are whole, whatever their size", () => {
    expect(axisNumbers([-20_000, 0, 20_000], 20_000)).toEqual(["−20,000", "0", "20,000"]);
    expect(axisNumbers([-8_388_608, -8_388_600], 8)).toEqual(["−8,388,608", "−8,388,600"]);
    expect(axisNumbers([1e-6, 2e-6], 1e-6)).toEqual(["1e−6", "2e−6"]);
    expect(axisNumbers([0, 2.5e-6, 5e-6], 2.5e-6)).toEqual(["0", "2.5e−6", "5.0e−6"]);
    expect(axisNumbers([5, 5.000001], 1e-6)).toEqual(["5.000000", "5.000001"]);
    expect(axisNumbers([-0.5, 0, 0.5], 0.5)).toEqual(["−0.5", "0.0", "0.5"]);
    expect(axisNumbers([0.0025, 0.005], 0.0025)).toEqual(["0.0025", "0.0050"]);
    expect(axisNumbers([9995, 10_000], 5)).toEqual(["9995", "10,000"]);
  });

  test("tell neighbours apart", () => {
    for (const step of [1e-9, 2.5e-5, 0.002, 0.25, 2.5, 20, 5e6]) {
      for (const start of [0, step * 40, -step * 1234]) {
        const numbers = axisNumbers([0, 1, 2, 3].map((i) => start + i * step), step);
        expect(new Set(numbers).size, numbers.join(" ")).toBe(4);
      }
    }
  });
});

describe("instants", () => {
  test("a recording of nothing has no date", () => {
    expect(begun(null)).toBe("empty");
    expect(begun(new Date(2026, 10, 24, 9, 5, 7, 300).getTime() / 1000)).toBe("24/11/2026 09:05:07.3");
  });
});

describe("words", () => {
  const estimate = (status: EstimateRecord["status"], more: Partial<EstimateRecord> = {}): EstimateRecord => ({ status, x_mm: 1, ...more });

  test("every status has a word of its own and a reason", () => {
    const all = (["located", "no_contact", "ambiguous", "outside_model", "outside_surface"] as const).map((status) => statusWords(estimate(status)));
    expect(new Set(all.map(({ word }) => word)).size).toBe(5);
    all.forEach(({ why }) => expect(why.length).toBeGreaterThan(20));
  });

  test("several contacts, other places and a trade-off are said", () => {
    expect(statusWords(estimate("located", { further: [{ x_mm: 2 }] })).word).toBe("2 contacts");
    expect(statusWords(estimate("ambiguous", { modes: [{ x_mm: 2, probability: 0.3 }] })).why).toContain("another place");
    expect(statusWords(estimate("located", { trade_off: "force and position" })).why).toContain("force and position");
  });

  test("contacts have their units", () => {
    expect(contactWords({ x_mm: 12.34, sd_mm: 0.2, force_n: 3.21, sd_force_n: 0.05 })).toBe("12.3 mm, 3.21 N");
    expect(contactWords({ x_mm: 12.34, y_mm: 5.6, sd_mm: 0.2 })).toBe("12.3, 5.6 mm");
  });

  test("every event and every cause of a bad frame is said in words", () => {
    const events: EventRecord[] = [
      { time_s: 0, event: "source_opened", name: "serial" },
      { time_s: 0, event: "source_lost", why: "unplugged" },
      { time_s: 0, event: "source_ended" },
      { time_s: 0, event: "gap", seconds: 2, lost_frames: 7 },
      { time_s: 0, event: "clock_set", by_s: -3 },
      { time_s: 0, event: "touch_down", x_mm: 1 },
      { time_s: 0, event: "move", x_mm: 1 },
      { time_s: 0, event: "second_contact", x_mm: 1 },
      { time_s: 0, event: "lift_off", seconds: 1 },
      { time_s: 0, event: "outside_model" },
      { time_s: 0, event: "channel", name: "d1", state: "dead" },
      { time_s: 0, event: "tared" },
      { time_s: 0, event: "mark", text: "here" },
    ];
    const words = events.map(eventWords);
    expect(new Set(words).size).toBe(events.length);
    words.forEach((said) => expect(said).not.toMatch(/undefined|_/));
    expect(words[3]).toBe("Gap of 2.0 s, 7 frames lost");
    expect(words[4]).toBe("Clock set back by 3.0 s");
    expect(badFrameWords("not_a_number")).toBe("a value is not a number");
    expect(badFrameWords("something_new")).toBe("something new");
  });
});
