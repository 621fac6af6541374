//! A machine that presses where the guide of a calibration asks for it.

use super::guide::Waiting;
use super::press::Press;
use super::run::{Calibration, Note};
use crate::stage::{Done, Doubt, Finger, Order, StageError, StageThread, Stopping};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Readings that stay away for so long stop the machine: nobody sees what it does.
const SILENT: Duration = Duration::from_secs(2);
/// Time in which a press must be seen in the readings, and in which its reading must come to rest.
const SEEN_WITHIN: Duration = Duration::from_secs(3);
const AT_REST_WITHIN: Duration = Duration::from_secs(60);
/// Time in which the surface must be at rest when it has been let go.
const RELEASED_WITHIN: Duration = Duration::from_secs(300);
/// Presses in a row that no reading shows, after which no more are tried.
const MOST_UNSEEN: u32 = 3;

/// A machine that ended its work.
#[derive(Debug, thiserror::Error)]
pub enum MachineError {
    /// It does not do what it is asked for.
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
    /// Readings that stay away.
    #[error("no reading came for {} s: the machine was stopped", SILENT.as_secs())]
    Silent,
    /// Somebody stopped it.
    #[error("the machine was stopped by hand")]
    ByHand,
    /// Nobody who could stop it.
    #[error("nobody has watched the machine for {seconds} s: its finger was lifted")]
    Unwatched {
        /// Seconds that somebody was waited for.
        seconds: u64,
    },
    /// Presses that nobody sees.
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

/// Step of a machine that people are told of.
#[derive(Clone, Debug, PartialEq)]
pub enum MachineNote {
    /// It looks for its end stops.
    Homing,
    /// A press that no reading showed is left out.
    Unseen,
    /// A press whose reading did not come to rest is left out.
    NoRest,
}

/// Motion of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Motion {
    /// It waits for the first reading: nothing moves unseen.
    Blind,
    /// It looks for its end stops.
    Homing,
    /// It travels to a place, and presses there.
    Pressing,
    /// It lifts its finger.
    Lifting,
    /// Its finger is lifted, and it rests.
    Up,
    /// Its finger presses, and it rests.
    Down,
}

/// A machine that presses where the guide of a calibration asks for it.
#[derive(Debug)]
pub struct Machine {
    thread: StageThread,
    force_limit_n: f64,
    motion: Motion,
    /// The press that it was sent to last.
    press: Option<Press>,
    since: Instant,
    readings: u64,
    read_at: Instant,
    unseen: u32,
    /// Error with which it ends once its finger is lifted.
    ends_with: Option<MachineError>,
}

impl Machine {
    /// A machine whose stage is connected, and not homed yet.
    pub fn new(thread: StageThread, force_limit_n: Option<f64>) -> Self {
        let now = Instant::now();
        Self {
            thread,
            force_limit_n: force_limit_n.unwrap_or(f64::INFINITY),
            motion: Motion::Blind,
            press: None,
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

    /// Its motion.
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// The press that it was sent to last; `None` before the first.
    pub fn press(&self) -> Option<Press> {
        self.press
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

    /// Has it do what the guide waits for; to be called often.
    ///
    /// # Errors
    /// [`MachineError`] once it has ended its work.
    pub fn step(&mut self, calibration: &mut Calibration) -> Result<Option<MachineNote>, MachineError> {
        if calibration.readings() > self.readings {
            (self.readings, self.read_at) = (calibration.readings(), Instant::now());
        }
        if self.motion != Motion::Blind && self.read_at.elapsed() > SILENT {
            return self.fail(MachineError::Silent);
        }
        match self.thread.done() {
            Some(Ok(Done::Up)) => {
                if let Some(error) = self.ends_with.take() {
                    self.thread.close();
                    return Err(error);
                }
                self.enter(Motion::Up, calibration);
            }
            Some(Ok(Done::Down)) => self.enter(Motion::Down, calibration),
            Some(Err(error)) => return Err(error.into()),
            None => {}
        }
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
            (Motion::Up, Waiting::Untouched | Waiting::Release) if self.since.elapsed() > RELEASED_WITHIN => {
                self.thread.close();
                return Err(MachineError::NoRest);
            }
            (Motion::Down, Waiting::Untouched | Waiting::Release | Waiting::Nothing) => {
                self.unseen = 0;
                self.order(Order::Lift, calibration);
            }
            (Motion::Down, Waiting::Press) if self.since.elapsed() > SEEN_WITHIN => {
                self.leave_out(calibration);
                self.unseen += 1;
                if self.unseen == MOST_UNSEEN {
                    self.ends_with = Some(MachineError::Unseen);
                }
                return Ok(Some(MachineNote::Unseen));
            }
            (Motion::Down, Waiting::Rest) if self.since.elapsed() > AT_REST_WITHIN => {
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
        (self.motion, self.since) = (motion, Instant::now());
        calibration.set_guided(true);
    }

    fn order(&mut self, order: Order, calibration: &mut Calibration) {
        calibration.set_guided(false);
        let motion = match order {
            Order::Home => Motion::Homing,
            Order::Travel(_) | Order::Press { .. } => Motion::Pressing,
            Order::Lift => Motion::Lifting,
        };
        (self.motion, self.since) = (motion, Instant::now());
        self.thread.order(order);
    }

    fn fail<T>(&mut self, error: MachineError) -> Result<T, MachineError> {
        self.thread.stop();
        Err(error)
    }
}
