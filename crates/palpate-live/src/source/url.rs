//! URLs of sources.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// A source, as a URL names it.
#[derive(Clone, Debug, PartialEq)]
pub enum SourceUrl {
    /// `-`: the standard input.
    Stdin,
    /// `file:recording.mcap?speed=1`: the readings of a recording.
    File {
        /// The recording.
        path: PathBuf,
        /// Its pace over that at which it was recorded; 0 for as fast as can be.
        speed: f64,
    },
    /// `simulated:rig.toml?rate=1000&seed=0`: a simulated board.
    Simulated {
        /// The rig that it has on its bench.
        rig: PathBuf,
        /// Readings a second.
        rate_hz: f64,
        /// Seed of its noise and its finger.
        seed: u64,
    },
}

/// Text that is no URL of a source.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SourceUrlError {
    /// A scheme that no source has.
    #[error(
        "`{text}` is no source; sources are `-`, `file:recording.mcap?speed=1` and `simulated:rig.toml?rate=1000`"
    )]
    Scheme {
        /// The text.
        text: String,
    },
    /// A parameter that the source does not have, or a value that it cannot take.
    #[error("`{text}`: {problem}")]
    Parameter {
        /// The URL.
        text: String,
        /// What is wrong with it, and what it may be.
        problem: String,
    },
}

impl FromStr for SourceUrl {
    type Err = SourceUrlError;

    fn from_str(text: &str) -> Result<Self, SourceUrlError> {
        if text == "-" {
            return Ok(Self::Stdin);
        }
        if let Some(rest) = text.strip_prefix("file:") {
            return file(text, rest);
        }
        let Some(rest) = text.strip_prefix("simulated:") else {
            return Err(SourceUrlError::Scheme { text: text.to_owned() });
        };
        let (path, query) = rest.split_once('?').unwrap_or((rest, ""));
        let (mut rate_hz, mut seed) = (100.0, 0);
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let problem = |problem: String| SourceUrlError::Parameter { text: text.to_owned(), problem };
            match pair.split_once('=') {
                Some(("rate", value)) => {
                    rate_hz =
                        value.parse().ok().filter(|rate| *rate > 0.0 && *rate <= 1e5).ok_or_else(|| {
                            problem(format!(
                                "rate `{value}` must be a number greater than 0 and at most 100000 Hz"
                            ))
                        })?;
                }
                Some(("seed", value)) => {
                    seed = value.parse().map_err(|_| {
                        problem(format!("seed `{value}` must be a whole number of at least 0"))
                    })?;
                }
                _ => return Err(problem(format!("`{pair}` is no parameter; known are `rate` and `seed`"))),
            }
        }
        Ok(Self::Simulated { rig: path.into(), rate_hz, seed })
    }
}

/// What follows `file:`.
fn file(text: &str, rest: &str) -> Result<SourceUrl, SourceUrlError> {
    let problem = |problem: String| SourceUrlError::Parameter { text: text.to_owned(), problem };
    let (path, query) = rest.split_once('?').unwrap_or((rest, ""));
    let mut speed = 1.0;
    for pair in query.split('&').filter(|pair| !pair.is_empty()) {
        let Some(("speed", value)) = pair.split_once('=') else {
            return Err(problem(format!("`{pair}` is no parameter; known is `speed`")));
        };
        speed = super::file::parse_speed(value).ok_or_else(|| {
            problem(format!(
                "speed `{value}` must be a number from 0, which is as fast as can be, to 1000000"
            ))
        })?;
    }
    Ok(SourceUrl::File { path: path.into(), speed })
}

impl fmt::Display for SourceUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stdin => f.write_str("-"),
            Self::File { path, speed } => write!(f, "file:{}?speed={speed}", path.display()),
            Self::Simulated { rig, rate_hz, seed } => {
                write!(f, "simulated:{}?rate={rate_hz}&seed={seed}", rig.display())
            }
        }
    }
}
