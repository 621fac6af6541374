//! Machines with Marlin or GRBL firmware, which execute G-code (ISO 6983-1).
//!
//! An `ok` means that a move was parsed, not that it ended. A second command waits for the end: `M400`
//! (Marlin), or a dwell `G4` (GRBL). Marlin answers `ok` even to unexecuted lines. Every `ok` therefore
//! requires expected lines only, and a position at the target.

use super::error::{StageError, StopReason};
use super::firmware::{Firmware, ReplyKind, position_mm, status};
use super::link::StageLink;
use palpate_mechanics::contact::Position;
use palpate_rig::Stage;
use std::collections::VecDeque;
use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Effect of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopping {
    /// During any move.
    AtOnce,
    /// By a DTR reset: the firmware reads no stop during a move.
    ByReset,
    /// Between moves, without a reset line.
    BetweenMoves,
}

impl fmt::Display for Stopping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtOnce => f.write_str("a stop acts at once"),
            Self::ByReset => f.write_str(
                "its firmware has no emergency parser: a stop resets the board by DTR, and the motors lose their holding torque",
            ),
            Self::BetweenMoves => write!(
                f,
                "its firmware has no emergency parser, so that a stop waits for the end of a move: moves are cut into pieces of {} ms, and homing cannot be stopped. Keep its switch within reach",
                PIECE.as_millis()
            ),
        }
    }
}

/// First output: up to 10 s with a boot loader and memory card.
const IDENTIFY: Duration = Duration::from_secs(15);
/// Silence before a board is queried.
const GREETING: Duration = Duration::from_secs(3);
/// Answer without a move.
pub(super) const ANSWER: Duration = Duration::from_secs(5);
/// Two minutes on the slowest printers.
const HOMING: Duration = Duration::from_secs(300);
/// Added to twice the computed duration, for acceleration and earlier moves.
const MOVE_MARGIN: Duration = Duration::from_secs(10);
const LONGEST_MOVE: Duration = Duration::from_secs(3600);
/// Piece of a move, if stops act only between moves.
const PIECE: Duration = Duration::from_millis(40);
const MOST_PIECES: f64 = 1e6;
/// Last output after a stop.
const LAST_WORDS: Duration = Duration::from_millis(100);
/// Silence without an outstanding answer.
const QUIET: Duration = Duration::from_millis(500);
const UNENDING: Duration = Duration::from_millis(100);
/// Limit on a line, and on quoted text.
const LONGEST: usize = 1024;
/// Reports until one has GRBL's origin (`REPORT_WCO_REFRESH_IDLE_COUNT` is 10).
const OFFSET_REPORTS: usize = 11;
/// Limit on the position error: `M114` has two decimals, and a belt step is 0.0125 mm.
pub(super) const TOLERANCE_MM: f64 = 0.05;

#[derive(Debug)]
pub(super) enum Fault {
    Line(io::Error),
    Stopped,
    NotHomed,
    Unexpected(StopReason),
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Line(error)
    }
}

/// Machine that presses on a surface.
#[derive(Debug)]
pub struct GcodeStage<L> {
    pub(super) link: L,
    pub(super) firmware: Firmware,
    pub(super) setup: Stage,
    stop: Arc<AtomicBool>,
    stopping: Stopping,
    received: VecDeque<u8>,
    work_offset_mm: [f64; 3],
    /// `None` before homing and after a halt.
    pub(super) at_mm: Option<[f64; 3]>,
    pub(super) target_mm: [f64; 3],
    echoes: u32,
    pub(super) has_moved: bool,
    is_halted: bool,
}

impl<L: StageLink> GcodeStage<L> {
    /// Connects to a machine, without a move. `stop` stops it at any time.
    ///
    /// # Errors
    /// [`StageError`] for an unknown firmware, an unexpected answer, or an invalid setup.
    pub fn connect(link: L, setup: Stage, stop: Arc<AtomicBool>) -> Result<Self, StageError> {
        setup.check()?;
        if setup.dtr_reset && !link.has_dtr() {
            return Err(StageError::NoResetLine);
        }
        let mut stage = Self {
            link,
            firmware: Firmware::Marlin,
            setup,
            stop,
            stopping: Stopping::AtOnce,
            received: VecDeque::new(),
            work_offset_mm: [0.0; 3],
            at_mm: None,
            target_mm: [0.0; 3],
            echoes: 0,
            has_moved: false,
            is_halted: false,
        };
        let mut said = String::new();
        let identified = stage.identify(&mut said);
        match stage.stop_on_fault(identified)? {
            Some(firmware) => stage.firmware = firmware,
            None => return Err(StageError::Unknown { answer: said }),
        }
        let agreed = stage.synchronize(ANSWER).and_then(|()| stage.learn_stopping());
        stage.stop_on_fault(agreed)?;
        Ok(stage)
    }

    /// Firmware.
    pub fn firmware(&self) -> Firmware {
        self.firmware
    }

    /// Effect of a stop.
    pub fn stopping(&self) -> Stopping {
        self.stopping
    }

    /// Homes, and lifts the finger.
    ///
    /// # Errors
    /// [`StageError`].
    pub fn home(&mut self) -> Result<(), StageError> {
        let homed = self.try_to_home();
        self.stop_on_fault(homed)?;
        self.lift()
    }

    /// Travels at the height of travel.
    ///
    /// # Errors
    /// [`StageError`].
    pub fn travel(&mut self, position: Position) -> Result<(), StageError> {
        if self.is_below_travel() {
            self.lift()?;
        }
        let (x_m, y_m) = self.setup.origin_m;
        let to = [Some((x_m + position.x_m) * 1e3), Some((y_m + position.y_m) * 1e3), None];
        let gone = self.move_to(to, self.setup.travel_m_per_s);
        self.stop_on_fault(gone)
    }

    /// Presses to a depth in metres.
    ///
    /// # Errors
    /// [`StageError`].
    pub fn press(&mut self, depth_m: f64) -> Result<(), StageError> {
        let z_mm = (self.setup.touch_z_m - depth_m) * 1e3;
        let gone = self.move_to([None, None, Some(z_mm)], self.setup.press_m_per_s);
        self.stop_on_fault(gone)
    }

    /// Moves in metres, not below the height of travel.
    ///
    /// # Errors
    /// [`StageError`].
    pub fn jog(&mut self, by_m: [f64; 3]) -> Result<(), StageError> {
        if self.is_below_travel() {
            self.lift()?;
        }
        self.halt_if_requested()?;
        let at_mm = self.at_mm.ok_or(StageError::NotHomed)?;
        let lowest_mm = [f64::NEG_INFINITY, f64::NEG_INFINITY, self.travel_z_mm()];
        let to_mm: [f64; 3] =
            std::array::from_fn(|axis| (at_mm[axis] + by_m[axis] * 1e3).max(lowest_mm[axis]));
        let gone = self.move_to(to_mm.map(Some), self.setup.travel_m_per_s);
        self.stop_on_fault(gone)
    }

    /// Lowers the finger to a machine z in metres, not below the deepest press.
    ///
    /// # Errors
    /// [`StageError`].
    pub fn lower(&mut self, z_m: f64) -> Result<(), StageError> {
        let z_mm = z_m.max(self.setup.lowest_z_m()) * 1e3;
        let gone = self.move_to([None, None, Some(z_mm)], self.setup.press_m_per_s);
        self.stop_on_fault(gone)
    }

    /// Position in machine coordinates; `None` before homing and after a stop.
    pub fn position_m(&self) -> Option<[f64; 3]> {
        self.at_mm.map(|at_mm| at_mm.map(|at_mm| at_mm * 1e-3))
    }

    /// Lifts the finger.
    ///
    /// # Errors
    /// [`StageError`].
    pub fn lift(&mut self) -> Result<(), StageError> {
        let gone = self.move_to([None, None, Some(self.travel_z_mm())], self.setup.travel_m_per_s);
        self.stop_on_fault(gone)
    }

    /// Reads lines outside of any command, such as a greeting after a reset.
    ///
    /// # Errors
    /// [`StageError`] after a stop, and for any line except a report.
    pub fn watch(&mut self) -> Result<(), StageError> {
        let watched = self.reject_unexpected_lines();
        self.stop_on_fault(watched)
    }

    /// Halts after a requested stop.
    ///
    /// # Errors
    /// [`StageError::Stopped`] or `Line`.
    pub fn halt_if_requested(&mut self) -> Result<(), StageError> {
        let heeded = self.check_stop();
        self.stop_on_fault(heeded)
    }

    /// After a `Fault::Unexpected`, stops the machine, and lifts its finger if that is safe.
    fn stop_on_fault<T>(&mut self, outcome: Result<T, Fault>) -> Result<T, StageError> {
        outcome.map_err(|fault| match fault {
            Fault::Line(error) => StageError::Line(error),
            Fault::Stopped => StageError::Stopped,
            Fault::NotHomed => StageError::NotHomed,
            Fault::Unexpected(reason) => {
                let finger = self.retreat(&reason);
                StageError::Unexpected { reason, finger }
            }
        })
    }

    pub(super) fn travel_z_mm(&self) -> f64 {
        self.setup.travel_z_m() * 1e3
    }

    fn is_below_travel(&self) -> bool {
        self.at_mm.is_some_and(|[_, _, z_mm]| z_mm < self.travel_z_mm() - TOLERANCE_MM)
    }

    fn try_to_home(&mut self) -> Result<(), Fault> {
        (self.at_mm, self.has_moved) = (None, true);
        self.command(self.firmware.home(), HOMING)?;
        self.set()?;
        if self.firmware == Firmware::Grbl {
            self.learn_work_offset()?;
        }
        let at_mm = self.position()?;
        (self.at_mm, self.target_mm) = (Some(at_mm), at_mm);
        Ok(())
    }

    pub(super) fn set(&mut self) -> Result<(), Fault> {
        for setting in self.firmware.settings() {
            // Marlin without inches rejects the command that disables them.
            self.ask(setting, ANSWER, |firmware, line| {
                *setting == "G21" && firmware.is_unknown_command(setting, line)
            })?;
        }
        Ok(())
    }

    /// Moves straight to `to_mm`, in mm and mm/min, and checks the final position.
    pub(super) fn move_to(&mut self, to_mm: [Option<f64>; 3], speed_m_per_s: f64) -> Result<(), Fault> {
        self.check_stop()?;
        let from_mm = self.at_mm.ok_or(Fault::NotHomed)?;
        self.target_mm = std::array::from_fn(|axis| to_mm[axis].unwrap_or(from_mm[axis]));
        let target_mm = self.target_mm;
        let way_mm = from_mm.iter().zip(target_mm).map(|(from, to)| (to - from).powi(2)).sum::<f64>().sqrt();
        let duration_s = way_mm * 1e-3 / speed_m_per_s;
        let pieces = match self.stopping {
            Stopping::BetweenMoves => (duration_s / PIECE.as_secs_f64()).ceil().clamp(1.0, MOST_PIECES),
            Stopping::AtOnce | Stopping::ByReset => 1.0,
        };
        let time = Duration::try_from_secs_f64(2.0 * duration_s / pieces)
            .map_or(LONGEST_MOVE, |time| (time + MOVE_MARGIN).min(LONGEST_MOVE));
        for piece in 1..=pieces as u32 {
            let share = f64::from(piece) / pieces;
            let mut line = "G1".to_owned();
            for (axis, name) in
                ["X", "Y", "Z"].into_iter().enumerate().filter(|(axis, _)| to_mm[*axis].is_some())
            {
                let at_mm = from_mm[axis] + share * (target_mm[axis] - from_mm[axis]);
                line += &format!(" {name}{at_mm:.3}");
            }
            self.command(&format!("{line} F{:.3}", speed_m_per_s * 60e3), ANSWER)?;
            self.command(self.firmware.wait(), time)?;
        }
        let at_mm = self.position()?;
        for (axis, name) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if (at_mm[axis] - target_mm[axis]).abs() > TOLERANCE_MM {
                return Err(Fault::Unexpected(StopReason::OffPosition {
                    axis: name,
                    target_mm: target_mm[axis],
                    reported_mm: at_mm[axis],
                }));
            }
        }
        self.at_mm = Some(target_mm);
        Ok(())
    }

    pub(super) fn position(&mut self) -> Result<[f64; 3], Fault> {
        if self.firmware == Firmware::Marlin {
            let mut at_mm = None;
            self.ask("M114", ANSWER, |_, line| {
                at_mm = position_mm(line).or(at_mm);
                false
            })?;
            let no_report = StopReason::NoReport { command: "M114".to_owned(), expected: "a position" };
            return at_mm.ok_or(Fault::Unexpected(no_report));
        }
        let until = self.link.now() + ANSWER;
        loop {
            let report = self.status_report(until)?;
            if report.state == "Idle" {
                let expected = "a position";
                let no_report = Fault::Unexpected(StopReason::NoReport { command: "?".to_owned(), expected });
                return report.work_mm.ok_or(no_report);
            }
            if self.link.now() >= until {
                return Err(Fault::Unexpected(StopReason::Answer {
                    command: "?".to_owned(),
                    answer: report.state,
                }));
            }
        }
    }

    /// GRBL answers `?` at any time without `ok`.
    pub(super) fn status_report(&mut self, until: Duration) -> Result<StatusReport, Fault> {
        self.reject_unexpected_lines()?;
        self.link.write_all(b"?")?;
        self.link.flush()?;
        let Some(line) = self.next_line(until)? else {
            return Err(Fault::Unexpected(StopReason::Silent {
                command: "?".to_owned(),
                seconds: ANSWER.as_secs(),
            }));
        };
        let Some(status) = status(&line) else { return Err(self.unexpected("?", line)) };
        if let Some(offset_mm) = status.offset_mm {
            self.work_offset_mm = offset_mm;
        }
        let from_machine =
            status.machine_mm.map(|at| std::array::from_fn(|axis| at[axis] - self.work_offset_mm[axis]));
        Ok(StatusReport {
            state: status.state.to_owned(),
            is_held: status.is_held,
            names_offset: status.offset_mm.is_some() || status.work_mm.is_some(),
            work_mm: status.work_mm.or(from_machine),
        })
    }

    fn learn_work_offset(&mut self) -> Result<(), Fault> {
        self.work_offset_mm = [0.0; 3];
        for _ in 0..OFFSET_REPORTS {
            let until = self.link.now() + ANSWER;
            if self.status_report(until)?.names_offset {
                break;
            }
        }
        Ok(())
    }

    fn identify(&mut self, said: &mut String) -> Result<Option<Firmware>, Fault> {
        let until = self.link.now() + IDENTIFY;
        // Queries of Marlin and GRBL.
        let mut questions = ["M115\n", "$I\n"].into_iter().cycle();
        while self.link.now() < until {
            let until = self.link.now() + GREETING;
            while let Some(line) = self.next_line(until)? {
                if line.starts_with("Grbl") || line.starts_with("[VER:") {
                    return Ok(Some(Firmware::Grbl));
                }
                if line == "start" || line.contains("Marlin") {
                    return Ok(Some(Firmware::Marlin));
                }
                if said.len() < LONGEST {
                    said.push_str(&line);
                    said.push('\n');
                }
            }
            if let Some(question) = questions.next() {
                self.link.write_all(question.as_bytes())?;
                self.link.flush()?;
            }
        }
        Ok(None)
    }

    /// Skips outstanding answers.
    pub(super) fn synchronize(&mut self, time: Duration) -> Result<(), Fault> {
        match self.firmware {
            Firmware::Marlin => self.await_echo(time),
            Firmware::Grbl => self.await_version(time),
        }
    }

    /// Awaits a unique echo of Marlin; a firmware without `M118` quotes the command.
    fn await_echo(&mut self, time: Duration) -> Result<(), Fault> {
        self.echoes += 1;
        let echo = format!("palpate-{}", self.echoes);
        let command = format!("M118 {echo}");
        self.send(&command)?;
        let until = self.link.now() + time;
        let (mut is_echoed, mut is_silent) = (false, true);
        while let Some(line) = self.next_line(until)? {
            is_silent = false;
            is_echoed |= line.contains(&echo);
            if is_echoed && super::firmware::is_ok(&line) {
                return Ok(());
            }
        }
        if is_silent {
            return Err(Fault::Unexpected(StopReason::Silent { command, seconds: time.as_secs() }));
        }
        // Without an echo, silence has lasted long enough; the report of the next query verifies its `ok`.
        Ok(())
    }

    /// Awaits silence, then GRBL's version before the `ok`.
    fn await_version(&mut self, time: Duration) -> Result<(), Fault> {
        const TRIES: usize = 3;
        for _ in 0..TRIES {
            let until = self.link.now() + time;
            loop {
                let quiet = self.link.now() + QUIET;
                if self.next_line(quiet)?.is_none() || self.link.now() >= until {
                    break;
                }
            }
            self.send("$I")?;
            let until = self.link.now() + time;
            let mut is_named = false;
            while let Some(line) = self.next_line(until)? {
                is_named |= line.starts_with("[VER:");
                if super::firmware::is_ok(&line) {
                    break;
                }
            }
            if is_named {
                return Ok(());
            }
        }
        Err(Fault::Unexpected(StopReason::NoReport { command: "$I".to_owned(), expected: "its version" }))
    }

    fn learn_stopping(&mut self) -> Result<(), Fault> {
        if self.firmware == Firmware::Grbl {
            return Ok(());
        }
        let (mut is_named, mut is_at_once) = (false, false);
        self.ask("M115", ANSWER, |_, line| {
            is_named |= line.contains("FIRMWARE_NAME:") && line.contains("Marlin");
            is_at_once |= line.trim() == "Cap:EMERGENCY_PARSER:1";
            // Firmwares describe themselves in free text.
            !line.starts_with("Error") && !line.starts_with("Resend")
        })?;
        if !is_named {
            let expected = "a FIRMWARE_NAME of Marlin";
            return Err(Fault::Unexpected(StopReason::NoReport { command: "M115".to_owned(), expected }));
        }
        self.stopping = match (is_at_once, self.setup.dtr_reset) {
            (true, _) => Stopping::AtOnce,
            (false, true) => Stopping::ByReset,
            (false, false) => Stopping::BetweenMoves,
        };
        Ok(())
    }

    pub(super) fn command(&mut self, command: &str, time: Duration) -> Result<(), Fault> {
        self.ask(command, time, |_, _| false)
    }

    /// Awaits the `ok` of a command. `takes` receives all its lines, and returns true for the report.
    fn ask(
        &mut self,
        command: &str,
        time: Duration,
        mut takes: impl FnMut(Firmware, &str) -> bool,
    ) -> Result<(), Fault> {
        self.reject_unexpected_lines()?;
        self.send(command)?;
        let until = self.link.now() + time;
        while let Some(line) = self.next_line(until)? {
            let is_asked_for = takes(self.firmware, &line);
            match self.firmware.classify(&line) {
                ReplyKind::Ok => return Ok(()),
                ReplyKind::Report => {}
                ReplyKind::Greeting | ReplyKind::Unexpected if is_asked_for => {}
                ReplyKind::Greeting | ReplyKind::Unexpected => return Err(self.unexpected(command, line)),
            }
        }
        Err(Fault::Unexpected(StopReason::Silent { command: command.to_owned(), seconds: time.as_secs() }))
    }

    fn unexpected(&self, command: &str, line: String) -> Fault {
        Fault::Unexpected(match self.firmware.classify(&line) {
            ReplyKind::Greeting => StopReason::Restart { greeting: line },
            _ => StopReason::Answer { command: command.to_owned(), answer: line },
        })
    }

    pub(super) fn send(&mut self, command: &str) -> Result<(), Fault> {
        self.check_stop()?;
        self.link.write_all(format!("{command}\n").as_bytes())?;
        Ok(self.link.flush()?)
    }

    /// Rejects lines outside of any command; an `ok` would be mistaken for the next answer.
    fn reject_unexpected_lines(&mut self) -> Result<(), Fault> {
        while let Some(line) = self.next_line(self.link.now())? {
            match self.firmware.classify(&line) {
                ReplyKind::Report => {}
                ReplyKind::Greeting => return Err(Fault::Unexpected(StopReason::Restart { greeting: line })),
                ReplyKind::Ok | ReplyKind::Unexpected => {
                    return Err(Fault::Unexpected(StopReason::Unasked { line }));
                }
            }
        }
        Ok(())
    }

    /// Next line without its end, if in time.
    pub(super) fn next_line(&mut self, until: Duration) -> Result<Option<String>, Fault> {
        loop {
            while let Some(end) = self.received.iter().position(|byte| *byte == b'\n') {
                let bytes: Vec<u8> = self.received.drain(..=end).take(LONGEST).collect();
                let line = String::from_utf8_lossy(&bytes).trim().to_owned();
                if !line.is_empty() {
                    return Ok(Some(line));
                }
            }
            self.check_stop()?;
            let is_more = self.read()?;
            let now = self.link.now();
            if now >= until && (!is_more || now >= until + UNENDING) {
                return Ok(None);
            }
        }
    }

    /// Reads available bytes; false without any.
    fn read(&mut self) -> io::Result<bool> {
        let mut bytes = [0; 256];
        match self.link.read(&mut bytes) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                if self.received.len() < LONGEST {
                    self.received.extend(&bytes[..count]);
                } else {
                    // Only the end of an overlong line counts.
                    self.received.extend(bytes[..count].iter().filter(|byte| **byte == b'\n'));
                }
                Ok(true)
            }
            Err(error) => match error.kind() {
                io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => Ok(false),
                _ => Err(error),
            },
        }
    }

    pub(super) fn check_stop(&mut self) -> Result<(), Fault> {
        if self.is_halted {
            return Err(Fault::Stopped);
        }
        if !self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        self.halt()?;
        Err(Fault::Stopped)
    }

    pub(super) fn halt(&mut self) -> io::Result<()> {
        if std::mem::replace(&mut self.is_halted, true) {
            return Ok(());
        }
        self.at_mm = None;
        self.link.write_all(self.firmware.halt())?;
        self.link.flush()?;
        if self.stopping == Stopping::ByReset {
            self.link.reset_by_dtr()?;
        }
        self.read_last_lines();
        Ok(())
    }

    /// Reads the last output; closing a connection with unread bytes could lose the stop.
    fn read_last_lines(&mut self) {
        let until = self.link.now() + LAST_WORDS;
        while self.link.now() < until && self.read().is_ok() {
            self.received.clear();
        }
    }
}

pub(super) struct StatusReport {
    pub state: String,
    pub is_held: bool,
    names_offset: bool,
    pub work_mm: Option<[f64; 3]>,
}
