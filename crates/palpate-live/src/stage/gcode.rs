//! Machines of Marlin or GRBL firmware.
//!
//! Both take lines of G-code (ISO 6983-1) and answer each with `ok` or an error. A move is answered when it has been understood, not when it is
//! done, so that each is followed by a line that waits: `M400` (Marlin), a dwell `G4` (GRBL, which finishes its moves before one).

use palpate_mechanics::contact::Position;
use palpate_numerics::OutOfRange;
use palpate_rig::Stage;
use std::io::{self, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Firmware of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Firmware {
    /// That of most 3-D printers.
    Marlin,
    /// That of most small mills.
    Grbl,
}

impl Firmware {
    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Marlin => "Marlin",
            Self::Grbl => "GRBL",
        }
    }

    const fn home(self) -> &'static str {
        match self {
            Self::Marlin => "G28",
            Self::Grbl => "$H",
        }
    }

    const fn wait(self) -> &'static str {
        match self {
            Self::Marlin => "M400",
            Self::Grbl => "G4 P0.01",
        }
    }

    /// Bytes that stop a machine at once; those of GRBL are ones that it heeds in the middle of anything.
    const fn stop(self) -> &'static [u8] {
        match self {
            Self::Marlin => b"M112\n",
            Self::Grbl => b"!\x18",
        }
    }
}

/// Link to a machine: a serial port, a connection.
pub trait StageLink: Read + Write + Send {}

impl<T: Read + Write + Send> StageLink for T {}

/// A machine that does not do what it is asked for.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// Its line is broken.
    #[error("the line to the machine is broken: {0}")]
    Line(#[from] io::Error),
    /// A machine whose words name no firmware.
    #[error(
        "the machine says neither that it is Marlin nor that it is GRBL; it said: {said:?}. Is the baud rate right?"
    )]
    Unknown {
        /// Its words.
        said: String,
    },
    /// It refused a line.
    #[error("the machine answered `{answer}` to `{line}`")]
    Refused {
        /// The line.
        line: String,
        /// Its answer.
        answer: String,
    },
    /// It does not answer.
    #[error("the machine did not answer `{line}` within {seconds} s")]
    Silent {
        /// The line.
        line: String,
        /// Seconds that it was waited for.
        seconds: u64,
    },
    /// Somebody, or a limit, stopped it.
    #[error("the machine was stopped; it needs a reset before it moves again")]
    Stopped,
    /// A number of its setup is not in its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
}

/// Time for a greeting: boards start anew when their port is opened.
const GREETING: Duration = Duration::from_secs(3);
/// Time for an answer, and for one after a move or homing.
const ANSWER: Duration = Duration::from_secs(5);
const MOVE: Duration = Duration::from_secs(120);
/// Time for what it says after a stop.
const LAST_WORDS: Duration = Duration::from_millis(100);
/// Most bytes of a line that is kept.
const LONGEST: usize = 1024;

/// A machine that presses at places of a surface.
#[derive(Debug)]
pub struct GcodeStage<L> {
    link: L,
    firmware: Firmware,
    setup: Stage,
    stop: Arc<AtomicBool>,
    line: Vec<u8>,
}

impl<L: Read + Write> GcodeStage<L> {
    /// Greets a machine behind a link whose reads end after some 50 ms at most. Setting `stop` stops the machine whatever it does.
    ///
    /// # Errors
    /// [`StageError`] where its firmware is not known, or a number of the setup is not in its range.
    pub fn connect(link: L, setup: Stage, stop: Arc<AtomicBool>) -> Result<Self, StageError> {
        setup.check()?;
        let mut stage = Self { link, firmware: Firmware::Marlin, setup, stop, line: Vec::new() };
        stage.firmware = stage.identify()?;
        stage.order("G21", ANSWER)?;
        stage.order("G90", ANSWER)?;
        Ok(stage)
    }

    /// Its firmware.
    pub fn firmware(&self) -> Firmware {
        self.firmware
    }

    /// Moves to its end stops, by which it knows where it is.
    ///
    /// # Errors
    /// [`StageError`], also of the other steps.
    pub fn home(&mut self) -> Result<(), StageError> {
        self.order(self.firmware.home(), MOVE)?;
        self.lift()
    }

    /// Travels to a position of the surface, above it.
    pub fn travel(&mut self, position: Position) -> Result<(), StageError> {
        let (x_m, y_m) = self.setup.origin_m;
        let to = format!("X{:.3} Y{:.3}", (x_m + position.x_m) * 1e3, (y_m + position.y_m) * 1e3);
        self.go(&to, self.setup.travel_m_per_s)
    }

    /// Presses where it is, to a depth in metres.
    pub fn press(&mut self, depth_m: f64) -> Result<(), StageError> {
        let to = format!("Z{:.3}", (self.setup.touch_z_m - depth_m) * 1e3);
        self.go(&to, self.setup.press_m_per_s)
    }

    /// Lifts the finger to the height of travel.
    pub fn lift(&mut self) -> Result<(), StageError> {
        let to = format!("Z{:.3}", (self.setup.touch_z_m + self.setup.clearance_m) * 1e3);
        self.go(&to, self.setup.travel_m_per_s)
    }

    /// A straight move, and the wait for its end. G-code has mm and mm/min.
    fn go(&mut self, to: &str, speed_m_per_s: f64) -> Result<(), StageError> {
        self.order(&format!("G1 {to} F{:.0}", speed_m_per_s * 60e3), ANSWER)?;
        self.order(self.firmware.wait(), MOVE)
    }

    fn identify(&mut self) -> Result<Firmware, StageError> {
        let mut said = String::new();
        if let Some(firmware) = self.listen(GREETING, &mut said)? {
            return Ok(firmware);
        }
        // A board that does not start anew says nothing by itself: `M115` is Marlin's question, `$I` GRBL's.
        for question in ["M115\n", "$I\n"] {
            self.link.write_all(question.as_bytes())?;
            if let Some(firmware) = self.listen(ANSWER.min(GREETING), &mut said)? {
                return Ok(firmware);
            }
        }
        Err(StageError::Unknown { said })
    }

    /// Listens for a name of a firmware.
    fn listen(&mut self, time: Duration, said: &mut String) -> Result<Option<Firmware>, StageError> {
        let until = Instant::now() + time;
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
        Ok(None)
    }

    /// Sends a line, and waits for its `ok`.
    fn order(&mut self, line: &str, time: Duration) -> Result<(), StageError> {
        self.check_stop()?;
        self.link.write_all(line.as_bytes())?;
        self.link.write_all(b"\n")?;
        self.link.flush()?;
        let until = Instant::now() + time;
        while let Some(answer) = self.next_line(until)? {
            if answer == "ok" || answer.starts_with("ok ") {
                return Ok(());
            }
            let lower = answer.to_ascii_lowercase();
            if lower.starts_with("error") || lower.starts_with("alarm") || answer.starts_with("!!") {
                return Err(StageError::Refused { line: line.to_owned(), answer });
            }
        }
        Err(StageError::Silent { line: line.to_owned(), seconds: time.as_secs() })
    }

    /// The next line that the machine sends, without its end; `None` when time is up.
    fn next_line(&mut self, until: Instant) -> Result<Option<String>, StageError> {
        loop {
            self.check_stop()?;
            let mut byte = [0];
            match self.link.read(&mut byte) {
                Ok(0) => return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into()),
                Ok(_) if byte[0] == b'\n' => {
                    let line = String::from_utf8_lossy(&self.line).trim().to_owned();
                    self.line.clear();
                    if !line.is_empty() {
                        return Ok(Some(line));
                    }
                }
                Ok(_) if self.line.len() < LONGEST => self.line.push(byte[0]),
                Ok(_) => {}
                Err(error) => match error.kind() {
                    io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => {}
                    _ => return Err(error.into()),
                },
            }
            if Instant::now() >= until {
                return Ok(None);
            }
        }
    }

    /// Sends the stop, where it was asked for.
    pub(super) fn check_stop(&mut self) -> Result<(), StageError> {
        if !self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        self.link.write_all(self.firmware.stop())?;
        self.link.flush()?;
        self.hear_out();
        Err(StageError::Stopped)
    }

    /// Takes what the machine still says after its stop: a connection that is closed with unread bytes is reset, and the stop may be lost with it.
    fn hear_out(&mut self) {
        let until = Instant::now() + LAST_WORDS;
        let mut bytes = [0; 256];
        while Instant::now() < until {
            match self.link.read(&mut bytes) {
                Ok(0) => return,
                Err(error)
                    if !matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock) =>
                {
                    return;
                }
                Ok(_) | Err(_) => {}
            }
        }
    }
}
