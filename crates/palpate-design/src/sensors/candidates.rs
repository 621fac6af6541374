//! The sensors that a layout may be put together from.

use std::collections::HashMap;

use super::error::{DesignError, Exclusion};
use super::pool::exclusion;
use crate::sensors::{MustHave, SensorDesign, Sites, Symmetry};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{SensorKind, even_positions};
use palpate_mechanics::surface::{Extent, Surface};

/// Places closer than this share of the length are the same.
const SAME: f64 = 1e-6;

/// A sensor of one of the offered kinds somewhere on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSensor {
    /// Which of the design's offers.
    pub offer: usize,
    /// Where it sits.
    pub position: Position,
}

/// Every sensor that a layout may have.
#[derive(Clone)]
pub(super) struct Candidates {
    pub sensors: Vec<PlacedSensor>,
    /// Indices of those that every layout has.
    pub must_have: Vec<usize>,
}

impl Candidates {
    /// All offers at all sites where they read something and nothing forbids them, and what every layout has.
    pub fn of(surface: &dyn Surface, design: &SensorDesign) -> Result<Self, DesignError> {
        let extent = surface.extent();
        let sites = sites(&design.sites, extent);
        let mut sensors = Vec::new();
        for (offer, kind) in design.offers.iter().map(|offer| offer.kind).enumerate() {
            let reads = |position: &Position| reads_something(surface, kind, *position);
            let at = |position: Position| PlacedSensor { offer, position };
            if kind == SensorKind::Reaction {
                sensors.extend(surface.force_supports().into_iter().filter(reads).map(at));
            } else {
                let free =
                    |position: &Position| design.keep_out.iter().all(|zone| !zone.holds(*position, extent));
                sensors.extend(sites.iter().copied().filter(free).filter(reads).map(at));
            }
        }
        let mut candidates = Self { sensors, must_have: Vec::new() };
        for wanted in &design.must_have {
            candidates.must_have(wanted, surface, design)?;
        }
        check_must_haves(&candidates, design, extent)?;
        Ok(candidates)
    }

    fn must_have(
        &mut self,
        wanted: &MustHave,
        surface: &dyn Surface,
        design: &SensorDesign,
    ) -> Result<(), DesignError> {
        let MustHave { offer, position } = *wanted;
        let (kind, extent) = (design.offers[offer].kind, surface.extent());
        let plane = extent.is_plane();
        if !reads_something(surface, kind, position) {
            return Err(DesignError::MustHaveReadsNothing { kind, position, plane });
        }
        let kept_out = design.keep_out.iter().any(|zone| zone.holds(position, extent));
        if kept_out && kind != SensorKind::Reaction {
            return Err(DesignError::MustHaveKeptOut { kind, position, plane });
        }
        let index = self.add(offer, position, extent);
        self.must_have.push(index);
        // Its twin need not be one of the sites either.
        let twin = mirrored(position, extent);
        let kept_out = design.keep_out.iter().any(|zone| zone.holds(twin, extent));
        if design.symmetry == Symmetry::Wanted && !kept_out && reads_something(surface, kind, twin) {
            self.add(offer, twin, extent);
        }
        Ok(())
    }

    /// The candidate of an offer at a place, which becomes one if it is none.
    fn add(&mut self, offer: usize, position: Position, extent: Extent) -> usize {
        self.at(offer, position, extent).unwrap_or_else(|| {
            self.sensors.push(PlacedSensor { offer, position });
            self.sensors.len() - 1
        })
    }

    /// The candidate of an offer at a place.
    fn at(&self, offer: usize, position: Position, extent: Extent) -> Option<usize> {
        let same = |other: &PlacedSensor| {
            other.offer == offer && other.position.distance_m(position) <= SAME * extent.length_m
        };
        self.sensors.iter().position(same)
    }

    /// For each candidate the one that is its mirror image, itself in the middle.
    pub fn twins(&self, extent: Extent) -> Vec<Option<usize>> {
        let grain_m = SAME * extent.length_m;
        let key = |sensor: &PlacedSensor| {
            let cell = |at_m: f64| (at_m / grain_m).round() as i64;
            (sensor.offer, cell(sensor.position.x_m), cell(sensor.position.y_m))
        };
        let by_place: HashMap<_, usize> =
            self.sensors.iter().enumerate().map(|(i, sensor)| (key(sensor), i)).collect();
        let twin = |sensor: &PlacedSensor| {
            let mirrored = PlacedSensor { position: mirrored(sensor.position, extent), ..*sensor };
            let (offer, x, y) = key(&mirrored);
            // Rounding may put the same place into the next cell.
            [0, -1, 1].into_iter().find_map(|step| by_place.get(&(offer, x + step, y)).copied())
        };
        self.sensors.iter().map(twin).collect()
    }
}

/// The mirror image across the middle of the length.
pub(super) fn mirrored(position: Position, extent: Extent) -> Position {
    Position { x_m: extent.length_m - position.x_m, ..position }
}

/// Candidate sites; on a plane row by row.
fn sites(sites: &Sites, extent: Extent) -> Vec<Position> {
    let every = |every_m: f64, size_m: f64| {
        let steps = (size_m / every_m + 1e-6).floor() as usize;
        (0..=steps).map(move |i| (i as f64 * every_m).min(size_m))
    };
    match sites {
        Sites::At(positions) => positions.clone(),
        Sites::Count(count) => even_positions(*count, extent.length_m).collect(),
        Sites::Every(every_m) => match extent.width_m {
            None => every(*every_m, extent.length_m).map(Position::along).collect(),
            Some(width_m) => every(*every_m, width_m)
                .flat_map(|y_m| every(*every_m, extent.length_m).map(move |x_m| Position { x_m, y_m }))
                .collect(),
        },
    }
}

/// Whether a sensor reads anything at a place, wherever the surface is touched.
pub(super) fn reads_something(surface: &dyn Surface, kind: SensorKind, position: Position) -> bool {
    let still = surface.insensitive_sensor(kind, position).is_some();
    let carried = kind != SensorKind::Reaction || surface.is_supported_at(position);
    !still && carried && kind != SensorKind::Raw
}

/// What every layout has must not exclude each other.
fn check_must_haves(
    candidates: &Candidates,
    design: &SensorDesign,
    extent: Extent,
) -> Result<(), DesignError> {
    let plane = extent.is_plane();
    for (i, first) in candidates.must_have.iter().enumerate() {
        for second in &candidates.must_have[..i] {
            let [a, b] = [first, second].map(|index| candidates.sensors[*index]);
            let reason =
                if first == second { Some(Exclusion::Same) } else { exclusion(&a, &b, design, extent) };
            if let Some(reason) = reason {
                let (first, second) = (b.position, a.position);
                return Err(DesignError::MustHavesExclude { first, second, reason, plane });
            }
        }
    }
    Ok(())
}
