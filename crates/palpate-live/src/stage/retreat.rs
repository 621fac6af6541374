//! Retreat after a `StopReason`: stop, lift if safe, halt until a reset.
//!
//! A lift is safe at a reported position on the last move: the machine was not reset, and the lift increases
//! its z.

use super::error::{Finger, StopReason};
use super::firmware::Firmware;
use super::gcode::{Fault, GcodeStage, TOLERANCE_MM};
use super::link::StageLink;
use std::time::Duration;

const LIFE: Duration = Duration::from_secs(2);
/// Time for a feed hold, or for a greeting.
const HOLD: Duration = Duration::from_secs(2);

impl<L: StageLink> GcodeStage<L> {
    pub(super) fn retreat(&mut self, doubt: &StopReason) -> Finger {
        if !self.has_moved {
            return Finger::Unmoved;
        }
        let was_up = self.at_mm.is_some_and(|at_mm| self.is_up(at_mm[2]) && self.is_up(self.target_mm[2]));
        let is_lost = self.at_mm.is_none() || matches!(doubt, StopReason::Restart { .. });
        let lifted = if is_lost { Finger::Unknown } else { self.try_to_lift().unwrap_or(Finger::Unknown) };
        let finger = if was_up { Finger::Up } else { lifted };
        // Without a halt, the finger stays.
        match self.halt() {
            Ok(()) => finger,
            Err(_) => Finger::Unknown,
        }
    }

    fn is_up(&self, z_mm: f64) -> bool {
        z_mm >= self.travel_z_mm() - TOLERANCE_MM
    }

    fn try_to_lift(&mut self) -> Result<Finger, Fault> {
        match self.firmware {
            Firmware::Marlin => {
                // `M410` drops all moves and keeps the position.
                self.send("M410")?;
                self.synchronize(LIFE)?;
            }
            Firmware::Grbl => self.feed_hold()?,
        }
        let at_mm = self.position()?;
        if !self.is_on_way(at_mm) {
            return Ok(Finger::Unknown);
        }
        if self.is_up(at_mm[2]) {
            return Ok(Finger::Up);
        }
        self.at_mm = Some(at_mm);
        self.move_to([None, None, Some(self.travel_z_mm())], self.setup.travel_m_per_s)?;
        Ok(Finger::Lifted)
    }

    /// Stops by a feed hold; a reset at rest then drops the moves, but not the position.
    fn feed_hold(&mut self) -> Result<(), Fault> {
        self.skip_until_silence(LIFE)?;
        let until = self.link.now() + LIFE;
        let state = self.status_report(until)?.state;
        match state.as_str() {
            "Idle" => return self.synchronize(LIFE),
            "Run" | "Hold" => {}
            // An alarm may lose the position.
            _ => {
                return Err(Fault::Unexpected(StopReason::Answer { command: "?".to_owned(), answer: state }));
            }
        }
        self.link.write_all(b"!")?;
        let until = self.link.now() + HOLD;
        loop {
            let report = self.status_report(until)?;
            if report.is_held {
                break;
            }
            if self.link.now() >= until {
                return Err(Fault::Unexpected(StopReason::Silent {
                    command: "!".to_owned(),
                    seconds: HOLD.as_secs(),
                }));
            }
        }
        self.link.write_all(b"\x18")?;
        self.skip_until_silence(HOLD)?;
        self.synchronize(LIFE)?;
        self.set()
    }

    fn skip_until_silence(&mut self, most: Duration) -> Result<(), Fault> {
        let until = self.link.now() + most;
        while self.next_line(self.link.now())?.is_some() && self.link.now() < until {}
        Ok(())
    }

    fn is_on_way(&self, at_mm: [f64; 3]) -> bool {
        let Some(from_mm) = self.at_mm else { return false };
        let is_between = |at: f64, from: f64, to: f64| {
            (from.min(to) - TOLERANCE_MM..=from.max(to) + TOLERANCE_MM).contains(&at)
        };
        (0..3).all(|axis| is_between(at_mm[axis], from_mm[axis], self.target_mm[axis]))
    }
}
