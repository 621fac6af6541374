// Stream of the session, reopened after a loss.

import { api } from "./api";
import type { StreamMessage } from "./protocol";

export type Connection = "connecting" | "open" | "lost";

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 5_000;
/**
 * A session sends sixty messages a second. After this silence, the page checks the server: without a
 * source it sends none.
 */
const SILENCE_MS = 3_000;

/** Milliseconds before an attempt, from 1: doubled each time, up to five seconds. */
export function wait_ms(attempt: number): number {
  return Math.min(FIRST_WAIT_MS * 2 ** (attempt - 1), LONGEST_WAIT_MS);
}

/** Opens the stream, and keeps it open for the life of the page. */
export function openStream(take: (message: StreamMessage) => void, tell: (connection: Connection) => void): void {
  let attempt = 0;
  const open = () => {
    const socket = api.stream();
    let heard = performance.now();
    const watch = setInterval(() => {
      if (performance.now() - heard < SILENCE_MS) return;
      heard = performance.now();
      api.session().catch(() => lost());
    }, 1_000);
    let over = false;
    const lost = () => {
      if (over) return;
      over = true;
      clearInterval(watch);
      socket.close();
      attempt += 1;
      tell("lost");
      setTimeout(open, wait_ms(attempt));
    };
    socket.onopen = () => {
      attempt = 0;
      tell("open");
    };
    socket.onmessage = (event) => {
      heard = performance.now();
      if (!over && typeof event.data === "string") take(JSON.parse(event.data) as StreamMessage);
    };
    socket.onclose = lost;
    socket.onerror = lost;
  };
  tell("connecting");
  open();
}
