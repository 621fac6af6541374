//! `[sensors]`, or several `[[sensors]]`

use serde::Deserialize;

use palpate_estimators::arrangement::inner_grid;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelModel, Layout, Sensor, SensorKind, even_positions};
use palpate_mechanics::surface::{Extent, SurfaceSpec};

use crate::document::At;
use crate::error::{RigError, RigProblem};
use crate::recording::{ColumnKey, RecordingKeys};
use crate::values::{AtLeastZero, Count, Finite, Fraction, Grid, Length, NotNegative, OneOrMany, Point};
use crate::values::{ON_A_PLANE, RawQuantity};

const MOST: i64 = 10_000;

/// Sensors of one kind.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorsKeys {
    /// Kind of the sensors; `raw` on a measured surface, `strain` on a digit.
    pub measure: At<SensorKind>,
    /// Number of sensors, evenly along the length: the i-th at i·l/(count + 1). Raw channels need neither `count`, `grid` nor `positions`
    /// where [recording] lists them.
    pub count: Option<At<Count<1, MOST>>>,
    /// Columns and rows, evenly on a plane.
    pub grid: Option<At<Grid<MOST>>>,
    /// Positions of the sensors, one by one.
    pub positions: Option<At<Vec<At<Point>>>>,
    /// Standard deviation of a reading's noise; 0 by default.
    pub noise: Option<At<RawQuantity>>,
    /// Step to which a reading is rounded; 0 by default.
    pub resolution: Option<At<RawQuantity>>,
    /// Largest error of the gain, errors being uniform within ± this; 0 by default.
    pub gain_error: Option<Fraction>,
    /// Largest offset, offsets being uniform within ± this; 0 by default.
    pub offset_error: Option<At<RawQuantity>>,
    /// Largest error of a sensor's position along each side of the surface, errors being uniform within ± this; 0 by default.
    pub position_error: Option<At<NotNegative<Length>>>,
    /// The lowest and highest reading; unlimited by default.
    pub range: Option<At<RangeKeys>>,
    /// The numbers of sensors that always read 0, from 1.
    #[serde(default)]
    pub dead: Vec<At<i64>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(expecting = "a list of 2, the lower value first")]
pub(crate) struct RangeKeys(At<RawQuantity>, At<RawQuantity>);

pub(crate) fn build(
    sections: &At<OneOrMany<SensorsKeys>>,
    recording: Option<&RecordingKeys>,
    surface: &SurfaceSpec,
) -> Result<Layout, RigError> {
    let channels = recording.and_then(|recording| recording.channels.as_ref());
    let listed = sections.sections();
    let channel_count = channels.filter(|_| listed.len() == 1).map(|channels| channels.len());
    let mut sensors: Vec<Sensor> = Vec::new();
    for keys in listed {
        let kind = kind_on(surface, &keys.measure)?;
        let positions = keys.positions(surface, channel_count)?;
        let channel = keys.channel(kind)?;
        let dead = keys.disabled_sensors(positions.len())?;
        let before = sensors.iter().filter(|sensor| sensor.kind == kind).count();
        sensors.extend(positions.into_iter().enumerate().map(|(i, position)| Sensor {
            kind,
            position,
            name: format!("{kind}_{}", before + i + 1),
            channel: ChannelModel { disabled: dead.contains(&i), ..channel },
        }));
    }
    if sensors.is_empty() {
        return Err(sections.place.refuse("a list of at least 1"));
    }
    for (sensor, channel) in sensors.iter_mut().zip(channels.into_iter().flat_map(|channels| channels.iter()))
    {
        if let ColumnKey::Text(name) = &**channel {
            sensor.name.clone_from(name);
        }
    }
    Layout::new(sensors).map_err(|problem| RigProblem::Layout(problem).at_place(&sections.place))
}

pub(crate) fn kind_on(surface: &SurfaceSpec, measure: &At<SensorKind>) -> Result<SensorKind, RigError> {
    let place = &measure.place;
    match **measure {
        SensorKind::Strain => Ok(SensorKind::Strain),
        _ if matches!(surface, SurfaceSpec::Digit(_)) => {
            Err(place.refuse("strain on a digit, which is read by strain gauges"))
        }
        SensorKind::Raw if surface.model().is_some() => {
            Err(place
                .refuse("another kind: no model explains a raw channel; only a measured surface has them"))
        }
        kind => Ok(kind),
    }
}

impl At<SensorsKeys> {
    /// `channel_count` is that of the recording if all are of this section.
    fn positions(
        &self,
        surface: &SurfaceSpec,
        channel_count: Option<usize>,
    ) -> Result<Vec<Position>, RigError> {
        let (extent, kind) = (surface.extent(), *self.measure);
        let even = |count| even_positions(count, extent.length_m()).collect();
        let (positions, place): (Vec<_>, _) = match (&self.count, &self.grid, &self.positions) {
            (Some(_), _, Some(listed)) => return Err(listed.place.unused("`count`")),
            (_, Some(_), Some(listed)) => return Err(listed.place.unused("`grid`")),
            (Some(count), Some(_), None) => return Err(count.place.unused("`grid`")),
            (None, None, Some(listed)) if !(1..=MOST as usize).contains(&listed.len()) => {
                return Err(listed.place.refuse(format!("a list of 1 to {MOST}")));
            }
            (None, None, Some(listed)) => {
                let each = listed.iter().map(|point| point.on_surface(extent));
                (each.collect::<Result<_, _>>()?, &listed.place)
            }
            (None, Some(grid), None) => {
                let (columns, rows) = grid.sides(extent)?;
                (inner_grid(extent, columns, rows), &grid.place)
            }
            // The place of a raw channel has no effect.
            (Some(count), None, None) => match extent {
                Extent::Plane { .. } if kind != SensorKind::Raw => {
                    return Err(count.place.unused(ON_A_PLANE));
                }
                _ => (even(count.get()), &count.place),
            },
            (None, None, None) => match (channel_count, kind, extent) {
                (Some(count), SensorKind::Raw, _) => (even(count), &self.place),
                (_, _, Extent::Line { .. }) => return Err(self.place.missing("count")),
                (_, _, Extent::Plane { .. }) => return Err(self.place.missing("grid")),
            },
        };
        for (i, &position) in positions.iter().enumerate() {
            let listed = self.positions.as_ref().and_then(|listed| listed.get(i));
            let place = listed.map_or(place, |point| &point.place);
            check_sensor(surface, kind, i + 1, position).map_err(|problem| problem.at_place(place))?;
        }
        Ok(positions)
    }

    fn channel(&self, kind: SensorKind) -> Result<ChannelModel, RigError> {
        let dimension = kind.dimension();
        let size = |key: &Option<At<RawQuantity>>| {
            key.as_ref().map_or(Ok(0.0), |written| written.si::<AtLeastZero>(dimension))
        };
        // A reaction sensor is part of its support, and the place of a raw channel has no effect.
        if let (Some(error), SensorKind::Reaction | SensorKind::Raw) = (&self.position_error, kind) {
            return Err(error.place.unused(format!("measure = \"{kind}\"")));
        }
        let range = match &self.range {
            None => None,
            Some(range) => {
                let RangeKeys(low, high) = &**range;
                let (lowest, highest) = (low.si::<Finite>(dimension)?, high.si::<Finite>(dimension)?);
                if lowest >= highest {
                    let value = format!("{} to {}", low.place.written, high.place.written);
                    return Err(range.place.refuse_value(value, "a list of 2, the lower value first"));
                }
                Some((lowest, highest))
            }
        };
        Ok(ChannelModel {
            noise_sd: size(&self.noise)?,
            resolution: size(&self.resolution)?,
            gain_error: self.gain_error.map_or(0.0, |error| error.si),
            offset_error: size(&self.offset_error)?,
            position_error_m: self.position_error.as_ref().map_or(0.0, |error| error.si),
            range,
            disabled: false,
        })
    }

    fn disabled_sensors(&self, count: usize) -> Result<Vec<usize>, RigError> {
        let index = |number: &At<i64>| match usize::try_from(**number) {
            Ok(from_1 @ 1..) if from_1 <= count => Ok(from_1 - 1),
            _ => Err(number.place.refuse(format!("the number of a sensor of this section, 1 to {count}"))),
        };
        self.dead.iter().map(index).collect()
    }
}

/// A reaction sensor must be at a support, another one where the surface deforms.
fn check_sensor(
    surface: &SurfaceSpec,
    kind: SensorKind,
    number: usize,
    position: Position,
) -> Result<(), RigProblem> {
    let Some(model) = surface.model() else { return Ok(()) };
    let extent = model.extent();
    if kind == SensorKind::Reaction && !model.is_supported_at(position) {
        return Err(RigProblem::NoSupport { number, position, supports: model.force_supports(), extent });
    }
    match model.insensitive_sensor(kind, position) {
        Some(reason) => Err(RigProblem::InsensitiveSensor { number, kind, position, extent, reason }),
        None => Ok(()),
    }
}
