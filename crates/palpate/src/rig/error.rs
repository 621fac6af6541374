//! What can be wrong with a rig file, where, and what would help.

use std::fmt::Display;
use std::ops::Range;

use serde::de::{Expected, Unexpected};

use super::document::Place;
use crate::arrangement::ArrangementError;
use crate::contact::Position;
use crate::mechanics::modal::ModalBeamError;
use crate::mechanics::{BeamError, DigitError, Extent, NothingToRead, PlateError, SupportedBeamError};
use crate::sensing::SensorKind;

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
    /// A key that the section does not have.
    #[error("{}", unknown_key(key, known, with.as_deref()))]
    UnknownKey {
        /// The key.
        key: String,
        /// The keys that can stand there.
        known: Vec<&'static str>,
        /// What of the section leaves it with these keys, where it has others too: `kind = "beam"`.
        with: Option<String>,
    },
    /// A section is missing.
    #[error("there is no section [{section}]")]
    MissingSection {
        /// Its name.
        section: &'static str,
    },
    /// A section lacks a key.
    #[error("{} has no `{key}`", if section.is_empty() { "the file".to_owned() } else { format!("[{section}]") })]
    MissingKey {
        /// The section and those around it, as in `surface.supports`; empty for the file itself.
        section: String,
        /// The key.
        key: String,
    },
    /// A key that means nothing beside another one.
    #[error("`{key}` does not go with {with}")]
    UnusedKey {
        /// The key.
        key: String,
        /// What it does not go with.
        with: String,
    },
    /// A word that the key cannot be.
    #[error("`{key}` is `{word}`{}", suggestion(word, known))]
    UnknownWord {
        /// The key.
        key: String,
        /// What it is.
        word: String,
        /// What it can be.
        known: Vec<&'static str>,
    },
    /// A text that is not what the key wants, such as a quantity in another unit.
    #[error("`{key}`: {reason}")]
    Invalid {
        /// The key.
        key: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A number outside its bound.
    #[error("`{key}` is {value}; it must be {bound}")]
    OutOfRange {
        /// The key.
        key: String,
        /// Its value, as written.
        value: String,
        /// What it must be.
        bound: String,
    },
    /// A beam that cannot be computed.
    #[error(transparent)]
    Beam(BeamError),
    /// A beam on supports that cannot be computed.
    #[error(transparent)]
    SupportedBeam(SupportedBeamError),
    /// A plate that cannot be computed.
    #[error(transparent)]
    Plate(PlateError),
    /// A sensor that reads nothing, wherever the surface is touched.
    #[error(
        "{kind} sensor {number} is at {} and would read nothing: {reason}",
        extent.place_in_words(*position)
    )]
    NothingToRead {
        /// Which sensor of its section, from 1.
        number: usize,
        /// What it measures.
        kind: SensorKind,
        /// Where it is.
        position: Position,
        /// The surface.
        extent: Extent,
        /// Why.
        reason: NothingToRead,
    },
    /// A beam whose motion cannot be computed.
    #[error(transparent)]
    ModalBeam(ModalBeamError),
    /// A moving contact that is read too often to be held.
    #[error("the motion takes {readings} readings; at most {most} can be held")]
    TooManyReadings {
        /// Its duration times the rate.
        readings: f64,
        /// The most it can be.
        most: f64,
    },
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
        "sensor {number} is at {}, off the surface; it must be within {}",
        extent.place_in_words(*position),
        extent.bounds_in_words()
    )]
    SensorOffSurface {
        /// Which sensor of its section, from 1.
        number: usize,
        /// Where it is.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// A reaction sensor where nothing supports the surface.
    #[error(
        "reaction sensor {number} is at {}, where no support takes up force; {}",
        extent.place_in_words(*position),
        force_takers(*extent, supports)
    )]
    NoSupport {
        /// Which sensor of its section, from 1.
        number: usize,
        /// Where it is.
        position: Position,
        /// Where supports take up force.
        supports: Vec<Position>,
        /// The surface.
        extent: Extent,
    },
    /// A position with one coordinate on a plane, or with more than one on a line.
    #[error(
        "`{key}` has {found} where {} is expected",
        if *plane { "a pair of lengths, along and across," } else { "one length along the surface" }
    )]
    Coordinates {
        /// Where it stands.
        key: String,
        /// What is there.
        found: &'static str,
        /// Whether the surface has a width.
        plane: bool,
    },
    /// A place that is not on the surface.
    #[error(
        "`{key}` is at {}, off the surface; it must be within {}",
        extent.place_in_words(*position),
        extent.bounds_in_words()
    )]
    PlaceOffSurface {
        /// The key.
        key: String,
        /// Where it is.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// A stretch or rectangle that ends before it begins.
    #[error(
        "`to` is {}; it must lie beyond `from`, {}",
        extent.place_in_words(*to),
        extent.place_in_words(*from)
    )]
    EndsBeforeItBegins {
        /// Where it begins.
        from: Position,
        /// Where it ends.
        to: Position,
        /// The surface.
        extent: Extent,
    },
    /// A sensor that a layout must have, of a kind that cannot be had.
    #[error("`must_have` asks for a {kind} sensor, which is none of the kinds to choose from")]
    NotOffered {
        /// What it measures.
        kind: SensorKind,
    },
    /// A number of candidate sites, on a plane, where it does not say where they are.
    #[error("a number of `sites` does not say where on a plane they are")]
    CountOfSitesOnPlane,
    /// A number of places, on a plane, where it does not say where they are.
    #[error("[{section}] `count` alone does not say where on a plane they are")]
    CountOnPlane {
        /// The section.
        section: &'static str,
    },
    /// A raw channel on a surface with a model.
    #[error("a raw channel has no model; only a measured surface has raw channels")]
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
        key: String,
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
        first: SensorKind,
        /// What others measure.
        second: SensorKind,
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
            RigProblem::UnknownKey { key, known, .. } => {
                closest(key, known).map(|_| format!("known keys: {}", known.join(", ")))
            }
            RigProblem::UnknownWord { word, known, .. } => {
                closest(word, known).map(|_| format!("it can be: {}", known.join(", ")))
            }
            RigProblem::MissingSection { section } => Some(format!("add a section [{section}]")),
            RigProblem::MissingKey { key, .. } => Some(format!("add `{key} = …`")),
            RigProblem::NoForce => {
                Some("add `force = \"3 N\"` to [training] when later contacts have another, unknown force; to [contact] when they have the same".to_owned())
            }
            RigProblem::CountOnPlane { .. } => {
                Some("say `grid = [3, 3]`, columns and rows, or list pairs in `positions`".to_owned())
            }
            RigProblem::CountOfSitesOnPlane => {
                Some("say how far apart they are, as in `sites = \"10 mm\"`, or list pairs".to_owned())
            }
            RigProblem::Coordinates { plane: true, .. } => {
                Some("on a plane a position is written [\"75 mm\", \"40 mm\"]".to_owned())
            }
            RigProblem::NotAGauge { .. } => Some("`measure = \"strain\"`".to_owned()),
            RigProblem::NoSupport { .. } => Some("a reaction sensor sits at a support".to_owned()),
            RigProblem::NothingToRead { .. } => Some("move it off the support, or leave it out".to_owned()),
            RigProblem::NotOffered { kind } => {
                Some(format!("add {{ measure = \"{kind}\", noise = … }} to `kinds`"))
            }
            RigProblem::SupportedBeam(error) => error.help().map(str::to_owned),
            _ => None,
        }
    }

    /// Names the value that a type has refused, unless a value within it has been named already.
    pub(super) fn within(mut self, place: &Place) -> Self {
        if self.span.is_some() {
            return self;
        }
        match &mut *self.problem {
            RigProblem::OutOfRange { key, value, .. } => {
                place.key().clone_into(key);
                place.written().clone_into(value);
            }
            RigProblem::UnknownWord { key, .. } | RigProblem::Invalid { key, .. } => {
                place.key().clone_into(key);
            }
            RigProblem::MissingKey { section, .. } => place.path().clone_into(section),
            _ => {}
        }
        // What the file itself lacks is nowhere.
        self.span = (!place.path().is_empty()).then(|| place.span.clone());
        self
    }

    /// Names the place of a key that a table has refused, and what tells the table's keys.
    pub(super) fn at_key(mut self, span: Range<usize>, tag: Option<(&'static str, &str)>) -> Self {
        if let (RigProblem::UnknownKey { known, with, .. }, Some((key, word))) = (&mut *self.problem, tag) {
            known.insert(0, key);
            *with = Some(format!("{key} = \"{word}\""));
        }
        self.span = Some(span);
        self
    }
}

impl From<RigProblem> for RigError {
    /// The problem, of something that is nowhere.
    fn from(problem: RigProblem) -> Self {
        Self { problem: Box::new(problem), span: None }
    }
}

/// What types refuse; [`RigError::within`] says where.
impl serde::de::Error for RigError {
    fn custom<T: Display>(reason: T) -> Self {
        RigProblem::Invalid { key: String::new(), reason: reason.to_string() }.into()
    }

    fn invalid_type(_: Unexpected, expected: &dyn Expected) -> Self {
        let expected = expected.to_string();
        let bound = match expected.as_str() {
            "a sequence" => "a list",
            "a boolean" => "true or false",
            "a string" => "a text",
            "i64" => "a whole number",
            "f64" => "a number",
            words if words.starts_with("struct ") || words.starts_with("enum ") => "a table",
            words => words,
        };
        let bound = bound.to_owned();
        RigProblem::OutOfRange { key: String::new(), value: String::new(), bound }.into()
    }

    fn invalid_value(unexpected: Unexpected, expected: &dyn Expected) -> Self {
        Self::invalid_type(unexpected, expected)
    }

    fn invalid_length(_: usize, expected: &dyn Expected) -> Self {
        Self::invalid_type(Unexpected::Seq, expected)
    }

    fn unknown_variant(word: &str, known: &'static [&'static str]) -> Self {
        RigProblem::UnknownWord { key: String::new(), word: word.to_owned(), known: known.to_vec() }.into()
    }

    fn unknown_field(key: &str, known: &'static [&'static str]) -> Self {
        RigProblem::UnknownKey { key: key.to_owned(), known: known.to_vec(), with: None }.into()
    }

    fn missing_field(key: &'static str) -> Self {
        RigProblem::MissingKey { section: String::new(), key: key.to_owned() }.into()
    }
}

impl RigProblem {
    /// This problem, at a place of the document.
    pub(super) fn at(self, place: &Place) -> RigError {
        RigError { problem: Box::new(self), span: Some(place.span.clone()) }
    }
}

/// "those that do are at 0 mm and 400 mm".
fn force_takers(extent: Extent, supports: &[Position]) -> String {
    let places: Vec<String> = supports.iter().map(|support| extent.place_in_words(*support)).collect();
    match places.as_slice() {
        [] => "none of the supports does".to_owned(),
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

/// ", did you mean `x`?" for the known word closest to `word`, or what is known where none is close.
fn suggestion(word: &str, known: &[&'static str]) -> String {
    match closest(word, known) {
        Some(other) => format!(", did you mean `{other}`?"),
        None => format!("; known are {}", known.join(", ")),
    }
}

/// The known word that is a slip of the pen away: one edit, and one more for every four letters.
fn closest(word: &str, known: &[&'static str]) -> Option<&'static str> {
    let (distance, other) =
        known.iter().map(|other| (strsim::damerau_levenshtein(word, other), *other)).min()?;
    (distance <= 1 + word.chars().count() / 4).then_some(other)
}
