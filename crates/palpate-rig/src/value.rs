//! Values of a rig file, and reading them with errors that know their key and place.
#![allow(missing_docs, reason = "keys of the file, which the reference of keys describes")]

use std::fmt;
use std::ops::RangeInclusive;

use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use toml::Spanned;

use super::error::{RigError, RigProblem};
use palpate_mechanics::units::{Dimension, Quantity, UnitError};

/// A quantity as written: a text with a unit, or a number.
#[derive(Clone, Debug)]
pub enum RawQuantity {
    Text(String),
    Number(f64),
}

/// A position as written: a length along a line, or a list of lengths on a plane.
#[derive(Clone, Debug)]
pub enum RawPosition {
    Along(RawQuantity),
    List(Vec<Spanned<RawQuantity>>),
}

/// A column as written: its name, or its number.
#[derive(Clone, Debug)]
pub enum RawColumn {
    Name(String),
    Number(i64),
}

impl fmt::Display for RawQuantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text(text) => f.write_str(text),
            Self::Number(number) => write!(f, "{number}"),
        }
    }
}

impl RawQuantity {
    fn read(&self, wanted: Dimension) -> Result<f64, UnitError> {
        match self {
            Self::Text(text) => Quantity::parse_as(text, wanted),
            Self::Number(number) if !number.is_finite() => {
                Err(UnitError::NotFinite { text: number.to_string() })
            }
            Self::Number(number) if matches!(wanted, Dimension::None | Dimension::Ratio) => Ok(*number),
            Self::Number(number) => Err(UnitError::MissingUnit { text: number.to_string(), wanted }),
        }
    }
}

/// The SI value of `raw`, which stands at `key`.
pub(super) fn quantity(
    key: &'static str,
    raw: &Spanned<RawQuantity>,
    wanted: Dimension,
) -> Result<f64, RigError> {
    raw.get_ref().read(wanted).map_err(|error| RigProblem::Unit { key, error }.at(raw.span()))
}

/// The same, refused unless `good`; `bound` says when it is.
pub(super) fn bounded(
    key: &'static str,
    raw: &Spanned<RawQuantity>,
    wanted: Dimension,
    good: impl Fn(f64) -> bool,
    bound: &'static str,
) -> Result<f64, RigError> {
    let value = quantity(key, raw, wanted)?;
    if good(value) { Ok(value) } else { Err(out_of_range(key, raw, bound)) }
}

/// A quantity that must be greater than 0.
pub fn positive(key: &'static str, raw: &Spanned<RawQuantity>, wanted: Dimension) -> Result<f64, RigError> {
    bounded(key, raw, wanted, |value| value > 0.0, "greater than 0")
}

/// A quantity that must be at least 0.
pub(super) fn not_negative(
    key: &'static str,
    raw: &Spanned<RawQuantity>,
    wanted: Dimension,
) -> Result<f64, RigError> {
    bounded(key, raw, wanted, |value| value >= 0.0, "at least 0")
}

/// A finite number, refused unless `good`; `bound` says when it is.
pub(super) fn number(
    key: &'static str,
    raw: &Spanned<f64>,
    good: impl Fn(f64) -> bool,
    bound: &'static str,
) -> Result<f64, RigError> {
    let value = *raw.get_ref();
    if value.is_finite() && good(value) { Ok(value) } else { Err(out_of_range(key, raw, bound)) }
}

/// A whole number within `bounds`, which `bound` says in words.
pub fn count(
    key: &'static str,
    raw: &Spanned<i64>,
    bounds: RangeInclusive<usize>,
    bound: &'static str,
) -> Result<usize, RigError> {
    match usize::try_from(*raw.get_ref()) {
        Ok(value) if bounds.contains(&value) => Ok(value),
        _ => Err(out_of_range(key, raw, bound)),
    }
}

/// The error for a value outside its bound.
pub(super) fn out_of_range<T: fmt::Display>(
    key: &'static str,
    raw: &Spanned<T>,
    bound: &'static str,
) -> RigError {
    RigProblem::OutOfRange { key, value: raw.get_ref().to_string(), bound }.at(raw.span())
}

/// One of the words that `key` can be, and what it stands for.
pub fn choice<T: Copy>(
    key: &'static str,
    raw: &Spanned<String>,
    words: &[(&'static str, T)],
) -> Result<T, RigError> {
    let written = raw.get_ref();
    match words.iter().find(|(word, _)| word == written) {
        Some((_, meaning)) => Ok(*meaning),
        None => {
            let known = words.iter().map(|(word, _)| *word).collect();
            Err(RigProblem::UnknownWord { key, word: written.clone(), known }.at(raw.span()))
        }
    }
}

impl<'de> Deserialize<'de> for RawQuantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TextOrNumber;

        impl Visitor<'_> for TextOrNumber {
            type Value = RawQuantity;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a quantity such as \"400 mm\", or a number")
            }

            fn visit_str<E>(self, text: &str) -> Result<RawQuantity, E> {
                Ok(RawQuantity::Text(text.to_owned()))
            }

            fn visit_i64<E>(self, number: i64) -> Result<RawQuantity, E> {
                Ok(RawQuantity::Number(number as f64))
            }

            fn visit_f64<E>(self, number: f64) -> Result<RawQuantity, E> {
                Ok(RawQuantity::Number(number))
            }
        }

        deserializer.deserialize_any(TextOrNumber)
    }
}

impl<'de> Deserialize<'de> for RawPosition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct LengthOrList;

        impl<'de> Visitor<'de> for LengthOrList {
            type Value = RawPosition;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a length such as \"75 mm\", or two of them on a plane")
            }

            fn visit_str<E>(self, text: &str) -> Result<RawPosition, E> {
                Ok(RawPosition::Along(RawQuantity::Text(text.to_owned())))
            }

            fn visit_i64<E>(self, number: i64) -> Result<RawPosition, E> {
                Ok(RawPosition::Along(RawQuantity::Number(number as f64)))
            }

            fn visit_f64<E>(self, number: f64) -> Result<RawPosition, E> {
                Ok(RawPosition::Along(RawQuantity::Number(number)))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<RawPosition, A::Error> {
                let mut lengths = Vec::new();
                while let Some(length) = seq.next_element()? {
                    lengths.push(length);
                }
                Ok(RawPosition::List(lengths))
            }
        }

        deserializer.deserialize_any(LengthOrList)
    }
}

impl<'de> Deserialize<'de> for RawColumn {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameOrNumber;

        impl Visitor<'_> for NameOrNumber {
            type Value = RawColumn;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a column's name, or its number from 1")
            }

            fn visit_str<E>(self, name: &str) -> Result<RawColumn, E> {
                Ok(RawColumn::Name(name.to_owned()))
            }

            fn visit_i64<E>(self, number: i64) -> Result<RawColumn, E> {
                Ok(RawColumn::Number(number))
            }
        }

        deserializer.deserialize_any(NameOrNumber)
    }
}
