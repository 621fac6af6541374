// Recordings of a page's own stream, in the shapes of the server's answers, for servers with and without
// recording.

import type { Page, Route } from "playwright-core";
import type { EventRecord, RecordingContent, SampleRecord, SessionInfo, StreamMessage } from "../src/protocol";

const NAME = "session-1.mcap";
const FOLDER = "recordings";

/** Answers the recording requests of pages that are loaded later, and returns the recorded samples. */
export async function record(page: Page, url: string): Promise<() => SampleRecord[]> {
  let on = false;
  let samples: SampleRecord[] = [];
  let events: EventRecord[] = [];
  page.on("websocket", (stream) => {
    stream.on("framereceived", ({ payload }) => {
      if (!on || typeof payload !== "string") return;
      const message = JSON.parse(payload) as StreamMessage;
      samples.push(...message.samples);
      events.push(...message.events);
    });
  });
  const seconds = () => (samples.at(-1)?.time_s ?? 0) - (samples[0]?.time_s ?? 0);
  const bytes = () => JSON.stringify(samples).length;
  const session = async () => (await (await fetch(`${url}api/session`)).json()) as SessionInfo;
  await page.route("**/api/session", async (route) => {
    const recording = { folder: FOLDER, name: on ? NAME : null, bytes: bytes(), seconds: seconds() };
    await route.fulfill({ json: { ...(await session()), recording } });
  });
  await page.route("**/api/record", async (route: Route) => {
    on = (route.request().postDataJSON() as { on: boolean }).on;
    if (on) [samples, events] = [[], []];
    await route.fulfill({ json: {} });
  });
  await page.route("**/api/recordings", (route) => {
    const one = { name: NAME, bytes: bytes(), start_s: samples[0]?.time_s ?? 0, seconds: seconds(), readings: samples.length };
    return route.fulfill({ json: samples.length === 0 ? [] : [one] });
  });
  await page.route(`**/api/recordings/${NAME}?*`, async (route) => {
    const content: RecordingContent = { channels: (await session()).channels, start_s: samples[0]!.time_s, seconds: seconds(), samples, events };
    await route.fulfill({ json: content });
  });
  return () => samples;
}
