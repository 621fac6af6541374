//! Errors of machines, and their descriptions.

use palpate_numerics::OutOfRange;
use std::fmt;
use std::io;

/// Failure of a machine.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The line is broken, so that the machine can no longer be reached.
    #[error("the line to the machine is broken: {0}")]
    Line(#[from] io::Error),
    /// The firmware is unknown.
    #[error(
        "the machine identifies itself neither as Marlin nor as GRBL; its answer is {}; check the baud rate",
        quoted(said)
    )]
    Unknown {
        /// Text of the answer.
        said: String,
    },
    /// An answer or a position is not the expected one, so that the machine was stopped.
    #[error("{doubt}; {finger}")]
    Doubt {
        /// The reason.
        doubt: Doubt,
        /// The finger after the stop.
        finger: Finger,
    },
    /// A move was requested before homing.
    #[error("the machine is not homed")]
    NotHomed,
    /// A person or a limit stopped the machine.
    #[error("the machine was stopped; it needs a reset before it moves again")]
    Stopped,
    /// The link has no reset line, and the setup requires one.
    #[error("`dtr_reset` needs a serial port: this link has no reset line")]
    NoResetLine,
    /// A number of the setup is out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
}

/// Reason to trust neither the machine's answers nor its position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// A line that is not an answer to the command.
    #[error("the machine answered {} to `{command}`", quoted(answer))]
    Answer {
        /// The command.
        command: String,
        /// The line.
        answer: String,
    },
    /// An `ok` without the report that the command requests.
    #[error("the machine answered `{command}` without {expected}")]
    NoReport {
        /// The command.
        command: String,
        /// The report.
        expected: &'static str,
    },
    /// A line outside of any command.
    #[error("the machine sent {} while no command was under way", quoted(line))]
    Unasked {
        /// The line.
        line: String,
    },
    /// No answer in time.
    #[error("the machine did not answer `{command}` within {seconds} s")]
    Silent {
        /// The command.
        command: String,
        /// Seconds of waiting.
        seconds: u64,
    },
    /// The machine restarted.
    #[error("the machine was reset: it sent {}", quoted(greeting))]
    Restart {
        /// The line.
        greeting: String,
    },
    /// The reported position differs from the target.
    #[error("the machine reports {axis} {reported_mm:.2} mm and was sent to {axis} {target_mm:.2} mm")]
    OffPosition {
        /// `X`, `Y` or `Z`.
        axis: char,
        /// The target, in mm.
        target_mm: f64,
        /// The reported position, in mm.
        reported_mm: f64,
    },
}

/// State of the finger after the machine was stopped for a `Doubt`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finger {
    /// The machine had not moved yet.
    Unmoved,
    /// The finger was lifted to the height of travel, and the machine was halted.
    Lifted,
    /// The machine was halted with the finger at the height of travel or above.
    Up,
    /// The finger could not be lifted: the machine was halted, and the finger may still press.
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

/// Largest number of characters of a quoted line.
const QUOTED: usize = 80;

/// A machine's line between backticks: control characters and quotes escaped, at most 80 characters.
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
