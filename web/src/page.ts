// The page: what the session sends and a person does, and what is shown of it.

import { api, ApiError } from "./api";
import { need, setText } from "./dom";
import { startKeys } from "./keys";
import { Live } from "./model/live";
import { Pace } from "./model/pace";
import type { Player } from "./model/player";
import { CalibrationPanel } from "./panel/calibration";
import { announce, Events } from "./panel/events";
import { Health } from "./panel/health";
import { writeNumbers } from "./panel/numbers";
import { listRecordings } from "./panel/recordings";
import { Replay } from "./panel/replay";
import type { SessionInfo, StreamMessage } from "./protocol";
import type { Connection } from "./stream";
import { Budget } from "./view/budget";
import { begin } from "./view/canvas";
import { Charts } from "./view/charts";
import { LineView } from "./view/line";
import { onTheme } from "./view/palette";
import { drawPlane } from "./view/plane";
import { describe, isPlane, type Shown } from "./view/surface";
import { bytes, PLAIN_MARK, seconds } from "./words";

/** Milliseconds between two drawings: numbers are to be read, and charts cost most. */
const SURFACE_MS = 16;
const CHARTS_MS = 66;
const NUMBERS_MS = 100;
const HEALTH_MS = 250;
/** Motion for people who ask for less of it. */
const REDUCED_MS = 200;
/** Without a reading for so long the page says so. */
const SILENT_S = 2;

/** Views of a session; made anew for another one. */
interface Views {
  line: LineView;
  charts: Charts;
  budget: Budget;
  health: Health;
  events: Events;
}

export class Page {
  private session: SessionInfo | null = null;
  private setup = "";
  private live = new Live(0);
  private views: Views | null = null;
  private replay = new Replay(() => this.replayClosed());
  private calibration = new CalibrationPanel(
    () => this.calibrationChanged(),
    (error) => this.failed(error),
  );
  private connection: Connection = "connecting";
  private paused = false;
  private shown: Shown | null = null;
  private heard_ms = performance.now();
  private pace = new Pace();
  private dirty = true;
  private reduced = matchMedia("(prefers-reduced-motion: reduce)");

  start(): void {
    need("tare").addEventListener("click", () => this.tare());
    need("mark").addEventListener("click", () => this.openMark());
    need("record").addEventListener("click", () => this.record());
    need("pause").addEventListener("click", () => this.pause());
    need("simulate").addEventListener("click", () => this.simulate());
    need("help").addEventListener("click", () => need<HTMLDialogElement>("help-dialog").showModal());
    need("window").addEventListener("change", () => this.pace.all());
    need("mark-form").addEventListener("submit", () => this.mark());
    need("mark-cancel").addEventListener("click", () => need<HTMLDialogElement>("mark-dialog").close());
    startKeys({
      t: () => this.tare(),
      m: () => this.openMark(),
      r: () => (this.calibration.guides ? this.calibration.key("redo") : this.record()),
      b: () => this.calibration.key("begin"),
      s: () => this.calibration.key("skip"),
      q: () => this.calibration.key("stop"),
      f: () => this.calibration.key("finish"),
      c: () => this.calibration.key("check"),
      space: () => (this.replay.player === null ? this.pause() : this.replay.toggle()),
      "?": () => need<HTMLDialogElement>("help-dialog").showModal(),
      Escape: () => this.replay.close(),
    });
    onTheme(() => (this.dirty = true));
    new ResizeObserver(() => (this.dirty = true)).observe(need("surface"));
    setInterval(() => this.everySecond(), 1_000);
    let last = performance.now();
    const frame = (now: number) => {
      this.draw(now, (now - last) / 1000);
      last = now;
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  // What the server says.

  connected(connection: Connection): void {
    this.connection = connection;
    const chip = need("connection");
    chip.dataset.state = connection;
    setText(chip, { connecting: "Connecting…", open: "Connected", lost: "Connection lost" }[connection]);
    if (connection === "open") {
      this.heard_ms = performance.now();
      void this.ask();
    }
    this.writeBanner();
  }

  take(message: StreamMessage): void {
    const told = this.live.take(message);
    if (message.samples.length > 0) {
      this.heard_ms = performance.now();
      document.body.classList.remove("unread");
    }
    announce(told);
    if (told.some((event) => ["source_opened", "source_lost", "source_ended", "tared"].includes(event.event))) void this.ask();
    if (told.some((event) => event.event === "tared")) this.notice("Tared: the baseline was taken anew.");
  }

  /** Asks what session it is; new views for another one. */
  private async ask(): Promise<void> {
    try {
      const session = await api.session();
      this.session = session;
      const setup = JSON.stringify([session.locator, session.surface, session.channels, session.force, session.limit]);
      if (setup !== this.setup) {
        this.setup = setup;
        this.live = new Live(session.channels.length);
        this.shown = null;
        this.views = { line: new LineView(), charts: new Charts(session), budget: new Budget(session), health: new Health(session), events: new Events() };
        need("surface").classList.toggle("plane", isPlane(session));
        await this.list();
      }
      this.writeSession(session);
    } catch (error) {
      this.failed(error);
    }
  }

  private writeSession(session: SessionInfo): void {
    const locator = session.locator;
    setText(need("locator"), locator === null ? "no locator" : `${locator.name} · ${locator.kind}`);
    need("locator").title = locator?.description.join("\n") ?? "";
    if (session.calibrates) this.calibration.follow();
    need("welcome").hidden = session.source !== null || (session.calibrates && session.locator === null);
    setText(need("welcome-title"), this.live.sample === null ? "No source of readings yet" : "The source has ended");
    need("simulate").hidden = need("welcome-simulated").hidden = !session.has_simulated;
    const tare = need<HTMLButtonElement>("tare");
    tare.disabled = !session.tare.available;
    tare.title = session.tare.available ? "Take the baseline anew; nothing may touch" : (session.tare.why ?? "This locator cannot be tared");
    const record = need<HTMLButtonElement>("record");
    record.disabled = session.recording === null;
    record.title = session.recording === null ? "palpate serve … --record DIR says where recordings go" : `Recordings go to ${session.recording.folder}`;
    const name = session.recording?.name ?? null;
    record.setAttribute("aria-pressed", String(name !== null));
    const words = name === null ? "Record" : "Stop recording";
    record.replaceChildren(`${words} `, Object.assign(document.createElement("kbd"), { textContent: "r" }));
    const progress = name === null ? "" : `● Recording ${name}: ${seconds(session.recording!.seconds)}, ${bytes(session.recording!.bytes)}`;
    setText(need("recording-now"), progress);
  }

  private everySecond(): void {
    const records = this.session?.recording?.name != null;
    // A session that is silent may have ended, or another have begun.
    if (this.connection === "open" && (records || this.silent_s() > SILENT_S)) void this.ask();
    this.writeBanner();
  }

  /** Seconds since the last reading came. */
  private silent_s(): number {
    return (performance.now() - this.heard_ms) / 1000;
  }

  private writeBanner(): void {
    const banner = need("banner");
    const words = this.bannerWords();
    document.body.classList.toggle("stale", words !== "" && this.replay.player === null);
    setText(banner, words);
    banner.hidden = words === "";
  }

  private bannerWords(): string {
    // Words that do not change while they hold: a screen reader says every change.
    if (this.connection === "lost") return "The connection to palpate serve is lost: what is shown is not live. Trying again.";
    const expected = this.connection === "open" && this.session !== null && this.session.source !== null;
    if (!expected || this.silent_s() < SILENT_S) return "";
    if (this.live.state?.source == null) return "The source is away and looked for again: what is shown is not live.";
    return "The source sends no readings: what is shown is not live.";
  }

  /** A calibration that guides has no estimates: what shows them is left out, and the next place is drawn. */
  private calibrationChanged(): void {
    document.body.classList.toggle("calibrating", this.calibration.guides);
    this.dirty = true;
    // The session begins as soon as there is a locator.
    if (!this.calibration.guides && this.session?.locator === null) void this.ask();
  }

  // What a person does.

  private async act(what: () => Promise<void>, done: string): Promise<void> {
    try {
      await what();
      if (done !== "") this.notice(done);
    } catch (error) {
      this.failed(error);
    }
  }

  private tare(): void {
    if (need<HTMLButtonElement>("tare").disabled) return this.notice(need("tare").title);
    void this.act(api.tare, "Taring: keep off the surface…");
  }

  private openMark(): void {
    need<HTMLInputElement>("mark-text").value = "";
    need<HTMLDialogElement>("mark-dialog").showModal();
  }

  private mark(): void {
    const text = need<HTMLInputElement>("mark-text").value.trim();
    void this.act(() => api.mark(text === "" ? PLAIN_MARK : text), text === "" ? "Marked." : `Marked: ${text}`);
  }

  private record(): void {
    if (need<HTMLButtonElement>("record").disabled) return this.notice(need("record").title);
    const name = this.session?.recording?.name ?? null;
    void this.act(async () => {
      await api.record(name === null);
      await this.ask();
      if (name === null) return this.notice("Recording.");
      this.notice(`Recorded ${name}.`);
      await this.list();
    }, "");
  }

  private pause(): void {
    this.paused = !this.paused;
    const button = need("pause");
    button.setAttribute("aria-pressed", String(this.paused));
    button.replaceChildren(this.paused ? "Go on " : "Pause ", Object.assign(document.createElement("kbd"), { textContent: "space" }));
    document.body.classList.toggle("paused", this.paused);
    this.notice(this.paused ? "Paused: readings are still taken and recorded. Drag over a chart to look closer." : "");
  }

  private simulate(): void {
    const button = need<HTMLButtonElement>("simulate");
    button.disabled = true;
    void this.act(async () => {
      await api.simulate();
      await this.ask();
      need("main").focus();
    }, "").finally(() => (button.disabled = false));
  }

  private async list(): Promise<void> {
    if (this.session === null) return;
    await listRecordings(this.session, (name) => void this.act(() => this.openReplay(name), ""));
  }

  private async openReplay(name: string): Promise<void> {
    await this.replay.open(name);
    this.pace.all();
    document.body.classList.remove("unread");
    document.body.classList.add("replaying");
    this.writeBanner();
    this.notice("A replay: surface, numbers and charts are not live. Channels, source and events are.");
  }

  private replayClosed(): void {
    document.body.classList.remove("replaying");
    this.dirty = true;
    this.notice("");
  }

  private notice(words: string): void {
    setText(need("notice"), words);
  }

  private failed(error: unknown): void {
    const words = error instanceof ApiError ? error.message : "The server does not answer.";
    this.notice(words);
  }

  // What is shown.

  private draw(now: number, elapsed_s: number): void {
    if (this.session === null || this.views === null) return;
    const player = this.replay.player;
    if (player?.playing) {
      player.advance(elapsed_s);
      this.replay.write();
    }
    this.pace.frame(1000 * elapsed_s);
    const due = (part: string, every_ms: number) =>
      this.pace.due(part, now, this.reduced.matches ? Math.max(every_ms, REDUCED_MS) : every_ms);
    if (due("health", HEALTH_MS)) {
      this.views.health.write(this.live);
      this.views.events.write(this.live);
      if (this.shown !== null) this.views.budget.draw(this.shown.sample);
    }
    const frozen = this.paused && player === null;
    if (!due("surface", SURFACE_MS) && !this.dirty) return;
    if (this.shown === null || !frozen) this.shown = this.instant(this.session, player);
    else if (!this.dirty) return;
    this.drawSurface(this.views, this.shown);
    if (due("numbers", NUMBERS_MS) || this.dirty) {
      writeNumbers(this.session, this.shown.sample);
      need("surface").setAttribute("aria-label", describe(this.shown));
      this.writeSurfaceNote(this.views, this.shown);
    }
    this.dirty = false;
    if (!frozen && due("charts", CHARTS_MS)) this.drawCharts(this.views, player);
  }

  private instant(session: SessionInfo, player: Player | null): Shown {
    const { baseline, sample, trail } =
      player === null ? this.live : { baseline: player.baseline, sample: player.sample(), trail: player.trail() };
    return {
      session,
      sample,
      trail: this.reduced.matches ? [] : trail.aged(),
      calibration: this.calibration.guides ? this.calibration.state : null,
      deflections: sample === null || sample.status === "no_contact" ? null : baseline.deflections(sample.reading),
    };
  }

  private drawSurface(views: Views, shown: Shown): void {
    const frame = begin(need<HTMLCanvasElement>("surface"));
    if (frame === null) return;
    if (isPlane(shown.session)) drawPlane(frame, shown);
    else views.line.draw(frame, shown);
  }

  private writeSurfaceNote(views: Views, shown: Shown): void {
    const plane = isPlane(shown.session);
    const surface = shown.session.surface;
    const across = plane ? ` × ${surface?.width_mm} mm` : "";
    setText(need("surface-note"), surface === null ? "" : `${surface.kind}, ${surface.length_mm} mm${across}, to scale`);
    if (shown.calibration !== null) {
      setText(need("surface-legend"), "■ sensors · ○ places to press · ● places that were pressed · the arrow or the cross shows the next one");
      return;
    }
    const parts = ["■ sensors", plane ? "● contact, with the ellipse that holds 95 %" : "● contact, with its 95 % interval", "◌ other places that the reading fits"];
    const times = views.line.exaggeration;
    if (!plane && times !== null) parts.push(`deflection as measured, ${formatTimes(times)} × exaggerated, a spline between the sensors`);
    setText(need("surface-legend"), parts.join(" · "));
  }

  private drawCharts(views: Views, player: Player | null): void {
    if (player !== null) {
      const to_s = player.start_s + Math.max(player.seconds, 0.1);
      views.charts.draw(player.history, { from_s: player.start_s, to_s, head_s: player.start_s + player.head_s }, player.baseline.mean);
      return;
    }
    const to_s = this.live.history.lastTime();
    if (Number.isNaN(to_s)) return;
    const from_s = to_s - Number(need<HTMLSelectElement>("window").value);
    views.charts.draw(this.live.history, { from_s, to_s, head_s: null }, this.live.baseline.mean);
  }
}

function formatTimes(times: number): string {
  return times >= 1 ? String(Math.round(times)) : String(Number(times.toPrecision(1)));
}

