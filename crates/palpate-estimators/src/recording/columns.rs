//! Roles of the columns of a CSV file.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::marks::{Decimal, Separator};
use super::repeated_readings::RepeatedReadings;
use super::untouched::TimeSpan;
use super::zero::Zero;

use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

/// Roles of a file's columns. Columns without a role are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Columns {
    /// Whether the first line names the columns.
    pub header: Header,
    /// Columns of the contact position.
    pub position: PositionColumns,
    /// The unit of length of the position columns.
    pub position_unit: Unit,
    /// Conversion of the file's coordinates to positions on the surface.
    #[serde(default)]
    pub frame: Frame,
    /// One column for each sensor, in the layout's order.
    pub channels: Vec<ValueColumn>,
    /// Column of the contact force, if there is one.
    pub force: Option<ForceColumn>,
    /// Column of the nuisance coordinate, or of the first of several, if there is one; see [`Row::nuisances`](super::Row::nuisances).
    #[serde(default)]
    pub nuisance: Option<ValueColumn>,
    /// Columns of the further nuisance coordinates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further_nuisances: Vec<ValueColumn>,
    /// Column of the time, of numbers in this unit or of timestamps; `None` for the column `time_s`, if the header contains it. See
    /// [`Row::time_s`](super::Row::time_s).
    #[serde(default)]
    pub time: Option<ValueColumn>,
    /// Column that marks untouched rows, if there is one.
    #[serde(default)]
    pub untouched: Option<Column>,
    /// Times at which the surface is untouched.
    #[serde(default)]
    pub untouched_times: Vec<TimeSpan>,
    /// Greatest magnitude of the force of an untouched row, in newtons; `None` to determine it from the rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_zero_n: Option<f64>,
    /// Separator of the fields; `None` to determine it from the first line.
    #[serde(default)]
    pub separator: Option<Separator>,
    /// Decimal mark; `None` to determine it from the first number.
    #[serde(default)]
    pub decimal: Option<Decimal>,
    /// Treatment of rows that repeat the reading before them.
    #[serde(default, skip_serializing_if = "RepeatedReadings::is_auto")]
    pub repeated_readings: RepeatedReadings,
    /// Zero of the readings.
    #[serde(default, skip_serializing_if = "Zero::is_none")]
    pub zero: Zero,
}

/// Conversion of a file's coordinates to positions on the surface: rounding, then subtraction of the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// The file's coordinates of the surface's left support or lower left corner, in metres.
    pub origin: Position,
    /// Rounding step of the coordinates, in metres, greater than 0; `None` for no rounding. With rounding, presses of one place with slightly
    /// different logged coordinates have one position.
    pub round_m: Option<f64>,
}

impl Frame {
    /// Position on the surface of the file's (x, y), in metres.
    pub fn position(&self, x_m: f64, y_m: f64) -> Position {
        let rounded = |value_m: f64| match self.round_m {
            Some(step_m) => (value_m / step_m).round() * step_m,
            None => value_m,
        };
        Position { x_m: rounded(x_m) - self.origin.x_m, y_m: rounded(y_m) - self.origin.y_m }
    }
}

/// Whether a CSV file's first line names its columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Header {
    /// The first line names them.
    Present,
    /// The first line is a row like the others; columns are identified by their numbers.
    Absent,
}

/// A column by its name in the header, or by its number.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Column {
    /// The name in the header, without the spaces around it.
    Name(String),
    /// The number, from 1.
    Number(usize),
}

impl fmt::Display for Column {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(f, "`{name}`"),
            Self::Number(number) => write!(f, "number {number}"),
        }
    }
}

impl From<&str> for Column {
    fn from(name: &str) -> Self {
        Self::Name(name.trim().to_owned())
    }
}

impl From<usize> for Column {
    fn from(number: usize) -> Self {
        Self::Number(number)
    }
}

/// The column or columns of the contact position.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PositionColumns {
    /// Along a one-dimensional surface.
    Along(Column),
    /// Along and across a surface.
    Plane {
        /// Along the length.
        x: Column,
        /// Across the width.
        y: Column,
    },
}

/// A column of numbers and their unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValueColumn {
    /// The column.
    pub column: Column,
    /// The unit of its numbers.
    pub unit: Unit,
}

/// The column of the contact force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceColumn {
    /// The column, and its unit of force.
    pub values: ValueColumn,
    /// Treatment of a file that lacks it.
    pub need: Need,
}

/// Whether a file may lack a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Need {
    /// A file without it is refused.
    Required,
    /// A file without it leaves the value unknown.
    Optional,
}

impl Columns {
    /// A file with positions, in millimetres, in one column, and with raw channels in the given columns, by name or by number from 1. If any
    /// channel is given by number, the file has no header.
    ///
    /// ```
    /// use palpate_estimators::recording::Columns;
    /// use palpate_mechanics::units::Unit;
    ///
    /// let columns = Columns::along("X", ["Pl", "Pr"]).force("F");
    /// assert_eq!(columns.position_unit, Unit::from_symbol("mm").unwrap());
    /// ```
    pub fn along<C: Into<Column>>(
        position: impl Into<Column>,
        channels: impl IntoIterator<Item = C>,
    ) -> Self {
        Self::raw(PositionColumns::Along(position.into()), channels)
    }

    /// A file as for [`along`](Self::along), but with positions in two columns, along and across.
    pub fn plane<C: Into<Column>>(
        x: impl Into<Column>,
        y: impl Into<Column>,
        channels: impl IntoIterator<Item = C>,
    ) -> Self {
        Self::raw(PositionColumns::Plane { x: x.into(), y: y.into() }, channels)
    }

    /// Raw channels in these columns, without a force.
    fn raw<C: Into<Column>>(position: PositionColumns, channels: impl IntoIterator<Item = C>) -> Self {
        let channels: Vec<ValueColumn> = channels
            .into_iter()
            .map(|column| ValueColumn { column: column.into(), unit: Unit::NONE })
            .collect();
        let numbered = channels.iter().any(|channel| matches!(channel.column, Column::Number(_)));
        Self {
            header: if numbered { Header::Absent } else { Header::Present },
            position,
            position_unit: Unit::from_symbol("mm").unwrap_or(Unit::NONE),
            frame: Frame::default(),
            channels,
            force: None,
            nuisance: None,
            further_nuisances: Vec::new(),
            time: None,
            untouched: None,
            untouched_times: Vec::new(),
            force_zero_n: None,
            separator: None,
            decimal: None,
            repeated_readings: RepeatedReadings::Auto,
            zero: Zero::None,
        }
    }

    /// Sets the column of the contact force, in newtons.
    #[must_use]
    pub fn force(self, column: impl Into<Column>) -> Self {
        let values = ValueColumn { column: column.into(), unit: SensorKind::Reaction.unit() };
        Self { force: Some(ForceColumn { values, need: Need::Required }), ..self }
    }

    /// Adds a nuisance coordinate in this column and unit, after the existing ones; see [`Row::nuisances`](super::Row::nuisances).
    #[must_use]
    pub fn nuisance(mut self, column: impl Into<Column>, unit: Unit) -> Self {
        let values = ValueColumn { column: column.into(), unit };
        match self.nuisance {
            None => self.nuisance = Some(values),
            Some(_) => self.further_nuisances.push(values),
        }
        self
    }

    /// Columns of all nuisance coordinates, the first one first.
    pub fn nuisances(&self) -> impl Iterator<Item = &ValueColumn> {
        self.nuisance.iter().chain(&self.further_nuisances)
    }

    /// Sets the column of the time of each row, in seconds or as timestamps.
    #[must_use]
    pub fn time(self, column: impl Into<Column>) -> Self {
        let unit = Unit::from_symbol("s").unwrap_or(Unit::NONE);
        Self { time: Some(ValueColumn { column: column.into(), unit }), ..self }
    }

    /// Sets the frame of the file's coordinates.
    #[must_use]
    pub fn in_frame(self, frame: Frame) -> Self {
        Self { frame, ..self }
    }

    /// The columns that palpate itself writes: `time_s` and `force_n` where they are known, `position_mm` (or `x_mm`, `y_mm`),
    /// and for each channel its name and unit, as in `deflection_1_mm`; a raw channel has just its name.
    ///
    /// `channels` and `kinds` are the names and kinds of the sensors, one each.
    pub fn own(channels: &[String], kinds: &[SensorKind], extent: Extent) -> Self {
        let millimetre = SensorKind::Deflection.unit();
        let name = |name: &str| Column::Name(name.to_owned());
        let position = match extent.width_m() {
            None => PositionColumns::Along(name("position_mm")),
            Some(_) => PositionColumns::Plane { x: name("x_mm"), y: name("y_mm") },
        };
        let channels = channels.iter().zip(kinds).map(|(channel, kind)| {
            let unit = kind.unit();
            let suffix = if unit == Unit::NONE { "" } else { "_" };
            let column = Column::Name(format!("{channel}{suffix}{}", unit.symbol().to_lowercase()));
            ValueColumn { column, unit }
        });
        let force = ValueColumn { column: name("force_n"), unit: SensorKind::Reaction.unit() };
        Self {
            header: Header::Present,
            position,
            position_unit: millimetre,
            frame: Frame::default(),
            channels: channels.collect(),
            force: Some(ForceColumn { values: force, need: Need::Optional }),
            nuisance: None,
            further_nuisances: Vec::new(),
            time: None,
            untouched: None,
            untouched_times: Vec::new(),
            force_zero_n: None,
            separator: None,
            decimal: None,
            repeated_readings: RepeatedReadings::Auto,
            zero: Zero::None,
        }
    }
}
