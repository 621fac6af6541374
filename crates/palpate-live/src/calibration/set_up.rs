//! Work of a machine before a calibration: a dry run, jogs and touch-off. Nothing is recorded.

use super::press::Press;
use super::run::Calibration;
use super::touch_off::{TouchOff, TouchOffAction, TouchOffFailure};
use crate::stage::Order;
use palpate_mechanics::contact::Position;
use palpate_rig::Stage;
use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

/// Longest jog along an axis, in metres.
pub const LONGEST_JOG_M: f64 = 0.01;

/// Places of a plan, each once, for a dry run.
pub fn dry_run(plan: &[Press]) -> Vec<Position> {
    let mut places: Vec<Position> = plan.iter().map(|press| press.position).collect();
    places.dedup();
    places
}

/// Task of a machine that is set up.
#[derive(Clone, Debug, PartialEq)]
pub enum SetUpTask {
    /// Travel over these places at the height of travel, and end.
    DryRun(Vec<Position>),
    /// Move by these distances along x, y and z, never below the height of travel.
    Jog([f64; 3]),
    /// Find the height of the touch at the current position.
    TouchOff,
    /// End with the finger lifted.
    End,
}

/// Outcome of a task, or of a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SetUpNote {
    /// A dry run is above a place.
    Above(Position),
    /// A dry run has ended after this number of places.
    DryRunEnded(usize),
    /// A jog ended at this position, in metres of the machine.
    At([f64; 3]),
    /// The finger touches at this height, in metres of the machine.
    Touch(f64),
    /// A touch-off found no height.
    NoTouch(TouchOffFailure),
}

impl fmt::Display for SetUpNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above(Position { x_m, y_m }) => {
                write!(f, "above x {} mm, y {} mm of the surface", Millimetres(*x_m), Millimetres(*y_m))
            }
            Self::DryRunEnded(places) => {
                write!(f, "dry run: {places} positions reached at the height of travel, none pressed")
            }
            Self::At(at_m) => {
                let [x, y, z] = at_m.map(Millimetres);
                write!(f, "the finger is at x {x}, y {y}, z {z} mm of the machine")
            }
            Self::Touch(z_m) => {
                let z = Millimetres(*z_m);
                write!(
                    f,
                    "the finger touches at z {z} mm: `touch = \"{z} mm\"` in [stage] of the rig keeps that"
                )
            }
            Self::NoTouch(failure) => write!(f, "no height was found: {failure}"),
        }
    }
}

/// A length in metres, shown in millimetres with three decimals at most.
struct Millimetres(f64);

impl fmt::Display for Millimetres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Adding 0 makes -0 a 0.
        write!(f, "{}", (self.0 * 1e6).round() / 1e3 + 0.0)
    }
}

/// Next action of a set-up.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum SetUpAction {
    Wait,
    Order(Order),
    Note(SetUpNote),
}

/// A task under way.
#[derive(Debug)]
enum Work {
    /// The places to come, the place that it travels to, and the number of places that it reached.
    DryRun {
        places: VecDeque<Position>,
        to: Option<Position>,
        reached: usize,
    },
    /// A jog; true once it was ordered.
    Jog {
        by_m: [f64; 3],
        is_ordered: bool,
    },
    TouchOff(TouchOff),
}

/// Tasks of a machine that is set up.
#[derive(Debug)]
pub(super) struct SetUp {
    stage: Stage,
    asked: VecDeque<SetUpTask>,
    work: Option<Work>,
    has_ended: bool,
}

impl SetUp {
    pub fn new(stage: Stage) -> Self {
        Self { stage, asked: VecDeque::new(), work: None, has_ended: false }
    }

    pub fn ask(&mut self, task: SetUpTask) {
        match task {
            // This ends any task, because the machine lifts its finger when it is finished.
            SetUpTask::End => self.has_ended = true,
            task => self.asked.push_back(task),
        }
    }

    pub fn has_ended(&self) -> bool {
        self.has_ended
    }

    /// True while no task is under way or asked for.
    pub fn is_idle(&self) -> bool {
        self.work.is_none() && self.asked.is_empty()
    }

    /// True while no task is under way.
    pub fn is_between_tasks(&self) -> bool {
        self.work.is_none()
    }

    /// True while a touch-off lowers the finger according to the readings.
    pub fn needs_readings(&self) -> bool {
        matches!(self.work, Some(Work::TouchOff(_)))
    }

    /// The next action of a machine that rests at a position, in metres of the machine. `waited` is the time since its last move or note.
    pub fn next(&mut self, at_m: [f64; 3], waited: Duration, calibration: &mut Calibration) -> SetUpAction {
        let action = match &mut self.work {
            None => return self.begin(calibration),
            Some(Work::DryRun { places, to, reached }) => fly_over(places, to, reached),
            Some(Work::Jog { by_m, is_ordered: false }) => {
                let order = Order::Jog(*by_m);
                self.work = Some(Work::Jog { by_m: *by_m, is_ordered: true });
                SetUpAction::Order(order)
            }
            Some(Work::Jog { .. }) => SetUpAction::Note(SetUpNote::At(at_m)),
            Some(Work::TouchOff(search)) => match calibration.touch_detector() {
                None => SetUpAction::Wait,
                Some(detector) => match search.next(waited, detector) {
                    TouchOffAction::Wait => SetUpAction::Wait,
                    TouchOffAction::Lower(z_m) => SetUpAction::Order(Order::Lower(z_m)),
                    TouchOffAction::Lift => SetUpAction::Order(Order::Lift),
                    TouchOffAction::Found(z_m) => SetUpAction::Note(SetUpNote::Touch(z_m)),
                    TouchOffAction::Failed(failure) => SetUpAction::Note(SetUpNote::NoTouch(failure)),
                },
            },
        };
        let is_over = matches!(&action, SetUpAction::Note(note) if !matches!(note, SetUpNote::Above(_)));
        if is_over {
            // A dry run ends the set-up, because no user waits for further tasks.
            self.has_ended |= matches!(action, SetUpAction::Note(SetUpNote::DryRunEnded(_)));
            self.work = None;
            calibration.detect_touch(false);
        }
        action
    }

    fn begin(&mut self, calibration: &mut Calibration) -> SetUpAction {
        self.work = match self.asked.pop_front() {
            None => None,
            Some(SetUpTask::End) => None,
            Some(SetUpTask::DryRun(places)) => {
                Some(Work::DryRun { places: places.into(), to: None, reached: 0 })
            }
            Some(SetUpTask::Jog(by_m)) => Some(Work::Jog { by_m, is_ordered: false }),
            Some(SetUpTask::TouchOff) => {
                calibration.detect_touch(true);
                Some(Work::TouchOff(TouchOff::new(&self.stage)))
            }
        };
        SetUpAction::Wait
    }
}

/// Travels over the next place, after the last one was reached.
fn fly_over(places: &mut VecDeque<Position>, to: &mut Option<Position>, reached: &mut usize) -> SetUpAction {
    if let Some(position) = to.take() {
        *reached += 1;
        return SetUpAction::Note(SetUpNote::Above(position));
    }
    *to = places.pop_front();
    let ended = SetUpAction::Note(SetUpNote::DryRunEnded(*reached));
    to.map_or(ended, |position| SetUpAction::Order(Order::Travel(position)))
}
