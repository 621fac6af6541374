import { describe, expect, test } from "vitest";
import { Baseline } from "../src/model/baseline";
import { ofCovariance, ofIntervals } from "../src/model/ellipse";
import { envelope } from "../src/model/envelope";
import { FIRST_CHANNEL, FORCE, History, TIME, X, X_LOW } from "../src/model/history";
import { forceFactor, limitAt } from "../src/model/limit";
import { Live } from "../src/model/live";
import { Pace } from "../src/model/pace";
import { Player } from "../src/model/player";
import { fit, linear, roundUp, ticks } from "../src/model/scale";
import { naturalSpline } from "../src/model/spline";
import { Trail } from "../src/model/trail";
import type { EventRecord, LimitInfo, SampleRecord, SessionInfo, StateRecord, Status, StreamMessage } from "../src/protocol";

function sample(number: number, time_s: number, status: Status = "located", reading = [number, -number]): SampleRecord {
  return { number, time_s, reading, status, x_mm: 10 * number, x_95_mm: [10 * number - 1, 10 * number + 1], force_n: 2, sd_force_n: 0.1 };
}

const STATE: StateRecord = {
  source: "simulated",
  rate_hz: 100,
  touched: true,
  counters: { readings: 0, bad_frames: {}, lost_frames: 0, gaps: 0 },
  channels: [],
};

function message(samples: SampleRecord[], events: EventRecord[] = [], missed = 0): StreamMessage {
  return { state: STATE, samples, events, missed };
}

describe("scales", () => {
  test("a linear scale maps the ends to the ends, also downward", () => {
    const y = linear([0, 10], [200, 100]);
    expect([y(0), y(10), y(2.5)]).toEqual([200, 100, 175]);
  });

  test("round numbers are 1, 2 or 5 times a power of ten, and not below what was asked", () => {
    const asked = [0.3, 1, 1.1, 2.0001, 7, 0.0021];
    expect(asked.map(roundUp).map((value) => Number(value.toPrecision(6)))).toEqual([0.5, 1, 2, 5, 10, 0.005]);
    for (let power = -6; power < 6; power++) expect(roundUp(10 ** power)).toBeCloseTo(10 ** power, 12);
  });

  test("ticks begin at 0, reach the end and are no more than asked", () => {
    expect(ticks(400, 8)).toEqual([0, 50, 100, 150, 200, 250, 300, 350, 400]);
    for (const end of [0.7, 3, 33, 400, 12345]) {
      expect(ticks(end, 6).length).toBeLessThanOrEqual(7);
      expect(ticks(end, 6).length).toBeGreaterThanOrEqual(2);
    }
  });

  test("a surface is fitted to scale and in the middle", () => {
    const placed = fit({ length: 300, width: 100 }, { left: 10, top: 0, width: 600, height: 600 });
    expect(placed).toEqual({ perUnit: 2, left: 10, top: 200 });
  });
});

describe("history", () => {
  test("rows are found by time", () => {
    const history = new History(2, 20);
    for (let i = 6; i < 10; i++) history.push(sample(i, 100 + i));
    expect([history.length, history.at(TIME, 0), history.lastTime()]).toEqual([4, 106, 109]);
    expect(history.at(FIRST_CHANNEL + 1, 3)).toBe(-9);
    expect([0, 106, 106.5, 109, 200].map((time) => history.firstFrom(time))).toEqual([0, 0, 1, 3, 4]);
  });

  test("older rows are thinned, keep their peaks, and go after ten minutes", () => {
    const history = new History(1, 100);
    // 40 readings a second for 700 s, with a peak of one reading at 500 s.
    for (let i = 0; i < 28_000; i++) history.push(sample(i, i / 40, "located", [i === 20_003 ? 99 : Math.sin(i)]));
    const times = Array.from({ length: history.length }, (_, row) => history.at(TIME, row));
    const values = times.map((_, row) => history.at(FIRST_CHANNEL, row));
    expect(history.length).toBeLessThan(12_200);
    expect(times[0]).toBeGreaterThan(99);
    expect(times[0]).toBeLessThan(101);
    expect(Math.max(...values)).toBe(99);
    expect(times.every((time, row) => row === 0 || time >= times[row - 1]!)).toBe(true);
    // The newest hundred are as they came.
    expect(values.slice(-100)).toEqual(Array.from({ length: 100 }, (_, i) => Math.sin(27_900 + i)));
  });

  test("a gap stays a gap when its rows are thinned", () => {
    const history = new History(1, 2);
    [0, 0.01, 0.02].forEach((time) => history.push(sample(0, time)));
    history.pushGap(0.03);
    [0.04, 0.05, 0.06, 0.07].forEach((time) => history.push(sample(0, time)));
    const rows = Array.from({ length: history.length }, (_, row) => history.at(FIRST_CHANNEL, row));
    expect(rows.some(Number.isNaN)).toBe(true);
  });

  test("samples from before the first row are added once, and none twice", () => {
    const history = new History(1, 10);
    history.push(sample(5, 50));
    history.pushBefore([10, 20, 50, 60].map((time) => sample(time / 10, time)), [15]);
    history.pushBefore([sample(1, 10)], []);
    expect(Array.from({ length: history.length }, (_, row) => history.at(TIME, row))).toEqual([10, 15, 20, 50]);
  });

  test("a position stands only where something was located, no contact has no force, and of what nothing explains none is known", () => {
    const history = new History(2, 9);
    (["located", "no_contact", "outside_model", "ambiguous"] as const).forEach((status, i) => history.push(sample(i, i, status)));
    expect([0, 1, 2, 3].map((row) => history.at(X, row))).toEqual([0, NaN, NaN, 30]);
    expect([0, 1, 2, 3].map((row) => history.at(X_LOW, row))).toEqual([-1, NaN, NaN, 29]);
    expect([0, 1, 2, 3].map((row) => history.at(FORCE, row))).toEqual([2, 0, NaN, 2]);
  });
});

describe("envelope", () => {
  test("few rows are given as they are, with nulls for what is not known", () => {
    const history = new History(1, 10);
    history.push(sample(0, 0, "located", [7]));
    history.pushGap(1);
    history.push(sample(2, 2, "located", [9]));
    expect(envelope(history, [FIRST_CHANNEL], 0, 2, 100)).toEqual([[0, 1, 2], [7, null, 9]]);
  });

  test("of many rows no peak is lost, the number of points is bounded, and times never fall", () => {
    const history = new History(1, 5000);
    for (let i = 0; i < 7000; i++) history.push(sample(i, i * 1e-3, "located", [i === 4321 ? 99 : i === 5000 ? -99 : Math.sin(i)]));
    const [times, values] = envelope(history, [FIRST_CHANNEL], 2, 7, 400) as [number[], number[]];
    expect(times.length).toBeLessThanOrEqual(404);
    expect(times.length).toBeGreaterThan(150);
    expect([Math.max(...values), Math.min(...values)]).toEqual([99, -99]);
    for (let i = 1; i < times.length; i++) expect(times[i]).toBeGreaterThanOrEqual(times[i - 1]!);
  });

  test("points stay where they are while the window moves", () => {
    const history = new History(1, 1000);
    for (let i = 0; i < 1000; i++) history.push(sample(i, i, "located", [Math.sin(i * i)]));
    const before = envelope(history, [FIRST_CHANNEL], 0, 999, 100);
    for (let i = 1000; i < 1003; i++) history.push(sample(i, i, "located", [0]));
    const after = envelope(history, [FIRST_CHANNEL], 3, 1002, 100);
    const at = new Map(after[0]!.map((time, i) => [time, after[1]![i]]));
    before[0]!.slice(2, -2).forEach((time, i) => expect(at.get(time)).toBe(before[1]![i + 2]));
  });
});

describe("envelope of a span", () => {
  test("rows after the span are not part of it", () => {
    const history = new History(1, 10);
    [1, 2, 3, 4].forEach((time) => history.push(sample(time, time, "located", [time])));
    expect(envelope(history, [FIRST_CHANNEL], 2, 3, 100)).toEqual([[1, 2, 3], [1, 2, 3]]);
  });
});

describe("trail", () => {
  test("holds the last second of a contact, and lift-off ends it", () => {
    const trail = new Trail();
    for (let i = 0; i <= 30; i++) trail.push(sample(i, i * 0.1));
    const aged = trail.aged();
    expect(aged.length).toBe(10);
    expect(aged.at(-1)).toMatchObject({ x_mm: 300, age: 0 });
    expect(aged[0]!.age).toBeCloseTo(0.9, 9);
    trail.push(sample(31, 3.1, "outside_model"));
    expect(trail.aged().length).toBe(9);
    trail.push(sample(32, 3.2, "no_contact"));
    expect(trail.aged()).toEqual([]);
  });
});

describe("baseline", () => {
  test("is the mean of untouched readings, and deflections are what differs from it", () => {
    const baseline = new Baseline();
    expect(baseline.deflections([1, 2])).toBeNull();
    baseline.push(sample(0, 0, "no_contact", [1, 10]));
    baseline.push(sample(1, 1, "no_contact", [3, 20]));
    baseline.push(sample(2, 2, "located", [500, 500]));
    expect(baseline.deflections([4, 16])).toEqual([2, 1]);
  });
});

describe("spline", () => {
  test("goes through its points and is a straight line where they lie on one", () => {
    const points = [0, 1, 2.5, 4].map((x) => ({ x, y: Math.cos(x) }));
    const curve = naturalSpline(points);
    points.forEach(({ x, y }) => expect(curve(x)).toBeCloseTo(y, 12));
    const line = naturalSpline([0, 1, 3, 7].map((x) => ({ x, y: 2 * x - 1 })));
    [-1, 0.5, 2, 6.9, 9].forEach((x) => expect(line(x)).toBeCloseTo(2 * x - 1, 12));
  });

  test("nears a beam's deflection by the fourth order of the distance between sensors", () => {
    // sin has no curvature at 0 and π, as a beam on simple supports.
    const worst = (n: number) => {
      const curve = naturalSpline(Array.from({ length: n + 1 }, (_, i) => ({ x: (i * Math.PI) / n, y: Math.sin((i * Math.PI) / n) })));
      return Math.max(...Array.from({ length: 500 }, (_, i) => Math.abs(curve((i * Math.PI) / 499) - Math.sin((i * Math.PI) / 499))));
    };
    const order = Math.log2(worst(8) / worst(16));
    expect(order).toBeGreaterThan(3.8);
    expect(order).toBeLessThan(4.2);
  });

  test("has no kink at its points, nor at its ends", () => {
    const curve = naturalSpline([0, 1, 2.5, 4].map((x) => ({ x, y: Math.cos(3 * x) })));
    const slope = (x: number) => (curve(x + 1e-6) - curve(x - 1e-6)) / 2e-6;
    for (const x of [0, 1, 2.5, 4]) expect(slope(x - 1e-4)).toBeCloseTo(slope(x + 1e-4), 2);
  });
});

describe("limit", () => {
  const limit: LimitInfo = { positions_mm: [0, 10, 20, 30], sd_mm: [null, 2, 4, null], force_n: 3 };

  test("is interpolated along a line, and unknown where it is infinite or beyond", () => {
    expect([10, 15, 20].map((x) => limitAt(limit, x, undefined))).toEqual([2, 3, 4]);
    expect([-1, 0, 5, 25, 31].map((x) => limitAt(limit, x, undefined))).toEqual([null, null, null, null, null]);
  });

  test("is that of the nearest position of a plane", () => {
    const plane: LimitInfo = { positions_mm: [[0, 0], [10, 0], [0, 10], [10, 10]], sd_mm: [1, 2, 3, 4], force_n: 1 };
    expect(limitAt(plane, 9, 2)).toBe(2);
    expect(limitAt(plane, 1, 8)).toBe(3);
  });

  test("falls as 1 / force where the force is unknown and the surface linear", () => {
    const session = { force: { known_n: null, unknown: true }, surface: { kind: "beam" }, limit } as unknown as SessionInfo;
    expect(forceFactor(session, 6)).toBe(0.5);
    expect(forceFactor(session, undefined)).toBe(1);
    expect(forceFactor({ ...session, force: { known_n: 3, unknown: false } }, 6)).toBe(1);
    expect(forceFactor({ ...session, surface: { ...session.surface!, kind: "digit" } }, 6)).toBe(1);
  });
});

describe("live", () => {
  test("takes samples and events in the order of their times, and tells all but moves", () => {
    const live = new Live(2);
    const told = live.take(
      message(
        [sample(0, 1), sample(1, 2)],
        [
          { time_s: 1, event: "touch_down", x_mm: 3 },
          { time_s: 2, event: "move", x_mm: 4 },
        ],
        2,
      ),
    );
    expect(told.map((event) => event.event)).toEqual(["touch_down"]);
    expect(live.sample?.number).toBe(1);
    expect(live.history.length).toBe(2);
    live.take(message([], [], 3));
    expect(live.missed).toBe(5);
    expect(live.sample?.number).toBe(1);
  });

  test("a gap parts the lines before the reading that ends it", () => {
    const live = new Live(2);
    live.take(message([sample(0, 1)]));
    live.take(message([sample(1, 9)], [{ time_s: 9, event: "gap", seconds: 8 }]));
    expect([0, 1, 2].map((row) => live.history.at(TIME, row))).toEqual([1, 5, 9]);
    expect(live.history.at(FIRST_CHANNEL, 1)).toBeNaN();
    expect(live.trail.aged().length).toBe(1);
  });

  test("a session that begins anew empties what was drawn of the last", () => {
    const live = new Live(2);
    live.take(message([sample(500, 1), sample(501, 2)]));
    live.take(message([sample(0, 3)]));
    expect([live.history.length, live.trail.aged().length]).toEqual([1, 1]);
  });

  test("keeps the last 1,000 events", () => {
    const live = new Live(1);
    for (let i = 0; i < 1100; i++) live.take(message([], [{ time_s: i, event: "mark", text: String(i) }]));
    expect([live.events.length, live.events[0]!.time_s, live.eventCount]).toEqual([1000, 100, 1100]);
  });
});

describe("player", () => {
  const samples = Array.from({ length: 101 }, (_, i) => sample(i, 1_790_000_000 + i * 0.1));
  const content = { channels: [], start_s: 1_790_000_000, seconds: 10, samples, events: [] };

  test("shows the last sample that is not after the playhead", () => {
    const player = new Player("a", content);
    const numbers = [0, 0.05, 0.1, 4.99, 5, 99].map((at_s) => {
      player.seek(at_s);
      return player.sample()?.number;
    });
    expect(numbers).toEqual([0, 0, 1, 49, 50, 100]);
    expect(player.head_s).toBeCloseTo(10, 6);
  });

  test("plays at its speed, stops at the end, and begins again from there", () => {
    const player = new Player("a", content);
    player.speed = 2;
    player.advance(1);
    expect(player.head_s).toBe(0);
    player.toggle();
    player.advance(1);
    expect(player.head_s).toBe(2);
    player.advance(100);
    expect([player.playing, player.head_s]).toEqual([false, player.seconds]);
    player.toggle();
    expect([player.playing, player.head_s]).toEqual([true, 0]);
  });

  test("has the trail behind the playhead", () => {
    const player = new Player("a", content);
    player.seek(5);
    expect(player.trail().aged().map((point) => point.x_mm)).toEqual([41, 42, 43, 44, 45, 46, 47, 48, 49, 50].map((n) => n * 10));
  });

  test("an empty recording shows nothing and does not fail", () => {
    const player = new Player("a", { ...content, samples: [] });
    player.toggle();
    player.advance(1);
    expect([player.sample(), player.seconds, player.playing, player.trail().aged()]).toEqual([null, 0, false, []]);
  });
});

describe("pace", () => {
  /** Drawings of a part in a second of frames that take so long. */
  function drawings(frame_ms: number, every_ms: number): number {
    const pace = new Pace();
    let count = 0;
    for (let now = 0; now < 5_000; now += frame_ms) {
      pace.frame(frame_ms);
      if (pace.due("chart", now, every_ms) && now >= 4_000) count += 1;
    }
    return count;
  }

  test("a browser that keeps up draws a part as often as it is to be drawn", () => {
    expect(drawings(1000 / 60, 16)).toBeGreaterThanOrEqual(59);
    expect(drawings(1000 / 60, 100)).toBeGreaterThanOrEqual(9);
  });

  test("one that does not draws less often, and at times even then", () => {
    expect(drawings(100, 100)).toBeLessThanOrEqual(2);
    expect(drawings(100, 100)).toBeGreaterThanOrEqual(1);
    expect(drawings(500, 66)).toBeGreaterThanOrEqual(1);
  });

  test("a page that was hidden is not taken for a slow one", () => {
    const pace = new Pace();
    pace.frame(60_000);
    expect(pace.due("chart", 0, 100)).toBe(true);
    expect(pace.due("chart", 100, 100)).toBe(true);
  });
});

describe("ellipses", () => {
  test("without covariance of x and y, intervals and variances say the same", () => {
    const intervals = ofIntervals([10 - 1.96 * 2, 10 + 1.96 * 2], [5 - 1.96, 5 + 1.96]);
    const covariance = ofCovariance(10, 5, [4, 0, 1]);
    expect([covariance.x_mm, covariance.y_mm, covariance.angle]).toEqual([10, 5, 0]);
    for (const i of [0, 1] as const) expect(intervals.half_mm[i]).toBeCloseTo(covariance.half_mm[i], 9);
  });

  test("the half axes are those of the covariance turned back, at whatever angle", () => {
    for (const angle of [-1.2, -0.4, 0.3, 1.1]) {
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      // 3² along the axis, 1² across it.
      const ellipse = ofCovariance(0, 0, [9 * c * c + s * s, (9 - 1) * s * c, 9 * s * s + c * c]);
      expect(ellipse.angle).toBeCloseTo(angle, 9);
      expect(ellipse.half_mm[0]).toBeCloseTo(3 * 2.4477, 6);
      expect(ellipse.half_mm[1]).toBeCloseTo(2.4477, 6);
    }
  });

  test("a position that is known along a line has an ellipse without width, not NaN", () => {
    expect(ofCovariance(0, 0, [1, 1, 1]).half_mm[1]).toBeCloseTo(0, 6);
  });
});
