import { expect, test, vi } from "vitest";

vi.mock("../src/api", () => ({ api: {} }));
const { wait_ms } = await import("../src/stream");

test("waits double up to five seconds", () => {
  expect([1, 2, 3, 4, 5, 6, 60].map(wait_ms)).toEqual([250, 500, 1000, 2000, 4000, 5000, 5000]);
});
