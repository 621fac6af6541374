//! The units that palpate knows, and exact scaling by powers of ten.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// What a quantity measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Dimension {
    /// A plain number.
    None,
    /// Length, in metres.
    Length,
    /// Force, in newtons.
    Force,
    /// Elastic modulus or pressure, in pascals.
    Modulus,
    /// Angle, in radians.
    Angle,
    /// Strain, metres per metre.
    Strain,
    /// A share, as a number where 1 is the whole.
    Ratio,
    /// Mass per volume, in kg/m³.
    Density,
    /// Force per length that a spring gives way by, in N/m.
    Stiffness,
    /// Couple per angle that a spring turns by, in N·m/rad.
    RotationalStiffness,
    /// Length per time, in m/s.
    Speed,
    /// Time, in seconds.
    Time,
    /// How often a second, in hertz.
    Frequency,
}

impl Dimension {
    /// The word for it in messages, with its article.
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

    /// The units it can be written in, ASCII spellings only, smallest first.
    pub fn units(self) -> impl Iterator<Item = Unit> {
        (0..UNITS.len()).map(Unit).filter(move |unit| {
            let symbol = unit.symbol();
            unit.dimension() == self && symbol.is_ascii() && !symbol.is_empty()
        })
    }
}

/// How many SI units one unit is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    /// 10 to this power; scaling moves the decimal point, so nothing is lost.
    Power(i32),
    /// Any other factor.
    Factor(f64),
}

/// Symbol, dimension and scale. Where several spellings mean one unit, palpate writes the first.
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
    ("Hz", Dimension::Frequency, Scale::Power(0)),
    ("kHz", Dimension::Frequency, Scale::Power(3)),
];

/// A unit of measure.
///
/// Serialised as its symbol.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Unit(usize);

impl Unit {
    /// The unit of a plain number.
    pub const NONE: Self = Self(0);

    /// The unit with this symbol ("mm", "µε"); the empty symbol is that of a plain number.
    pub fn from_symbol(symbol: &str) -> Option<Self> {
        UNITS.iter().position(|(known, ..)| *known == symbol).map(Self)
    }

    /// Its symbol.
    pub fn symbol(self) -> &'static str {
        self.entry().0
    }

    /// What it measures.
    pub fn dimension(self) -> Dimension {
        self.entry().1
    }

    /// How many SI units one of it is.
    pub fn factor(self) -> f64 {
        match self.entry().2 {
            Scale::Power(exponent) => 10f64.powi(exponent),
            Scale::Factor(factor) => factor,
        }
    }

    /// Reads a decimal number in this unit as SI: "1.2" in mm is exactly the number that 0.0012 is.
    ///
    /// `None` unless `number` is a decimal number; infinities and NaN, as the text has them or by overflow, are
    /// passed on.
    pub fn parse_si(self, number: &str) -> Option<f64> {
        match self.entry().2 {
            Scale::Power(0) => number.parse().ok(),
            Scale::Power(power) => parse_shifted(number, power),
            Scale::Factor(factor) => number.parse::<f64>().ok().map(|value| value * factor),
        }
    }

    /// Writes an SI value as the shortest decimal number in this unit that `parse_si` reads back: exactly, where
    /// the unit is a power of ten of the SI unit.
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

/// `number` · 10^`power`, rounded once.
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

/// The shortest digits of `value`, the decimal point moved `power` places to the right.
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

/// Plain decimal notation where that stays short, scientific elsewhere; `exponent` is that of the first digit.
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
