//! What can be wrong with a rig file, where, and what would help.

use std::ops::Range;

use crate::arrangement::ArrangementError;
use crate::mechanics::{BeamError, DigitError};
use crate::units::{UnitError, format_length_mm};

/// A rig file, or a section of one in a study, that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct RigError {
    /// What is wrong.
    pub problem: Box<RigProblem>,
    /// The bytes of the document that are meant; `None` when something is not there at all.
    pub span: Option<Range<usize>>,
}

/// What is wrong with a rig file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigProblem {
    /// The text is not TOML, or a value has the wrong type.
    #[error("{}", .0.message())]
    Toml(toml::de::Error),
    /// A key that no section has, or not this one.
    #[error("unknown key `{key}`{}", suggestion(key, known.iter().map(String::as_str)))]
    UnknownKey {
        /// The key.
        key: String,
        /// The keys that can stand there.
        known: Vec<String>,
    },
    /// A section is missing.
    #[error("there is no section [{section}]")]
    MissingSection {
        /// Its name.
        section: &'static str,
    },
    /// A section lacks a key.
    #[error("[{section}] has no `{key}`")]
    MissingKey {
        /// The section.
        section: &'static str,
        /// The key.
        key: &'static str,
    },
    /// A key that means nothing beside another one.
    #[error("`{key}` does not go with {with}")]
    UnusedKey {
        /// The key.
        key: &'static str,
        /// What it does not go with.
        with: &'static str,
    },
    /// A word that the key cannot be.
    #[error("`{key}` is `{word}`{}", suggestion(word, known.iter().copied()))]
    UnknownWord {
        /// The key.
        key: &'static str,
        /// What it is.
        word: String,
        /// What it can be.
        known: Vec<&'static str>,
    },
    /// A text that is not the quantity which the key wants.
    #[error("`{key}`: {error}")]
    Unit {
        /// The key.
        key: &'static str,
        /// What is wrong with it.
        error: UnitError,
    },
    /// A number outside its bound.
    #[error("`{key}` is {value}; it must be {bound}")]
    OutOfRange {
        /// The key.
        key: &'static str,
        /// Its value, as written.
        value: String,
        /// What it must be.
        bound: &'static str,
    },
    /// A beam that cannot be computed.
    #[error(transparent)]
    Beam(BeamError),
    /// A digit that cannot be computed.
    #[error(transparent)]
    Digit(DigitError),
    /// A sensor on a digit that is no strain gauge.
    #[error("a digit is read by strain gauges; `measure` is `{kind}`")]
    NotAGauge {
        /// What it measures.
        kind: crate::sensing::SensorKind,
    },
    /// A force that bends a digit further than its model goes.
    #[error(
        "`force` is {value}; with a contact at the tip this digit bears at most {:.3} N, a load F·l²/(E·I) of {}",
        most_n,
        crate::mechanics::Digit::MOST_LOAD
    )]
    TooMuchForce {
        /// The force, as written.
        value: String,
        /// The largest, in newtons.
        most_n: f64,
    },
    /// Training positions that cannot be laid out.
    #[error(transparent)]
    Arrangement(ArrangementError),
    /// A sensor beside the surface.
    #[error(
        "sensor {number} is at {}, off the surface; it must be within 0 and {}",
        format_length_mm(*x_m),
        format_length_mm(*length_m)
    )]
    SensorOffSurface {
        /// Which sensor of its section, from 1.
        number: usize,
        /// Where it is, in metres.
        x_m: f64,
        /// The surface's length, in metres.
        length_m: f64,
    },
    /// A reaction sensor where nothing supports the surface.
    #[error(
        "reaction sensor {number} is at {}, where no support is; the supports are at 0 and {}",
        format_length_mm(*x_m),
        format_length_mm(*length_m)
    )]
    NoSupport {
        /// Which sensor of its section, from 1.
        number: usize,
        /// Where it is, in metres.
        x_m: f64,
        /// The surface's length, in metres.
        length_m: f64,
    },
    /// A raw channel on a surface with a model.
    #[error("a raw channel has no model on a beam; only a measured surface has raw channels")]
    RawOnModel,
    /// A dead sensor that does not exist.
    #[error("`dead` names sensor {number}; this section has sensors 1 to {count}")]
    DeadNumber {
        /// The number.
        number: i64,
        /// How many sensors the section has.
        count: usize,
    },
    /// The rig is to be simulated, but its force is unknown.
    #[error(
        "the surface is to be simulated at these training positions, but neither [training] nor [contact] has a `force`"
    )]
    NoForce,
    /// The training positions, their repeats and the sensors make a recording too large to hold.
    #[error("training positions × repeats × sensors make {values} values; at most {most} can be held")]
    TooManyValues {
        /// The product.
        values: usize,
        /// The most it can be.
        most: usize,
    },
    /// The columns that hold channels are not as many as the sensors.
    #[error("`{key}` lists {listed}, but there are {sensors} sensors; they must be as many")]
    ChannelCount {
        /// The key.
        key: &'static str,
        /// How many it lists.
        listed: usize,
        /// How many sensors there are.
        sensors: usize,
    },
    /// Two channels are the same column.
    #[error("channels {first} and {second} are the same column")]
    SameColumn {
        /// The first one's number, from 1.
        first: usize,
        /// The second one's number, from 1.
        second: usize,
    },
    /// One reading is to scale sensors that measure different things.
    #[error("one reading cannot scale both {first} and {second} sensors")]
    MixedKinds {
        /// What some measure.
        first: crate::sensing::SensorKind,
        /// What others measure.
        second: crate::sensing::SensorKind,
    },
    /// A column is given by name in a file without a header.
    #[error(
        "column `{name}` is given by name, but `header = false`; a file without a header has column numbers only"
    )]
    NameWithoutHeader {
        /// The name.
        name: String,
    },
}

impl RigError {
    /// What would help, where more can be said than the message does.
    pub fn help(&self) -> Option<String> {
        match &*self.problem {
            RigProblem::UnknownKey { key, known } => closest(key, known.iter().map(String::as_str))
                .map(|_| format!("known keys: {}", known.join(", "))),
            RigProblem::UnknownWord { word, known, .. } => {
                closest(word, known.iter().copied()).map(|_| format!("it can be: {}", known.join(", ")))
            }
            RigProblem::MissingSection { section } => Some(format!("add a section [{section}]")),
            RigProblem::MissingKey { key, .. } => Some(format!("add `{key} = …`")),
            RigProblem::NoForce => {
                Some("add `force = \"3 N\"` to [training] when later contacts have another, unknown force; to [contact] when they have the same".to_owned())
            }
            RigProblem::NotAGauge { .. } => Some("`measure = \"strain\"`".to_owned()),
            RigProblem::NoSupport { .. } => Some("a reaction sensor sits at a support".to_owned()),
            _ => None,
        }
    }

    /// The error for a document that is not even a set of sections.
    pub(crate) fn from_toml(error: toml::de::Error) -> Self {
        let span = error.span();
        let problem = match unknown_key(error.message()) {
            Some((key, known)) => RigProblem::UnknownKey { key, known },
            None => RigProblem::Toml(error),
        };
        Self { problem: Box::new(problem), span }
    }
}

impl RigProblem {
    /// This problem, at a place of the document.
    pub(crate) fn at(self, span: Range<usize>) -> RigError {
        RigError { problem: Box::new(self), span: Some(span) }
    }

    /// This problem, of something that is not there.
    pub(crate) fn nowhere(self) -> RigError {
        RigError { problem: Box::new(self), span: None }
    }
}

/// The key and the known keys, from serde's words "unknown field `a`, expected one of `b`, `c`".
fn unknown_key(message: &str) -> Option<(String, Vec<String>)> {
    let rest = message.strip_prefix("unknown field `")?;
    let (key, known) = rest.split_once("`, expected ")?;
    let known = known.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    Some((key.to_owned(), known))
}

/// ", did you mean `x`?" for the known word closest to `word`, or what is known where none is close.
fn suggestion<'a>(word: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match closest(word, known.clone()) {
        Some(other) => format!(", did you mean `{other}`?"),
        None => format!("; known are {}", known.collect::<Vec<_>>().join(", ")),
    }
}

/// The known word that is a slip of the pen away: one edit, and one more for every four letters.
fn closest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let (distance, other) = known.map(|other| (strsim::damerau_levenshtein(word, other), other)).min()?;
    (distance <= 1 + word.chars().count() / 4).then_some(other)
}
