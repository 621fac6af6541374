//! `[recording]`

use serde::Deserialize;

use palpate_estimators::recording::{
    Column, Columns, ForceColumn, Frame, Header, Need, PositionColumns, ValueColumn,
};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::{Dimension, Unit, UnitError};

use crate::document::At;
use crate::error::{RigError, RigProblem};
use crate::values::{Count, Length, Positive, Quantity};

/// Which column of a CSV file is what; what is not said is as in the recordings that palpate itself writes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RecordingKeys {
    /// Whether the first line names the columns.
    #[serde(default = "yes")]
    pub header: bool,
    /// The contact's position along a line.
    pub position: Option<At<ColumnKey>>,
    /// Its position along a plane's length.
    pub x: Option<At<ColumnKey>>,
    /// Its position across a plane's width.
    pub y: Option<At<ColumnKey>>,
    /// The unit of positions.
    pub position_unit: Option<At<String>>,
    /// Each sensor's readings.
    pub channels: Option<At<Vec<At<ColumnKey>>>>,
    /// The unit of readings, or that of each channel.
    pub channel_unit: Option<At<ChannelUnitKeys>>,
    /// The contact's force.
    pub force: Option<At<ColumnKey>>,
    /// The unit of forces.
    pub force_unit: Option<At<String>>,
    /// A coordinate that readings depend on and nobody wants to know.
    pub hidden: Option<At<ColumnKey>>,
    /// The unit of that coordinate.
    pub hidden_unit: Option<At<String>>,
    /// The file's coordinates of the surface's left end or lower left corner.
    pub origin: Option<At<Vec<Quantity<Length>>>>,
    /// Positions are rounded to whole multiples of this.
    pub round: Option<Positive<Length>>,
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

/// One unit for all channels, or one for each.
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
        Ok(Columns {
            header: if self.header { Header::Present } else { Header::Absent },
            position: self.positions(extent)?.unwrap_or(own.position),
            position_unit: match &self.position_unit {
                Some(symbol) => unit(symbol, Dimension::Length)?,
                None => own.position_unit,
            },
            frame: self.frame(extent)?,
            channels: self.channels(layout, own.channels)?,
            force: self.force(own.force)?,
            hidden: self.hidden()?,
        })
    }

    /// Without a header, columns must be numbers; the force can be missing.
    fn check_numbered(&self, extent: Extent) -> Result<(), RigError> {
        let positions = [&self.position, &self.x, &self.y].into_iter().flatten();
        let values = [&self.force, &self.hidden].into_iter().flatten();
        let channels = self.channels.iter().flat_map(|channels| channels.iter());
        let named = |key: &&At<ColumnKey>| matches!(***key, ColumnKey::Text(_));
        match positions.clone().chain(values).chain(channels).find(named) {
            _ if self.header => Ok(()),
            Some(key) => Err(key.place.refuse("a column's number where `header = false`")),
            None if positions.count() == 0 => {
                Err(self.place.missing(if extent.is_plane() { "x" } else { "position" }))
            }
            None if self.channels.is_none() => Err(self.place.missing("channels")),
            None => Ok(()),
        }
    }

    fn positions(&self, extent: Extent) -> Result<Option<PositionColumns>, RigError> {
        match (&self.position, &self.x, &self.y) {
            (None, None, None) => Ok(None),
            (Some(_), Some(other), _) | (Some(_), None, Some(other)) => Err(other.place.unused("`position`")),
            (Some(x), None, None) if extent.is_plane() => {
                Err(x.place.unused("a surface that has a width; use `x` and `y`"))
            }
            (Some(x), None, None) => Ok(Some(PositionColumns::Along(x.column()))),
            (None, Some(_), None) => Err(self.place.missing("y")),
            (None, None, Some(_)) => Err(self.place.missing("x")),
            (None, Some(_), Some(y)) if !extent.is_plane() => {
                Err(y.place.unused("a surface without a width"))
            }
            (None, Some(x), Some(y)) => Ok(Some(PositionColumns::Plane { x: x.column(), y: y.column() })),
        }
    }

    fn channels(&self, layout: &Layout, own: Vec<ValueColumn>) -> Result<Vec<ValueColumn>, RigError> {
        let kinds = layout.kinds();
        let units = self.channel_units(&kinds)?;
        let columns: Vec<Column> = match &self.channels {
            None => own.into_iter().map(|channel| channel.column).collect(),
            Some(listed) => {
                let columns: Vec<_> = listed.iter().map(|channel| channel.column()).collect();
                if columns.len() != kinds.len() {
                    return Err(listed.place.refuse(one_each(kinds.len())));
                }
                if let Some(again) = (1..columns.len()).find(|i| columns[..*i].contains(&columns[*i])) {
                    let place = &listed[again].place;
                    return Err(place.refuse_as(format!("{} again", place.written), "a column of its own"));
                }
                columns
            }
        };
        Ok(columns.into_iter().zip(units).map(|(column, unit)| ValueColumn { column, unit }).collect())
    }

    /// One unit per sensor: those given, or those in which palpate writes.
    fn channel_units(&self, kinds: &[SensorKind]) -> Result<Vec<Unit>, RigError> {
        let Some(key) = &self.channel_unit else { return Ok(kinds.iter().map(|kind| kind.unit()).collect()) };
        match &**key {
            ChannelUnitKeys::Text(symbol) => {
                kinds.iter().map(|kind| unit(symbol, kind.dimension())).collect()
            }
            ChannelUnitKeys::List(symbols) if symbols.len() == kinds.len() => {
                kinds.iter().zip(symbols).map(|(kind, symbol)| unit(symbol, kind.dimension())).collect()
            }
            ChannelUnitKeys::List(_) => Err(key.place.refuse(one_each(kinds.len()))),
        }
    }

    fn force(&self, own: Option<ForceColumn>) -> Result<Option<ForceColumn>, RigError> {
        let unit = match (&self.force, &self.force_unit) {
            (None, None) => return Ok(own),
            (None, Some(unit)) => return Err(self.lacks("force", unit)),
            (Some(_), None) => SensorKind::Reaction.unit(),
            (Some(_), Some(symbol)) => unit(symbol, Dimension::Force)?,
        };
        let values = self.force.as_ref().map(|force| ValueColumn { column: force.column(), unit });
        Ok(values.map(|values| ForceColumn { values, need: Need::Required }))
    }

    fn hidden(&self) -> Result<Option<ValueColumn>, RigError> {
        let unit = match (&self.hidden, &self.hidden_unit) {
            (None, None) => return Ok(None),
            (None, Some(unit)) => return Err(self.lacks("hidden", unit)),
            (Some(_), None) => Unit::NONE,
            (Some(_), Some(symbol)) => Unit::from_symbol(symbol)
                .ok_or_else(|| symbol.place.invalid(UnitError::UnknownUnit { unit: (**symbol).clone() }))?,
        };
        Ok(self.hidden.as_ref().map(|hidden| ValueColumn { column: hidden.column(), unit }))
    }

    /// The error for a unit without its column.
    fn lacks(&self, key: &'static str, unit: &At<String>) -> RigError {
        RigProblem::MissingKey { section: self.place.path.clone(), key: key.to_owned() }.at(&unit.place)
    }

    /// Origin and rounding; as many coordinates as the surface has.
    fn frame(&self, extent: Extent) -> Result<Frame, RigError> {
        let round_m = self.round.map(|round| round.si);
        let origin = match (self.origin.as_ref().map(|origin| (origin, origin.as_slice())), extent.is_plane())
        {
            (None, _) => Position::default(),
            (Some((_, [x])), false) => Position::along(x.si),
            (Some((_, [x, y])), true) => Position { x_m: x.si, y_m: y.si },
            (Some((origin, _)), true) => return Err(origin.place.refuse("a list of 2, x and y")),
            (Some((origin, _)), false) => return Err(origin.place.refuse("a list of 1")),
        };
        Ok(Frame { origin, round_m })
    }
}

impl ColumnKey {
    fn column(&self) -> Column {
        match self {
            Self::Text(name) => Column::Name(name.trim().to_owned()),
            Self::Number(number) => Column::Number(number.get()),
        }
    }
}

fn one_each(sensors: usize) -> String {
    format!("a list of {sensors}, one for each sensor")
}

fn unit(symbol: &At<String>, wanted: Dimension) -> Result<Unit, RigError> {
    let text = (**symbol).clone();
    match Unit::from_symbol(symbol) {
        Some(unit) if unit.dimension() == wanted => Ok(unit),
        _ if wanted == Dimension::None => Err(symbol.place.invalid(UnitError::UnwantedUnit { text })),
        _ => Err(symbol.place.invalid(UnitError::WrongUnit { unit: text, wanted })),
    }
}
