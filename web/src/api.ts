// Requests to `palpate serve`, at the origin of the page.

import type {
  AlarmFile,
  BringUpRecord,
  CalibrationRecord,
  CalibrationStep,
  MadeRigRecord,
  PastRecord,
  PressRecord,
  RecordingContent,
  RecordingInfo,
  RigForm,
  SessionInfo,
  StepDetails,
} from "./protocol";

/** An error answer of the server: message and remedy. */
export class ApiError extends Error {
  constructor(
    readonly status: number,
    words: string,
    readonly help: string | null,
    /** Invalid field of a form. */
    readonly field: string | null = null,
  ) {
    super(help === null ? words : `${words}: ${help}`);
  }
}

/** Token in the page's address; only servers beyond loopback have one. */
const token = new URLSearchParams(location.search).get("token");

const TIMEOUT_MS = 10_000;

async function request(path: string, init: RequestInit): Promise<Response> {
  const headers = new Headers(init.headers);
  if (token !== null) headers.set("Authorization", `Bearer ${token}`);
  const response = await fetch(`api/${path}`, { ...init, headers, signal: AbortSignal.timeout(TIMEOUT_MS) });
  if (response.ok) return response;
  const body: unknown = await response.json().catch(() => null);
  const { error, help, field } = (body ?? {}) as { error?: string; help?: string; field?: string };
  throw new ApiError(response.status, error ?? `the server answered ${response.status}`, help ?? null, field ?? null);
}

async function get<T>(path: string): Promise<T> {
  return (await (await request(path, {})).json()) as T;
}

async function post(path: string, body: object): Promise<Response> {
  return request(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
}

export const api = {
  past: () => get<PastRecord>("history"),
  bringUp: () => get<BringUpRecord>("bring-up"),
  choosePort: async (port: string | null, baud: number) => (await (await post("bring-up", { port, baud })).json()) as BringUpRecord,
  makeRig: async (form: RigForm) => (await (await post("rig", form)).json()) as MadeRigRecord,
  alarms: () => get<AlarmFile>("alarms"),
  setAlarms: async (text: string) => (await (await post("alarms", { text })).json()) as AlarmFile,
  session: () => get<SessionInfo>("session"),
  recordings: () => get<RecordingInfo[]>("recordings"),
  recording: (name: string, points: number) =>
    get<RecordingContent>(`recordings/${encodeURIComponent(name)}?points=${points}`),
  tare: async () => void (await post("tare", {})),
  mark: async (text: string) => void (await post("mark", { text })),
  record: async (on: boolean) => void (await post("record", { on })),
  calibration: () => get<CalibrationRecord>("calibration"),
  calibrate: async (step: CalibrationStep, details: StepDetails = {}) => (await (await post("calibration", { step, ...details })).json()) as CalibrationRecord,
  presses: () => get<PressRecord[]>("calibration/presses"),
  emergencyStop: async () => void (await post("emergency-stop", {})),
  simulate: async () => void (await post("source", { url: "simulated" })),
  recordingFile: (name: string) => withToken(`api/recordings/${encodeURIComponent(name)}/file`),
  stream: () => {
    const url = new URL(withToken("api/stream"), location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    return new WebSocket(url);
  },
};

function withToken(path: string): string {
  return token === null ? path : `${path}?token=${encodeURIComponent(token)}`;
}
