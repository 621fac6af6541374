// The page: state of the session, actions of the user, and display.

import { api, ApiError } from "./api";
import { need, remember, remembered, save, setText } from "./dom";
import { startKeys } from "./keys";
import { Live } from "./model/live";
import { Pace } from "./model/pace";
import { takeSnapshot, type Snapshot } from "./model/snapshot";
import { csv } from "./model/summary";
import { Alarms } from "./panel/alarms";
import { BringUpPanel } from "./panel/bring_up";
import { CalibrationPanel } from "./panel/calibration";
import { announce, Events } from "./panel/events";
import { Health } from "./panel/health";
import { writeNumbers } from "./panel/numbers";
import { isSimulated, pill, SILENT_S } from "./panel/pill";
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
import { describe, isPlane } from "./view/surface";
import { badFrameWords, bytes, PLAIN_MARK, seconds } from "./words";

/** Milliseconds between two snapshots; all views of a frame show one snapshot. */
const SNAPSHOT_MS = 33;
/** Milliseconds between two updates of facts without an estimate: age, rate, counts. */
const FACTS_MS = 250;
/** Milliseconds between snapshots with reduced motion. */
const REDUCED_MS = 200;

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
  private bringUp = new BringUpPanel(() => void this.ask());
  private alarms = new Alarms();
  private connection: Connection = "connecting";
  private paused = false;
  private shown: Snapshot | null = null;
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
    need("export-csv").addEventListener("click", () => this.exportCsv());
    need("export-png").addEventListener("click", () => this.exportPng());
    need("simulated-close").addEventListener("click", () => {
      remember("simulated", "seen");
      need("simulated").hidden = true;
    });
    need("mark-form").addEventListener("submit", () => this.mark());
    need("mark-cancel").addEventListener("click", () => need<HTMLDialogElement>("mark-dialog").close());
    startKeys({
      t: () => this.tare(),
      m: () => this.openMark(),
      r: () => (this.calibration.guides ? this.calibration.key("redo") : this.record()),
      b: () => this.calibration.key("begin"),
      s: () => this.calibration.key("skip"),
      u: () => this.calibration.key("untouched"),
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

  connected(connection: Connection): void {
    this.connection = connection;
    if (connection === "open") {
      this.heard_ms = performance.now();
      void this.ask();
    }
    this.writeBanner();
  }

  take(message: StreamMessage): void {
    const waited = this.live.state?.source == null;
    const told = this.live.take(message);
    this.alarms.take(told);
    if (waited !== (message.state.source === null)) this.writeBanner();
    if (message.samples.length > 0) {
      this.heard_ms = performance.now();
      document.body.classList.remove("unread");
    }
    announce(told);
    if (told.some((event) => ["source_opened", "source_lost", "source_ended", "tared"].includes(event.event))) void this.ask();
    if (told.some((event) => event.event === "tared")) this.notice("Tared: the baseline was measured again.");
  }

  /** Requests the session; creates new views for another one. */
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
        const live = this.live;
        void api.past().then(
          (past) => {
            live.takePast(past);
            if (past.samples.length > 0) document.body.classList.remove("unread");
          },
          (error: unknown) => this.failed(error),
        );
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
    if (session.brings_up) this.bringUp.follow();
    else this.bringUp.end();
    if (session.calibrates) this.calibration.follow();
    need("simulated").hidden = !isSimulated(session) || remembered("simulated") !== null;
    need("welcome").hidden = session.source !== null || session.locator === null;
    const alarms = need<HTMLButtonElement>("alarms");
    alarms.disabled = session.locator === null;
    alarms.title = session.locator === null ? "Alarms need a locator" : "Rules that raise alarms";
    setText(need("welcome-title"), this.live.sample === null ? "No source of readings yet" : "The source has ended");
    need("simulate").hidden = need("welcome-simulated").hidden = !session.has_simulated;
    const tare = need<HTMLButtonElement>("tare");
    tare.disabled = !session.tare.available;
    tare.title = session.tare.available ? "Measure the baseline again; the surface must be untouched" : (session.tare.why ?? "This locator cannot be tared");
    const record = need<HTMLButtonElement>("record");
    record.disabled = session.recording === null;
    record.title = session.recording === null ? "Set the folder of recordings with palpate serve … --record DIR" : `Recordings go to ${session.recording.folder}`;
    const name = session.recording?.name ?? null;
    record.setAttribute("aria-pressed", String(name !== null));
    const words = name === null ? "Record" : "Stop recording";
    record.replaceChildren(`${words} `, Object.assign(document.createElement("kbd"), { textContent: "r" }));
    const progress = name === null ? "" : `● Recording ${name}: ${seconds(session.recording!.seconds)}, ${bytes(session.recording!.bytes)}`;
    setText(need("recording-now"), progress);
  }

  private everySecond(): void {
    const records = this.session?.recording?.name != null;
    // A silent session may have ended, or another may have begun.
    if (this.connection === "open" && (records || this.silent_s() > SILENT_S)) void this.ask();
    this.writeBanner();
  }

  private silent_s(): number {
    return (performance.now() - this.heard_ms) / 1000;
  }

  private writeBanner(): void {
    const { state, words: source } = pill(this.connection, this.session, this.live.state, this.silent_s());
    const chip = need("connection");
    chip.dataset.state = state;
    setText(chip, source);
    const banner = need("banner");
    const words = this.bannerWords();
    document.body.classList.toggle("stale", words !== "" && this.replay.player === null);
    setText(banner, words);
    banner.hidden = words === "";
  }

  private bannerWords(): string {
    // Words that do not change while a state lasts: a screen reader announces every change.
    if (this.connection === "lost") return "The connection to palpate serve is lost: what is shown is not live. Trying again.";
    const expected = this.connection === "open" && this.session !== null && this.session.source !== null;
    if (!expected || this.silent_s() < SILENT_S) return "";
    if (this.live.state?.source == null) {
      const waits = (this.live.state?.counters.readings ?? 0) === 0;
      return waits ? "The source is not there yet; it is opened as soon as it is." : "The source is disconnected, and palpate tries to reconnect: the values shown are not live.";
    }
    // A word for the most frequent cause, which does not change with every frame.
    const bad = Object.entries(this.live.state?.counters.bad_frames ?? {}).sort(([, one], [, other]) => other - one);
    const cause = bad[0]?.[0];
    if (cause === undefined) return "The source sends no readings: what is shown is not live.";
    return `The source sends frames that are not readings (${badFrameWords(cause)}): what is shown is not live.`;
  }

  /** A guided calibration has no estimates: their display is hidden, and the next place is drawn. */
  private calibrationChanged(): void {
    document.body.classList.toggle("calibrating", this.calibration.guides);
    this.dirty = true;
    // The session begins as soon as there is a locator.
    if (!this.calibration.guides && this.session?.locator === null) void this.ask();
  }

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

  private exportCsv(): void {
    if (this.session === null || this.shown === null) return;
    save(`${this.exportName()}.csv`, new Blob([csv(this.session, this.shown.history, this.shown.span)], { type: "text/csv" }));
  }

  private exportPng(): void {
    this.views?.charts.png().toBlob((png) => {
      if (png === null) return this.notice("This browser makes no picture of the charts.");
      save(`${this.exportName()}.png`, png);
    });
  }

  /** Name of an exported file: date and time of the last reading, by the browser's clock. */
  private exportName(): string {
    const date = new Date((this.shown?.span.to_s ?? 0) * 1000);
    const two = (part: number) => String(part).padStart(2, "0");
    const day = `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())}`;
    return `palpate-${day}-${two(date.getHours())}${two(date.getMinutes())}${two(date.getSeconds())}`;
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

  private draw(now: number, elapsed_s: number): void {
    if (this.session === null || this.views === null) return;
    const player = this.replay.player;
    if (player?.playing) {
      player.advance(elapsed_s);
      this.replay.write();
    }
    this.pace.frame(1000 * elapsed_s);
    const every_ms = this.reduced.matches ? REDUCED_MS : SNAPSHOT_MS;
    if (!this.pace.due("snapshot", now, every_ms) && !this.dirty) return;
    this.dirty = false;
    const frozen = this.paused && player === null;
    if (this.shown === null || !frozen) this.shown = this.snapshot(this.session);
    this.show(this.views, this.shown, frozen);
    if (this.pace.due("facts", now, FACTS_MS)) {
      const live = frozen ? this.snapshot(this.session) : this.shown;
      need("surface").setAttribute("aria-label", describe(this.shown));
      this.views.health.writeFacts(live);
      this.views.events.write(live);
    }
  }

  private snapshot(session: SessionInfo): Snapshot {
    return takeSnapshot({
      session,
      live: this.live,
      player: this.replay.player,
      calibration: this.calibration.guides ? this.calibration.state : null,
      window_s: Number(need<HTMLSelectElement>("window").value),
      showsTrail: !this.reduced.matches,
    });
  }

  private show(views: Views, shown: Snapshot, frozen: boolean): void {
    this.drawSurface(views, shown);
    writeNumbers(shown);
    this.writeSurfaceNote(views, shown);
    views.budget.draw(shown);
    views.health.writeChannels(shown);
    // A user may have selected a part of a frozen chart.
    if (!frozen) views.charts.draw(shown);
  }

  private drawSurface(views: Views, shown: Snapshot): void {
    const frame = begin(need<HTMLCanvasElement>("surface"));
    if (frame === null) return;
    if (isPlane(shown.session)) drawPlane(frame, shown);
    else views.line.draw(frame, shown);
  }

  private writeSurfaceNote(views: Views, shown: Snapshot): void {
    const plane = isPlane(shown.session);
    const surface = shown.session.surface;
    const across = plane ? ` × ${surface?.width_mm} mm` : "";
    setText(need("surface-note"), surface === null ? "" : `${surface.kind}, ${surface.length_mm} mm${across}, to scale`);
    if (shown.calibration !== null) {
      setText(need("surface-legend"), "■ sensors · ○ places to press · ● places that were pressed · the arrow or the cross shows the next one");
      return;
    }
    const parts = ["■ sensors", plane ? "● contact, with its 95 % ellipse" : "● contact, with its 95 % interval", "◌ other places that the reading fits"];
    const times = views.line.exaggeration;
    if (!plane && times !== null) parts.push(`deflection as measured, ${formatTimes(times)} × exaggerated, a spline between the sensors`);
    setText(need("surface-legend"), parts.join(" · "));
  }
}

function formatTimes(times: number): string {
  return times >= 1 ? String(Math.round(times)) : String(Number(times.toPrecision(1)));
}

