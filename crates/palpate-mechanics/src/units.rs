//! Units of measure; values inside palpate are SI.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Metres from millimetres.
pub const fn mm(length: f64) -> f64 {
    length * 1e-3
}

/// Metres from micrometres.
pub const fn um(length: f64) -> f64 {
    length * 1e-6
}

/// Newtons.
pub const fn newtons(force: f64) -> f64 {
    force
}

/// Pascals from gigapascals.
pub const fn gpa(modulus: f64) -> f64 {
    modulus * 1e9
}

/// Pascals from megapascals.
pub const fn mpa(modulus: f64) -> f64 {
    modulus * 1e6
}

/// Strain from microstrain.
pub const fn microstrain(strain: f64) -> f64 {
    strain * 1e-6
}

/// A finite value and its dimension.
///
/// ```
/// use palpate_mechanics::units::{Dimension, Quantity};
///
/// assert_eq!(Quantity::parse_as("1.2 mm", Dimension::Length)?, 0.0012);
/// assert_eq!(Quantity { value: 0.0012, dimension: Dimension::Length }.to_string(), "1.2 mm");
/// let refused = Quantity::parse_as("3 N", Dimension::Length).unwrap_err();
/// assert_eq!(refused.to_string(), "wrong unit `N`; a length is one of nm, um, mm, cm, m");
/// # Ok::<(), palpate_mechanics::units::UnitError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// SI value.
    pub value: f64,
    /// Dimension of the value.
    pub dimension: Dimension,
}

/// Error of a text.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnitError {
    /// The text is empty.
    #[error("empty; write a number and a unit, as in `400 mm`")]
    Empty,
    /// It does not start with a number.
    #[error("`{text}` does not start with a number; write a number and a unit, as in `400 mm`")]
    NotANumber {
        /// The text.
        text: String,
    },
    /// The SI value is not finite.
    #[error("`{text}` is not finite; the largest number is 1.8e308")]
    NotFinite {
        /// The text.
        text: String,
    },
    /// The unit is unknown.
    #[error("unknown unit `{unit}`; known are {}", Symbols(None))]
    UnknownUnit {
        /// Text after the number.
        unit: String,
    },
    /// The unit is unknown or of another dimension.
    #[error("{} `{unit}`; {} is one of {}", unit_problem(unit), wanted.noun(), Symbols(Some(*wanted)))]
    WrongUnit {
        /// Text after the number.
        unit: String,
        /// Expected dimension.
        wanted: Dimension,
    },
    /// A required unit is missing.
    #[error("`{text}` has no unit; {} is one of {}", wanted.noun(), Symbols(Some(*wanted)))]
    MissingUnit {
        /// The text.
        text: String,
        /// Expected dimension.
        wanted: Dimension,
    },
    /// A unit after a plain number.
    #[error("`{text}` has a unit, but a plain number is expected")]
    UnwantedUnit {
        /// The text.
        text: String,
    },
}

fn unit_problem(unit: &str) -> &'static str {
    if Unit::from_symbol(unit).is_some() { "wrong unit" } else { "unknown unit" }
}

struct Symbols(Option<Dimension>);

impl fmt::Display for Symbols {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wanted = |unit: &Unit| self.0.is_none_or(|only| only == unit.dimension());
        for (i, unit) in Unit::in_ascii().filter(wanted).enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}{unit}")?;
        }
        Ok(())
    }
}

impl Quantity {
    /// Parses a quantity of a dimension as its SI value; a ratio may be a plain number.
    ///
    /// # Errors
    /// [`UnitError`].
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

    /// Parses the ends of an interval; a plain start has the unit of the end.
    ///
    /// ```
    /// use palpate_mechanics::units::{Dimension, Quantity};
    ///
    /// assert_eq!(Quantity::parse_span(["0", "100 mm"], Dimension::Length), Ok([Some(0.0), Some(0.1)]));
    /// assert_eq!(Quantity::parse_span(["95 s", ""], Dimension::Time), Ok([Some(95.0), None]));
    /// ```
    ///
    /// # Errors
    /// [`UnitError`].
    pub fn parse_span([from, to]: [&str; 2], wanted: Dimension) -> Result<[Option<f64>; 2], UnitError> {
        let end = |text: &str| -> Result<Option<f64>, UnitError> {
            if text.is_empty() { Ok(None) } else { Self::parse_as(text, wanted).map(Some) }
        };
        let (from, to) = (from.trim(), to.trim());
        let to_value = end(to)?;
        let unit = to.trim_start_matches(|c: char| c.is_ascii_digit() || "+-.eE ".contains(c));
        let from_value =
            if from.parse::<f64>().is_ok() { end(&format!("{from} {unit}"))? } else { end(from)? };
        Ok([from_value, to_value])
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

/// Formats with thousands separators: "26,850".
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

/// Formats in millimetres with at most four decimals.
pub fn format_length_mm(length_m: f64) -> String {
    format!("{} mm", rounded(length_m * 1e3, 4))
}

fn rounded(value: f64, decimals: usize) -> String {
    if value.abs() >= 1e15 {
        return format!("{value:.decimals$e}");
    }
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

impl fmt::Display for Quantity {
    /// Six significant digits, or all of a plain number's before the point.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = self.value.abs() >= 1e5 && self.value.abs() < 1e15 && self.dimension == Dimension::None;
        let rounded = if whole {
            self.value.round()
        } else {
            format!("{:.5e}", self.value).parse().unwrap_or(self.value)
        };
        f.write_str(&self.in_readable_unit(rounded))
    }
}

impl Quantity {
    /// Formats all digits, in the unit of `Display`.
    ///
    /// ```
    /// use palpate_mechanics::units::{Dimension, Quantity};
    ///
    /// let saturated = Quantity { value: 8388607.0, dimension: Dimension::None };
    /// assert_eq!(saturated.in_full(), "8388607");
    /// ```
    pub fn in_full(&self) -> String {
        self.in_readable_unit(self.value)
    }

    fn in_readable_unit(&self, value: f64) -> String {
        match readable_unit(*self) {
            Some(unit) => format!("{} {unit}", unit.format_si(value)),
            None => Unit::NONE.format_si(value),
        }
    }
}

/// Largest unit with a number of at least 1; metres from 10 m on.
fn readable_unit(quantity: Quantity) -> Option<Unit> {
    let magnitude = quantity.value.abs() * (1.0 + 1e-9);
    if magnitude == 0.0 {
        return quantity.dimension.units().find(|unit| unit.factor() == 1.0);
    }
    let chosen = |unit: &Unit| match unit.symbol() {
        "m" => magnitude >= 10.0,
        symbol => !["cm", "deg", "um/m", "mm/m", "g/cm3", "min", "h"].contains(&symbol),
    };
    // Units are in ascending order.
    let fits = |unit: &Unit| magnitude >= unit.factor();
    let units = || quantity.dimension.units().filter(chosen);
    units().filter(fits).last().or(units().next())
}

/// Dimension of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dimension {
    /// A plain number.
    None,
    /// Length, in metres.
    Length,
    /// Force, in newtons.
    Force,
    /// Modulus or pressure, in pascals.
    Modulus,
    /// Angle, in radians.
    Angle,
    /// Strain, metres per metre.
    Strain,
    /// Ratio; 1 is 100 %.
    Ratio,
    /// Density, in kg/m³.
    Density,
    /// Stiffness, in N/m.
    Stiffness,
    /// Rotational stiffness, in N·m/rad.
    RotationalStiffness,
    /// Speed, in m/s.
    Speed,
    /// Time, in seconds.
    Time,
    /// Frequency, in hertz.
    Frequency,
}

impl Dimension {
    /// Noun with article, for messages.
    pub const fn noun(self) -> &'static str {
        match self {
            Self::None => "a plain number",
            Self::Length => "a length",
            Self::Force => "a force",
            Self::Modulus => "a modulus",
            Self::Angle => "an angle",
            Self::Strain => "a strain",
            Self::Ratio => "a ratio",
            Self::Density => "a density",
            Self::Stiffness => "a stiffness",
            Self::RotationalStiffness => "a rotational stiffness",
            Self::Speed => "a speed",
            Self::Time => "a time",
            Self::Frequency => "a frequency",
        }
    }

    /// Units in ASCII, ascending.
    pub fn units(self) -> impl Iterator<Item = Unit> {
        Unit::in_ascii().filter(move |unit| unit.dimension() == self)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// Power of 10, without rounding.
    Power(i32),
    Factor(f64),
}

const UNITS: &[(&str, Dimension, Scale)] = &[
    ("", Dimension::None, Scale::Power(0)),
    ("nm", Dimension::Length, Scale::Power(-9)),
    ("um", Dimension::Length, Scale::Power(-6)),
    ("µm", Dimension::Length, Scale::Power(-6)),
    ("μm", Dimension::Length, Scale::Power(-6)),
    ("mm", Dimension::Length, Scale::Power(-3)),
    ("cm", Dimension::Length, Scale::Power(-2)),
    ("m", Dimension::Length, Scale::Power(0)),
    ("uN", Dimension::Force, Scale::Power(-6)),
    ("µN", Dimension::Force, Scale::Power(-6)),
    ("μN", Dimension::Force, Scale::Power(-6)),
    ("mN", Dimension::Force, Scale::Power(-3)),
    ("N", Dimension::Force, Scale::Power(0)),
    ("kN", Dimension::Force, Scale::Power(3)),
    ("Pa", Dimension::Modulus, Scale::Power(0)),
    ("kPa", Dimension::Modulus, Scale::Power(3)),
    ("MPa", Dimension::Modulus, Scale::Power(6)),
    ("GPa", Dimension::Modulus, Scale::Power(9)),
    ("urad", Dimension::Angle, Scale::Power(-6)),
    ("µrad", Dimension::Angle, Scale::Power(-6)),
    ("μrad", Dimension::Angle, Scale::Power(-6)),
    ("mrad", Dimension::Angle, Scale::Power(-3)),
    ("deg", Dimension::Angle, Scale::Factor(std::f64::consts::PI / 180.0)),
    ("°", Dimension::Angle, Scale::Factor(std::f64::consts::PI / 180.0)),
    ("rad", Dimension::Angle, Scale::Power(0)),
    ("ue", Dimension::Strain, Scale::Power(-6)),
    ("µε", Dimension::Strain, Scale::Power(-6)),
    ("με", Dimension::Strain, Scale::Power(-6)),
    ("um/m", Dimension::Strain, Scale::Power(-6)),
    ("µm/m", Dimension::Strain, Scale::Power(-6)),
    ("μm/m", Dimension::Strain, Scale::Power(-6)),
    ("mm/m", Dimension::Strain, Scale::Power(-3)),
    ("m/m", Dimension::Strain, Scale::Power(0)),
    ("%", Dimension::Ratio, Scale::Power(-2)),
    ("g/cm3", Dimension::Density, Scale::Power(3)),
    ("kg/m3", Dimension::Density, Scale::Power(0)),
    ("kg/m³", Dimension::Density, Scale::Power(0)),
    ("N/m", Dimension::Stiffness, Scale::Power(0)),
    ("kN/m", Dimension::Stiffness, Scale::Power(3)),
    ("N/mm", Dimension::Stiffness, Scale::Power(3)),
    ("Nm/rad", Dimension::RotationalStiffness, Scale::Power(0)),
    ("N·m/rad", Dimension::RotationalStiffness, Scale::Power(0)),
    ("mm/s", Dimension::Speed, Scale::Power(-3)),
    ("m/s", Dimension::Speed, Scale::Power(0)),
    ("us", Dimension::Time, Scale::Power(-6)),
    ("µs", Dimension::Time, Scale::Power(-6)),
    ("μs", Dimension::Time, Scale::Power(-6)),
    ("ms", Dimension::Time, Scale::Power(-3)),
    ("s", Dimension::Time, Scale::Power(0)),
    ("min", Dimension::Time, Scale::Factor(60.0)),
    ("h", Dimension::Time, Scale::Factor(3600.0)),
    ("Hz", Dimension::Frequency, Scale::Power(0)),
    ("kHz", Dimension::Frequency, Scale::Power(3)),
];

/// A unit, serialised as its symbol.
///
/// ```
/// use palpate_mechanics::units::Unit;
///
/// let um = Unit::from_symbol("um").unwrap();
/// assert_eq!(um.parse_si("5"), Some(5e-6));
/// assert_eq!(um.format_si(5e-6), "5");
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Unit(usize);

impl Unit {
    /// Unit of a plain number.
    pub const NONE: Self = Self(0);

    /// Returns the unit of a symbol; "" for a plain number.
    pub fn from_symbol(symbol: &str) -> Option<Self> {
        UNITS.iter().position(|(known, ..)| *known == symbol).map(Self)
    }

    fn in_ascii() -> impl Iterator<Item = Self> {
        let written = |unit: &Self| unit.symbol().is_ascii() && !unit.symbol().is_empty();
        (0..UNITS.len()).map(Self).filter(written)
    }

    /// Symbol.
    pub fn symbol(self) -> &'static str {
        self.entry().0
    }

    /// Dimension of the unit.
    pub fn dimension(self) -> Dimension {
        self.entry().1
    }

    /// SI factor.
    pub fn factor(self) -> f64 {
        match self.entry().2 {
            Scale::Power(exponent) => 10f64.powi(exponent),
            Scale::Factor(factor) => factor,
        }
    }

    /// Parses a decimal number, or passes on infinity and NaN.
    pub fn parse_si(self, number: &str) -> Option<f64> {
        match self.entry().2 {
            Scale::Power(0) => number.parse().ok(),
            Scale::Power(power) => parse_shifted(number, power),
            Scale::Factor(factor) => number.parse::<f64>().ok().map(|value| value * factor),
        }
    }

    /// Formats the shortest number that `parse_si` parses to an SI value.
    pub fn format_si(self, value_si: f64) -> String {
        match self.entry().2 {
            Scale::Power(0) => format_shifted(value_si, 0),
            Scale::Power(power) => format_shifted(value_si, -power),
            Scale::Factor(factor) => format_shifted(value_si / factor, 0),
        }
    }

    fn entry(self) -> &'static (&'static str, Dimension, Scale) {
        &UNITS[self.0]
    }
}

impl fmt::Debug for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Unit({:?})", self.symbol())
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

impl Serialize for Unit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.symbol())
    }
}

impl<'de> Deserialize<'de> for Unit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let symbol = String::deserialize(deserializer)?;
        Self::from_symbol(&symbol)
            .ok_or_else(|| serde::de::Error::custom(format_args!("unknown unit `{symbol}`")))
    }
}

fn parse_shifted(number: &str, power: i32) -> Option<f64> {
    let (mantissa, exponent) = match number.find(['e', 'E']) {
        Some(at) => (number.get(..at)?, number.get(at + 1..)?.parse::<i32>().ok()?),
        None => (number, 0),
    };
    let value = mantissa.parse::<f64>().ok()?;
    if !value.is_finite() {
        return Some(value);
    }
    format!("{mantissa}e{}", exponent.saturating_add(power)).parse().ok()
}

/// Decimal point moved `power` places to the right.
fn format_shifted(value: f64, power: i32) -> String {
    let scientific = format!("{value:e}");
    let Some((mantissa, exponent)) = scientific.split_once('e') else { return scientific };
    let Ok(exponent) = exponent.parse::<i32>() else { return scientific };
    let (sign, mantissa) = mantissa.strip_prefix('-').map_or(("", mantissa), |rest| ("-", rest));
    let digits: String = mantissa.chars().filter(|c| *c != '.').collect();
    if digits == "0" {
        return format!("{sign}0");
    }
    place_point(sign, &digits, exponent + power)
}

fn place_point(sign: &str, digits: &str, exponent: i32) -> String {
    let count = digits.len();
    match usize::try_from(exponent) {
        Ok(exponent) if exponent <= 15 && exponent + 1 >= count => {
            format!("{sign}{digits}{}", "0".repeat(exponent + 1 - count))
        }
        Ok(exponent) if exponent <= 15 => {
            let (whole, fraction) = digits.split_at(exponent + 1);
            format!("{sign}{whole}.{fraction}")
        }
        Err(_) if exponent >= -7 => {
            let zeros = "0".repeat(exponent.unsigned_abs() as usize - 1);
            format!("{sign}0.{zeros}{digits}")
        }
        _ => {
            let (first, rest) = digits.split_at(1);
            let point = if rest.is_empty() { "" } else { "." };
            format!("{sign}{first}{point}{rest}e{exponent}")
        }
    }
}

#[cfg(test)]
mod tests;
