//! `[sensors]` or `[[sensors]]`

use toml::Spanned;

use super::places::{grid_sides, place};
use crate::error::{RigError, RigProblem};
use crate::sections::{RecordingSection, SensorsSection, SensorsSections};
use crate::value::{RawColumn, RawPosition, RawQuantity, bounded, choice, count, not_negative, quantity};
use palpate_estimators::arrangement::inner_grid;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelModel, Layout, Sensor, SensorKind, even_positions};
use palpate_mechanics::surface::SurfaceSpec;
use palpate_mechanics::units::Dimension;

const SECTION: &str = "sensors";
/// More sensors than anyone wires up.
const MOST: usize = 10_000;
const MOST_BOUND: &str = "at least 1 and at most 10000";

pub(super) fn validate(
    sections: Option<&Spanned<SensorsSections>>,
    recording: Option<&Spanned<RecordingSection>>,
    surface: &SurfaceSpec,
) -> Result<Layout, RigError> {
    let sections = sections.ok_or_else(|| RigProblem::MissingSection { section: SECTION }.nowhere())?;
    let channels = recording.and_then(|recording| recording.get_ref().channels.as_ref());
    let listed = sections.get_ref().each(sections.span());
    let channel_count = channels.filter(|_| listed.len() == 1).map(|channels| channels.get_ref().len());
    let mut sensors = Vec::new();
    for (section, span) in listed {
        let context = Context { section, span, surface, channel_count };
        context.append(&mut sensors)?;
    }
    if sensors.is_empty() {
        let value = "a list of 0".to_owned();
        return Err(
            RigProblem::OutOfRange { key: SECTION, value, bound: "a list of at least 1" }.at(sections.span())
        );
    }
    if let Some(channels) = channels {
        name_after(channels.get_ref(), &mut sensors);
    }
    Ok(Layout { sensors })
}

/// Sensors are called what the recording calls its channels.
fn name_after(channels: &[Spanned<RawColumn>], sensors: &mut [Sensor]) {
    for (sensor, channel) in sensors.iter_mut().zip(channels) {
        if let RawColumn::Name(name) = channel.get_ref() {
            sensor.name.clone_from(name);
        }
    }
}

/// One section, and what its keys are judged by.
struct Context<'a> {
    section: &'a SensorsSection,
    span: std::ops::Range<usize>,
    surface: &'a SurfaceSpec,
    /// How many channels the recording has, when they are all this section's.
    channel_count: Option<usize>,
}

impl Context<'_> {
    fn append(&self, sensors: &mut Vec<Sensor>) -> Result<(), RigError> {
        let measure = self.section.measure.as_ref().ok_or_else(|| self.missing("measure"))?;
        let kind = choice("measure", measure, &SensorKind::ALL.map(|kind| (kind.name(), kind)))?;
        if kind != SensorKind::Strain && matches!(self.surface, SurfaceSpec::Digit(_)) {
            return Err(RigProblem::NotAGauge { kind }.at(measure.span()));
        }
        if kind == SensorKind::Raw && self.surface.model().is_some() {
            return Err(RigProblem::RawOnModel.at(measure.span()));
        }
        let positions = self.positions(kind)?;
        let channel = self.channel(kind)?;
        let dead = self.dead(positions.len())?;
        let before = sensors.iter().filter(|sensor| sensor.kind == kind).count();
        sensors.extend(positions.into_iter().enumerate().map(|(i, position)| Sensor {
            kind,
            position,
            name: format!("{kind}_{}", before + i + 1),
            channel: ChannelModel { dead: dead.contains(&i), ..channel },
        }));
        Ok(())
    }

    fn positions(&self, kind: SensorKind) -> Result<Vec<Position>, RigError> {
        let extent = self.surface.extent();
        let SensorsSection { count: number, grid, positions, .. } = self.section;
        let unused = |key, with, span| Err(RigProblem::UnusedKey { key, with }.at(span));
        match (number, grid, positions) {
            (Some(_), _, Some(positions)) => unused("positions", "`count`", positions.span()),
            (_, Some(_), Some(positions)) => unused("positions", "`grid`", positions.span()),
            (Some(count), Some(_), None) => unused("count", "`grid`", count.span()),
            (None, None, Some(positions)) => self.explicit(kind, positions),
            (None, Some(raw), None) => {
                let [columns, rows] = grid_sides(raw, extent, MOST, "at least 1 and at most 10000 in all")?;
                let positions = inner_grid(extent, columns, rows);
                self.check_places(kind, &positions, |_| raw.span())?;
                Ok(positions)
            }
            // Where a raw channel is means nothing.
            (Some(raw), None, None) if extent.is_plane() && kind != SensorKind::Raw => {
                Err(RigProblem::CountOnPlane { section: SECTION }.at(raw.span()))
            }
            (Some(raw), None, None) => {
                let count = count("count", raw, 1..=MOST, MOST_BOUND)?;
                let positions: Vec<_> = even_positions(count, extent.length_m).collect();
                self.check_places(kind, &positions, |_| raw.span())?;
                Ok(positions)
            }
            (None, None, None) => match (self.channel_count, kind) {
                (Some(count), SensorKind::Raw) => Ok(even_positions(count, extent.length_m).collect()),
                _ => Err(self.missing(if extent.is_plane() { "grid" } else { "count" })),
            },
        }
    }

    fn explicit(
        &self,
        kind: SensorKind,
        listed: &Spanned<Vec<Spanned<RawPosition>>>,
    ) -> Result<Vec<Position>, RigError> {
        let extent = self.surface.extent();
        let mut positions = Vec::new();
        for raw in listed.get_ref() {
            let position = place("positions", raw, extent)?;
            if !extent.contains(position) {
                let number = positions.len() + 1;
                return Err(RigProblem::SensorOffSurface { number, position, extent }.at(raw.span()));
            }
            positions.push(position);
        }
        if !(1..=MOST).contains(&positions.len()) {
            let value = format!("a list of {}", positions.len());
            return Err(RigProblem::OutOfRange { key: "positions", value, bound: "a list of 1 to 10000" }
                .at(listed.span()));
        }
        self.check_places(kind, &positions, |i| {
            listed.get_ref().get(i).map_or(listed.span(), Spanned::span)
        })?;
        Ok(positions)
    }

    /// Under a modelled surface a reaction sensor must sit at a support, and the others where something moves.
    fn check_places(
        &self,
        kind: SensorKind,
        positions: &[Position],
        span: impl Fn(usize) -> std::ops::Range<usize>,
    ) -> Result<(), RigError> {
        let Some(surface) = self.surface.model() else { return Ok(()) };
        for (i, position) in positions.iter().enumerate() {
            let (number, extent) = (i + 1, surface.extent());
            if kind == SensorKind::Reaction && !surface.is_supported_at(*position) {
                let supports = surface.force_supports();
                let problem = RigProblem::NoSupport { number, position: *position, supports, extent };
                return Err(problem.at(span(i)));
            }
            if let Some(reason) = surface.nothing_to_read(kind, *position) {
                let position = *position;
                return Err(RigProblem::NothingToRead { number, kind, position, extent, reason }.at(span(i)));
            }
        }
        Ok(())
    }

    fn channel(&self, kind: SensorKind) -> Result<ChannelModel, RigError> {
        let dimension = kind.dimension();
        let size = |key, raw: &Option<Spanned<RawQuantity>>| {
            raw.as_ref().map_or(Ok(0.0), |raw| not_negative(key, raw, dimension))
        };
        let gain_error = self.section.gain_error.as_ref().map_or(Ok(0.0), |raw| {
            let good = |gain: f64| (0.0..1.0).contains(&gain);
            bounded("gain_error", raw, Dimension::Ratio, good, "at least 0 and below 1")
        })?;
        Ok(ChannelModel {
            noise_sd: size("noise", &self.section.noise)?,
            resolution: size("resolution", &self.section.resolution)?,
            gain_error,
            offset_error: size("offset_error", &self.section.offset_error)?,
            position_error_m: self.position_error(kind)?,
            range: self.range(dimension)?,
            dead: false,
        })
    }

    /// A reaction sensor is part of its support, and a raw channel's place means nothing.
    fn position_error(&self, kind: SensorKind) -> Result<f64, RigError> {
        let Some(raw) = &self.section.position_error else { return Ok(0.0) };
        let unused = |with| Err(RigProblem::UnusedKey { key: "position_error", with }.at(raw.span()));
        match kind {
            SensorKind::Reaction => unused("measure = \"reaction\""),
            SensorKind::Raw => unused("measure = \"raw\""),
            _ => not_negative("position_error", raw, Dimension::Length),
        }
    }

    fn range(&self, dimension: Dimension) -> Result<Option<(f64, f64)>, RigError> {
        let Some(range) = &self.section.range else { return Ok(None) };
        let refuse = |value| {
            let bound = "a list of 2, the lower value first";
            Err(RigProblem::OutOfRange { key: "range", value, bound }.at(range.span()))
        };
        match range.get_ref().as_slice() {
            [low, high] => {
                let (lowest, highest) =
                    (quantity("range", low, dimension)?, quantity("range", high, dimension)?);
                if lowest < highest {
                    Ok(Some((lowest, highest)))
                } else {
                    refuse(format!("{} to {}", low.get_ref(), high.get_ref()))
                }
            }
            listed => refuse(format!("a list of {}", listed.len())),
        }
    }

    /// The dead sensors' indices within the section.
    fn dead(&self, count: usize) -> Result<Vec<usize>, RigError> {
        let Some(dead) = &self.section.dead else { return Ok(Vec::new()) };
        let index = |raw: &Spanned<i64>| {
            let number = *raw.get_ref();
            let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
            let index = index.filter(|index| *index < count);
            index.ok_or_else(|| RigProblem::DeadNumber { number, count }.at(raw.span()))
        };
        dead.get_ref().iter().map(index).collect()
    }

    fn missing(&self, key: &'static str) -> RigError {
        RigProblem::MissingKey { section: SECTION, key }.at(self.span.clone())
    }
}
