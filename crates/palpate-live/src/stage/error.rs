use palpate_numerics::OutOfRange;
use std::fmt;
use std::io;

/// Error of a machine.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// Broken connection.
    #[error("the line to the machine is broken: {0}")]
    Line(#[from] io::Error),
    /// Unknown firmware.
    #[error(
        "the machine identifies itself neither as Marlin nor as GRBL; its answer is {}; check the baud rate",
        quoted(answer)
    )]
    Unknown {
        /// Answer.
        answer: String,
    },
    /// Unexpected answer or position.
    #[error("{reason}; {finger}")]
    Unexpected {
        /// Reason.
        reason: StopReason,
        /// Finger after the stop.
        finger: Finger,
    },
    /// Move before homing.
    #[error("the machine is not homed")]
    NotHomed,
    /// Stop by a person or a limit.
    #[error("the machine was stopped; it needs a reset before it moves again")]
    Stopped,
    /// The link lacks the required reset line.
    #[error("`dtr_reset` needs a serial port: this link has no reset line")]
    NoResetLine,
    /// Setup number out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
}

/// Reason for a stop: unexpected answer or position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StopReason {
    /// Unexpected answer.
    #[error("the machine answered {} to `{command}`", quoted(answer))]
    Answer {
        /// Command.
        command: String,
        /// Line.
        answer: String,
    },
    /// `ok` without the requested report.
    #[error("the machine answered `{command}` without {expected}")]
    NoReport {
        /// Command.
        command: String,
        /// Report.
        expected: &'static str,
    },
    /// Line outside of any command.
    #[error("the machine sent {} while no command was under way", quoted(line))]
    Unasked {
        /// Line.
        line: String,
    },
    /// Missing answer.
    #[error("the machine did not answer `{command}` within {seconds} s")]
    Silent {
        /// Command.
        command: String,
        /// Seconds of waiting.
        seconds: u64,
    },
    /// Restart.
    #[error("the machine was reset: it sent {}", quoted(greeting))]
    Restart {
        /// Line.
        greeting: String,
    },
    /// Position off the target.
    #[error("the machine reports {axis} {reported_mm:.2} mm and was sent to {axis} {target_mm:.2} mm")]
    OffPosition {
        /// `X`, `Y` or `Z`.
        axis: char,
        /// Target in mm.
        target_mm: f64,
        /// Reported in mm.
        reported_mm: f64,
    },
}

/// Finger after a stop for a [`StopReason`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finger {
    /// No move so far.
    Unmoved,
    /// Lifted.
    Lifted,
    /// At or above the height of travel.
    Up,
    /// Possibly in contact.
    Unknown,
}

impl fmt::Display for Finger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unmoved => "the machine did not move",
            Self::Lifted => "it was stopped, and its finger is lifted",
            Self::Up => "it was stopped with its finger up",
            Self::Unknown => {
                "it was stopped, and its finger could not be lifted: it may still press, so lift it by hand"
            }
        })
    }
}

const QUOTED: usize = 80;

/// Escapes a line in backticks, at most 80 characters.
pub(super) fn quoted(line: &str) -> String {
    let escaped: String = line
        .chars()
        .flat_map(|c| if c == '"' || c == '\'' { vec![c] } else { c.escape_default().collect() })
        .collect();
    let mut kept: String = escaped.chars().take(QUOTED).collect();
    if kept.len() < escaped.len() {
        kept.truncate(QUOTED - 3);
        kept.push_str("...");
    }
    format!("`{kept}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_at_most_80_printable_characters() {
        assert_eq!(quoted("echo:Unknown command: \"G1\""), "`echo:Unknown command: \"G1\"`");
        assert_eq!(quoted("\u{1b}[31m\u{fffd}"), "`\\u{1b}[31m\\u{fffd}`");
        let long = quoted(&"é\n".repeat(500));
        assert!(long.len() <= QUOTED + 2 && long.is_ascii(), "{long}");
    }
}
