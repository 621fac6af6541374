//! URLs of machines: `gcode:serial:///dev/ttyUSB0?baud=115200` and `gcode:tcp://host:port`.

use crate::source::{Address, SourceUrl};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Address of a machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StageUrl {
    /// Serial port.
    Serial {
        /// Path of the port.
        port: PathBuf,
        /// Bits a second.
        baud: u32,
    },
    /// TCP server, for example a serial bridge.
    Tcp(Address),
}

/// Error of an invalid address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a machine{problem}; machines are `gcode:serial:///dev/ttyUSB0?baud=115200` and `gcode:tcp://host:port`"
)]
pub struct StageUrlError {
    /// Invalid text.
    pub text: String,
    /// Problem after `: `, if known.
    pub problem: String,
}

impl FromStr for StageUrl {
    type Err = StageUrlError;

    fn from_str(text: &str) -> Result<Self, StageUrlError> {
        let error = |problem: String| StageUrlError { text: text.to_owned(), problem };
        let link = text.strip_prefix("gcode:").ok_or_else(|| error(String::new()))?;
        match link.parse::<SourceUrl>() {
            Ok(SourceUrl::Serial { port, baud, columns }) if columns.is_empty() => {
                Ok(Self::Serial { port, baud })
            }
            Ok(SourceUrl::Tcp { server, columns }) if columns.is_empty() => Ok(Self::Tcp(server)),
            Ok(_) => Err(error(String::new())),
            Err(problem) => Err(error(format!(": {problem}"))),
        }
    }
}

impl fmt::Display for StageUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { port, baud } => write!(f, "gcode:serial://{}?baud={baud}", port.display()),
            Self::Tcp(server) => write!(f, "gcode:tcp://{server}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_is_at_a_port_or_behind_tcp() {
        for text in ["gcode:serial:///dev/ttyUSB0?baud=250000", "gcode:tcp://printer.local:23"] {
            assert_eq!(text.parse::<StageUrl>().unwrap().to_string(), text);
        }
        assert_eq!(
            "gcode:serial:///dev/ttyUSB0".parse::<StageUrl>().unwrap().to_string(),
            "gcode:serial:///dev/ttyUSB0?baud=115200"
        );
    }

    #[test]
    fn others_are_refused_with_the_reason() {
        for (text, words) in [
            ("serial:///dev/ttyUSB0", "machines are `gcode:serial:///dev/ttyUSB0?baud=115200`"),
            ("gcode:udp://:5000", "is not a machine"),
            ("gcode:tcp://host", "`host` has no port"),
            ("gcode:serial:///dev/x?columns=a", "is not a machine"),
        ] {
            let error = text.parse::<StageUrl>().unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
