//! A machine that presses at the request of the guide of a calibration, or is set up first.

use super::guide::Waiting;
use super::press::Press;
use super::run::{Calibration, Note};
use super::set_up::{SetUp, SetUpAction, SetUpNote, SetUpTask};
use crate::stage::{Done, Doubt, Finger, Order, StageError, StageThread, Stopping};
use palpate_rig::Stage;
use serde::Serialize;
use std::time::Duration;

/// Time without readings after which the machine is stopped.
const SILENT: Duration = Duration::from_secs(2);
/// Time limit for a press to show in the readings, and for its reading to come to rest.
const SEEN_WITHIN: Duration = Duration::from_secs(3);
const AT_REST_WITHIN: Duration = Duration::from_secs(60);
/// Time limit for the surface to come to rest after a lift.
const RELEASED_WITHIN: Duration = Duration::from_secs(300);
/// Consecutive unseen presses that end the run.
const MOST_UNSEEN: u32 = 3;

/// Error that ended the work of a machine.
#[derive(Debug, thiserror::Error)]
pub enum MachineError {
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// A channel reads the end of its range.
    #[error("channel `{name}` reads the end of its range: the machine was stopped")]
    Saturated {
        /// The channel.
        name: String,
    },
    /// The load cell reads more than its limit.
    #[error(
        "the load cell reads {force_n:.3} N, more than the limit of {limit_n} N: the machine was stopped"
    )]
    Overload {
        /// The force.
        force_n: f64,
        /// The limit.
        limit_n: f64,
    },
    /// No readings arrive.
    #[error("no reading came for {} s: the machine was stopped", SILENT.as_secs())]
    Silent,
    /// A stop by hand.
    #[error("the machine was stopped by hand")]
    ByHand,
    /// No page is connected.
    #[error("no page has been open for {seconds} s: the machine lifted its finger")]
    Unwatched {
        /// Seconds without an open page.
        seconds: u64,
    },
    /// The readings have not shown the last presses.
    #[error(
        "the readings have not shown the last {MOST_UNSEEN} presses: `touch` or `depths` of [stage] are wrong"
    )]
    Unseen,
    /// The surface does not come to rest.
    #[error("the untouched readings have not settled within {} s", RELEASED_WITHIN.as_secs())]
    NoRest,
}

impl MachineError {
    /// The remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Stage(StageError::Line(_)) => "check that it is on, and at this port",
            Self::Stage(StageError::Doubt { doubt: Doubt::OffPosition { .. }, .. }) => {
                "check that `origin`, `touch` and `depths` of [stage] are within its travel; then reset it"
            }
            Self::Stage(StageError::Doubt { finger: Finger::Unmoved, .. }) => {
                "reset it, and check that no other program uses its port"
            }
            Self::Stage(StageError::Doubt { .. }) => {
                "check its display, and that its path is free; then reset it"
            }
            Self::Stage(StageError::Unknown { .. }) => "give the baud rate of its firmware",
            Self::Stage(StageError::OutOfRange(_) | StageError::NoResetLine) => "correct [stage] of the rig",
            Self::Stage(StageError::Stopped | StageError::NotHomed) | Self::ByHand => {
                "reset it, for example by its button, then continue"
            }
            Self::Saturated { .. } => "reset it, and press less deep: `depths` of [stage]",
            Self::Overload { .. } => "reset it, and press less deep, or raise `force_limit` of [stage]",
            Self::Silent => "check the board that sends the readings; then reset the machine",
            Self::Unwatched { .. } => "keep a page open while it presses",
            Self::Unseen => "jog the finger to the untouched surface, and write its z as `touch`",
            Self::NoRest => {
                "make sure that only the finger touches the surface and that the surface does not shake"
            }
        }
    }
}

/// Step of a machine, for messages.
#[derive(Clone, Debug, PartialEq)]
pub enum MachineNote {
    /// The machine homes against its end stops.
    Homing,
    /// A press is left out, because the readings did not show it.
    Unseen,
    /// A press is left out, because its reading did not come to rest.
    NoRest,
    /// A task of the set-up has ended, or made progress.
    SetUp(SetUpNote),
}

/// Motion of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// The machine waits for the first reading.
    Blind,
    /// The machine homes against its end stops.
    Homing,
    /// It travels at the height of travel.
    Travelling,
    /// The machine travels to a place and presses there, or goes down in search of the touch.
    Pressing,
    /// It lifts its finger.
    Lifting,
    /// The finger is lifted, and the machine rests.
    Up,
    /// The finger presses, and the machine rests.
    Down,
}

/// A machine that presses at the request of the guide of a calibration, or is set up first.
///
/// The instants of its steps are those of the clock of its [`StageThread`].
#[derive(Debug)]
pub struct Machine {
    thread: StageThread,
    /// Tasks of a machine that is set up; `None` for one that presses.
    set_up: Option<SetUp>,
    force_limit_n: f64,
    motion: Motion,
    /// The last press that it was sent to.
    press: Option<Press>,
    /// Position after the last move, in metres of the machine.
    at_m: Option<[f64; 3]>,
    now: Duration,
    /// Instant of the last order, or of its end.
    since: Duration,
    readings: u64,
    read_at: Duration,
    unseen: u32,
    /// Error that ends the work once the finger is lifted.
    ends_with: Option<MachineError>,
}

impl Machine {
    /// A machine with a connected stage that is not homed yet.
    pub fn new(thread: StageThread, force_limit_n: Option<f64>, now: Duration) -> Self {
        Self::with_tasks(thread, force_limit_n, now, None)
    }

    /// A machine to be set up: it homes, and executes the tasks of [`Self::ask`]. Presses are not recorded.
    pub fn to_set_up(thread: StageThread, stage: Stage, now: Duration) -> Self {
        let limit_n = stage.force_limit_n;
        Self::with_tasks(thread, limit_n, now, Some(SetUp::new(stage)))
    }

    fn with_tasks(
        thread: StageThread,
        force_limit_n: Option<f64>,
        now: Duration,
        set_up: Option<SetUp>,
    ) -> Self {
        Self {
            thread,
            set_up,
            force_limit_n: force_limit_n.unwrap_or(f64::INFINITY),
            motion: Motion::Blind,
            press: None,
            at_m: None,
            now,
            since: now,
            readings: 0,
            read_at: now,
            unseen: 0,
            ends_with: None,
        }
    }

    /// The way in which a stop acts on the machine.
    pub fn stopping(&self) -> Stopping {
        self.thread.stopping()
    }

    /// Present motion.
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// The last press that it was sent to; `None` before the first.
    pub fn press(&self) -> Option<Press> {
        self.press
    }

    /// Position after its last move, in metres of the machine; `None` before homing.
    pub fn position_m(&self) -> Option<[f64; 3]> {
        self.at_m
    }

    /// Adds a task for a machine that is set up, after the earlier ones; false for a machine that presses.
    pub fn ask(&mut self, task: SetUpTask) -> bool {
        let Some(set_up) = &mut self.set_up else { return false };
        set_up.ask(task);
        true
    }

    /// True if the machine rests, and waits for a task of a set-up.
    pub fn is_idle(&self) -> bool {
        self.motion == Motion::Up && self.set_up.as_ref().is_some_and(SetUp::is_idle)
    }

    /// True once all work is done, so that the machine can be finished.
    pub fn is_done(&self, calibration: &Calibration) -> bool {
        match &self.set_up {
            None => calibration.guide().waiting() == Waiting::Nothing,
            Some(set_up) => set_up.has_ended(),
        }
    }

    /// Stops the machine at once, if the notes of the calibration require it.
    ///
    /// # Errors
    /// [`MachineError`] with the reason.
    pub fn heed(&mut self, notes: &[Note]) -> Result<(), MachineError> {
        let error = notes.iter().find_map(|note| match note {
            Note::Saturated(name) => Some(MachineError::Saturated { name: name.clone() }),
            Note::Overload(force_n) => {
                Some(MachineError::Overload { force_n: *force_n, limit_n: self.force_limit_n })
            }
            _ => None,
        });
        error.map_or(Ok(()), |error| self.fail(error))
    }

    /// Stops the machine at once.
    ///
    /// # Errors
    /// [`MachineError::ByHand`], always.
    pub fn stop_by_hand(&mut self) -> Result<(), MachineError> {
        self.fail(MachineError::ByHand)
    }

    /// Executes the next step, at an instant; must be called often.
    ///
    /// # Errors
    /// [`MachineError`] once the work has ended.
    pub fn step(
        &mut self,
        now: Duration,
        calibration: &mut Calibration,
    ) -> Result<Option<MachineNote>, MachineError> {
        self.now = now;
        if calibration.readings() > self.readings {
            (self.readings, self.read_at) = (calibration.readings(), now);
        }
        if self.needs_readings() && now.saturating_sub(self.read_at) > SILENT {
            return self.fail(MachineError::Silent);
        }
        match self.thread.done() {
            Some(Ok(Done::Up(at_m))) => {
                if let Some(error) = self.ends_with.take() {
                    self.thread.close();
                    return Err(error);
                }
                self.at_m = Some(at_m);
                self.enter(Motion::Up, calibration);
            }
            Some(Ok(Done::Down(at_m))) => {
                self.at_m = Some(at_m);
                self.enter(Motion::Down, calibration);
            }
            Some(Err(error)) => return Err(error.into()),
            None => {}
        }
        match self.set_up {
            None => self.press_next(calibration),
            Some(_) => Ok(self.set_up_next(calibration)),
        }
    }

    /// True if the work depends on readings.
    fn needs_readings(&self) -> bool {
        match &self.set_up {
            None => self.motion != Motion::Blind,
            Some(set_up) => set_up.needs_readings(),
        }
    }

    /// Executes the next task of the set-up, if the machine rests.
    fn set_up_next(&mut self, calibration: &mut Calibration) -> Option<MachineNote> {
        if self.motion == Motion::Blind {
            self.order(Order::Home, calibration);
            return Some(MachineNote::Homing);
        }
        let at_m = self.at_m.filter(|_| matches!(self.motion, Motion::Up | Motion::Down))?;
        let set_up = self.set_up.as_mut()?;
        if set_up.is_between_tasks() {
            // The next task begins to wait now, and needs readings from now on.
            (self.since, self.read_at) = (self.now, self.now);
        }
        let waited = self.now.saturating_sub(self.since);
        match set_up.next(at_m, waited, calibration) {
            SetUpAction::Wait => {}
            SetUpAction::Note(note) => return Some(MachineNote::SetUp(note)),
            SetUpAction::Order(order) => self.order(order, calibration),
        }
        None
    }

    /// Executes the step that the guide waits for.
    fn press_next(&mut self, calibration: &mut Calibration) -> Result<Option<MachineNote>, MachineError> {
        let waited = self.now.saturating_sub(self.since);
        match (self.motion, calibration.guide().waiting()) {
            (Motion::Blind, _) if self.readings > 0 => {
                self.order(Order::Home, calibration);
                return Ok(Some(MachineNote::Homing));
            }
            (Motion::Up, Waiting::Press) => {
                if let Some((_, press)) = calibration.guide().next_press() {
                    let depth_m = press.depth_m.unwrap_or_default();
                    self.press = Some(press);
                    self.order(Order::Press { position: press.position, depth_m }, calibration);
                }
            }
            (Motion::Up, Waiting::Untouched | Waiting::Release) if waited > RELEASED_WITHIN => {
                self.thread.close();
                return Err(MachineError::NoRest);
            }
            (Motion::Down, Waiting::Untouched | Waiting::Release | Waiting::Nothing) => {
                self.unseen = 0;
                self.order(Order::Lift, calibration);
            }
            (Motion::Down, Waiting::Press) if waited > SEEN_WITHIN => {
                self.leave_out(calibration);
                self.unseen += 1;
                if self.unseen == MOST_UNSEEN {
                    self.ends_with = Some(MachineError::Unseen);
                }
                return Ok(Some(MachineNote::Unseen));
            }
            (Motion::Down, Waiting::Rest) if waited > AT_REST_WITHIN => {
                self.leave_out(calibration);
                return Ok(Some(MachineNote::NoRest));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Lifts the finger, and waits until it is lifted.
    ///
    /// # Errors
    /// [`MachineError`] if the lift fails.
    pub fn finish(mut self) -> Result<(), MachineError> {
        let ends_with = self.ends_with.take();
        self.thread.finish()?;
        ends_with.map_or(Ok(()), Err)
    }

    fn leave_out(&mut self, calibration: &mut Calibration) {
        self.order(Order::Lift, calibration);
        calibration.skip();
    }

    fn enter(&mut self, motion: Motion, calibration: &mut Calibration) {
        (self.motion, self.since) = (motion, self.now);
        calibration.set_guided(true);
    }

    fn order(&mut self, order: Order, calibration: &mut Calibration) {
        calibration.set_guided(false);
        let motion = match order {
            Order::Home => Motion::Homing,
            Order::Travel(_) | Order::Jog(_) => Motion::Travelling,
            Order::Press { .. } | Order::Lower(_) => Motion::Pressing,
            Order::Lift => Motion::Lifting,
        };
        (self.motion, self.since) = (motion, self.now);
        self.thread.order(order);
    }

    fn fail<T>(&mut self, error: MachineError) -> Result<T, MachineError> {
        self.thread.stop();
        Err(error)
    }
}
