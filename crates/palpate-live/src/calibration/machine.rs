//! A machine that presses where the guide of a calibration asks for it, or is set up before.

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
/// Time in which a press must be seen in the readings, and in which its reading must come to rest.
const SEEN_WITHIN: Duration = Duration::from_secs(3);
const AT_REST_WITHIN: Duration = Duration::from_secs(60);
/// Time in which the surface must be at rest when it has been let go.
const RELEASED_WITHIN: Duration = Duration::from_secs(300);
/// Unseen presses in a row after which the run ends.
const MOST_UNSEEN: u32 = 3;

/// A machine that ended its work.
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
    /// No readings.
    #[error("no reading came for {} s: the machine was stopped", SILENT.as_secs())]
    Silent,
    /// A stop by hand.
    #[error("the machine was stopped by hand")]
    ByHand,
    /// No page is open.
    #[error("nobody has watched the machine for {seconds} s: its finger was lifted")]
    Unwatched {
        /// Seconds without an open page.
        seconds: u64,
    },
    /// Unseen presses.
    #[error(
        "the readings have not shown the last {MOST_UNSEEN} presses: `touch` or `depths` of [stage] are wrong"
    )]
    Unseen,
    /// A surface that never rests.
    #[error("the untouched readings have not come to rest within {} s", RELEASED_WITHIN.as_secs())]
    NoRest,
}

impl MachineError {
    /// The remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Stage(StageError::Line(_)) => "see that it is on, and at this port",
            Self::Stage(StageError::Doubt { doubt: Doubt::OffPosition { .. }, .. }) => {
                "see that `origin`, `touch` and `depths` of [stage] are within its travel; then reset it"
            }
            Self::Stage(StageError::Doubt { finger: Finger::Unmoved, .. }) => {
                "reset it, and see that no other program uses its port"
            }
            Self::Stage(StageError::Doubt { .. }) => {
                "see its own display, and that its way is free; then reset it"
            }
            Self::Stage(StageError::Unknown { .. }) => "give the baud rate of its firmware",
            Self::Stage(StageError::OutOfRange(_) | StageError::NoResetLine) => "mend [stage] of the rig",
            Self::Stage(StageError::Stopped | StageError::NotHomed) | Self::ByHand => {
                "reset it, as by its button, before it goes on"
            }
            Self::Saturated { .. } => "reset it, and press less deep: `depths` of [stage]",
            Self::Overload { .. } => "reset it, and press less deep, or raise `force_limit` of [stage]",
            Self::Silent => "see to the board that sends the readings; then reset the machine",
            Self::Unwatched { .. } => "keep a page open while it presses",
            Self::Unseen => "jog the finger to the untouched surface, and write its z as `touch`",
            Self::NoRest => "see that nothing else touches or shakes the surface",
        }
    }
}

/// Step of a machine, for messages.
#[derive(Clone, Debug, PartialEq)]
pub enum MachineNote {
    /// It looks for its end stops.
    Homing,
    /// A press that no reading showed is left out.
    Unseen,
    /// A press whose reading did not come to rest is left out.
    NoRest,
    /// A task of the set-up has ended, or gone on.
    SetUp(SetUpNote),
}

/// Motion of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// It waits for the first reading.
    Blind,
    /// It looks for its end stops.
    Homing,
    /// It travels at the height of travel.
    Travelling,
    /// It travels to a place, and presses there; or it goes down in search of the touch.
    Pressing,
    /// It lifts its finger.
    Lifting,
    /// Its finger is lifted, and it rests.
    Up,
    /// Finger presses, and it rests.
    Down,
}

/// A machine that presses where the guide of a calibration asks for it, or is set up before.
///
/// The instants of its steps are those of the clock of its [`StageThread`].
#[derive(Debug)]
pub struct Machine {
    thread: StageThread,
    /// Tasks of a machine that is set up; `None` of one that presses.
    set_up: Option<SetUp>,
    force_limit_n: f64,
    motion: Motion,
    /// The press that it was sent to last.
    press: Option<Press>,
    /// Position after the last move, in metres of the machine.
    at_m: Option<[f64; 3]>,
    now: Duration,
    /// Instant of the last order, or of its end.
    since: Duration,
    readings: u64,
    read_at: Duration,
    unseen: u32,
    /// Error with which it ends once its finger is lifted.
    ends_with: Option<MachineError>,
}

impl Machine {
    /// A machine whose stage is connected, and not homed yet.
    pub fn new(thread: StageThread, force_limit_n: Option<f64>, now: Duration) -> Self {
        Self::with_tasks(thread, force_limit_n, now, None)
    }

    /// A machine that is set up: it homes, and does what [`Self::ask`] asks for. No press is taken.
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

    /// The way in which a stop acts on it.
    pub fn stopping(&self) -> Stopping {
        self.thread.stopping()
    }

    /// Motion.
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// The press that it was sent to last; `None` before the first.
    pub fn press(&self) -> Option<Press> {
        self.press
    }

    /// Position after its last move, in metres of the machine; `None` before homing.
    pub fn position_m(&self) -> Option<[f64; 3]> {
        self.at_m
    }

    /// Asks for a task of a machine that is set up, which follows those before it; false of one that presses.
    pub fn ask(&mut self, task: SetUpTask) -> bool {
        let Some(set_up) = &mut self.set_up else { return false };
        set_up.ask(task);
        true
    }

    /// True where it rests, has no task of a set-up any more, and waits for one.
    pub fn is_idle(&self) -> bool {
        self.motion == Motion::Up && self.set_up.as_ref().is_some_and(SetUp::is_idle)
    }

    /// True once nothing is left to do, so that it is to be finished.
    pub fn is_done(&self, calibration: &Calibration) -> bool {
        match &self.set_up {
            None => calibration.guide().waiting() == Waiting::Nothing,
            Some(set_up) => set_up.has_ended(),
        }
    }

    /// Stops it at once, where what the calibration noted asks for that.
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

    /// Stops it at once.
    ///
    /// # Errors
    /// [`MachineError::ByHand`], always.
    pub fn stop_by_hand(&mut self) -> Result<(), MachineError> {
        self.fail(MachineError::ByHand)
    }

    /// Has it do what is next, at an instant; to be called often.
    ///
    /// # Errors
    /// [`MachineError`] once it has ended its work.
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

    /// True where its work depends on readings.
    fn needs_readings(&self) -> bool {
        match &self.set_up {
            None => self.motion != Motion::Blind,
            Some(set_up) => set_up.needs_readings(),
        }
    }

    /// Does what the next task of the set-up asks for, where it rests.
    fn set_up_next(&mut self, calibration: &mut Calibration) -> Option<MachineNote> {
        if self.motion == Motion::Blind {
            self.order(Order::Home, calibration);
            return Some(MachineNote::Homing);
        }
        let at_m = self.at_m.filter(|_| matches!(self.motion, Motion::Up | Motion::Down))?;
        let set_up = self.set_up.as_mut()?;
        if set_up.is_between_tasks() {
            // The next task waits, and needs readings, from now on.
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

    /// Does what the guide waits for.
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

    /// Lifts the finger, and waits for that.
    ///
    /// # Errors
    /// [`MachineError`] where it does not.
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
