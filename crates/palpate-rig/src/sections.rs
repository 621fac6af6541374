//! The rig file as it is written, before anything is checked: every key optional, every value with its place.
#![allow(missing_docs, reason = "keys of the file, which the reference of keys describes")]

use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor, value::MapAccessDeserializer};
use toml::Spanned;

use super::value::{RawColumn, RawPosition, RawQuantity};
pub use design::{ContactsKeys, DesignSection, MustHaveKeys, OfferKeys, SitesKey, ZoneKeys};
pub use supports::{BeamSectionKeys, EdgesSection, SupportKeys, SupportsKey};

mod design;
mod supports;

/// A value and its place, if the key is there.
type Key<T> = Option<Spanned<T>>;

/// The sections of a rig file. A study file has the same, and more beside them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigSections {
    pub surface: Key<SurfaceSection>,
    pub sensors: Key<SensorsSections>,
    pub contact: Key<ContactSection>,
    pub training: Key<TrainingSection>,
    pub estimator: Key<EstimatorSection>,
    pub recording: Key<RecordingSection>,
    pub motion: Key<MotionSections>,
    pub load: Option<Vec<Spanned<LoadSection>>>,
    pub design: Key<DesignSection>,
}

/// `[surface]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceSection {
    pub kind: Key<String>,
    pub length: Key<RawQuantity>,
    pub width: Key<RawQuantity>,
    pub thickness: Key<RawQuantity>,
    pub youngs_modulus: Key<RawQuantity>,
    pub supports: Key<SupportsKey>,
    pub sections: Key<Vec<Spanned<BeamSectionKeys>>>,
    pub poissons_ratio: Key<f64>,
    pub edges: Key<EdgesSection>,
    pub elements: Key<i64>,
    pub density: Key<RawQuantity>,
    pub direction: Key<String>,
}

/// One section, or several of one name.
#[derive(Clone, Debug)]
pub enum OneOrMany<T> {
    One(Box<T>),
    Many(Vec<Spanned<T>>),
}

/// A section that there may be several of.
pub trait Repeatable {
    const NAME: &'static str;
}

/// `[sensors]`, or several `[[sensors]]`
pub type SensorsSections = OneOrMany<SensorsSection>;

impl Repeatable for SensorsSection {
    const NAME: &'static str = "sensors";
}

/// `[motion]`, or several `[[motion]]`
pub type MotionSections = OneOrMany<MotionSection>;

impl Repeatable for MotionSection {
    const NAME: &'static str = "motion";
}

impl<T> OneOrMany<T> {
    /// Every section with its place; one alone is at `place`.
    pub fn each(&self, place: Range<usize>) -> Vec<(&T, Range<usize>)> {
        match self {
            Self::One(section) => vec![(section, place)],
            Self::Many(many) => many.iter().map(|section| (section.get_ref(), section.span())).collect(),
        }
    }
}

/// One `[sensors]` or `[[sensors]]`: sensors of one kind
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorsSection {
    pub measure: Key<String>,
    pub count: Key<i64>,
    pub grid: Key<Vec<Spanned<i64>>>,
    pub positions: Key<Vec<Spanned<RawPosition>>>,
    pub noise: Key<RawQuantity>,
    pub resolution: Key<RawQuantity>,
    pub gain_error: Key<RawQuantity>,
    pub offset_error: Key<RawQuantity>,
    pub position_error: Key<RawQuantity>,
    pub range: Key<Vec<Spanned<RawQuantity>>>,
    pub dead: Key<Vec<Spanned<i64>>>,
}

/// `[contact]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactSection {
    pub force: Key<RawQuantity>,
}

/// One `[[load]]`: a force spread over part of the surface
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadSection {
    pub from: Key<RawPosition>,
    pub to: Key<RawPosition>,
    pub force: Key<RawQuantity>,
}

/// `[training]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainingSection {
    pub arrangement: Key<String>,
    pub count: Key<i64>,
    pub grid: Key<Vec<Spanned<i64>>>,
    pub middle: Key<i64>,
    pub portion: Key<Vec<Spanned<RawQuantity>>>,
    pub positions: Key<Vec<Spanned<RawPosition>>>,
    pub repeats: Key<i64>,
    pub force: Key<RawQuantity>,
}

/// One `[motion]` or `[[motion]]`: how a contact moves
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionSection {
    pub from: Key<RawPosition>,
    pub to: Key<RawPosition>,
    pub speed: Key<RawQuantity>,
    pub turn: Key<RawQuantity>,
    pub passes: Key<i64>,
    pub lifted: Key<RawQuantity>,
    pub touch: Key<RawQuantity>,
    pub force: Key<RawQuantity>,
    pub rate: Key<RawQuantity>,
    pub damping: Key<RawQuantity>,
}

/// `[estimator]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimatorSection {
    pub kind: Key<String>,
    pub hidden: Key<Vec<Spanned<i64>>>,
    pub hidden_activation: Key<String>,
    pub output_activation: Key<String>,
    pub biases: Key<bool>,
    pub output: Key<String>,
    pub input_scale: Key<RawQuantity>,
    pub learning_rate: Key<f64>,
    pub momentum: Key<f64>,
    pub aggregate_error: Key<f64>,
    pub max_epochs: Key<i64>,
    pub order: Key<String>,
    pub initial_weights: Key<f64>,
    pub from: Key<String>,
    pub contacts: Key<i64>,
    pub force_sd: Key<RawQuantity>,
    pub theory: Key<String>,
}

impl EstimatorSection {
    /// The keys that are there but for `kind`, with their places.
    pub fn present(&self) -> Vec<(&'static str, Range<usize>)> {
        fn place<T>(name: &'static str, key: &Key<T>) -> Option<(&'static str, Range<usize>)> {
            key.as_ref().map(|key| (name, key.span()))
        }
        let keys = [
            place("hidden", &self.hidden),
            place("hidden_activation", &self.hidden_activation),
            place("output_activation", &self.output_activation),
            place("biases", &self.biases),
            place("output", &self.output),
            place("input_scale", &self.input_scale),
            place("learning_rate", &self.learning_rate),
            place("momentum", &self.momentum),
            place("aggregate_error", &self.aggregate_error),
            place("max_epochs", &self.max_epochs),
            place("order", &self.order),
            place("initial_weights", &self.initial_weights),
            place("from", &self.from),
            place("contacts", &self.contacts),
            place("force_sd", &self.force_sd),
            place("theory", &self.theory),
        ];
        keys.into_iter().flatten().collect()
    }

    /// These keys, and those of `base` where this section is silent.
    pub fn over(self, base: &Self) -> Self {
        let base = base.clone();
        Self {
            kind: self.kind.or(base.kind),
            hidden: self.hidden.or(base.hidden),
            hidden_activation: self.hidden_activation.or(base.hidden_activation),
            output_activation: self.output_activation.or(base.output_activation),
            biases: self.biases.or(base.biases),
            output: self.output.or(base.output),
            input_scale: self.input_scale.or(base.input_scale),
            learning_rate: self.learning_rate.or(base.learning_rate),
            momentum: self.momentum.or(base.momentum),
            aggregate_error: self.aggregate_error.or(base.aggregate_error),
            max_epochs: self.max_epochs.or(base.max_epochs),
            order: self.order.or(base.order),
            initial_weights: self.initial_weights.or(base.initial_weights),
            from: self.from.or(base.from),
            contacts: self.contacts.or(base.contacts),
            force_sd: self.force_sd.or(base.force_sd),
            theory: self.theory.or(base.theory),
        }
    }
}

/// `[recording]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingSection {
    pub header: Option<bool>,
    pub position: Key<RawColumn>,
    pub x: Key<RawColumn>,
    pub y: Key<RawColumn>,
    pub position_unit: Key<String>,
    pub channels: Key<Vec<Spanned<RawColumn>>>,
    pub channel_unit: Key<UnitNames>,
    pub force: Key<RawColumn>,
    pub force_unit: Key<String>,
    pub hidden: Key<RawColumn>,
    pub hidden_unit: Key<String>,
    pub origin: Key<Vec<Spanned<RawQuantity>>>,
    pub round: Key<RawQuantity>,
}

/// One unit for all channels, or one for each
#[derive(Clone, Debug)]
pub enum UnitNames {
    One(String),
    Each(Vec<Spanned<String>>),
}

impl<'de, T: Deserialize<'de> + Repeatable> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TableOrTables<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de> + Repeatable> Visitor<'de> for TableOrTables<T> {
            type Value = OneOrMany<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a table [{name}], or several [[{name}]]", name = T::NAME)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<OneOrMany<T>, A::Error> {
                Box::deserialize(MapAccessDeserializer::new(map)).map(OneOrMany::One)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<OneOrMany<T>, A::Error> {
                let mut sections = Vec::new();
                while let Some(section) = seq.next_element()? {
                    sections.push(section);
                }
                Ok(OneOrMany::Many(sections))
            }
        }

        deserializer.deserialize_any(TableOrTables(PhantomData))
    }
}

impl<'de> Deserialize<'de> for UnitNames {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OneOrEach;

        impl<'de> Visitor<'de> for OneOrEach {
            type Value = UnitNames;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a unit such as \"mm\", or an array of them")
            }

            fn visit_str<E: serde::de::Error>(self, unit: &str) -> Result<UnitNames, E> {
                Ok(UnitNames::One(unit.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<UnitNames, A::Error> {
                let mut units = Vec::new();
                while let Some(unit) = seq.next_element()? {
                    units.push(unit);
                }
                Ok(UnitNames::Each(units))
            }
        }

        deserializer.deserialize_any(OneOrEach)
    }
}
