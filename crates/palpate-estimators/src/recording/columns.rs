//! Roles of CSV columns.

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

/// Roles of columns; others are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Columns {
    /// Presence of a header.
    pub header: Header,
    /// Position columns.
    pub position: PositionColumns,
    /// Unit of position.
    pub position_unit: Unit,
    /// Conversion of coordinates.
    #[serde(default)]
    pub frame: Frame,
    /// Sensor columns, in the layout's order.
    pub channels: Vec<ValueColumn>,
    /// Force column.
    pub force: Option<ForceColumn>,
    /// First nuisance coordinate; see [`Row::nuisances`](super::Row::nuisances).
    #[serde(default)]
    pub nuisance: Option<ValueColumn>,
    /// Further nuisance coordinates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further_nuisances: Vec<ValueColumn>,
    /// Time column; `None` for an optional `time_s`.
    #[serde(default)]
    pub time: Option<ValueColumn>,
    /// Mark of untouched rows.
    #[serde(default)]
    pub untouched: Option<Column>,
    /// Untouched times.
    #[serde(default)]
    pub untouched_times: Vec<TimeSpan>,
    /// Greatest untouched force magnitude in newtons; `None` to recognise it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_zero_n: Option<f64>,
    /// Separator of the fields; `None` to detect it.
    #[serde(default)]
    pub separator: Option<Separator>,
    /// Decimal mark; `None` to detect it.
    #[serde(default)]
    pub decimal: Option<Decimal>,
    /// Treatment of repeated rows.
    #[serde(default, skip_serializing_if = "RepeatedReadings::is_auto")]
    pub repeated_readings: RepeatedReadings,
    /// Zero of the readings.
    #[serde(default, skip_serializing_if = "Zero::is_none")]
    pub zero: Zero,
}

/// Conversion of file coordinates to surface positions: rounding, then subtraction of the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// Surface origin in file coordinates: left support or lower left corner.
    pub origin: Position,
    /// Rounding step in metres, greater than 0; unites logged coordinates of one place.
    pub round_m: Option<f64>,
}

impl Frame {
    /// Converts file coordinates, in metres.
    pub fn position(&self, x_m: f64, y_m: f64) -> Position {
        let rounded = |value_m: f64| match self.round_m {
            Some(step_m) => (value_m / step_m).round() * step_m,
            None => value_m,
        };
        Position { x_m: rounded(x_m) - self.origin.x_m, y_m: rounded(y_m) - self.origin.y_m }
    }
}

/// Presence of column names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Header {
    /// Names in the first line.
    Present,
    /// Numbered columns without names.
    Absent,
}

/// Column by name or number.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Column {
    /// Name, without surrounding spaces.
    Name(String),
    /// Number, from 1.
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

/// Position columns.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PositionColumns {
    /// One-dimensional surface.
    Along(Column),
    /// Two-dimensional surface.
    Plane {
        /// Along the length.
        x: Column,
        /// Across the width.
        y: Column,
    },
}

/// Numeric column with its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ValueColumn {
    /// Column.
    pub column: Column,
    /// Unit.
    pub unit: Unit,
}

/// Force column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceColumn {
    /// Column and unit of force.
    pub values: ValueColumn,
    /// Necessity of the column.
    pub need: Need,
}

/// Necessity of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Need {
    /// Missing column: error.
    Required,
    /// Missing column: unknown values.
    Optional,
}

impl Columns {
    /// Columns with positions in millimetres and raw channels. A channel given by number means a file without
    /// header.
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

    /// As [`along`](Self::along), with positions along and across.
    pub fn plane<C: Into<Column>>(
        x: impl Into<Column>,
        y: impl Into<Column>,
        channels: impl IntoIterator<Item = C>,
    ) -> Self {
        Self::raw(PositionColumns::Plane { x: x.into(), y: y.into() }, channels)
    }

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

    /// Sets the force column, in newtons.
    #[must_use]
    pub fn force(self, column: impl Into<Column>) -> Self {
        let values = ValueColumn { column: column.into(), unit: SensorKind::Reaction.unit() };
        Self { force: Some(ForceColumn { values, need: Need::Required }), ..self }
    }

    /// Appends a nuisance coordinate.
    #[must_use]
    pub fn nuisance(mut self, column: impl Into<Column>, unit: Unit) -> Self {
        let values = ValueColumn { column: column.into(), unit };
        match self.nuisance {
            None => self.nuisance = Some(values),
            Some(_) => self.further_nuisances.push(values),
        }
        self
    }

    /// All nuisance coordinates.
    pub fn nuisances(&self) -> impl Iterator<Item = &ValueColumn> {
        self.nuisance.iter().chain(&self.further_nuisances)
    }

    /// Sets the time column, in seconds or timestamps.
    #[must_use]
    pub fn time(self, column: impl Into<Column>) -> Self {
        let unit = Unit::from_symbol("s").unwrap_or(Unit::NONE);
        Self { time: Some(ValueColumn { column: column.into(), unit }), ..self }
    }

    /// Sets the frame.
    #[must_use]
    pub fn in_frame(self, frame: Frame) -> Self {
        Self { frame, ..self }
    }

    /// Columns of palpate's own files: `time_s` and `force_n` if known, `position_mm` (or `x_mm`, `y_mm`),
    /// and channels with units, as in `deflection_1_mm`.
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
