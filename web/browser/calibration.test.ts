// A calibration in the browser on the real server, from a rig without a locator to a live dot; a machine
// presses in place of a person.

import { existsSync, readFileSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { Bench } from "./bench";
import { endAll } from "./children";
import { FIT_MS, dotAt, hasChromium, launch, open, picture, says } from "./chromium";
import { Server } from "./server";

const SIX_TWICE: [string, string][] = [
  ["count = 10\nrepeats = 10", "count = 6\nrepeats = 2"],
];

async function step(page: Page): Promise<string> {
  return (await page.locator("#calibration-step").textContent()) ?? "";
}

/** Follows the instructions of the page until `until` returns true. */
async function obey(
  page: Page,
  bench: Bench,
  until: (step: string, taken: number) => boolean,
  press: (x_mm: number) => void = (x_mm) => bench.press(x_mm),
): Promise<void> {
  const end = Date.now() + 90_000;
  let pressed = "";
  for (;;) {
    const asked = await step(page);
    const taken = await page.locator("#calibration-bar").evaluate((bar) => (bar as HTMLProgressElement).value);
    if (until(asked, taken)) return;
    const place = /^Press at ([\d.]+) mm/.exec(asked)?.[1];
    if (place !== undefined && place !== pressed) press(Number((pressed = place)));
    if (/^(Let go|Leave)/.test(asked)) {
      bench.lift();
      pressed = "";
    }
    if (Date.now() > end) throw new Error(`the calibration does not go on from ${asked}`);
    await page.waitForTimeout(50);
  }
}

function presses(bench: Bench): number {
  const lines = readFileSync(bench.path("presses.csv"), "utf8").split("\n");
  return lines.filter((line) => /^[\d.]+,/.test(line) && Number(line.split(",")[2]) > 0).length;
}

async function dotUnder(page: Page, bench: Bench, x_mm: number): Promise<void> {
  bench.press(x_mm);
  await dotAt(page, x_mm);
  bench.lift();
}

function started(bench: Bench): Promise<Server> {
  const [rig, csv, out] = ["rig.toml", "presses.csv", "locator.json"].map((name) => bench.path(name));
  return Server.start([rig!, "--from", bench.from, "--calibrate", "--presses", csv!, "--out", out!]);
}

describe.skipIf(!hasChromium())("calibration", () => {
  let browser: Browser;
  beforeAll(async () => {
    browser = await launch();
  });
  afterEach(endAll);
  afterAll(() => browser?.close());

  test("records no press without a touch by a hand that taps, on a board with hysteresis, creep, drift and repeated readings", async () => {
    const faults = ["--hysteresis", "0.01", "--creep", "0.02", "--drift", "0.000005", "--repeated-readings", "1"];
    const bench = await Bench.start("noisy-beam.toml", SIX_TWICE, faults);
    const server = await started(bench);
    const { page } = await open(browser, server.url);
    await says(page, "calibration-step", /^Ready to calibrate$/);
    await page.locator("#calibration-begin").click();
    const done = (asked: string) => asked === "No more presses are asked for";
    await obey(page, bench, done, (x_mm) => bench.tap(x_mm, 2));
    const lines = readFileSync(bench.path("presses.csv"), "utf8").split("\n");
    const rows = lines.filter((line) => /^[\d.]+,/.test(line)).map((line) => line.split(",").map(Number));
    // Columns are time, position, force and the channels.
    const force = 2;
    const pressed = rows.filter((row) => row[force]! > 0);
    const untouched = rows.find((row) => row[force] === 0)!;
    expect(pressed.length).toBe(12);
    const size = (row: number[], from: number[]) => Math.hypot(...row.slice(force + 1).map((value, i) => value - from[force + 1 + i]!));
    for (const row of pressed) {
      const other = pressed.find((one) => one !== row && one[1] === row[1])!;
      expect(size(row, other)).toBeLessThan(0.2 * size(other, untouched));
    }
    await page.context().close();
  });

  test("goes from an empty page to a live dot by clicks", async () => {
    const bench = await Bench.start("noisy-beam.toml", SIX_TWICE);
    const server = await started(bench);
    const { page, faults } = await open(browser, server.url);
    await says(page, "calibration-step", /^Ready to calibrate$/);
    expect(await page.locator("#welcome").isVisible()).toBe(false);
    // Readings are shown before the first press, and the page asks for the placement.
    await says(page, "calibration-rate", /^\d+ from .*Hz/);
    await page.locator("#calibration-placement").fill("1.5");
    await picture(page, "calibration-ready");
    await page.locator("#calibration-begin").click();
    await obey(page, bench, (_, taken) => taken === 3);
    await says(page, "calibration-step", /^(Let go|Press at)/);
    // The third press is requested again.
    await page.locator("#calibration-redo").click();
    await says(page, "calibration-progress", /^2 of 12/);
    await obey(page, bench, (asked, taken) => taken === 3 && asked.startsWith("Press at"));
    await page.locator("#calibration summary").first().click();
    await says(page, "calibration-places", /2 of 2[\d.]+ %taken/);
    await picture(page, "calibration-light");
    await obey(page, bench, (asked) => asked === "No more presses are asked for");
    expect(presses(bench)).toBe(12);
    // A deleted press is requested again.
    await page.locator("#calibration-presses summary").click();
    await page.getByRole("button", { name: "Strike out press 5", exact: true }).click();
    await says(page, "calibration-progress", /^11 of 12/);
    await obey(page, bench, (asked) => asked === "No more presses are asked for");
    await says(page, "calibration-press-list", /^12/);
    expect(await page.locator("#calibration-press-list svg.trace").count()).toBe(12);
    await picture(page, "calibration-presses");
    expect(readFileSync(bench.path("presses.csv"), "utf8")).toMatch(/^# .*; placement 1.5 mm\n/);
    await page.locator("#calibration-finish").click();
    expect(await says(page, "calibration-step", /^Fitted to 12 presses: error at held-out positions [\d.]+ mm/, FIT_MS)).toContain("median");
    expect(existsSync(bench.path("locator.json"))).toBe(true);
    await dotUnder(page, bench, 123);
    await picture(page, "calibration-done");
    await page.locator("#calibration-check").click();
    // Until the check has begun, the step is still that of the fit.
    await says(page, "calibration-step", /^(Let go|Leave|Press at)/);
    await obey(page, bench, (asked, taken) => asked.startsWith("Fitted") && taken === 12);
    expect(await says(page, "calibration-checked-words", /^Error [\d.]+ mm/)).toContain("of 5 within their 95 % intervals");
    expect(await page.locator("#calibration-checked-places tr").count()).toBe(5);
    await picture(page, "calibration-checked");
    bench.lift();
    // The session continues with the locator.
    await dotUnder(page, bench, 200);
    await page.locator("#calibration-close").click();
    expect(await page.locator("#calibration").isVisible()).toBe(false);
    expect(faults).toEqual([]);
    await page.context().close();
    await server.stop();
    bench.stop();
  });

  test("is gone on with after the server was killed, by keys, and is not cut off on a phone in the dark", async () => {
    const bench = await Bench.start("noisy-beam.toml", SIX_TWICE);
    const server = await started(bench);
    const first = await open(browser, server.url);
    await says(first.page, "calibration-step", /^Ready to calibrate$/);
    await first.page.keyboard.press("b");
    await obey(first.page, bench, (_, taken) => taken === 2);
    await server.kill();
    await first.page.context().close();
    bench.lift();
    expect(presses(bench)).toBe(2);
    const again = await started(bench);
    const { page, faults } = await open(browser, again.url, {
      viewport: { width: 390, height: 844 },
      colorScheme: "dark",
      reducedMotion: "reduce",
    });
    await says(page, "calibration-step", /^Ready to go on$/);
    await page.keyboard.press("b");
    await obey(page, bench, (asked) => asked.startsWith("Press at"));
    await page.keyboard.press("s");
    await says(page, "calibration-progress", /of 11 presses/);
    await picture(page, "calibration-phone");
    expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBe(390);
    await obey(page, bench, (_, taken) => taken === 10);
    await page.keyboard.press("r");
    await says(page, "calibration-progress", /^9 of/);
    await obey(page, bench, (_, taken) => taken === 10);
    await page.keyboard.press("q");
    await says(page, "calibration-step", /^No more presses/);
    expect(presses(bench)).toBe(10);
    bench.lift();
    await page.keyboard.press("f");
    await says(page, "calibration-step", /^Fitted to 10 presses/, FIT_MS);
    await dotUnder(page, bench, 250);
    await picture(page, "calibration-phone-done");
    expect(faults).toEqual([]);
    await page.context().close();
    await again.stop();
    bench.stop();
  });
});
