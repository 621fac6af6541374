// The dashboard in a browser, on the real server with its simulated board: as a person uses it, by clicks and by keys.

import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import type { SampleRecord } from "../src/protocol";
import { isPlaced, number, statusWords } from "../src/words";
import { hasChromium, launch, open, picture, says } from "./chromium";
import { record } from "./recorder";
import { Server } from "./server";

/** Waits until the page shows a sample. */
async function shows(page: Page, sample: SampleRecord): Promise<void> {
  const position = isPlaced(sample.status) ? number(sample.x_mm, sample.sd_mm) : "—";
  const expected = { status: statusWords(sample).word, position };
  await page.waitForFunction(
    ({ status, position }) =>
      document.getElementById("status")?.textContent === status && document.getElementById("position")?.textContent === position,
    expected,
  );
}

/** Pixels of the surface that have the colour of the contact. */
function contactPixels(page: Page): Promise<number> {
  return page.evaluate(() => {
    const canvas = document.getElementById("surface") as HTMLCanvasElement;
    const probe = document.createElement("canvas").getContext("2d")!;
    probe.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--contact");
    probe.fillRect(0, 0, 1, 1);
    const [r, g, b] = probe.getImageData(0, 0, 1, 1).data;
    const { data } = canvas.getContext("2d")!.getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) if (data[i] === r && data[i + 1] === g && data[i + 2] === b) count += 1;
    return count;
  });
}

describe.skipIf(!hasChromium())("dashboard", () => {
  let browser: Browser;
  beforeAll(async () => {
    browser = await launch();
  });
  afterAll(() => browser?.close());

  describe("of the demo", () => {
    let server: Server;
    let page: Page;
    let faults: string[];
    beforeAll(async () => {
      server = await Server.start([]);
      ({ page, faults } = await open(browser, server.url));
    });
    afterAll(() => server?.stop());

    test("shows a live dot with its interval, in numbers, on the surface and aloud", async () => {
      await says(page, "connection", /^Connected$/);
      await says(page, "status", /^Located$/);
      expect(Number(await says(page, "position", /^\d/))).toBeGreaterThanOrEqual(0);
      expect(await says(page, "position-95", /^95 %: .+ to .+ mm$/)).toContain("mm");
      // The disc of the contact alone has 200 pixels; the words and its trail are beside it.
      expect(await contactPixels(page)).toBeGreaterThan(150);
      await says(page, "announcer", /^(Touch-down at \d+.* mm|Lift-off after )/);
      await says(page, "budget-words", /^Limit for .* N: .* mm over the surface\./);
      expect(await page.locator("#health tr").count()).toBe(8);
      expect(await page.locator("#health td[data-state=well]").count()).toBe(8);
      await picture(page, "light");
    });

    test("says that nothing touches, and shows no dot then", async () => {
      await page.waitForFunction(() => {
        const status = document.getElementById("status")?.textContent;
        return status === "No contact" && document.getElementById("position")?.textContent === "—";
      });
      await page.keyboard.press("Space");
      await page.waitForTimeout(200);
      // A touch may have begun in the meantime: then the page shows that, and this test has nothing to see.
      if ((await page.locator("#status").textContent()) === "No contact") expect(await contactPixels(page)).toBe(0);
      await page.keyboard.press("Space");
    });

    test("pauses by a click and goes on by a key", async () => {
      await page.locator("#pause").click();
      await says(page, "notice", /^Paused/);
      await page.waitForTimeout(150);
      const frozen = await page.locator("#surface").evaluate((canvas) => (canvas as HTMLCanvasElement).toDataURL());
      await page.waitForTimeout(1_000);
      expect(await page.locator("#surface").evaluate((canvas) => (canvas as HTMLCanvasElement).toDataURL()) === frozen).toBe(true);
      await page.locator("#surface-title").click();
      await page.keyboard.press("Space");
      expect(await page.locator("#pause").getAttribute("aria-pressed")).toBe("false");
      await page.waitForFunction((was) => (document.getElementById("surface") as HTMLCanvasElement).toDataURL() !== was, frozen);
    });

    test("tares and marks by keys", async () => {
      await page.keyboard.press("t");
      await says(page, "notice", /^Tared/);
      await page.keyboard.press("m");
      await page.keyboard.type("a nut fell on it");
      await page.keyboard.press("Enter");
      await says(page, "events", /Mark: a nut fell on it/);
      expect(await page.locator("#events").textContent()).toContain("Tared");
    });

    test("keys do nothing while somebody types, nor where they are switched off", async () => {
      await page.keyboard.press("m");
      await page.keyboard.type("mrt ?");
      expect(await page.locator("#mark-text").inputValue()).toBe("mrt ?");
      await page.keyboard.press("Escape");
      await page.keyboard.press("?");
      await page.locator("#keys-on").uncheck();
      await page.keyboard.press("Escape");
      await page.keyboard.press("Space");
      expect(await page.locator("#pause").getAttribute("aria-pressed")).toBe("false");
      await page.locator("#help").click();
      await page.locator("#keys-on").check();
      await page.getByRole("button", { name: "Close" }).click();
      expect(await page.locator("dialog[open]").count()).toBe(0);
    });

    test("records by a click, and replays with a scrubber by keys", async () => {
      const recorded = await record(page, server.url);
      await page.reload();
      await says(page, "status", /^(Located|No contact)$/);
      await page.locator("#record").click();
      await says(page, "recording-now", /Recording \S+: .*\d (B|kB|MB)$/);
      await page.waitForTimeout(3_000);
      await page.locator("#surface-title").click();
      await page.keyboard.press("r");
      const name = (await says(page, "notice", /^Recorded /)).replace(/^Recorded (.*)\.$/, "$1");
      await page.getByRole("button", { name: `Replay ${name}` }).click();
      await says(page, "replay-title", new RegExp(`^Replay of ${name.replaceAll(".", "\\.")}$`));
      const scrubber = page.locator("#scrubber");
      const seconds = Number(await scrubber.getAttribute("max"));
      expect(seconds).toBeGreaterThan(2);
      await says(page, "replay-play", /^Stop$/);
      await page.keyboard.press("Space");
      await says(page, "replay-play", /^Play$/);
      await page.keyboard.press("Home");
      await says(page, "replay-time", /^0\.00 \//);
      await shows(page, recorded()[0]!);
      await page.keyboard.press("ArrowRight");
      await page.keyboard.press("ArrowRight");
      expect(Number(await scrubber.inputValue())).toBeGreaterThan(0);
      await page.keyboard.press("End");
      await says(page, "replay-time", new RegExp(`^${seconds.toFixed(2).replace(".", "\\.")} /`));
      await shows(page, recorded().at(-1)!);
      await picture(page, "replay");
      await page.keyboard.press("Escape");
      expect(await page.locator("#replay").isVisible()).toBe(false);
      await page.unrouteAll();
    });

    test("says that the connection is lost, and is live again after the server has been started anew", async () => {
      const port = server.port;
      await server.stop();
      await says(page, "connection", /^Connection lost$/);
      expect(await page.locator("#banner").textContent()).toContain("not live");
      await picture(page, "lost");
      server = await Server.start([], port);
      await says(page, "connection", /^Connected$/);
      await page.locator("#banner").waitFor({ state: "hidden" });
      await says(page, "status", /^Located$/);
    });

    test("had no error, and fetched nothing from elsewhere", async () => {
      expect(faults).toEqual([]);
      await page.context().close();
    });

    test("is readable in the dark, and keeps to the choice of a person", async () => {
      const { page, faults } = await open(browser, server.url, { colorScheme: "dark" });
      await says(page, "status", /^Located$/);
      const theme = () => page.evaluate(() => document.documentElement.dataset.theme);
      expect(await theme()).toBe("dark");
      await picture(page, "dark");
      await page.locator("#theme").click();
      expect(await theme()).toBe("light");
      await page.reload();
      await says(page, "theme", /^Theme: light$/);
      expect(await theme()).toBe("light");
      expect(faults).toEqual([]);
      await page.context().close();
    });

    test("is not cut off at the width of a phone", async () => {
      const viewport = { width: 390, height: 844 };
      const { page, faults } = await open(browser, server.url, { viewport, colorScheme: "dark", reducedMotion: "reduce", hasTouch: true });
      await says(page, "status", /^Located$/);
      expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBe(viewport.width);
      await picture(page, "phone");
      await page.locator("#pause").tap();
      await says(page, "notice", /^Paused/);
      expect(faults).toEqual([]);
      await page.context().close();
    });
  });

  describe("without a source", () => {
    let server: Server;
    beforeAll(async () => {
      server = await Server.start(["examples/noisy-beam.toml"]);
    });
    afterAll(() => server?.stop());

    test("explains itself, and is live after the simulated board was chosen, by keys alone", async () => {
      const { page, faults } = await open(browser, server.url);
      await says(page, "connection", /^Connected$/);
      await page.locator("#welcome").waitFor();
      await picture(page, "welcome");
      for (let i = 0; i < 10; i++) {
        await page.keyboard.press("Tab");
        if ((await page.evaluate(() => document.activeElement?.id)) === "simulate") break;
      }
      await page.keyboard.press("Enter");
      await page.locator("#welcome").waitFor({ state: "hidden" });
      await says(page, "status", /^Located$/);
      expect(faults).toEqual([]);
      await page.context().close();
    });
  });
});
