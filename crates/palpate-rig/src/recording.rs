//! `[recording]`

use serde::Deserialize;

use palpate_estimators::recording::{
    Column, Columns, Decimal, ForceColumn, Frame, Header, Need, PositionColumns, RepeatedReadings, Separator,
    TimeSpan, ValueColumn, Zero,
};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Dimension, Unit, UnitError};

use crate::document::At;
use crate::error::{Place, RigError, RigProblem};
use crate::values::{Count, Force, Length, NotNegative, Positive, Quantity};

/// Columns of a CSV file by their roles; the defaults are the columns of palpate's own recordings.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RecordingKeys {
    /// Whether the first line names the columns; without it columns are numbers, from 1.
    #[serde(default = "yes")]
    pub header: bool,
    /// Separator of the fields; recognised from the first line by default.
    pub separator: Option<Separator>,
    /// Decimal mark; recognised from the first number by default.
    pub decimal: Option<Decimal>,
    /// Column of the contact's position along a line; `position_mm` by default.
    pub position: Option<At<ColumnKey>>,
    /// Column of its position along a plane's length; `x_mm` by default.
    pub x: Option<At<ColumnKey>>,
    /// Column of its position across a plane's width; `y_mm` by default.
    pub y: Option<At<ColumnKey>>,
    /// The unit of positions; mm by default.
    pub position_unit: Option<At<String>>,
    /// Columns of the sensors' readings, which also name raw sensors; the sensors' names with their units by default.
    pub channels: Option<At<Vec<At<ColumnKey>>>>,
    /// The unit of readings, or that of each channel; by default mm, rad, m/m or N, and no unit for raw channels.
    pub channel_unit: Option<At<ChannelUnitKeys>>,
    /// Column of the contact's force, positive downward, 0 in untouched rows; `force_n`, where the file has it, by default.
    pub force: Option<At<ColumnKey>>,
    /// The unit of forces; N by default.
    pub force_unit: Option<At<String>>,
    /// Largest absolute force of an untouched row, because load cells never read exactly 0; estimated from the rows by default.
    pub force_zero: Option<NotNegative<Force>>,
    /// Column of a nuisance coordinate, or a list of several: readings depend on it, and it is known here, but unknown in use. The first is
    /// searched with the position.
    pub nuisance: Option<At<NuisanceKeys>>,
    /// The unit of the nuisance coordinate, or a list of as many; none by default.
    pub nuisance_unit: Option<At<ChannelUnitKeys>>,
    /// Column of the time of each row, as numbers or timestamps; `time_s`, where the file has it, by default.
    pub time: Option<At<ColumnKey>>,
    /// The unit of times that are numbers; s by default.
    pub time_unit: Option<At<String>>,
    /// Column that marks untouched rows with 1, true or yes; rows of force 0, and those with neither position nor force,
    /// need no mark.
    pub untouched: Option<At<ColumnKey>>,
    /// Untouched times, in the time of the rows; timestamps count from the first row.
    pub untouched_times: Option<Vec<At<Span>>>,
    /// The file's coordinates of the surface's left end or lower left corner; 0 by default.
    pub origin: Option<At<Vec<Quantity<Length>>>>,
    /// Positions are rounded to whole multiples of this.
    pub round: Option<Positive<Length>>,
    /// Treatment of rows that repeat the reading before them in every channel.
    #[serde(default)]
    pub repeated_readings: RepeatedReadings,
    /// Zero of the readings.
    #[serde(default)]
    pub zero: Zero,
}

fn yes() -> bool {
    true
}

/// A column by its name in the header, or by its number from 1.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename = "by shape", expecting = "a column's name, or its number from 1")]
pub(crate) enum ColumnKey {
    Text(String),
    Number(Count<1, { i64::MAX }>),
}

/// One column, or a list of them.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename = "by shape", expecting = "a column's name or number, or a list of them")]
pub(crate) enum NuisanceKeys {
    Scalar(At<ColumnKey>),
    List(Vec<At<ColumnKey>>),
}

impl NuisanceKeys {
    fn columns(&self) -> &[At<ColumnKey>] {
        match self {
            Self::Scalar(column) => std::slice::from_ref(column),
            Self::List(columns) => columns,
        }
    }
}

/// A span of time, as in "0 s..10 s", "95 s.." or "..2 min".
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span(TimeSpan);

impl<'de> Deserialize<'de> for Span {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map(Self).map_err(serde::de::Error::custom)
    }
}

/// One unit, or a list of them.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename = "by shape", expecting = "a unit such as \"mm\", or a list of them")]
pub(crate) enum ChannelUnitKeys {
    Text(At<String>),
    List(Vec<At<String>>),
}

impl At<RecordingKeys> {
    pub fn build(&self, layout: &Layout, extent: Extent) -> Result<Columns, RigError> {
        self.check_numbered(extent)?;
        let own = Columns::own(&layout.names(), &layout.kinds(), extent);
        let force_unit = unit(&self.force_unit, Dimension::Force, SensorKind::Reaction.unit())?;
        let mut nuisances = self.nuisances()?.into_iter();
        let second = Unit::from_symbol("s").unwrap_or(Unit::NONE);
        let time_unit = unit(&self.time_unit, Dimension::Time, second)?;
        let force = self.value("force", &self.force, &self.force_unit, force_unit)?;
        Ok(Columns {
            header: if self.header { Header::Present } else { Header::Absent },
            position: self.positions(extent)?.unwrap_or(own.position),
            position_unit: unit(&self.position_unit, Dimension::Length, own.position_unit)?,
            frame: self.frame(extent)?,
            channels: self.channels(&layout.kinds(), own.channels)?,
            force: force.map(|values| ForceColumn { values, need: Need::Required }).or(own.force),
            nuisance: nuisances.next(),
            further_nuisances: nuisances.collect(),
            separator: self.separator,
            decimal: self.decimal,
            time: self.value("time", &self.time, &self.time_unit, time_unit)?,
            untouched: self.untouched.as_ref().map(|column| column.column()),
            force_zero_n: self.force_zero.map(|force| force.si),
            untouched_times: self.untouched_times.iter().flatten().map(|span| span.0).collect(),
            repeated_readings: self.repeated_readings,
            zero: self.zero,
        })
    }

    /// Without a header columns are numbers; the force is optional.
    fn check_numbered(&self, extent: Extent) -> Result<(), RigError> {
        let positions = [&self.position, &self.x, &self.y].into_iter().flatten();
        let nuisances = self.nuisance.iter().flat_map(|nuisances| nuisances.columns());
        let values = [&self.force, &self.time, &self.untouched].into_iter().flatten().chain(nuisances);
        let channels = self.channels.iter().flat_map(|channels| channels.iter());
        let named = |key: &&At<ColumnKey>| matches!(***key, ColumnKey::Text(_));
        match positions.clone().chain(values).chain(channels).find(named) {
            _ if self.header => Ok(()),
            Some(key) => Err(key.place.refuse("a column's number where `header = false`")),
            None if positions.count() == 0 => Err(self.place.missing(match extent {
                Extent::Line { .. } => "position",
                Extent::Plane { .. } => "x",
            })),
            None if self.channels.is_none() => Err(self.place.missing("channels")),
            None => Ok(()),
        }
    }

    fn positions(&self, extent: Extent) -> Result<Option<PositionColumns>, RigError> {
        match (&self.position, &self.x, &self.y) {
            (None, None, None) => Ok(None),
            (Some(_), Some(key), _) | (Some(_), None, Some(key)) => Err(key.place.unused("`position`")),
            (None, Some(_), None) => Err(self.place.missing("y")),
            (None, None, Some(_)) => Err(self.place.missing("x")),
            (Some(x), None, None) => match extent {
                Extent::Line { .. } => Ok(Some(PositionColumns::Along(x.column()))),
                Extent::Plane { .. } => Err(x.place.unused("a surface that has a width; use `x` and `y`")),
            },
            (None, Some(x), Some(y)) => match extent {
                Extent::Line { .. } => Err(y.place.unused("a surface without a width")),
                Extent::Plane { .. } => Ok(Some(PositionColumns::Plane { x: x.column(), y: y.column() })),
            },
        }
    }

    fn frame(&self, extent: Extent) -> Result<Frame, RigError> {
        let origin = match &self.origin {
            None => Position::default(),
            Some(origin) => match (extent, origin.as_slice()) {
                (Extent::Line { .. }, [x]) => Position::along(x.si),
                (Extent::Line { .. }, _) => return Err(origin.place.refuse("a list of 1")),
                (Extent::Plane { .. }, [x, y]) => Position { x_m: x.si, y_m: y.si },
                (Extent::Plane { .. }, _) => return Err(origin.place.refuse("a list of 2, x and y")),
            },
        };
        Ok(Frame { origin, round_m: self.round.map(|round| round.si) })
    }

    fn channels(&self, kinds: &[SensorKind], own: Vec<ValueColumn>) -> Result<Vec<ValueColumn>, RigError> {
        let dimensions = kinds.iter().map(|kind| kind.dimension());
        let one_each = || format!("a list of {}, one for each sensor", kinds.len());
        let units: Vec<Unit> = match self.channel_unit.as_ref().map(|key| (&key.place, &**key)) {
            None => kinds.iter().map(|kind| kind.unit()).collect(),
            Some((_, ChannelUnitKeys::Text(symbol))) => {
                dimensions.map(|wanted| unit_of(symbol, wanted)).collect::<Result<_, _>>()?
            }
            Some((place, ChannelUnitKeys::List(symbols))) if symbols.len() != kinds.len() => {
                return Err(place.refuse(one_each()));
            }
            Some((_, ChannelUnitKeys::List(symbols))) => {
                let each = symbols.iter().zip(dimensions);
                each.map(|(symbol, wanted)| unit_of(symbol, wanted)).collect::<Result<_, _>>()?
            }
        };
        let columns: Vec<Column> = match &self.channels {
            None => own.into_iter().map(|channel| channel.column).collect(),
            Some(listed) if listed.len() != kinds.len() => return Err(listed.place.refuse(one_each())),
            Some(listed) => distinct(listed)?,
        };
        Ok(columns.into_iter().zip(units).map(|(column, unit)| ValueColumn { column, unit }).collect())
    }

    fn nuisances(&self) -> Result<Vec<ValueColumn>, RigError> {
        let Some(listed) = &self.nuisance else {
            return match &self.nuisance_unit {
                Some(symbols) => Err(self.unpaired_key("nuisance", &symbols.place)),
                None => Ok(Vec::new()),
            };
        };
        let columns = distinct(listed.columns())?;
        if columns.is_empty() {
            return Err(listed.place.refuse("a column, or a list of at least 1"));
        }
        let symbols: &[At<String>] = match self.nuisance_unit.as_deref() {
            None => &[],
            Some(ChannelUnitKeys::Text(symbol)) => std::slice::from_ref(symbol),
            Some(ChannelUnitKeys::List(symbols)) => symbols,
        };
        if let Some(said) = self.nuisance_unit.as_ref().filter(|_| symbols.len() != columns.len()) {
            let count = columns.len();
            return Err(said.place.refuse(format!("a list of {count}, one for each nuisance coordinate")));
        }
        let unit_of = |symbol: &At<String>| {
            let unknown = || symbol.place.invalid(UnitError::UnknownUnit { unit: symbol.to_string() });
            Unit::from_symbol(symbol).ok_or_else(unknown)
        };
        let each = columns.into_iter().enumerate().map(|(i, column)| {
            let unit = symbols.get(i).map_or(Ok(Unit::NONE), unit_of)?;
            Ok(ValueColumn { column, unit })
        });
        each.collect()
    }

    fn unpaired_key(&self, key: &str, place: &Place) -> RigError {
        let (section, key) = (self.place.path.clone(), key.to_owned());
        RigProblem::MissingKey { section, key }.at_place(place)
    }

    /// Reads the column of `key`; a unit needs its column.
    fn value(
        &self,
        key: &str,
        column: &Option<At<ColumnKey>>,
        symbol: &Option<At<String>>,
        unit: Unit,
    ) -> Result<Option<ValueColumn>, RigError> {
        match (column, symbol) {
            (None, Some(symbol)) => Err(self.unpaired_key(key, &symbol.place)),
            (column, _) => Ok(column.as_ref().map(|column| ValueColumn { column: column.column(), unit })),
        }
    }
}

/// Checks that all columns differ.
fn distinct(listed: &[At<ColumnKey>]) -> Result<Vec<Column>, RigError> {
    let columns: Vec<_> = listed.iter().map(|column| column.column()).collect();
    if let Some(again) = (1..columns.len()).find(|i| columns[..*i].contains(&columns[*i])) {
        let place = &listed[again].place;
        return Err(place.refuse_value(format!("{} again", place.written), "a column of its own"));
    }
    Ok(columns)
}

impl ColumnKey {
    fn column(&self) -> Column {
        match self {
            Self::Text(name) => Column::Name(name.trim().to_owned()),
            Self::Number(number) => Column::Number(number.get()),
        }
    }
}

fn unit(symbol: &Option<At<String>>, wanted: Dimension, own: Unit) -> Result<Unit, RigError> {
    symbol.as_ref().map_or(Ok(own), |symbol| unit_of(symbol, wanted))
}

fn unit_of(symbol: &At<String>, wanted: Dimension) -> Result<Unit, RigError> {
    let text = symbol.to_string();
    match Unit::from_symbol(symbol) {
        Some(unit) if unit.dimension() == wanted => Ok(unit),
        _ if wanted == Dimension::None => Err(symbol.place.invalid(UnitError::UnwantedUnit { text })),
        _ => Err(symbol.place.invalid(UnitError::WrongUnit { unit: text, wanted })),
    }
}
