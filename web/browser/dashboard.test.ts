// The dashboard in a browser on the real server with a simulated board, by clicks and keys.

import { readFileSync } from "node:fs";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import type { SampleRecord, StreamMessage } from "../src/protocol";
import { isPlaced, number, statusWords } from "../src/words";
import { hasChromium, launch, open, picture, says } from "./chromium";
import { record } from "./recorder";
import { Server } from "./server";

async function shows(page: Page, sample: SampleRecord): Promise<void> {
  const position = isPlaced(sample.status) ? number(sample.x_mm, sample.sd_mm) : "—";
  const expected = { status: statusWords(sample).word, position };
  await page.waitForFunction(
    ({ status, position }) =>
      document.getElementById("status")?.textContent === status && document.getElementById("position")?.textContent === position,
    expected,
  );
}

/** Pixels of the surface with the colour of the contact. */
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

/**
 * Values of views in frames with a located contact: label of the dot, large number, dot of the budget
 * in mm.
 */
function estimatesOfFrames(page: Page, count: number): Promise<{ drawn: string; written: string; budget: number; sd: boolean }[]> {
  return page.evaluate(async (count) => {
    const drawing = CanvasRenderingContext2D.prototype;
    const [fillText, arc] = [drawing.fillText, drawing.arc];
    let [label, dot_px] = ["", NaN];
    drawing.fillText = function (this: CanvasRenderingContext2D, text: string, ...at: [number, number]) {
      const match = /^([\d.]+) mm/.exec(text);
      if (this.canvas.id === "surface" && match !== null) label = match[1]!;
      fillText.call(this, text, ...at);
    };
    drawing.arc = function (this: CanvasRenderingContext2D, ...at: Parameters<typeof arc>) {
      if (this.canvas.closest("#budget") !== null) dot_px = at[0];
      arc.apply(this, at);
    };
    const seen: { drawn: string; written: string; budget: number; sd: boolean }[] = [];
    const canvas = document.querySelector<HTMLCanvasElement>("#budget canvas")!;
    const text = (id: string) => document.getElementById(id)?.textContent ?? "";
    let previous = "";
    while (seen.length < count) {
      await new Promise((resolve) => requestAnimationFrame(resolve));
      // The page's own frame and all drawings are complete before or within this task.
      await new Promise((resolve) => setTimeout(resolve));
      if (text("status") !== "Located" || label === "" || label === previous) continue;
      previous = label;
      const context = canvas.getContext("2d")!;
      const left = 8 + 6 + Math.ceil(Math.max(...["0.01", "0.1", "1"].map((number) => context.measureText(number).width)));
      const budget = ((dot_px - left) / (canvas.clientWidth - 12 - left)) * 400;
      const sd = text("budget-words").includes("this estimate has");
      seen.push({ drawn: label, written: text("position"), budget, sd });
    }
    [drawing.fillText, drawing.arc] = [fillText, arc];
    return seen;
  }, count);
}

/** Records the texts on the charts, and texts beyond the edges. */
async function watchTexts(page: Page): Promise<void> {
  await page.evaluate(() => {
    const watched = window as unknown as { cutTexts: string[]; drawnTexts: Map<string, string[]> };
    [watched.cutTexts, watched.drawnTexts] = [[], new Map()];
    const drawing = CanvasRenderingContext2D.prototype;
    const [fillText, clearRect] = [drawing.fillText, drawing.clearRect];
    const chart = (canvas: HTMLCanvasElement) => canvas.closest(".chart")?.id ?? "";
    drawing.clearRect = function (this: CanvasRenderingContext2D, ...at: Parameters<typeof clearRect>) {
      watched.drawnTexts.set(chart(this.canvas), []);
      clearRect.apply(this, at);
    };
    drawing.fillText = function (this: CanvasRenderingContext2D, text: string, x: number, y: number) {
      const width = this.measureText(text).width;
      const left = this.getTransform().e + x - { right: width, center: width / 2 }[this.textAlign as "right"]!;
      watched.drawnTexts.get(chart(this.canvas))?.push(text);
      if (left < 0 || left + width > this.canvas.width) watched.cutTexts.push(text);
      fillText.call(this, text, x, y);
    };
  });
}

async function downloaded(page: Page, button: string): Promise<string> {
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator(button).click()]);
  return download.path();
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
      await says(page, "connection", /^Simulated$/);
      await says(page, "status", /^Located$/);
      expect(Number(await says(page, "position", /^\d/))).toBeGreaterThanOrEqual(0);
      expect(await says(page, "position-95", /^95 %: .+ to .+ mm$/)).toContain("mm");
      // The disc of the contact has 200 pixels; label and trail are beside it.
      expect(await contactPixels(page)).toBeGreaterThan(150);
      await says(page, "announcer", /^(Touch-down at \d+.* mm|Lift-off after )/);
      await says(page, "budget-words", /^Limit for .* N: .* mm over the surface\./);
      expect(await page.locator("#health tr").count()).toBe(8);
      expect(await page.locator("#health td[data-state=well]").count()).toBe(8);
      await picture(page, "light");
    });

    test("shows large that the board is simulated, until a person confirms it", async () => {
      expect(await page.locator("#simulated h2").textContent()).toBe("This board is simulated");
      expect(await page.locator("#simulated h2").evaluate((title) => Number.parseFloat(getComputedStyle(title).fontSize))).toBeGreaterThan(24);
      await page.locator("#simulated-close").click();
      await page.reload();
      await says(page, "connection", /^Simulated$/);
      expect(await page.locator("#simulated").isVisible()).toBe(false);
    });

    test("every view shows one estimate at every moment", async () => {
      const seen = await estimatesOfFrames(page, 40);
      expect(seen.length).toBe(40);
      for (const { drawn, written, budget, sd } of seen) {
        expect(drawn).toBe(written);
        // The dot of the budget is at the contact; the label contains the standard deviation.
        expect(Math.abs(budget - Number(written))).toBeLessThan(1);
        expect(sd).toBe(true);
      }
      // The estimates moved meanwhile, so views of different instants would differ.
      expect(new Set(seen.map(({ drawn }) => drawn)).size).toBeGreaterThan(5);
    });

    test("keeps the charts and the events over a reload, and exports them", async () => {
      await page.locator("#window").selectOption("600");
      await page.waitForTimeout(3_000);
      const loaded_s = Date.now() / 1000;
      await page.reload();
      await says(page, "status", /^(Located|No contact)$/);
      await page.locator("#window").selectOption("600");
      await page.waitForTimeout(500);
      const lines = readFileSync(await downloaded(page, "#export-csv"), "utf8").trim().split("\n");
      expect(lines[0]).toMatch(/^time_s,x_mm,.*,deflection_8 \(mm\)$/);
      const times = lines.slice(1).map((line) => Number(line.split(",")[0]));
      expect(times[0]).toBeLessThan(loaded_s - 3);
      expect(times.at(-1)).toBeGreaterThan(loaded_s);
      for (let i = 1; i < times.length; i++) expect(times[i]).toBeGreaterThanOrEqual(times[i - 1]!);
      await says(page, "events", /Source opened: a simulated board/);
      expect(readFileSync(await downloaded(page, "#export-png")).subarray(1, 4).toString()).toBe("PNG");
      // The board may be untouched at this moment.
      const label = () => page.locator("#chart-position").getAttribute("aria-label");
      await expect.poll(label, { timeout: 10_000 }).toMatch(/^Position over .*\. Position: [\d.]+ mm to [\d.]+ mm, .* now\.$/);
      await page.locator("#window").selectOption("10");
    });

    test("the values of a chart are zoomed by buttons, and fit again", async () => {
      const range = () => page.evaluate(() => (window as unknown as { drawnTexts: Map<string, string[]> }).drawnTexts.get("chart-channels") ?? []);
      await watchTexts(page);
      await page.waitForTimeout(300);
      const whole = await range();
      for (let i = 0; i < 4; i++) await page.locator("#chart-channels-zoom button[value=in]").click();
      await page.waitForFunction((whole) => JSON.stringify((window as unknown as { drawnTexts: Map<string, string[]> }).drawnTexts.get("chart-channels")) !== whole, JSON.stringify(whole));
      const numbers = (await range()).filter((text) => !text.includes(":")).map((text) => Number(text.replace("−", "-")));
      expect(Math.max(...numbers) - Math.min(...numbers)).toBeLessThan(0.5);
      expect(await page.locator("#chart-channels").getAttribute("class")).toContain("zoomed");
      await page.locator("#chart-channels-zoom button[value=all]").click();
      expect(await page.locator("#chart-channels").getAttribute("class")).not.toContain("zoomed");
    });

    test("raises an alarm by a rule that was set on the page, and finds it in the log", async () => {
      await page.locator("#alarms").click();
      await page.locator("#alarm-name").fill("anywhere");
      await page.locator("#alarm-x-low").fill("0");
      await page.locator("#alarm-x-high").fill("-5");
      await page.locator("#alarm-text").fill("a hand is there");
      await page.getByRole("button", { name: "Add the rule" }).click();
      await says(page, "alarm-problem", /^line 3: `x` is from 0 mm to -5 mm/);
      // The browser records every refusal.
      expect(faults.splice(0)).toEqual(["Failed to load resource: the server responded with a status of 400 (Bad Request)"]);
      const file = page.locator("#alarm-file");
      await file.fill((await file.inputValue()).replace("-5 mm", "400 mm"));
      await page.locator("#alarm-set").click();
      await says(page, "alarm-done", /^1 alarm is set/);
      await picture(page, "alarms");
      await page.locator("#alarms-close").click();
      await says(page, "alarm-words", /^Alarm at .*: a hand is there, by rule “anywhere”/);
      await picture(page, "alarm");
      await page.locator("#alarm-dismiss").click();
      await page.locator("#events-search").fill("HAND there");
      await page.waitForFunction(() => [...document.querySelectorAll("#events li")].length > 0 && [...document.querySelectorAll("#events li")].every((item) => item.textContent?.includes("Alarm: a hand is there (anywhere)")));
      await page.locator("#events-search").fill("");
      await page.locator("#alarms").click();
      await page.waitForFunction(() => (document.getElementById("alarm-file") as HTMLTextAreaElement).value.includes("a hand is there"));
      await file.fill("");
      await page.locator("#alarm-set").click();
      await says(page, "alarm-done", /^No alarms are set/);
      await page.locator("#alarms-close").click();
      // The focus returns to the button, which the space bar would press.
      await page.locator("#surface-title").click();
    });

    test("numbers of axes are whole, however large or small", async () => {
      for (const [factor, expected] of [[2_800_000, /^−\d,\d{3},\d{3}$/], [1e-6, /e−6$/]] as const) {
        const { page, faults } = await open(browser, "about:blank");
        await page.route("**/api/history", (route) => route.fulfill({ json: { samples: [], events: [] } }));
        await page.addInitScript((factor) => {
          const parse = JSON.parse;
          JSON.parse = (text: string) => {
            const message = parse(text) as Partial<StreamMessage> | null;
            for (const sample of message?.samples ?? []) sample.reading = sample.reading.map((value) => value * factor);
            return message;
          };
        }, factor);
        await page.goto(server.url);
        await watchTexts(page);
        await says(page, "status", /^Located$/);
        await page.waitForTimeout(1_000);
        const { cut, texts } = await page.evaluate(() => {
          const watched = window as unknown as { cutTexts: string[]; drawnTexts: Map<string, string[]> };
          return { cut: watched.cutTexts, texts: watched.drawnTexts.get("chart-channels") ?? [] };
        });
        expect(cut).toEqual([]);
        expect(texts.filter((text) => expected.test(text)).length, texts.join(" ")).toBeGreaterThan(1);
        await picture(page, `axes-${factor}`);
        expect(faults.filter((fault) => !fault.startsWith("fetched"))).toEqual([]);
        await page.context().close();
      }
    });

    test("shows no contact and no dot without a contact", async () => {
      await page.waitForFunction(() => {
        const status = document.getElementById("status")?.textContent;
        return status === "No contact" && document.getElementById("position")?.textContent === "—";
      });
      await page.keyboard.press("Space");
      await page.waitForTimeout(200);
      // A touch may have begun in the meantime: then the page shows it, and the check is skipped.
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

    test("keys are ignored during typing and where they are switched off", async () => {
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

    test("shows that the connection is lost, and is live again after a restart of the server", async () => {
      const port = server.port;
      await server.stop();
      await says(page, "connection", /^Connection lost$/);
      expect(await page.locator("#banner").textContent()).toContain("not live");
      await picture(page, "lost");
      server = await Server.start([], port);
      await says(page, "connection", /^Simulated$/);
      await page.locator("#banner").waitFor({ state: "hidden" });
      await says(page, "status", /^Located$/);
    });

    test("had no error, and fetched only from its server", async () => {
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
      await says(page, "connection", /^No source$/);
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
