//! What can be wrong with a rig file, where, and what would help.

use std::ops::Range;

use palpate_estimators::arrangement::ArrangementError;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::modal::ModalBeamError;
use palpate_mechanics::surface::{
    BeamError, DigitError, Extent, NothingToRead, PlateError, SupportedBeamError,
};
use palpate_mechanics::units::UnitError;

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
        kind: palpate_mechanics::sensing::SensorKind,
    },
    /// A force that bends a digit further than its model goes.
    #[error(
        "`force` is {value}; with a contact at the tip this digit bears at most {:.3} N, a load F·l²/(E·I) of {}",
        most_n,
        palpate_mechanics::surface::Digit::MOST_LOAD
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
        key: &'static str,
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
        key: &'static str,
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

    /// The error for a document that is not even a set of sections.
    pub fn from_toml(error: toml::de::Error) -> Self {
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
    pub fn at(self, span: Range<usize>) -> RigError {
        RigError { problem: Box::new(self), span: Some(span) }
    }

    /// This problem, of something that is not there.
    pub fn nowhere(self) -> RigError {
        RigError { problem: Box::new(self), span: None }
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
