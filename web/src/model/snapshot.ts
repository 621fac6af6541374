// One instant of the page, for all views of a frame.

import type { CalibrationRecord, EventRecord, SampleRecord, SessionInfo, StateRecord } from "../protocol";
import type { History } from "./history";
import type { Live } from "./live";
import type { Player } from "./player";
import type { TrailPoint } from "./trail";

export interface Span {
  readonly from_s: number;
  readonly to_s: number;
  /** Instant of a replay, marked by a line; null for a live session. */
  readonly head_s: number | null;
}

/** The page at one instant, independent of later readings. */
export interface Snapshot {
  readonly session: SessionInfo;
  readonly state: StateRecord | null;
  readonly live: SampleRecord | null;
  /** Displayed reading, live or of the replay. */
  readonly sample: SampleRecord | null;
  readonly trail: readonly (TrailPoint & { age: number })[];
  /** Readings minus baseline, in the units of the channels; null without a contact or baseline. */
  readonly deflections: readonly number[] | null;
  readonly untouched: readonly number[] | null;
  readonly calibration: CalibrationRecord | null;
  readonly events: readonly EventRecord[];
  /** Number of events; changes with every event. */
  readonly eventCount: number;
  readonly missed: number;
  /** Rows of the charts; those after `span.to_s` are not part of the snapshot. */
  readonly history: History;
  readonly span: Span;
}

export interface Scene {
  session: SessionInfo;
  live: Live;
  player: Player | null;
  calibration: CalibrationRecord | null;
  window_s: number;
  showsTrail: boolean;
}

export function takeSnapshot({ session, live, player, calibration, window_s, showsTrail }: Scene): Snapshot {
  const sample = player === null ? live.sample : player.sample();
  const baseline = player === null ? live.baseline : player.baseline;
  const trail = player === null ? live.trail : player.trail();
  return Object.freeze({
    session,
    state: live.state,
    live: live.sample,
    sample,
    trail: showsTrail ? trail.aged() : [],
    deflections: sample === null || sample.status === "no_contact" ? null : baseline.deflections(sample.reading),
    untouched: baseline.mean,
    calibration,
    events: live.events.slice(),
    eventCount: live.eventCount,
    missed: live.missed,
    history: player === null ? live.history : player.history,
    span: player === null ? liveSpan(live, window_s) : replaySpan(player),
  });
}

function liveSpan(live: Live, window_s: number): Span {
  const to_s = live.history.lastTime();
  return { from_s: to_s - window_s, to_s, head_s: null };
}

function replaySpan(player: Player): Span {
  return { from_s: player.start_s, to_s: player.start_s + Math.max(player.seconds, 0.1), head_s: player.start_s + player.head_s };
}
