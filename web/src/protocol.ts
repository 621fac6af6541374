// Records of `palpate serve`, as in docs/reference/server.md and the server's own documentation.

/** Position, force and uncertainty, as far as they are estimated. */
export interface ContactRecord {
  x_mm: number;
  y_mm?: number;
  force_n?: number;
  x_95_mm?: [number, number];
  y_95_mm?: [number, number];
  sd_mm?: number;
  sd_force_n?: number;
  /** Covariance of the position on a plane, xx, xy and yy; of the first contact of a sample. */
  covariance_mm2?: [number, number, number];
  force_95_n?: [number, number];
  trade_off?: string;
}

export type Status = "located" | "no_contact" | "ambiguous" | "outside_model" | "outside_surface";

/** A candidate place with its probability. */
export type ModeRecord = ContactRecord & { probability: number };

export interface EstimateRecord extends ContactRecord {
  status: Status;
  modes?: ModeRecord[];
  further?: ContactRecord[];
}

/** A reading, in the units of its channels, with its estimate. Times are seconds since 1970. */
export interface SampleRecord extends EstimateRecord {
  number: number;
  time_s: number;
  reading: number[];
}

export type ChannelState = "well" | "dead" | "saturated";

export interface StateRecord {
  source: string | null;
  rate_hz: number;
  touched: boolean;
  counters: { readings: number; bad_frames: Record<string, number>; lost_frames: number; gaps: number };
  channels: { state: ChannelState; range: [number, number] | null; noise_sd: number }[];
}

export type EventRecord = { time_s: number } & (
  | { event: "source_opened"; name: string }
  | { event: "source_lost"; why: string }
  | { event: "source_ended" }
  | { event: "gap"; seconds: number; lost_frames?: number }
  | { event: "clock_set"; by_s: number }
  | ({ event: "touch_down" | "move" | "second_contact" } & ContactRecord)
  | { event: "lift_off"; seconds: number }
  | { event: "outside_model" }
  | { event: "channel"; name: string; state: ChannelState }
  | { event: "tared" }
  | { event: "trouble"; text: string }
  | { event: "alarm"; name: string; text: string }
  | { event: "mark"; text: string }
);

export interface StreamMessage {
  state: StateRecord;
  samples: SampleRecord[];
  events: EventRecord[];
  missed: number;
}

/** Past of a session: ten samples a second of the last ten minutes, and the last events. */
export interface PastRecord {
  samples: SampleRecord[];
  events: EventRecord[];
}

export interface ChannelInfo {
  name: string;
  label: string;
  unit: string;
  measure: string;
  x_mm: number | null;
  y_mm?: number | null;
}

export interface SurfaceInfo {
  kind: string;
  length_mm: number;
  width_mm: number | null;
  supports: { at_mm: number; kind: string }[];
}

export interface LimitInfo {
  positions_mm: (number | [number, number])[];
  sd_mm: (number | null)[];
  force_n: number;
}

export interface SessionInfo {
  version: string;
  locator: { name: string; kind: string; description: string[] } | null;
  surface: SurfaceInfo | null;
  channels: ChannelInfo[];
  force: { known_n: number | null; unknown: boolean };
  tare: { available: boolean; follows: boolean; why?: string };
  limit: LimitInfo | null;
  source: string | null;
  recording: RecordingState | null;
  has_simulated: boolean;
  calibrates: boolean;
  /** True for a board without a rig. */
  brings_up: boolean;
}

/** Destination of recordings, and the name of a running one. */
export interface RecordingState {
  folder: string;
  name: string | null;
  bytes: number;
  seconds: number;
}

export interface RecordingInfo {
  name: string;
  bytes: number;
  /** Seconds since 1970; null for an empty recording. */
  start_s: number | null;
  seconds: number;
  readings: number;
}

export interface RecordingContent {
  channels: ChannelInfo[];
  start_s: number | null;
  seconds: number;
  samples: SampleRecord[];
  events: EventRecord[];
}

export type CalibrationPhase = "ready" | "pressing" | "pressed" | "fitting" | "assessing" | "done" | "checking" | "setting_up";
export type Waiting = "untouched" | "press" | "rest" | "release" | "nothing";
export type CalibrationStep =
  | "begin" | "redo" | "skip" | "untouched" | "stop" | "finish" | "strike" | "check" | "dry_run" | "set_up" | "jog" | "touch_off";
export type Axis = "x" | "y" | "z";

/**
 * Details of a step: statements of the operator with `begin`, number of the press with `strike`, axis
 * and distance with `jog`.
 */
export interface StepDetails {
  placement_mm?: number;
  second_force_n?: number;
  force_is_known?: boolean;
  press?: number;
  axis?: Axis;
  by_mm?: number;
}

export interface PlaceRecord {
  x_mm: number;
  y_mm?: number;
  force_n?: number;
  taken: number;
  left: number;
  spread_percent: number | null;
}

export interface CalibrationRecord {
  phase: CalibrationPhase;
  waiting: Waiting;
  next: PlaceRecord | null;
  taken: number;
  left: number;
  places: PlaceRecord[];
  last_percent: number | null;
  source: string | null;
  readings: number;
  reading: number[];
  bad_frames: number;
  presses: string;
  /** Standard deviation of the pressed place about the requested one; null if it is unknown. */
  placement_mm: number | null;
  /** The weight of all presses, if a second one is requested. */
  single_weight_n: number | null;
  problem: string | null;
  hint: string | null;
  machine: MachineRecord | null;
  outcome: CalibrationOutcome | null;
  check: CheckRecord | null;
  can_check: boolean;
  /** True if a machine can be set up: dry run, jogs, touch-off. */
  can_set_up: boolean;
}

export interface PressRecord {
  press: number;
  x_mm: number;
  y_mm?: number;
  force_n: number | null;
  deviation_percent: number | null;
  held_out_mm: number | null;
  /** Seconds before the press was taken, and the distance from the untouched reading in %. */
  trace: [number, number][];
}

/** A check of the locator at new places. */
export interface CheckRecord {
  presses: string;
  places: { x_mm: number; y_mm?: number; estimate_x_mm: number; estimate_y_mm?: number; error_mm: number; covered: boolean | null }[];
  median_mm: number;
  mean_mm: number;
  covered: number | null;
  placement_mm: number | null;
}

export type Motion = "blind" | "homing" | "travelling" | "pressing" | "lifting" | "up" | "down";

export interface MachineRecord {
  url: string;
  firmware: string | null;
  /** Effect of a stop that does not act at once; null if it does. */
  stopping: string | null;
  /** True from the greeting until the final lift of the finger. */
  runs: boolean;
  motion: Motion | null;
  /** Target place on the surface. */
  x_mm: number | null;
  y_mm: number | null;
  depth_mm: number | null;
  force_n: number | null;
  left_s: number | null;
  /** Position in its own axes, after the last move. */
  at_mm: [number, number, number] | null;
  /** Height of a touch-off. */
  found_touch_mm: number | null;
  moves: MovesRecord;
}

/** Range and speed of a machine's moves, in its own axes. */
export interface MovesRecord {
  x_mm: [number, number];
  y_mm: [number, number];
  travel_z_mm: number;
  touch_z_mm: number;
  depths_mm: number[];
  travel_mm_per_s: number;
  press_mm_per_s: number;
  load_cell: string | null;
  force_limit_n: number | null;
}

export interface CalibrationOutcome {
  locator: string;
  presses: number;
  folds: number | null;
  median_mm: number | null;
  mean_mm: number | null;
  gain_percent: number | null;
  stop_percent: number | null;
  remarks: string[];
}

/** A board without a rig. */
export interface BringUpRecord {
  from: string;
  /** For serial ports. */
  port: string | null;
  baud: number | null;
  ports: { name: string; device: string | null }[];
  source: string | null;
  problem: string | null;
  bytes: number;
  readings: number;
  rate_hz: number;
  bad_frames: Record<string, number>;
  channels: { name: string; now: number | null; range: [number, number] | null }[];
  /** True if the board names its values. */
  named: boolean;
  lines: { time_s: number; text: string; reads: boolean }[];
}

/** Answers of the form from which the server makes a rig. */
export interface RigForm {
  file: string;
  channels: string[];
  length_mm: number;
  width_mm: number | null;
  places: number[];
  repeats: number;
  /** Force of every press; null if it is unknown. */
  force_n: number | null;
  second_force_n: number | null;
  /** Standard deviation of the pressed place about the requested one. */
  placement_mm: number | null;
  /** Place of each sensor: along the length and, on a plane, across it. */
  sensor_places_mm: number[][] | null;
  force_is_known: boolean;
  overwrite: boolean;
  write: boolean;
}

export interface MadeRigRecord {
  file: string;
  text: string;
  /** Command that calibrates it later. */
  command: string;
  written: boolean;
  /** Files that would be replaced. */
  exists: string[];
}

export interface AlarmFile {
  text: string;
  /** File of the text; null if it is lost with the server. */
  file: string | null;
}
