//! A number with its unit, as people write it.

use std::fmt;
use std::str::FromStr;

use serde::de::{Deserialize, Deserializer, Visitor};

use super::{Dimension, Unit};

/// A finite value and what it measures.
///
/// Parsed from "400 mm", "200GPa", "5 µm", "5 %" or a plain number; shown with the prefix that keeps it readable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The value in SI units (m, N, Pa, rad, m/m, kg/m³, N/m, N·m/rad, m/s, s, Hz; a ratio of 5 % is 0.05).
    pub value: f64,
    /// What it measures.
    pub dimension: Dimension,
}

/// Why a text is not the quantity that was wanted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnitError {
    /// There is no text.
    #[error("empty; write a number and a unit, as in `400 mm`")]
    Empty,
    /// The text does not start with a decimal number.
    #[error("`{text}` does not start with a number; write a number and a unit, as in `400 mm`")]
    NotANumber {
        /// The text.
        text: String,
    },
    /// The number is NaN or infinite, or becomes infinite in SI units.
    #[error("`{text}` is not finite; the largest number is 1.8e308")]
    NotFinite {
        /// The text.
        text: String,
    },
    /// No unit has this symbol, whatever it was to measure.
    #[error("unknown unit `{unit}`; known are {}", Symbols(None))]
    UnknownUnit {
        /// What stands where the unit should.
        unit: String,
    },
    /// The unit is unknown, or measures something else than was wanted.
    #[error("{} `{unit}`; {} is one of {}", complaint(unit), wanted.noun(), Symbols(Some(*wanted)))]
    WrongUnit {
        /// What stands where the unit should.
        unit: String,
        /// What was wanted.
        wanted: Dimension,
    },
    /// A plain number stands where a unit is needed.
    #[error("`{text}` has no unit; {} is one of {}", wanted.noun(), Symbols(Some(*wanted)))]
    MissingUnit {
        /// The text.
        text: String,
        /// What was wanted.
        wanted: Dimension,
    },
    /// A unit stands where a plain number is wanted.
    #[error("`{text}` has a unit where a plain number is wanted")]
    UnwantedUnit {
        /// The text.
        text: String,
    },
}

fn complaint(unit: &str) -> &'static str {
    if Unit::from_symbol(unit).is_some() { "wrong unit" } else { "unknown unit" }
}

/// The symbols of one dimension, or of all, for messages.
struct Symbols(Option<Dimension>);

impl fmt::Display for Symbols {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use Dimension::{Angle, Density, Force, Length, Modulus, Ratio, Strain};
        use Dimension::{Frequency, RotationalStiffness, Speed, Stiffness, Time};
        let all = [
            Length,
            Force,
            Modulus,
            Angle,
            Strain,
            Ratio,
            Density,
            Stiffness,
            RotationalStiffness,
            Speed,
            Time,
            Frequency,
        ];
        let units =
            all.into_iter().filter(|d| self.0.is_none_or(|only| only == *d)).flat_map(Dimension::units);
        for (i, unit) in units.enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}{unit}")?;
        }
        Ok(())
    }
}

impl Quantity {
    /// Reads `text` as a quantity of the dimension `wanted` and returns its SI value.
    ///
    /// A ratio may be a plain number (0.05) or a percentage ("5 %"); every other dimension needs its unit.
    ///
    /// # Errors
    /// [`UnitError`], with the text or unit and the units that would do.
    pub fn parse_as(text: &str, wanted: Dimension) -> Result<f64, UnitError> {
        match text.parse::<Self>() {
            Ok(quantity) if quantity.dimension == wanted => Ok(quantity.value),
            Ok(Self { value, dimension: Dimension::None }) if wanted == Dimension::Ratio => Ok(value),
            Ok(Self { dimension: Dimension::None, .. }) => {
                Err(UnitError::MissingUnit { text: text.trim().to_owned(), wanted })
            }
            Ok(_) if wanted == Dimension::None => {
                Err(UnitError::UnwantedUnit { text: text.trim().to_owned() })
            }
            Ok(_) => Err(UnitError::WrongUnit { unit: split(text.trim()).1.to_owned(), wanted }),
            Err(UnitError::UnknownUnit { unit }) if wanted != Dimension::None => {
                Err(UnitError::WrongUnit { unit, wanted })
            }
            Err(error) => Err(error),
        }
    }
}

impl FromStr for Quantity {
    type Err = UnitError;

    fn from_str(text: &str) -> Result<Self, UnitError> {
        let text = text.trim();
        if text.is_empty() {
            return Err(UnitError::Empty);
        }
        let (number, symbol) = split(text);
        if number.is_empty() {
            let spelled = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
            let infinite = spelled.starts_with("inf") || spelled.starts_with("nan");
            let text = text.to_owned();
            return Err(if infinite {
                UnitError::NotFinite { text }
            } else {
                UnitError::NotANumber { text }
            });
        }
        let unit =
            Unit::from_symbol(symbol).ok_or_else(|| UnitError::UnknownUnit { unit: symbol.to_owned() })?;
        match unit.parse_si(number) {
            Some(value) if value.is_finite() => Ok(Self { value, dimension: unit.dimension() }),
            Some(_) => Err(UnitError::NotFinite { text: text.to_owned() }),
            None => Err(UnitError::NotANumber { text: text.to_owned() }),
        }
    }
}

/// The longest decimal number at the head of `text`, and what follows it without the space between.
fn split(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let digits_from = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits_from(sign);
    let mut end = sign + whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits_from(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return ("", text);
    }
    if let Some(b'e' | b'E') = bytes.get(end) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = bytes.get(end + 1 + sign).map_or(0, |_| digits_from(end + 1 + sign));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    let (number, rest) = text.split_at(end);
    (number, rest.trim_start())
}

/// A count with separators of thousands: "26,850".
pub fn format_count(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A length in metres as people read it: millimetres with at most four decimals, "44.4444 mm".
pub fn format_length_mm(length_m: f64) -> String {
    format!("{} mm", rounded(length_m * 1e3, 4))
}

/// Decimal notation with at most `decimals` decimals and no trailing zeros.
fn rounded(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

impl fmt::Display for Quantity {
    /// Six significant digits in the largest unit that keeps the number at 1 or above.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = readable_unit(*self);
        let rounded: f64 = format!("{:.5e}", self.value).parse().unwrap_or(self.value);
        let number = match unit {
            Some(unit) => unit.format_si(rounded),
            None => Unit::NONE.format_si(rounded),
        };
        match unit {
            Some(unit) => write!(f, "{number} {unit}"),
            None => f.write_str(&number),
        }
    }
}

/// The largest unit that keeps the number at 1 or above. Some units are read but never chosen, and lengths below 10 m
/// stay in millimetres.
fn readable_unit(quantity: Quantity) -> Option<Unit> {
    let magnitude = quantity.value.abs() * (1.0 + 1e-9);
    if magnitude == 0.0 {
        return quantity.dimension.units().find(|unit| unit.factor() == 1.0);
    }
    let hidden: &[&str] = if magnitude < 10.0 {
        &["m", "cm", "deg", "um/m", "mm/m", "g/cm3"]
    } else {
        &["cm", "deg", "um/m", "mm/m", "g/cm3"]
    };
    let mut best = None;
    for unit in quantity.dimension.units().filter(|unit| !hidden.contains(&unit.symbol())) {
        if best.is_none() || magnitude >= unit.factor() {
            best = Some(unit);
        }
    }
    best
}

impl<'de> Deserialize<'de> for Quantity {
    /// From a text with a unit, or from a plain number.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct TextOrNumber;

        impl Visitor<'_> for TextOrNumber {
            type Value = Quantity;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a quantity such as \"400 mm\", or a number")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Quantity, E> {
                text.parse().map_err(E::custom)
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Quantity, E> {
                if value.is_finite() {
                    Ok(Quantity { value, dimension: Dimension::None })
                } else {
                    Err(E::custom(UnitError::NotFinite { text: value.to_string() }))
                }
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Quantity, E> {
                self.visit_f64(value as f64)
            }

            fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<Quantity, E> {
                self.visit_f64(value as f64)
            }
        }

        deserializer.deserialize_any(TextOrNumber)
    }
}
