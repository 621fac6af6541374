//! Machine of a calibration, and attendance of people.

use crate::calibration::{Calibration, Machine, Motion, Note};
use crate::stage::{StageUrl, Stopping};
use crate::stamp::HostClock;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_rig::Stage;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// Time before an unwatched machine lifts its finger and ends.
pub const UNWATCHED: Duration = Duration::from_secs(5);

/// Attendance of people who can stop a machine.
#[derive(Debug)]
pub struct Attendance {
    clock: HostClock,
    seen_ms: AtomicU64,
    is_needed: AtomicBool,
}

impl Attendance {
    /// Uses real time even for simulated machines, as people do.
    pub fn new() -> Self {
        Self { clock: HostClock::new(), seen_ms: AtomicU64::new(0), is_needed: AtomicBool::new(false) }
    }

    pub fn note(&self) {
        self.seen_ms.store(self.now_ms(), Ordering::Relaxed);
    }

    pub fn is_needed(&self) -> bool {
        self.is_needed.load(Ordering::Relaxed)
    }

    pub fn set_needed(&self, is_needed: bool) {
        self.is_needed.store(is_needed, Ordering::Relaxed);
    }

    /// True after [`UNWATCHED`] without a signal.
    pub fn is_absent(&self) -> bool {
        self.now_ms().saturating_sub(self.seen_ms.load(Ordering::Relaxed)) > UNWATCHED.as_millis() as u64
    }

    fn now_ms(&self) -> u64 {
        self.clock.elapsed().as_millis() as u64
    }
}

/// State of a machine for other threads.
#[derive(Clone, Debug, Default)]
pub struct MachineState {
    pub firmware: Option<&'static str>,
    pub stopping: Option<Stopping>,
    pub motion: Option<Motion>,
    position: Option<Position>,
    depth_m: Option<f64>,
    /// Instants of the first press and now, and presses in between.
    pressing_since: Option<Duration>,
    now: Duration,
    recorded: usize,
    pub omitted: usize,
    at_m: Option<[f64; 3]>,
    pub touch_z_m: Option<f64>,
}

impl MachineState {
    pub fn take(&mut self, now: Duration, machine: &Machine, notes: &[Note]) {
        self.now = now;
        self.motion = Some(machine.motion());
        self.at_m = machine.position_m();
        self.position = machine.press().map(|press| press.position);
        self.depth_m = machine.press().and_then(|press| press.depth_m);
        if self.position.is_some() {
            self.pressing_since.get_or_insert(now);
        }
        self.recorded += notes.iter().filter(|note| **note == Note::Taken).count();
    }
}

#[derive(Clone, Debug, Serialize)]
pub struct MachineRecord {
    url: String,
    firmware: Option<&'static str>,
    /// Effect of a delayed stop.
    stopping: Option<String>,
    /// From connection to final lift.
    runs: bool,
    /// `None` while connecting.
    motion: Option<Motion>,
    x_mm: Option<f64>,
    y_mm: Option<f64>,
    depth_mm: Option<f64>,
    force_n: Option<f64>,
    left_s: Option<f64>,
    at_mm: Option<[f64; 3]>,
    found_touch_mm: Option<f64>,
    moves: MovesRecord,
}

/// In machine coordinates.
#[derive(Clone, Debug, Serialize)]
struct MovesRecord {
    x_mm: (f64, f64),
    y_mm: (f64, f64),
    travel_z_mm: f64,
    touch_z_mm: f64,
    depths_mm: Vec<f64>,
    travel_mm_per_s: f64,
    press_mm_per_s: f64,
    load_cell: Option<String>,
    force_limit_n: Option<f64>,
}

impl MachineRecord {
    /// Machine at rest; `found_touch_m` is from a touch-off.
    pub fn new(url: &StageUrl, stage: &Stage, places: &[Position], found_touch_m: Option<f64>) -> Self {
        let (from_x_m, from_y_m) = stage.origin_m;
        let span_mm = |at_m: &dyn Fn(Position) -> f64| {
            let (low_m, high_m) = places
                .iter()
                .map(|place| at_m(*place))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
            (low_m * 1e3, high_m * 1e3)
        };
        Self {
            url: url.to_string(),
            firmware: None,
            stopping: None,
            runs: false,
            motion: None,
            x_mm: None,
            y_mm: None,
            depth_mm: None,
            force_n: None,
            left_s: None,
            at_mm: None,
            found_touch_mm: found_touch_m.map(|z_m| z_m * 1e3),
            moves: MovesRecord {
                x_mm: span_mm(&|place| from_x_m + place.x_m),
                y_mm: span_mm(&|place| from_y_m + place.y_m),
                travel_z_mm: stage.travel_z_m() * 1e3,
                touch_z_mm: stage.touch_z_m * 1e3,
                depths_mm: stage.depths_m.iter().map(|depth_m| depth_m * 1e3).collect(),
                travel_mm_per_s: stage.travel_m_per_s * 1e3,
                press_mm_per_s: stage.press_m_per_s * 1e3,
                load_cell: stage.load_cell.clone(),
                force_limit_n: stage.force_limit_n,
            },
        }
    }

    pub fn running(
        self,
        state: &MachineState,
        calibration: &Calibration,
        extent: Extent,
        left: usize,
    ) -> Self {
        let left_s = state
            .pressing_since
            .filter(|_| state.recorded > 0)
            .map(|since| state.now.saturating_sub(since).as_secs_f64() / state.recorded as f64 * left as f64);
        Self {
            firmware: state.firmware,
            stopping: state
                .stopping
                .filter(|stopping| *stopping != Stopping::AtOnce)
                .map(|stopping| stopping.to_string()),
            runs: true,
            motion: state.motion,
            x_mm: state.position.map(|position| position.x_m * 1e3),
            y_mm: state.position.filter(|_| extent.width_m().is_some()).map(|position| position.y_m * 1e3),
            depth_mm: state.depth_m.map(|depth_m| depth_m * 1e3),
            force_n: calibration.cell_force_n(),
            left_s,
            at_mm: state.at_m.map(|at_m| at_m.map(|at_m| at_m * 1e3)),
            found_touch_mm: state.touch_z_m.map(|z_m| z_m * 1e3).or(self.found_touch_mm),
            ..self
        }
    }
}
