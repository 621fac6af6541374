// State of connection and source in two words.

import type { SessionInfo, StateRecord } from "../protocol";
import type { Connection } from "../stream";

/** Time without a reading after which the source is silent, in seconds. */
export const SILENT_S = 2;

export interface Pill {
  /** Selects the colour. */
  state: "good" | "wait" | "bad" | "simulated";
  words: string;
}

export function pill(connection: Connection, session: SessionInfo | null, state: StateRecord | null, silent_s: number): Pill {
  if (connection === "lost") return { state: "bad", words: "Connection lost" };
  if (connection === "connecting" || session === null) return { state: "wait", words: "Connecting…" };
  if (session.brings_up) return { state: "wait", words: "No rig yet" };
  if (session.calibrates && session.source === null) return { state: "wait", words: "Calibration" };
  if (session.source === null) return { state: "bad", words: "No source" };
  if (state === null) return { state: "wait", words: "Waiting for the source" };
  if (state.source === null) {
    return state.counters.readings === 0 ? { state: "wait", words: "Waiting for the source" } : { state: "bad", words: "Source lost" };
  }
  if (silent_s > SILENT_S) {
    return state.counters.readings === 0 ? { state: "wait", words: "Waiting for readings" } : { state: "bad", words: "Source silent" };
  }
  if (isSimulated(session)) return { state: "simulated", words: "Simulated" };
  if (session.source.startsWith("file:")) return { state: "good", words: "Recording" };
  return { state: "good", words: "Live" };
}

export function isSimulated(session: SessionInfo): boolean {
  return session.source === "simulated" || session.source?.startsWith("simulated:") === true;
}
