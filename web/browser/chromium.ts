// Headless Chromium, and pages that record their faults.

import { appendFileSync, existsSync, mkdirSync } from "node:fs";
import { type Browser, type BrowserContextOptions, chromium, type Page } from "playwright-core";
import { ROOT } from "./server";

const PROGRAM = process.env.PALPATE_CHROMIUM ?? "/usr/bin/chromium";
const FLAGS = [
  "--headless",
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];
/** Screenshots for manual inspection. */
const PICTURES = `${ROOT}/target/xtask/dashboard`;

/** Returns true if Chromium is installed; otherwise reports skipped tests, as the tests in Rust do. */
export function hasChromium(): boolean {
  if (existsSync(PROGRAM)) return true;
  const line = "skipped web/browser/dashboard.test.ts: Chromium is missing; install Debian's chromium, or name the program in PALPATE_CHROMIUM";
  if (process.env.PALPATE_STRICT === "1") throw new Error(line);
  console.error(line);
  if (process.env.PALPATE_SKIPPED !== undefined) appendFileSync(process.env.PALPATE_SKIPPED, `${line}\n`);
  return false;
}

export function launch(): Promise<Browser> {
  mkdirSync(PICTURES, { recursive: true });
  return chromium.launch({ executablePath: PROGRAM, args: FLAGS });
}

/** Opens a page; `faults` collects errors and requests to other hosts. */
export async function open(browser: Browser, url: string, options: BrowserContextOptions = {}): Promise<{ page: Page; faults: string[] }> {
  const context = await browser.newContext({ viewport: { width: 1280, height: 1000 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(15_000);
  const faults: string[] = [];
  page.on("pageerror", (error) => faults.push(String(error.stack ?? error)));
  page.on("console", (message) => {
    // The page itself reports a server that does not respond.
    if (message.type() === "error" && !message.text().includes("ERR_CONNECTION")) faults.push(message.text());
  });
  page.on("request", (request) => {
    if (new URL(request.url()).host !== new URL(url).host) faults.push(`fetched ${request.url()}`);
  });
  await page.goto(url);
  return { page, faults };
}

export async function picture(page: Page, name: string): Promise<void> {
  await page.screenshot({ path: `${PICTURES}/${name}.png`, fullPage: true });
}

/** Longest wait for a fit, in milliseconds: it is computed beside a browser on two cores. */
export const FIT_MS = 90_000;

export async function says(page: Page, id: string, text: RegExp, timeout = 30_000): Promise<string> {
  await page.waitForFunction(
    ({ id, source, flags }) => new RegExp(source, flags).test(document.getElementById(id)?.textContent ?? ""),
    { id, source: text.source, flags: text.flags },
    { timeout },
  );
  return (await page.locator(`#${id}`).textContent()) ?? "";
}

export async function dotAt(page: Page, x_mm: number): Promise<void> {
  await page.waitForFunction(
    (x_mm) => {
      const located = document.getElementById("status")?.textContent === "Located";
      return located && Math.abs(Number(document.getElementById("position")?.textContent) - x_mm) < 2;
    },
    x_mm,
    { timeout: 20_000 },
  );
}
