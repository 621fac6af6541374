// A calibration by the simulated machine of the simulated board, on the real server.

import { existsSync, readFileSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { CLOCK_SPEED, MachineBench } from "./bench";
import { endAll } from "./children";
import { FIT_MS, dotAt, hasChromium, launch, open, picture, says } from "./chromium";
import { Server } from "./server";

async function taken(page: Page, count: number): Promise<void> {
  await page.waitForFunction((count) => (document.getElementById("calibration-bar") as HTMLProgressElement).value >= count, count, { timeout: 60_000 });
}

function presses(bench: MachineBench): number {
  const lines = readFileSync(bench.path("presses.csv"), "utf8").split("\n").filter((line) => line !== "" && !line.startsWith("#"));
  const depth = lines[0]!.split(",").indexOf("depth_mm");
  return lines.slice(1).filter((line) => Number(line.split(",")[depth]) > 0).length;
}

function started(bench: MachineBench): Promise<Server> {
  const [rig, csv, out] = ["rig.toml", "presses.csv", "locator.json"].map((name) => bench.path(name));
  return Server.start([rig!, "--from", bench.from, "--calibrate", "--stage", bench.stage, "--presses", csv!, "--out", out!, ...CLOCK_SPEED]);
}

describe.skipIf(!hasChromium())("calibration by a machine", () => {
  let browser: Browser;
  beforeAll(async () => {
    browser = await launch();
  });
  afterEach(endAll);
  afterAll(() => browser?.close());

  test("goes from an empty page to a live dot by clicks, and stops at once in the middle", async () => {
    const bench = await MachineBench.start("fsi-like.toml", [["repeats = 3", "repeats = 1"]]);
    const server = await started(bench);
    const { page, faults } = await open(browser, server.url);
    await says(page, "calibration-step", /^Ready to calibrate$/);
    expect(await says(page, "machine-moves", /presses 18 times, down to z 21 and 20 mm/)).toContain("It searches for its end stops first");
    expect(await page.locator("#machine-stop").isVisible()).toBe(false);
    await picture(page, "machine-ready");
    await page.locator("#calibration-dry-run").click();
    await says(page, "calibration-why", /^Dry run: 9 positions reached at the height of travel, none pressed\.$/);
    await page.locator("#calibration-set-up").click();
    await says(page, "calibration-step", /^Jog the machine, or find the touch$/);
    await page.locator("#machine-step").selectOption("10");
    for (const x of [10, 20, 30, 40, 50, 60, 70]) {
      await page.locator("#machine-jogs button", { hasText: "x +" }).click();
      await says(page, "machine-at", new RegExp(`^x ${x}, y 0, z 27 mm$`));
    }
    await page.locator("#machine-touch-off").click();
    await says(page, "calibration-why", /^The finger touches at z 2[12]\.\d+ mm/);
    await picture(page, "machine-set-up");
    await page.locator("#calibration-stop").click();
    await says(page, "machine-moves", /The untouched surface is at z 2[12]\.\d+ mm/);
    await page.locator("#calibration-begin").click();
    await taken(page, 3);
    await says(page, "calibration-step", /^Pressing at [\d.]+ mm, [12] mm deep$/);
    await says(page, "machine-left", /\d s$/);
    expect(await page.locator("#calibration-redo").isVisible()).toBe(false);
    await picture(page, "machine-light");
    await page.locator("#machine-stop").click();
    expect(await says(page, "calibration-problem", /stopped by hand/)).toContain("reset it");
    await says(page, "calibration-step", /^Ready to go on$/);
    const pressed = presses(bench);
    expect(pressed).toBeGreaterThanOrEqual(3);
    await picture(page, "machine-stopped");
    await page.locator("#calibration-begin").click();
    await taken(page, 18);
    await says(page, "calibration-step", /^All presses are taken$/);
    expect(presses(bench)).toBe(18);
    await page.locator("#calibration-finish").click();
    await says(page, "calibration-step", /^Fitted to 18 presses: error at held-out positions [\d.]+ mm/, FIT_MS);
    expect(existsSync(bench.path("locator.json"))).toBe(true);
    await page.locator("#calibration-check").click();
    await says(page, "calibration-checked-words", /\(median\).* of 5 within their 95 % intervals/);
    await picture(page, "machine-checked");
    await bench.press(55);
    await dotAt(page, 55);
    await picture(page, "machine-done");
    expect(faults).toEqual([]);
  });

  test("is stopped by Escape and gone on with by keys on a phone in the dark, and ends when the page is closed", async () => {
    const bench = await MachineBench.start("fsi-like.toml", [["repeats = 3", "repeats = 2"]]);
    const server = await started(bench);
    const phone = { viewport: { width: 390, height: 844 }, colorScheme: "dark", reducedMotion: "reduce" } as const;
    const first = await open(browser, server.url, phone);
    await says(first.page, "calibration-step", /^Ready to calibrate$/);
    await picture(first.page, "machine-phone-ready");
    await first.page.keyboard.press("b");
    await taken(first.page, 2);
    await picture(first.page, "machine-phone");
    expect(await first.page.evaluate(() => document.documentElement.scrollWidth)).toBe(390);
    // The stop is visible over all dialogs.
    await first.page.keyboard.press("?");
    await first.page.keyboard.press("Escape");
    await says(first.page, "calibration-problem", /stopped by hand/);
    await first.page.keyboard.press("Escape");
    await says(first.page, "calibration-step", /^Ready to go on$/);
    await first.page.keyboard.press("b");
    await taken(first.page, 5);
    await first.page.context().close();
    // Without a page the finger is lifted after 5 s of the bench's clock, and pressing stops.
    await new Promise((resolve) => setTimeout(resolve, 6_000));
    const pressed = presses(bench);
    await new Promise((resolve) => setTimeout(resolve, 1_000));
    expect(presses(bench)).toBe(pressed);
    expect(pressed).toBeLessThan(36);
    const { page, faults } = await open(browser, server.url, phone);
    await says(page, "calibration-problem", /no page has been open for 5 s: the machine lifted its finger/);
    await page.keyboard.press("b");
    await says(page, "calibration-step", /^All presses are taken$/, 90_000);
    expect(presses(bench)).toBe(36);
    await page.keyboard.press("f");
    await says(page, "calibration-step", /^Fitted to 36 presses/, FIT_MS);
    expect(faults).toEqual([]);
  });

  test("explains that the machine is missing", async () => {
    const bench = await MachineBench.start("fsi-like.toml", []);
    bench.stage = "gcode:tcp://127.0.0.1:1";
    const server = await started(bench);
    const { page } = await open(browser, server.url);
    await says(page, "calibration-step", /^Ready to calibrate$/);
    await page.locator("#calibration-begin").click();
    expect(await says(page, "calibration-problem", /the line to the machine is broken/)).toContain("check that it is on");
    await says(page, "calibration-step", /^Ready to calibrate$/);
  });
});
