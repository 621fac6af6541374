//! `[sensors]`, or several `[[sensors]]`

use serde::Deserialize;

use super::document::{At, Place};
use super::error::{RigError, RigProblem};
use super::recording::{ColumnKey, RecordingKeys};
use super::values::{AtLeastZero, Count, Finite, Fraction, Grid, Length, NotNegative, OneOrMany, Point, Written};
use crate::arrangement::inner_grid;
use crate::contact::Position;
use crate::mechanics::SurfaceSpec;
use crate::sensing::{ChannelModel, Layout, Sensor, SensorKind, even_positions};

/// More sensors than anyone wires up.
const MOST: i64 = 10_000;

/// Sensors of one kind.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorsKeys {
    /// What they measure.
    pub measure: At<SensorKind>,
    /// How many there are, evenly along the length: the i-th at i·l/(count + 1).
    pub count: Option<At<Count<1, MOST>>>,
    /// Columns and rows, evenly on a plane.
    pub grid: Option<At<Grid<MOST>>>,
    /// Where they are, one by one.
    pub positions: Option<At<Vec<At<Point>>>>,
    /// Standard deviation of a reading's noise.
    pub noise: Option<At<Written>>,
    /// Step to which a reading is rounded.
    pub resolution: Option<At<Written>>,
    /// Standard deviation of the gain's error.
    pub gain_error: Option<Fraction>,
    /// Standard deviation of the offset.
    pub offset_error: Option<At<Written>>,
    /// Standard deviation of the distance between a sensor and where it is said to be.
    pub position_error: Option<At<NotNegative<Length>>>,
    /// The lowest and highest reading.
    pub range: Option<At<RangeKeys>>,
    /// The numbers of sensors that always read 0, from 1.
    #[serde(default)]
    pub dead: Vec<At<i64>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(expecting = "a list of 2, the lower value first")]
pub(super) struct RangeKeys(At<Written>, At<Written>);

/// Every sensor of `sections`, named after the channels of the recording where it names them.
pub(super) fn build(
    sections: &At<OneOrMany<SensorsKeys>>,
    recording: Option<&RecordingKeys>,
    surface: &SurfaceSpec,
) -> Result<Layout, RigError> {
    let channels = recording.and_then(|recording| recording.channels.as_ref());
    let listed = sections.sections();
    let channel_count = channels.filter(|_| listed.len() == 1).map(|channels| channels.len());
    let mut sensors: Vec<Sensor> = Vec::new();
    for keys in listed {
        let kind = keys.kind(surface)?;
        let positions = keys.positions(surface, channel_count)?;
        let channel = keys.channel(kind)?;
        let dead = keys.dead(positions.len())?;
        let before = sensors.iter().filter(|sensor| sensor.kind == kind).count();
        sensors.extend(positions.into_iter().enumerate().map(|(i, position)| Sensor {
            kind,
            position,
            name: format!("{kind}_{}", before + i + 1),
            channel: ChannelModel { dead: dead.contains(&i), ..channel },
        }));
    }
    if sensors.is_empty() {
        return Err(sections.place.refuse("a list of at least 1"));
    }
    for (sensor, channel) in sensors.iter_mut().zip(channels.into_iter().flat_map(|channels| channels.iter())) {
        if let ColumnKey::Text(name) = &**channel {
            sensor.name.clone_from(name);
        }
    }
    Ok(Layout { sensors })
}

/// What a sensor of `surface` measures.
pub(super) fn kind_on(surface: &SurfaceSpec, measure: &At<SensorKind>) -> Result<SensorKind, RigError> {
    let kind = **measure;
    if kind != SensorKind::Strain && matches!(surface, SurfaceSpec::Digit(_)) {
        return Err(RigProblem::NotAGauge { kind }.at(&measure.place));
    }
    if kind == SensorKind::Raw && surface.model().is_some() {
        return Err(RigProblem::RawOnModel.at(&measure.place));
    }
    Ok(kind)
}

impl At<SensorsKeys> {
    fn kind(&self, surface: &SurfaceSpec) -> Result<SensorKind, RigError> {
        kind_on(surface, &self.measure)
    }

    /// Where they are; `channel_count` is how many channels the recording has where they are all this section's.
    fn positions(
        &self,
        surface: &SurfaceSpec,
        channel_count: Option<usize>,
    ) -> Result<Vec<Position>, RigError> {
        let (extent, kind) = (surface.extent(), *self.measure);
        let even = |count| even_positions(count, extent.length_m).collect();
        let (positions, place): (Vec<_>, _) = match (&self.count, &self.grid, &self.positions) {
            (Some(_), _, Some(positions)) => return Err(positions.place.unused("`count`")),
            (_, Some(_), Some(positions)) => return Err(positions.place.unused("`grid`")),
            (Some(count), Some(_), None) => return Err(count.place.unused("`grid`")),
            (None, None, Some(listed)) => (self.listed(surface, listed)?, &listed.place),
            (None, Some(grid), None) => {
                let (columns, rows) = grid.sides(extent)?;
                (inner_grid(extent, columns, rows), &grid.place)
            }
            // Where a raw channel is means nothing.
            (Some(count), None, None) if extent.is_plane() && kind != SensorKind::Raw => {
                return Err(RigProblem::CountOnPlane { section: "sensors" }.at(&count.place));
            }
            (Some(count), None, None) => (even(count.get()), &count.place),
            (None, None, None) => match (channel_count, kind) {
                (Some(count), SensorKind::Raw) => (even(count), &self.place),
                _ => return Err(self.place.missing(if extent.is_plane() { "grid" } else { "count" })),
            },
        };
        let place_of = |i: usize| match &self.positions {
            Some(listed) => listed.get(i).map_or(place, |point| &point.place),
            None => place,
        };
        check_places(surface, kind, &positions, place_of)?;
        Ok(positions)
    }

    fn listed(&self, surface: &SurfaceSpec, listed: &At<Vec<At<Point>>>) -> Result<Vec<Position>, RigError> {
        if !(1..=MOST as usize).contains(&listed.len()) {
            return Err(listed.place.refuse(format!("a list of 1 to {MOST}")));
        }
        let extent = surface.extent();
        let each = listed.iter().enumerate().map(|(i, point)| match point.position(extent)? {
            position if extent.contains(position) => Ok(position),
            position => {
                Err(RigProblem::SensorOffSurface { number: i + 1, position, extent }.at(&point.place))
            }
        });
        each.collect()
    }

    fn channel(&self, kind: SensorKind) -> Result<ChannelModel, RigError> {
        let dimension = kind.dimension();
        let size = |key: &Option<At<Written>>| {
            key.as_ref().map_or(Ok(0.0), |written| written.si::<AtLeastZero>(dimension))
        };
        // A reaction sensor is part of its support, and a raw channel's place means nothing.
        if let (Some(error), SensorKind::Reaction | SensorKind::Raw) = (&self.position_error, kind) {
            return Err(error.place.unused(&format!("measure = \"{kind}\"")));
        }
        let range = match &self.range {
            None => None,
            Some(range) => {
                let RangeKeys(low, high) = &**range;
                let (lowest, highest) = (low.si::<Finite>(dimension)?, high.si::<Finite>(dimension)?);
                if lowest >= highest {
                    let value = format!("{} to {}", low.place.written(), high.place.written());
                    return Err(range.place.refuse_as(value, "a list of 2, the lower value first"));
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
            dead: false,
        })
    }

    /// The dead sensors' indices within the section.
    fn dead(&self, count: usize) -> Result<Vec<usize>, RigError> {
        let index = |number: &At<i64>| match usize::try_from(**number) {
            Ok(from_1 @ 1..) if from_1 <= count => Ok(from_1 - 1),
            _ => Err(RigProblem::DeadNumber { number: **number, count }.at(&number.place)),
        };
        self.dead.iter().map(index).collect()
    }
}

/// Under a modelled surface a reaction sensor must sit at a support, and the others where something moves.
fn check_places<'a>(
    surface: &SurfaceSpec,
    kind: SensorKind,
    positions: &[Position],
    place_of: impl Fn(usize) -> &'a Place,
) -> Result<(), RigError> {
    let Some(model) = surface.model() else { return Ok(()) };
    let extent = model.extent();
    for (i, &position) in positions.iter().enumerate() {
        let number = i + 1;
        if kind == SensorKind::Reaction && !model.is_supported_at(position) {
            let supports = model.force_supports();
            return Err(RigProblem::NoSupport { number, position, supports, extent }.at(place_of(i)));
        }
        if let Some(reason) = model.nothing_to_read(kind, position) {
            return Err(RigProblem::NothingToRead { number, kind, position, extent, reason }.at(place_of(i)));
        }
    }
    Ok(())
}
