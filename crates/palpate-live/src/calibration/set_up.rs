use super::press::Press;
use super::run::Calibration;
use super::touch_off::{TouchOff, TouchOffAction, TouchOffFailure};
use crate::stage::Order;
use palpate_mechanics::contact::Position;
use palpate_rig::Stage;
use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

/// Longest jog, in metres.
pub const LONGEST_JOG_M: f64 = 0.01;

/// Distinct places of a plan.
pub fn dry_run(plan: &[Press]) -> Vec<Position> {
    let mut places: Vec<Position> = plan.iter().map(|press| press.position).collect();
    places.dedup();
    places
}

/// Set-up task.
#[derive(Clone, Debug, PartialEq)]
pub enum SetUpTask {
    /// Travel above these places, then end.
    DryRun(Vec<Position>),
    /// Move in metres, not below the height of travel.
    Jog([f64; 3]),
    /// Touch-off at the present position.
    TouchOff,
    /// End with the finger lifted.
    End,
}

/// Outcome of a set-up task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SetUpNote {
    /// A dry run is above this place.
    Above(Position),
    /// Places of a finished dry run.
    DryRunEnded(usize),
    /// Position after a jog, in machine coordinates.
    At([f64; 3]),
    /// Height of the touch, in machine coordinates.
    Touch(f64),
    /// Failed touch-off.
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

/// Length in metres, displayed in mm.
struct Millimetres(f64);

impl fmt::Display for Millimetres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Turns -0 into 0.
        write!(f, "{}", (self.0 * 1e6).round() / 1e3 + 0.0)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum SetUpAction {
    Wait,
    Order(Order),
    Note(SetUpNote),
}

#[derive(Debug)]
enum Work {
    DryRun { places: VecDeque<Position>, to: Option<Position>, reached: usize },
    Jog { by_m: [f64; 3], is_ordered: bool },
    TouchOff(TouchOff),
}

#[derive(Debug)]
pub(super) struct SetUp {
    stage: Stage,
    requested: VecDeque<SetUpTask>,
    work: Option<Work>,
    has_ended: bool,
}

impl SetUp {
    pub fn new(stage: Stage) -> Self {
        Self { stage, requested: VecDeque::new(), work: None, has_ended: false }
    }

    pub fn ask(&mut self, task: SetUpTask) {
        match task {
            // Ends any task, because finish lifts the finger.
            SetUpTask::End => self.has_ended = true,
            task => self.requested.push_back(task),
        }
    }

    pub fn has_ended(&self) -> bool {
        self.has_ended
    }

    pub fn is_idle(&self) -> bool {
        self.work.is_none() && self.requested.is_empty()
    }

    pub fn is_between_tasks(&self) -> bool {
        self.work.is_none()
    }

    pub fn needs_readings(&self) -> bool {
        matches!(self.work, Some(Work::TouchOff(_)))
    }

    /// Next action of a resting machine; `waited` since its last move or note.
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
            self.has_ended |= matches!(action, SetUpAction::Note(SetUpNote::DryRunEnded(_)));
            self.work = None;
            calibration.detect_touch(false);
        }
        action
    }

    fn begin(&mut self, calibration: &mut Calibration) -> SetUpAction {
        self.work = match self.requested.pop_front() {
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

fn fly_over(places: &mut VecDeque<Position>, to: &mut Option<Position>, reached: &mut usize) -> SetUpAction {
    if let Some(position) = to.take() {
        *reached += 1;
        return SetUpAction::Note(SetUpNote::Above(position));
    }
    *to = places.pop_front();
    let ended = SetUpAction::Note(SetUpNote::DryRunEnded(*reached));
    to.map_or(ended, |position| SetUpAction::Order(Order::Travel(position)))
}
