use super::body::{ErrorAnswer, JsonAnswer, JsonBody};
use super::bring_up::{BringUpError, BringUpRecord};
use super::calibration::{CalibrationRecord, CalibratorError};
use super::guard::{Access, EMERGENCY_STOP, Guard, guarded};
use super::live::{Live, LiveError};
use super::press_records::PressRecord;
use super::rig_maker::{NewRigRecord, RigForm, RigFormError};
use super::session_info::SessionInfo;
use super::{page, stream};
use crate::calibration::{SetUpTask, Statements};
use crate::input::Command;
use crate::recording::{Excerpt, RecordingError, RecordingSummary};
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{DefaultBodyLimit, Path, Query, State};
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::http::{Method, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get, post};
use axum::{Router, middleware};
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;

const MOST_BYTES: usize = 1 << 16;
const MOST_OF_A_MARK: usize = 200;

type Answer = Result<JsonAnswer<Value>, ErrorAnswer>;

/// All routes, guarded.
pub fn router(access: Access, live: Arc<Live>) -> Router {
    let guard = Arc::new(Guard::new(access));
    Router::new()
        .route("/api/session", get(session))
        .route("/api/stream", get(stream::stream))
        .route("/api/history", get(history))
        .route("/api/tare", post(tare))
        .route("/api/mark", post(mark))
        .route("/api/source", post(source))
        .route("/api/record", post(record))
        .route("/api/alarms", get(alarms).post(set_alarms))
        .route("/api/bring-up", get(bring_up).post(choose_port))
        .route("/api/rig", post(make_rig))
        .route("/api/calibration", get(calibration).post(calibrate))
        .route("/api/calibration/presses", get(calibration_presses))
        .route(EMERGENCY_STOP, post(emergency_stop))
        .route("/api/recordings", get(recordings))
        .route("/api/recordings/{name}", get(recording))
        .route("/api/recordings/{name}/file", get(recording_file))
        .route("/api", any(unknown))
        .route("/api/", any(unknown))
        .route("/api/{*unknown}", any(unknown))
        .method_not_allowed_fallback(other_method)
        .fallback(page::page)
        .layer(DefaultBodyLimit::max(MOST_BYTES))
        .layer(middleware::from_fn_with_state(guard, guarded))
        .with_state(live)
}

async fn session(State(live): State<Arc<Live>>) -> JsonAnswer<SessionInfo> {
    JsonAnswer(live.info())
}

async fn history(State(live): State<Arc<Live>>) -> Response {
    ([(CONTENT_TYPE, "application/json")], live.past()).into_response()
}

/// Object with ignored fields.
#[derive(Deserialize)]
struct EmptyBody {}

async fn tare(State(live): State<Arc<Live>>, JsonBody(EmptyBody {}): JsonBody<EmptyBody>) -> Answer {
    done(live.command(Command::Tare))
}

#[derive(Deserialize)]
struct Mark {
    text: String,
}

async fn mark(State(live): State<Arc<Live>>, JsonBody(Mark { text }): JsonBody<Mark>) -> Answer {
    let length = text.chars().count();
    if length == 0 || length > MOST_OF_A_MARK || text.chars().any(char::is_control) {
        let error = format!(
            "a mark has {length} characters; it must have 1 to {MOST_OF_A_MARK}, without control characters"
        );
        return Err(ErrorAnswer::new(StatusCode::BAD_REQUEST, error, "write less, on one line"));
    }
    done(live.command(Command::Mark(text)))
}

async fn alarms(State(live): State<Arc<Live>>) -> JsonAnswer<Value> {
    let (text, file) = live.alarm_text();
    JsonAnswer(json!({ "text": text, "file": file.map(|file| file.path().display().to_string()) }))
}

#[derive(Deserialize)]
struct AlarmRules {
    text: String,
}

async fn set_alarms(
    State(live): State<Arc<Live>>,
    JsonBody(AlarmRules { text }): JsonBody<AlarmRules>,
) -> Result<JsonAnswer<Value>, ErrorAnswer> {
    let setting = Arc::clone(&live);
    blocking(move || setting.set_alarms(&text)).await?;
    Ok(alarms(State(live)).await)
}

#[derive(Deserialize)]
struct Source {
    url: String,
}

async fn source(State(live): State<Arc<Live>>, JsonBody(Source { url }): JsonBody<Source>) -> Answer {
    live.check_source_is_free().map_err(|error| refusal(&error))?;
    if url != "simulated" {
        return Err(ErrorAnswer::new(
            StatusCode::FORBIDDEN,
            "a browser may choose the source `simulated` only",
            "name other sources by `palpate serve LOCATOR --from URL`",
        ));
    }
    // Waits for the end of the running session.
    blocking(move || live.begin_simulated()).await.map(|()| JsonAnswer(json!({})))
}

async fn bring_up(State(live): State<Arc<Live>>) -> Result<JsonAnswer<BringUpRecord>, ErrorAnswer> {
    // Listing the ports is slow.
    blocking(move || live.bring_up_record()).await.map(JsonAnswer)
}

#[derive(Deserialize)]
struct Port {
    port: Option<String>,
    baud: Option<u32>,
}

async fn choose_port(
    State(live): State<Arc<Live>>,
    JsonBody(Port { port, baud }): JsonBody<Port>,
) -> Result<JsonAnswer<BringUpRecord>, ErrorAnswer> {
    blocking(move || {
        live.choose_port(port.as_deref(), baud)?;
        live.bring_up_record()
    })
    .await
    .map(JsonAnswer)
}

async fn make_rig(
    State(live): State<Arc<Live>>,
    JsonBody(form): JsonBody<RigForm>,
) -> Result<JsonAnswer<NewRigRecord>, ErrorAnswer> {
    // Waits for the end of the source and for the disk.
    blocking(move || live.make_rig(&form)).await.map(JsonAnswer)
}

async fn calibration(State(live): State<Arc<Live>>) -> Result<JsonAnswer<CalibrationRecord>, ErrorAnswer> {
    // A step may have locked the state.
    blocking(move || {
        live.attend();
        live.calibration()
    })
    .await
    .map(JsonAnswer)
}

/// Separate from the state, because traces are long.
async fn calibration_presses(
    State(live): State<Arc<Live>>,
) -> Result<JsonAnswer<Vec<PressRecord>>, ErrorAnswer> {
    blocking(move || Ok(live.calibrator()?.presses())).await.map(JsonAnswer)
}

/// Does not wait for the body.
async fn emergency_stop(State(live): State<Arc<Live>>) -> Answer {
    done(live.calibrator().and_then(|calibrator| Ok(calibrator.halt()?)))
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Step {
    Begin,
    Redo,
    Skip,
    Untouched,
    Stop,
    Finish,
    Strike,
    Check,
    DryRun,
    SetUp,
    Jog,
    TouchOff,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Axis {
    X,
    Y,
    Z,
}

#[derive(Deserialize)]
struct Calibrate {
    step: Step,
    /// For `strike`.
    press: Option<usize>,
    /// For `jog`.
    axis: Option<Axis>,
    by_mm: Option<f64>,
    /// For `begin`.
    placement_mm: Option<f64>,
    second_force_n: Option<f64>,
    #[serde(default)]
    force_is_known: bool,
}

impl Calibrate {
    fn jog(&self) -> SetUpTask {
        let by_m = self.by_mm.unwrap_or_default() * 1e-3;
        SetUpTask::Jog(match self.axis {
            Some(Axis::X) => [by_m, 0.0, 0.0],
            Some(Axis::Y) => [0.0, by_m, 0.0],
            Some(Axis::Z) => [0.0, 0.0, by_m],
            None => [0.0; 3],
        })
    }

    fn statements(&self) -> Statements {
        Statements {
            placement_sd_m: self.placement_mm.map(|sd_mm| sd_mm * 1e-3),
            second_force_n: self.second_force_n,
            force_is_known: self.force_is_known,
        }
    }
}

async fn calibrate(
    State(live): State<Arc<Live>>,
    JsonBody(wish): JsonBody<Calibrate>,
) -> Result<JsonAnswer<CalibrationRecord>, ErrorAnswer> {
    // Waits for the end of a source, and for the disk.
    blocking(move || {
        live.attend();
        match wish.step {
            Step::Begin => live.begin_calibration(wish.statements())?,
            Step::Strike => live.calibrator()?.strike(wish.press.unwrap_or_default())?,
            Step::Check => live.begin_check()?,
            Step::DryRun => live.begin_set_up(true)?,
            Step::SetUp => live.begin_set_up(false)?,
            Step::Jog => live.calibrator()?.ask_set_up(wish.jog())?,
            Step::TouchOff => live.calibrator()?.ask_set_up(SetUpTask::TouchOff)?,
            Step::Redo => live.calibrator()?.redo()?,
            Step::Skip => live.calibrator()?.skip()?,
            Step::Untouched => live.calibrator()?.relearn_untouched()?,
            Step::Stop => live.calibrator()?.stop()?,
            Step::Finish => live.finish_calibration()?,
        }
        live.calibration()
    })
    .await
    .map(JsonAnswer)
}

fn done(result: Result<(), LiveError>) -> Answer {
    result.map(|()| JsonAnswer(json!({}))).map_err(|error| refusal(&error))
}

fn refusal(error: &LiveError) -> ErrorAnswer {
    let (status, help) = match error {
        LiveError::NoLocator => (StatusCode::CONFLICT, "calibrate first: POST /api/calibration"),
        LiveError::NotCalibrating => (
            StatusCode::NOT_FOUND,
            "start `palpate serve RIG --calibrate --from URL --presses FILE --out LOCATOR`",
        ),
        LiveError::Calibrator(CalibratorError::NoMachine) => {
            (StatusCode::CONFLICT, "start `palpate serve` with --stage MACHINE")
        }
        LiveError::Calibrator(CalibratorError::NotSetUp) => {
            (StatusCode::CONFLICT, "connect it first: the step `set_up`")
        }
        LiveError::Calibrator(CalibratorError::Jog) => {
            (StatusCode::BAD_REQUEST, "give an `axis`, x, y or z, and a distance `by_mm`")
        }
        LiveError::Calibrator(CalibratorError::MachinePresses) => {
            (StatusCode::CONFLICT, "end it early, or wait until it has ended")
        }
        LiveError::Calibrator(CalibratorError::Statement(_)) => {
            (StatusCode::BAD_REQUEST, "give a length in mm and a force in N, greater than 0")
        }
        LiveError::Calibrator(CalibratorError::NoSuchPress { .. }) => {
            (StatusCode::BAD_REQUEST, "GET /api/calibration/presses lists them")
        }
        LiveError::Calibrator(_) => (StatusCode::CONFLICT, "GET /api/calibration reports its progress"),
        LiveError::NoSession => (StatusCode::CONFLICT, "choose a source first"),
        LiveError::Behind => (StatusCode::SERVICE_UNAVAILABLE, "try it again"),
        LiveError::Calibrates { .. } => (
            StatusCode::CONFLICT,
            "start `palpate serve RIG --calibrate` with another --from URL, or omit --calibrate",
        ),
        LiveError::NotSimulated => (StatusCode::CONFLICT, "start `palpate serve` with a rig"),
        LiveError::Source(_) | LiveError::Columns(_) | LiveError::Pace(_) | LiveError::OneWay(_) => {
            (StatusCode::BAD_REQUEST, "start `palpate serve` with another source")
        }
        LiveError::BringUp(BringUpError::Source(_)) => (StatusCode::BAD_REQUEST, "choose another port"),
        LiveError::BringUp(BringUpError::Thread(_)) => {
            (StatusCode::INTERNAL_SERVER_ERROR, "start palpate again")
        }
        LiveError::BringUp(BringUpError::HasRig) => {
            (StatusCode::CONFLICT, "start `palpate serve --from URL` without a rig")
        }
        LiveError::BringUp(_) => (StatusCode::BAD_REQUEST, "GET /api/bring-up lists the ports"),
        LiveError::RigForm(RigFormError::Exists { .. }) => {
            (StatusCode::CONFLICT, "choose another name, or have it replaced with `overwrite`")
        }
        LiveError::RigForm(RigFormError::Presses { .. }) => (StatusCode::CONFLICT, "choose another name"),
        LiveError::RigForm(RigFormError::Write { .. }) => {
            (StatusCode::INTERNAL_SERVER_ERROR, "check that the folder is writable")
        }
        LiveError::RigForm(_) => (StatusCode::BAD_REQUEST, "correct it and try again"),
        LiveError::AlarmFile { .. } => {
            (StatusCode::INTERNAL_SERVER_ERROR, "check that the folder is writable; the alarms are unchanged")
        }
        LiveError::Rule(_) => (StatusCode::BAD_REQUEST, "docs/how-to/react-by-rules.md describes rules"),
        LiveError::Session(_) => (StatusCode::CONFLICT, "start `palpate serve` without --track"),
        LiveError::Thread(_) => (StatusCode::INTERNAL_SERVER_ERROR, "start palpate again"),
        LiveError::NoFolder => (StatusCode::CONFLICT, "start `palpate serve` with --record FOLDER"),
        LiveError::Recording(RecordingError::File { error, .. })
            if error.kind() == std::io::ErrorKind::NotFound =>
        {
            (StatusCode::NOT_FOUND, "GET /api/recordings lists them")
        }
        LiveError::Recording(RecordingError::GoesOn { .. }) => {
            (StatusCode::CONFLICT, "end the current recording first")
        }
        LiveError::Recording(_) => (StatusCode::BAD_REQUEST, "GET /api/recordings lists recordings"),
    };
    let field = match error {
        LiveError::RigForm(error) => error.field(),
        _ => None,
    };
    ErrorAnswer::new(status, error.to_string(), help).with_field(field)
}

#[derive(Deserialize)]
struct Record {
    on: bool,
    name: Option<String>,
}

async fn record(State(live): State<Arc<Live>>, JsonBody(Record { on, name }): JsonBody<Record>) -> Answer {
    // Waits for the last byte of a recording.
    blocking(move || {
        let status = if on { live.begin_recording(name.as_deref()).map(Some) } else { live.end_recording() };
        status.map(|status| json!({ "recording": status }))
    })
    .await
    .map(JsonAnswer)
}

async fn recordings(State(live): State<Arc<Live>>) -> Result<JsonAnswer<Vec<RecordingSummary>>, ErrorAnswer> {
    blocking(move || live.list_recordings()).await.map(JsonAnswer)
}

#[derive(Deserialize)]
struct Part {
    from_s: Option<f64>,
    to_s: Option<f64>,
    points: Option<usize>,
}

/// Default and largest number of points.
const POINTS: (usize, usize) = (2000, 20_000);

async fn recording(
    State(live): State<Arc<Live>>,
    name: Result<Path<String>, PathRejection>,
    part: Result<Query<Part>, QueryRejection>,
) -> Result<JsonAnswer<Excerpt>, ErrorAnswer> {
    let Query(Part { from_s, to_s, points }) = part.map_err(|error| {
        ErrorAnswer::new(StatusCode::BAD_REQUEST, error.body_text(), "write ?from_s=0&to_s=60&points=2000")
    })?;
    let name = name_in(name)?;
    let span_s = (from_s.unwrap_or(0.0), to_s.unwrap_or(f64::INFINITY));
    let points = points.unwrap_or(POINTS.0).clamp(1, POINTS.1);
    blocking(move || live.read_recording(&name, span_s, points)).await.map(JsonAnswer)
}

/// Limit on files sent from memory.
const MOST_OF_A_FILE: u64 = 256 << 20;

async fn recording_file(
    State(live): State<Arc<Live>>,
    name: Result<Path<String>, PathRejection>,
) -> Result<Response, ErrorAnswer> {
    let name = name_in(name)?;
    let path = live.recording_path(&name).map_err(|error| refusal(&error))?;
    let read = tokio::task::spawn_blocking(move || {
        let bytes = std::fs::metadata(&path)?.len();
        if bytes > MOST_OF_A_FILE {
            return Ok(Err(bytes));
        }
        std::fs::read(&path).map(Ok)
    });
    match read.await.map_err(|error| std::io::Error::other(error.to_string())).flatten() {
        Ok(Ok(bytes)) => {
            let as_file = format!("attachment; filename=\"{name}\"");
            let headers =
                [(CONTENT_TYPE, "application/octet-stream"), (CONTENT_DISPOSITION, as_file.as_str())];
            Ok((headers, bytes).into_response())
        }
        Ok(Err(bytes)) => Err(ErrorAnswer::new(
            StatusCode::PAYLOAD_TOO_LARGE,
            format!("{name} has {bytes} bytes; at most {MOST_OF_A_FILE} are sent"),
            "copy it from the folder of recordings",
        )),
        Err(error) => Err(ErrorAnswer::new(
            StatusCode::NOT_FOUND,
            format!("{name} cannot be read: {error}"),
            "GET /api/recordings lists them",
        )),
    }
}

async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, LiveError> + Send + 'static,
) -> Result<T, ErrorAnswer> {
    match tokio::task::spawn_blocking(work).await {
        Ok(done) => done.map_err(|error| refusal(&error)),
        Err(error) => {
            Err(ErrorAnswer::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string(), "start palpate again"))
        }
    }
}

async fn unknown() -> ErrorAnswer {
    ErrorAnswer::new(
        StatusCode::NOT_FOUND,
        "the request does not exist",
        "docs/reference/server.md lists them",
    )
}

/// The header `Allow` lists the valid methods.
async fn other_method(method: Method) -> ErrorAnswer {
    let error = format!("{method} is not a method of this request");
    ErrorAnswer::new(StatusCode::METHOD_NOT_ALLOWED, error, "docs/reference/server.md lists the methods")
}

fn name_in(path: Result<Path<String>, PathRejection>) -> Result<String, ErrorAnswer> {
    let help = "write a name as GET /api/recordings has it";
    path.map(|Path(name)| name).map_err(|error| ErrorAnswer::new(error.status(), error.body_text(), help))
}
