use super::guide::AwaitedStep;
use super::press::Press;
use super::run::{Calibration, Note};
use super::set_up::{SetUp, SetUpAction, SetUpNote, SetUpTask};
use crate::stage::{Finger, Order, StageError, StagePosition, StageThread, StopReason, Stopping};
use palpate_rig::Stage;
use serde::Serialize;
use std::time::Duration;

const SILENT: Duration = Duration::from_secs(2);
/// Time limits for a press to show, and to rest.
const SEEN_WITHIN: Duration = Duration::from_secs(3);
const AT_REST_WITHIN: Duration = Duration::from_secs(60);
const RELEASED_WITHIN: Duration = Duration::from_secs(300);
const MOST_UNSEEN: u32 = 3;

/// Error of a machine's work.
#[derive(Debug, thiserror::Error)]
pub enum MachineError {
    /// The stage failed.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// A channel is saturated.
    #[error("channel `{name}` reads the end of its range: the machine was stopped")]
    Saturated {
        /// Channel.
        name: String,
    },
    /// Overload of the load cell.
    #[error(
        "the load cell reads {force_n:.3} N, more than the limit of {limit_n} N: the machine was stopped"
    )]
    Overload {
        /// Force.
        force_n: f64,
        /// Limit.
        limit_n: f64,
    },
    /// No readings arrive.
    #[error("no reading came for {} s: the machine was stopped", SILENT.as_secs())]
    Silent,
    /// Stop by hand.
    #[error("the machine was stopped by hand")]
    ByHand,
    /// No page is connected.
    #[error("no page has been open for {seconds} s: the machine lifted its finger")]
    Unwatched {
        /// Seconds without an open page.
        seconds: u64,
    },
    /// Undetected presses.
    #[error(
        "the readings have not shown the last {MOST_UNSEEN} presses: `touch` or `depths` of [stage] are wrong"
    )]
    Unseen,
    /// No rest of the surface.
    #[error("the untouched readings have not settled within {} s", RELEASED_WITHIN.as_secs())]
    NoRest,
}

impl MachineError {
    /// Remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Stage(StageError::Line(_)) => "check that it is on, and at this port",
            Self::Stage(StageError::Unexpected { reason: StopReason::OffPosition { .. }, .. }) => {
                "check that `origin`, `touch` and `depths` of [stage] are within its travel; then reset it"
            }
            Self::Stage(StageError::Unexpected { finger: Finger::Unmoved, .. }) => {
                "reset it, and check that no other program uses its port"
            }
            Self::Stage(StageError::Unexpected { .. }) => {
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
    /// Homing.
    Homing,
    /// Press skipped as undetected.
    Unseen,
    /// Press skipped without rest.
    NoRest,
    /// Result of a set-up task.
    SetUp(SetUpNote),
}

/// Motion of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// Wait for a reading.
    Blind,
    /// Homing.
    Homing,
    /// Travel.
    Travelling,
    /// Travel and press, or touch-off.
    Pressing,
    /// Lift.
    Lifting,
    /// Rest, lifted.
    Up,
    /// Rest in contact.
    Down,
}

/// Machine that presses or is set up.
///
/// Instants are those of the clock of its [`StageThread`].
#[derive(Debug)]
pub struct Machine {
    thread: StageThread,
    set_up: Option<SetUp>,
    force_limit_n: f64,
    motion: Motion,
    press: Option<Press>,
    /// In machine coordinates.
    at_m: Option<[f64; 3]>,
    now: Duration,
    since: Duration,
    readings: u64,
    read_at: Duration,
    unseen: u32,
    ends_with: Option<MachineError>,
}

impl Machine {
    /// Machine, not homed yet.
    pub fn new(thread: StageThread, force_limit_n: Option<f64>, now: Duration) -> Self {
        Self::with_tasks(thread, force_limit_n, now, None)
    }

    /// Creates a machine for set-up: homing, then [`Self::ask`].
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

    /// Effect of a stop.
    pub fn stopping(&self) -> Stopping {
        self.thread.stopping()
    }

    /// Present motion.
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// Last ordered press.
    pub fn press(&self) -> Option<Press> {
        self.press
    }

    /// Machine coordinates after the last move; `None` before homing.
    pub fn position_m(&self) -> Option<[f64; 3]> {
        self.at_m
    }

    /// Queues a set-up task; false without a set-up.
    pub fn ask(&mut self, task: SetUpTask) -> bool {
        let Some(set_up) = &mut self.set_up else { return false };
        set_up.ask(task);
        true
    }

    /// True while waiting for a set-up task.
    pub fn is_idle(&self) -> bool {
        self.motion == Motion::Up && self.set_up.as_ref().is_some_and(SetUp::is_idle)
    }

    /// True after all work.
    pub fn is_done(&self, calibration: &Calibration) -> bool {
        match &self.set_up {
            None => calibration.guide().awaited_step() == AwaitedStep::Nothing,
            Some(set_up) => set_up.has_ended(),
        }
    }

    /// Stops the machine if the notes require it.
    ///
    /// # Errors
    /// [`MachineError`] of the stop.
    pub fn stop_on_notes(&mut self, notes: &[Note]) -> Result<(), MachineError> {
        let error = notes.iter().find_map(|note| match note {
            Note::Saturated(name) => Some(MachineError::Saturated { name: name.clone() }),
            Note::Overload(force_n) => {
                Some(MachineError::Overload { force_n: *force_n, limit_n: self.force_limit_n })
            }
            _ => None,
        });
        error.map_or(Ok(()), |error| self.fail(error))
    }

    /// Stops the machine.
    ///
    /// # Errors
    /// [`MachineError::ByHand`], always.
    pub fn stop_by_hand(&mut self) -> Result<(), MachineError> {
        self.fail(MachineError::ByHand)
    }

    /// Executes the next step; must be called often.
    ///
    /// # Errors
    /// [`MachineError`] that ends the work.
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
            Some(Ok(StagePosition::Up(at_m))) => {
                if let Some(error) = self.ends_with.take() {
                    self.thread.close();
                    return Err(error);
                }
                self.at_m = Some(at_m);
                self.enter(Motion::Up, calibration);
            }
            Some(Ok(StagePosition::Down(at_m))) => {
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

    fn needs_readings(&self) -> bool {
        match &self.set_up {
            None => self.motion != Motion::Blind,
            Some(set_up) => set_up.needs_readings(),
        }
    }

    fn set_up_next(&mut self, calibration: &mut Calibration) -> Option<MachineNote> {
        if self.motion == Motion::Blind {
            self.order(Order::Home, calibration);
            return Some(MachineNote::Homing);
        }
        let at_m = self.at_m.filter(|_| matches!(self.motion, Motion::Up | Motion::Down))?;
        let set_up = self.set_up.as_mut()?;
        if set_up.is_between_tasks() {
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

    fn press_next(&mut self, calibration: &mut Calibration) -> Result<Option<MachineNote>, MachineError> {
        let waited = self.now.saturating_sub(self.since);
        match (self.motion, calibration.guide().awaited_step()) {
            (Motion::Blind, _) if self.readings > 0 => {
                self.order(Order::Home, calibration);
                return Ok(Some(MachineNote::Homing));
            }
            (Motion::Up, AwaitedStep::Press) => {
                if let Some((_, press)) = calibration.guide().next_press() {
                    let depth_m = press.depth_m.unwrap_or_default();
                    self.press = Some(press);
                    self.order(Order::Press { position: press.position, depth_m }, calibration);
                }
            }
            (Motion::Up, AwaitedStep::Untouched | AwaitedStep::Release) if waited > RELEASED_WITHIN => {
                self.thread.close();
                return Err(MachineError::NoRest);
            }
            (Motion::Down, AwaitedStep::Untouched | AwaitedStep::Release | AwaitedStep::Nothing) => {
                self.unseen = 0;
                self.order(Order::Lift, calibration);
            }
            (Motion::Down, AwaitedStep::Press) if waited > SEEN_WITHIN => {
                self.leave_out(calibration);
                self.unseen += 1;
                if self.unseen == MOST_UNSEEN {
                    self.ends_with = Some(MachineError::Unseen);
                }
                return Ok(Some(MachineNote::Unseen));
            }
            (Motion::Down, AwaitedStep::Rest) if waited > AT_REST_WITHIN => {
                self.leave_out(calibration);
                return Ok(Some(MachineNote::NoRest));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Lifts the finger, and waits.
    ///
    /// # Errors
    /// [`MachineError`] of the lift.
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
