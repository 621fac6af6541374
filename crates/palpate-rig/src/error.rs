//! Errors of a rig or study file: problem, place and remedy.

use std::fmt::Display;
use std::ops::Range;

use palpate_estimators::arrangement::ArrangementError;
use palpate_estimators::setup::SetupError;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{LayoutError, SensorKind};
use palpate_mechanics::surface::modal::ModalBeamError;
use palpate_mechanics::surface::{
    BeamError, DigitError, Extent, InsensitiveSensor, PlateError, SupportedBeamError,
};
use palpate_numerics::OutOfRange;
use serde::de::{Expected, Unexpected};

/// Error of a rig or study file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct RigError {
    /// Problem.
    pub problem: Box<RigProblem>,
    /// Bytes at fault; `None` if an item is missing.
    pub span: Option<Range<usize>>,
}

/// Problem of a rig or study file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigProblem {
    /// Invalid TOML.
    #[error("{}", .0.message())]
    Toml(toml::de::Error),
    /// Missing section.
    #[error("section {section} is missing")]
    MissingSection {
        /// Name in brackets.
        section: &'static str,
    },
    /// Missing key.
    #[error("{} has no `{key}`", if section.is_empty() { "the file".to_owned() } else { format!("[{section}]") })]
    MissingKey {
        /// Path, as in `surface.supports`; empty for the file.
        section: String,
        /// Key.
        key: String,
    },
    /// Unknown key.
    #[error("{}", unknown_key(key, known, with.as_deref()))]
    UnknownKey {
        /// Key.
        key: String,
        /// Valid keys.
        known: Vec<&'static str>,
        /// Key and value that restrict the keys.
        with: Option<String>,
    },
    /// Key without effect.
    #[error("`{key}` does not go with {with}")]
    UnusedKey {
        /// Key.
        key: String,
        /// Conflicting key or item.
        with: String,
    },
    /// Unknown word.
    #[error("`{key}` is `{word}`{}", suggestion(word, known))]
    UnknownWord {
        /// Key.
        key: String,
        /// Word.
        word: String,
        /// Valid words.
        known: Vec<&'static str>,
    },
    /// Invalid text, such as a quantity in another unit.
    #[error("`{key}`: {reason}")]
    Invalid {
        /// Key.
        key: String,
        /// Reason.
        reason: String,
    },
    /// Value out of range.
    #[error("`{key}` is {value}; it must be {bound}")]
    OutOfRange {
        /// Key.
        key: String,
        /// Value as written.
        value: String,
        /// Bound in words.
        bound: String,
    },
    /// Side of a surface out of range.
    #[error(transparent)]
    Extent(OutOfRange),
    /// Invalid beam.
    #[error(transparent)]
    Beam(BeamError),
    /// Invalid beam on supports.
    #[error(transparent)]
    SupportedBeam(SupportedBeamError),
    /// Invalid plate.
    #[error(transparent)]
    Plate(PlateError),
    /// Invalid digit.
    #[error(transparent)]
    Digit(DigitError),
    /// Invalid beam with a motion.
    #[error(transparent)]
    ModalBeam(ModalBeamError),
    /// Invalid motion.
    #[error(transparent)]
    Motion(OutOfRange),
    /// Invalid sensor.
    #[error(transparent)]
    Layout(LayoutError),
    /// Sensors or force that do not suit the surface.
    #[error(transparent)]
    Setup(SetupError),
    /// Invalid training positions.
    #[error(transparent)]
    Arrangement(ArrangementError),
    /// Insensitive sensor.
    #[error(
        "{kind} sensor {number} is at {} and would always read 0: {reason}",
        extent.place_in_words(*position)
    )]
    InsensitiveSensor {
        /// Number in its section, from 1.
        number: usize,
        /// Kind.
        kind: SensorKind,
        /// Position.
        position: Position,
        /// Surface.
        extent: Extent,
        /// Reason.
        reason: InsensitiveSensor,
    },
    /// Reaction sensor without a support.
    #[error(
        "reaction sensor {number} is at {}, where no support takes up force; {}",
        extent.place_in_words(*position),
        force_takers(*extent, supports)
    )]
    NoSupport {
        /// Number in its section, from 1.
        number: usize,
        /// Position.
        position: Position,
        /// Supports with a force.
        supports: Vec<Position>,
        /// Surface.
        extent: Extent,
    },
    /// Unknown force in a simulation.
    #[error(
        "the surface is to be simulated at these training positions, but neither [training] nor [contact] has a `force`"
    )]
    NoForce,
}

/// Place of a value in the document.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// Keys joined by dots; an element has the path of its list, the document an empty one.
    pub path: String,
    pub span: Range<usize>,
    /// Value as messages quote it.
    pub written: String,
}

impl Place {
    pub fn key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or_default()
    }

    pub fn refuse(&self, bound: impl Display) -> RigError {
        self.refuse_value(&self.written, bound)
    }

    /// As [`Place::refuse`], with `value` in the message.
    pub fn refuse_value(&self, value: impl Display, bound: impl Display) -> RigError {
        let (value, bound) = (value.to_string(), bound.to_string());
        RigProblem::OutOfRange { key: self.key().to_owned(), value, bound }.at_place(self)
    }

    pub fn invalid(&self, reason: impl Display) -> RigError {
        RigProblem::Invalid { key: self.key().to_owned(), reason: reason.to_string() }.at_place(self)
    }

    pub fn missing(&self, key: &str) -> RigError {
        RigProblem::MissingKey { section: self.path.clone(), key: key.to_owned() }.at_place(self)
    }

    pub fn unused(&self, with: impl Display) -> RigError {
        RigProblem::UnusedKey { key: self.key().to_owned(), with: with.to_string() }.at_place(self)
    }
}

impl RigError {
    /// Remedy beyond the message.
    pub fn help(&self) -> Option<String> {
        match &*self.problem {
            RigProblem::UnknownKey { key, known, .. } => {
                closest(key, known).map(|_| format!("known keys: {}", known.join(", ")))
            }
            RigProblem::UnknownWord { word, known, .. } => {
                closest(word, known).map(|_| format!("it can be: {}", known.join(", ")))
            }
            RigProblem::MissingSection { section } => Some(format!("add a section {section}")),
            RigProblem::MissingKey { key, .. } => Some(format!("add `{key} = …`")),
            RigProblem::NoForce => {
                Some("add `force = \"3 N\"` to [training] when later contacts have another, unknown force; to [contact] when they have the same".to_owned())
            }
            RigProblem::NoSupport { .. } => Some("a reaction sensor sits at a support".to_owned()),
            RigProblem::InsensitiveSensor { .. } => Some("move it off the support, or leave it out".to_owned()),
            RigProblem::SupportedBeam(error) => error.help().map(str::to_owned),
            _ => None,
        }
    }

    /// Sets key and place, unless an inner value has set them.
    pub(crate) fn with_place(mut self, place: &Place) -> Self {
        if self.span.is_some() {
            return self;
        }
        match &mut *self.problem {
            RigProblem::OutOfRange { key, value, .. } => {
                place.key().clone_into(key);
                place.written.clone_into(value);
            }
            RigProblem::UnknownWord { key, .. } | RigProblem::Invalid { key, .. } => {
                place.key().clone_into(key);
            }
            RigProblem::MissingKey { section, .. } => place.path.clone_into(section),
            _ => {}
        }
        // A key that the file itself lacks has no place.
        self.span = (!place.path.is_empty()).then(|| place.span.clone());
        self
    }

    /// Sets the place of an unknown key; `tag` determined the valid keys.
    pub(crate) fn at_key(mut self, span: Range<usize>, tag: Option<(&'static str, &str)>) -> Self {
        if let (RigProblem::UnknownKey { known, with, .. }, Some((key, word))) = (&mut *self.problem, tag) {
            known.insert(0, key);
            *with = Some(format!("{key} = \"{word}\""));
        }
        self.span = Some(span);
        self
    }
}

impl RigProblem {
    pub(crate) fn at_place(self, place: &Place) -> RigError {
        RigError { problem: Box::new(self), span: Some(place.span.clone()) }
    }

    pub(crate) fn without_place(self) -> RigError {
        RigError { problem: Box::new(self), span: None }
    }
}

/// Errors of types; the deserializer adds the place.
impl serde::de::Error for RigError {
    fn custom<T: Display>(reason: T) -> Self {
        RigProblem::Invalid { key: String::new(), reason: reason.to_string() }.without_place()
    }

    fn invalid_type(_: Unexpected, expected: &dyn Expected) -> Self {
        let expected = expected.to_string();
        let bound = match expected.as_str() {
            "a sequence" => "a list",
            "a boolean" => "true or false",
            "a string" => "a text",
            "i64" => "a whole number",
            words if words.starts_with("struct ") || words.starts_with("enum ") => "a table",
            words => words,
        };
        RigProblem::OutOfRange { key: String::new(), value: String::new(), bound: bound.to_owned() }
            .without_place()
    }

    fn invalid_value(unexpected: Unexpected, expected: &dyn Expected) -> Self {
        Self::invalid_type(unexpected, expected)
    }

    fn invalid_length(_: usize, expected: &dyn Expected) -> Self {
        Self::invalid_type(Unexpected::Seq, expected)
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        RigProblem::UnknownWord { key: String::new(), word: word.to_owned(), known: known.to_vec() }
            .without_place()
    }

    fn unknown_field(key: &str, known: &'static [&'static str]) -> Self {
        RigProblem::UnknownKey { key: key.to_owned(), known: known.to_vec(), with: None }.without_place()
    }

    fn missing_field(key: &'static str) -> Self {
        RigProblem::MissingKey { section: String::new(), key: key.to_owned() }.without_place()
    }
}

/// Lists supports: "those that do are at 0 mm and 400 mm".
fn force_takers(extent: Extent, supports: &[Position]) -> String {
    let places: Vec<String> = supports.iter().map(|support| extent.place_in_words(*support)).collect();
    match places.as_slice() {
        [] => "no support does".to_owned(),
        [only] => format!("the only one that does is at {only}"),
        [first @ .., last] => format!("those that do are at {} and {last}", first.join(", ")),
    }
}

fn unknown_key(key: &str, known: &[&'static str], with: Option<&str>) -> String {
    match with {
        Some(with) if closest(key, known).is_none() => {
            format!("`{key}` does not go with {with}; known are {}", known.join(", "))
        }
        _ => format!("unknown key `{key}`{}", suggestion(key, known)),
    }
}

/// ", did you mean `x`?" for a close word, else the valid words.
fn suggestion(word: &str, known: &[&'static str]) -> String {
    match closest(word, known) {
        Some(other) => format!(", did you mean `{other}`?"),
        None => format!("; known are {}", known.join(", ")),
    }
}

/// Invalid words with their valid synonyms.
const RENAMED: [(&str, &str); 1] = [("from", "source")];

/// Synonym, or closest word within one edit plus one per four letters.
fn closest(word: &str, known: &[&'static str]) -> Option<&'static str> {
    let renamed = RENAMED.iter().find(|(before, now)| *before == word && known.contains(now));
    if let Some((_, now)) = renamed {
        return Some(now);
    }
    let (distance, other) =
        known.iter().map(|other| (strsim::damerau_levenshtein(word, other), *other)).min()?;
    (distance <= 1 + word.chars().count() / 4).then_some(other)
}
