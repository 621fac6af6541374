// A board without a rig: displayed, given a rig, and calibrated in the browser.

import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer, type AddressInfo, type Server as Board } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { leave } from "./children";
import { hasChromium, launch, open, picture, says } from "./chromium";
import { Server } from "./server";

/** A name that is too long for a column. */
const LONG = "strain_gauge_under_the_left_support_of_the_second_beam_channel_A";

/** A board that sends a line of named values 50 times a second. */
async function board(): Promise<{ url: string; say: (line: () => string) => void }> {
  let line = () => `{"${LONG}":${-8_388_608 + Math.round(9 * Math.random())},"b":12,"t":1}`;
  const server: Board = createServer((socket) => {
    const timer = setInterval(() => socket.write(`${line()}\n`), 20);
    socket.on("error", () => {});
    socket.on("close", () => clearInterval(timer));
  });
  await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
  leave(() => server.close());
  return { url: `tcp://127.0.0.1:${(server.address() as AddressInfo).port}`, say: (said) => (line = said) };
}

describe.skipIf(!hasChromium())("a board without a rig", () => {
  let browser: Browser;
  beforeAll(async () => {
    browser = await launch();
  });
  afterAll(() => browser?.close());

  test("shows what it sends, becomes a rig by a form, and is calibrated", async () => {
    const folder = mkdtempSync(join(tmpdir(), "palpate-bring-up-"));
    leave(() => rmSync(folder, { recursive: true, force: true }));
    const { url, say } = await board();
    const server = await Server.start(["--from", url], undefined, folder);
    for (const [name, options] of [
      ["phone", { viewport: { width: 390, height: 844 }, colorScheme: "dark" }],
      ["wide", { viewport: { width: 1280, height: 800 } }],
    ] as const) {
      const { page, faults } = await open(browser, server.url, options);
      await says(page, "connection", /^No rig yet$/);
      await says(page, "bring-up-rate", /^\d\d Hz$/);
      // A long name takes two lines, and leaves the value visible.
      const now = page.locator("#bring-up-channels td").first();
      expect(await now.textContent()).toMatch(/^−8,388,\d{3}$/);
      const box = (await now.boundingBox())!;
      expect(box.x + box.width).toBeLessThanOrEqual(options.viewport.width);
      expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBe(options.viewport.width);
      expect(await page.locator("#bring-up-lines li").last().textContent()).toContain(`{"${LONG}":-8388`);
      expect(await page.locator(".numbers").isVisible()).toBe(false);
      expect(await page.locator("#surface").isVisible()).toBe(false);
      // The name of a channel is legible beside the place of the sensor.
      const field = (await page.locator("#rig-channel-1").boundingBox())!;
      const place = (await page.locator("#rig-sensor-place-1").boundingBox())!;
      expect(field.width).toBeGreaterThan(100);
      expect(field.x + field.width).toBeLessThanOrEqual(place.x);
      await picture(page, `bring-up-${name}`);
      expect(faults).toEqual([]);
      if (name === "phone") await page.context().close();
    }
    const page = browser.contexts()[0]!.pages()[0]!;
    // Any text of the board is shown as text.
    say(() => '<img src=x onerror="document.title=1">');
    await says(page, "bring-up-lines", /<img src=x onerror/);
    await says(page, "bring-up-problem", /lines arrive without values/);
    say(() => `{"${LONG}":1,"b":12}`);
    await page.locator("#bring-up-problem").waitFor({ state: "hidden" });

    // Problems are beside their fields, from the page and from the server.
    await page.locator("#rig-length").fill("-300");
    await page.locator("#rig-places").focus();
    await says(page, "rig-length-problem", /^This must be greater than 0\.$/);
    await page.locator("#rig-make").click();
    await says(page, "rig-force-problem", /^This is needed\.$/);
    await picture(page, "bring-up-problems");
    await page.locator("#rig-length").fill("300");
    await page.locator("#rig-length-problem").waitFor({ state: "hidden" });
    await page.locator("#rig-force").fill("200");
    await says(page, "rig-text", /length = "300 mm"[^]*force = "1\.96133 N"/);
    await page.locator("#rig-placement").fill("300");
    await says(page, "rig-placement-problem", /^the placement is 300 mm; it must be less than 300 mm/);
    await page.locator("#rig-placement").fill("2");
    await page.locator("#rig-placement-problem").waitFor({ state: "hidden" });
    await page.locator("#rig-sensor-place-0").fill("400");
    await page.locator("#rig-sensor-place-1").fill("250");
    await says(page, "rig-channels-problem", /is at 400 mm; it must be from 0 mm to 300 mm/);
    await page.locator("#rig-sensor-place-0").fill("50");
    await page.locator("#rig-second-force").fill("500");
    await says(page, "rig-text", /positions = \["50 mm", "250 mm"\][^]*placement = "2 mm"/);
    await page.locator("#rig-force-unknown").check();
    await page.waitForFunction(() => !document.getElementById("rig-text")!.textContent.includes("force"));
    await page.locator("#rig-force-unknown").uncheck();
    writeFileSync(join(folder, "rig.toml"), "mine");
    await page.locator("#rig-places").fill("6");
    await says(page, "rig-overwrite-words", /^Replace rig\.toml, which is there already$/);
    await page.locator("#rig-make").click();
    // An existing file is not replaced without consent.
    expect(readFileSync(join(folder, "rig.toml"), "utf8")).toBe("mine");
    await page.locator("#rig-overwrite").check();
    await page.locator("#rig-make").click();
    await says(page, "calibration-step", /^Ready to calibrate$/);
    expect(readFileSync(join(folder, "rig.toml"), "utf8")).toContain(`channels = ["${LONG}", "b"]`);
    expect(await page.locator("#bring-up").isVisible()).toBe(false);
    await says(page, "connection", /^Calibration$/);
    expect(await says(page, "calibration-progress", /./)).toBe("0 of 18 presses, in rig-presses.csv");
    await picture(page, "bring-up-calibration");
    await page.context().close();
    await server.stop();
  });
});
