//! Values of keys as types with checks.

use std::marker::PhantomData;

use palpate_estimators::status::FalseAlarmRate;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{self, Dimension, UnitError};
use serde::de::{Deserialize, Deserializer, Error, Unexpected};

use crate::document::At;
use crate::error::{Place, RigError};

/// Quantity in SI units of dimension `D` within bound `B`: "400 mm" becomes 0.4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quantity<D, B = Finite> {
    pub si: f64,
    of: PhantomData<(D, B)>,
}

pub(crate) type Positive<D> = Quantity<D, AboveZero>;
pub(crate) type NotNegative<D> = Quantity<D, AtLeastZero>;
pub(crate) type Fraction = Quantity<Ratio, BelowOne>;

pub(crate) type FalseAlarms = Quantity<Ratio, AlarmRange>;

pub(crate) trait Measure {
    const DIMENSION: Dimension;
}

/// Bound in words and as a test of SI values.
pub(crate) trait Bound {
    const WORDS: &'static str;
    fn holds(si: f64) -> bool;
}

macro_rules! measures {
    ($($name:ident = $dimension:ident),*) => {$(
        #[derive(Clone, Copy, Debug)]
        pub(crate) enum $name {}
        impl Measure for $name {
            const DIMENSION: Dimension = Dimension::$dimension;
        }
    )*};
}
measures!(Number = None, Length = Length, Force = Force, Modulus = Modulus, Ratio = Ratio, Density = Density);
measures!(Stiffness = Stiffness, RotationalStiffness = RotationalStiffness, Speed = Speed, Time = Time);
measures!(Frequency = Frequency);

macro_rules! bounds {
    ($($name:ident: $words:literal if $holds:expr;)*) => {$(
        #[derive(Clone, Copy, Debug)]
        pub(crate) enum $name {}
        impl Bound for $name {
            const WORDS: &'static str = $words;
            fn holds(si: f64) -> bool {
                let holds: fn(f64) -> bool = $holds;
                holds(si)
            }
        }
    )*};
}
bounds! {
    Finite: "finite" if f64::is_finite;
    AboveZero: "greater than 0" if |si| si > 0.0;
    AtLeastZero: "at least 0" if |si| si >= 0.0;
    BelowOne: "at least 0 and below 1" if |si| (0.0..1.0).contains(&si);
    TailFreedom: "greater than 2" if |si| si > 2.0;
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum AlarmRange {}

impl Bound for AlarmRange {
    const WORDS: &'static str = FalseAlarmRate::RANGE_IN_WORDS;
    fn holds(si: f64) -> bool {
        FalseAlarmRate::RANGE.contains(&si)
    }
}

impl<'de, D: Measure, B: Bound> Deserialize<'de> for Quantity<D, B> {
    fn deserialize<T: Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        let si = RawQuantity::deserialize(deserializer)?.si(D::DIMENSION).map_err(T::Error::custom)?;
        if B::holds(si) {
            Ok(Self { si, of: PhantomData })
        } else {
            Err(T::Error::invalid_value(Unexpected::Float(si), &B::WORDS))
        }
    }
}

/// A quantity as it is written, with the dimension of its sensors.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(rename = "by shape", expecting = "a quantity such as \"400 mm\", or a number")]
pub(crate) enum RawQuantity {
    Text(String),
    Number(f64),
}

/// Share of the sensors' range, or quantity of the sensors.
pub(crate) type ShareOrQuantity = RawQuantity;

impl RawQuantity {
    fn si(&self, wanted: Dimension) -> Result<f64, UnitError> {
        match self {
            Self::Text(text) => units::Quantity::parse_as(text, wanted),
            Self::Number(number) if !number.is_finite() => {
                Err(UnitError::NotFinite { text: number.to_string() })
            }
            Self::Number(number) if matches!(wanted, Dimension::None | Dimension::Ratio) => Ok(*number),
            Self::Number(number) => Err(UnitError::MissingUnit { text: number.to_string(), wanted }),
        }
    }
}

impl At<RawQuantity> {
    pub fn si<B: Bound>(&self, wanted: Dimension) -> Result<f64, RigError> {
        match RawQuantity::si(self, wanted) {
            Ok(si) if B::holds(si) => Ok(si),
            Ok(_) => Err(self.place.refuse(B::WORDS)),
            Err(error) => Err(self.place.invalid(error)),
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Count<const LEAST: i64, const MOST: i64>(usize);

impl<const LEAST: i64, const MOST: i64> Count<LEAST, MOST> {
    pub const fn get(self) -> usize {
        self.0
    }
}

impl<'de, const LEAST: i64, const MOST: i64> Deserialize<'de> for Count<LEAST, MOST> {
    fn deserialize<T: Deserializer<'de>>(deserializer: T) -> Result<Self, T::Error> {
        let number = i64::deserialize(deserializer)?;
        match usize::try_from(number) {
            Ok(count) if (LEAST..=MOST).contains(&number) => Ok(Self(count)),
            _ => {
                let most = if MOST == i64::MAX { String::new() } else { format!(" and at most {MOST}") };
                let bound = format!("at least {LEAST}{most}");
                Err(T::Error::invalid_value(Unexpected::Signed(number), &bound.as_str()))
            }
        }
    }
}

pub(crate) const ON_A_PLANE: &str =
    "a plane; set `grid = [3, 3]`, columns and rows, or list pairs in `positions`";

/// Columns and rows of a grid of at most `MOST` positions.
#[derive(Clone, Copy, Debug, serde::Deserialize)]
#[serde(expecting = "a list of 2, columns along the length and rows across the width")]
pub(crate) struct Grid<const MOST: i64>(Count<1, MOST>, Count<1, MOST>);

impl<const MOST: i64> At<Grid<MOST>> {
    pub fn sides(&self, extent: Extent) -> Result<(usize, usize), RigError> {
        if let Extent::Line { .. } = extent {
            return Err(self.place.unused("a surface that is a line; set `count`"));
        }
        let (columns, rows) = (self.0.get(), self.1.get());
        if columns.saturating_mul(rows) as u64 > MOST.unsigned_abs() {
            let bound = format!("at least 1 and at most {MOST} in all");
            return Err(self.place.refuse_value(format!("{columns} × {rows}"), bound));
        }
        Ok((columns, rows))
    }
}

/// A position: a length along a line, or a pair of lengths on a plane, along and across.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(rename = "by shape", expecting = "a length such as \"75 mm\", or two of them on a plane")]
pub(crate) enum Point {
    Scalar(Quantity<Length>),
    List(Vec<Quantity<Length>>),
}

impl At<Point> {
    /// Returns the unchecked position.
    pub fn position(&self, extent: Extent) -> Result<Position, RigError> {
        match (extent, &**self) {
            (Extent::Line { .. }, Point::Scalar(x)) => Ok(Position::along(x.si)),
            (Extent::Line { .. }, Point::List(_)) => Err(self.place.refuse("one length along the surface")),
            (Extent::Plane { .. }, Point::List(list)) if list.len() == 2 => {
                Ok(Position { x_m: list[0].si, y_m: list[1].si })
            }
            (Extent::Plane { .. }, _) => {
                Err(self.place.refuse("a pair of lengths, along and across, such as [\"75 mm\", \"40 mm\"]"))
            }
        }
    }

    /// Returns the position, checked.
    pub fn on_surface(&self, extent: Extent) -> Result<Position, RigError> {
        match self.position(extent)? {
            position if extent.contains(position) => Ok(position),
            position => {
                let bound = format!("on the surface, within {}", extent.bounds_in_words());
                Err(self.place.refuse_value(extent.place_in_words(position), bound))
            }
        }
    }
}

/// Checks that a section or rectangle goes right and up; `place` is its end.
pub(crate) fn check_order(
    from: Position,
    to: Position,
    extent: Extent,
    place: &Place,
) -> Result<(), RigError> {
    if extent.coordinates_m(from).zip(extent.coordinates_m(to)).all(|(from_m, to_m)| from_m < to_m) {
        return Ok(());
    }
    let bound = format!("beyond `from`, {}", extent.place_in_words(from));
    Err(place.refuse_value(extent.place_in_words(to), bound))
}

/// One section, or several of one name.
#[derive(Clone, Debug, serde::Deserialize)]
#[serde(rename = "by shape", expecting = "a table, or a list of tables")]
pub(crate) enum OneOrMany<T> {
    Table(At<T>),
    List(Vec<At<T>>),
}

impl<T> OneOrMany<T> {
    pub fn sections(&self) -> &[At<T>] {
        match self {
            Self::Table(section) => std::slice::from_ref(section),
            Self::List(sections) => sections,
        }
    }
}
