//! Candidates of searches: sensors or mirrored pairs, and their exclusions.

use std::collections::HashMap;

use super::design::{DesignError, Exclusion};
use super::design::{FixedList, RequiredSensor, SensorDesign, Sites, Supply, Symmetry};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{SensorKind, even_positions};
use palpate_mechanics::surface::{Extent, Surface};

/// Distance of equal places, relative to the length.
const SAME: f64 = 1e-6;

/// Sensor of an offered kind at a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSensor {
    /// Index of the offer.
    pub offer: usize,
    /// Position.
    pub position: Position,
}

impl PlacedSensor {
    pub(super) fn is_same(&self, other: &Self, extent: Extent) -> bool {
        self.offer == other.offer && self.position.distance_m(other.position) <= SAME * extent.length_m()
    }
}

#[derive(Clone)]
pub(super) struct Candidates {
    pub sensors: Vec<PlacedSensor>,
    pub must_have: Vec<usize>,
}

impl Candidates {
    /// Collects the fixed sensors, and all sensitive, permitted offers.
    pub fn new(surface: &dyn Surface, design: &SensorDesign) -> Result<Self, DesignError> {
        let extent = surface.extent();
        let sites = sites(&design.sites, extent);
        let mut sensors = Vec::new();
        let offered = design.offers.iter().enumerate().filter(|(_, offer)| offer.supply == Supply::Any);
        for (offer, kind) in offered.map(|(i, offer)| (i, offer.kind)) {
            let reads = |position: &Position| is_sensitive(surface, kind, *position);
            let at = |position: Position| PlacedSensor { offer, position };
            if kind == SensorKind::Reaction {
                sensors.extend(surface.force_supports().into_iter().filter(reads).map(at));
            } else {
                let free = |position: &Position| !design.keeps_out(*position, extent);
                sensors.extend(sites.iter().copied().filter(free).filter(reads).map(at));
            }
        }
        let mut candidates = Self { sensors, must_have: Vec::new() };
        for (i, wanted) in design.must_have.iter().enumerate() {
            candidates.must_have(wanted, design.list_of(i), surface, design)?;
        }
        check_must_haves(&candidates, design, extent)?;
        Ok(candidates)
    }

    fn must_have(
        &mut self,
        wanted: &RequiredSensor,
        list: FixedList,
        surface: &dyn Surface,
        design: &SensorDesign,
    ) -> Result<(), DesignError> {
        let RequiredSensor { offer, position } = *wanted;
        let (kind, extent) = (design.offers[offer].kind, surface.extent());
        if !is_sensitive(surface, kind, position) {
            return Err(DesignError::MustHaveReadsNothing { list, kind, position, extent });
        }
        if design.keeps_out(position, extent) && kind != SensorKind::Reaction {
            return Err(DesignError::MustHaveKeptOut { list, kind, position, extent });
        }
        let index = self.add(PlacedSensor { offer, position }, extent);
        self.must_have.push(index);
        // The mirror image need not be one of the sites either.
        let twin = mirrored(position, extent);
        let reads = !design.keeps_out(twin, extent) && is_sensitive(surface, kind, twin);
        if design.symmetry == Symmetry::Wanted && reads {
            self.add(PlacedSensor { offer, position: twin }, extent);
        }
        Ok(())
    }

    fn add(&mut self, sensor: PlacedSensor, extent: Extent) -> usize {
        self.sensors.iter().position(|other| other.is_same(&sensor, extent)).unwrap_or_else(|| {
            self.sensors.push(sensor);
            self.sensors.len() - 1
        })
    }

    /// Indices of mirror images; in the middle the own index.
    pub fn twins(&self, extent: Extent) -> Vec<Option<usize>> {
        let grain_m = SAME * extent.length_m();
        let key = |sensor: &PlacedSensor| {
            let cell = |at_m: f64| (at_m / grain_m).round() as i64;
            (sensor.offer, cell(sensor.position.x_m), cell(sensor.position.y_m))
        };
        let by_place: HashMap<_, usize> =
            self.sensors.iter().enumerate().map(|(i, sensor)| (key(sensor), i)).collect();
        let twin = |sensor: &PlacedSensor| {
            let mirrored = PlacedSensor { position: mirrored(sensor.position, extent), ..*sensor };
            let (offer, x, y) = key(&mirrored);
            // Rounding may put one place into the next cell.
            [0, -1, 1].into_iter().find_map(|step| by_place.get(&(offer, x + step, y)).copied())
        };
        self.sensors.iter().map(twin).collect()
    }
}

pub(super) fn mirrored(position: Position, extent: Extent) -> Position {
    Position { x_m: extent.length_m() - position.x_m, ..position }
}

fn sites(sites: &Sites, extent: Extent) -> Vec<Position> {
    let every = |every_m: f64, size_m: f64| {
        let steps = (size_m / every_m + 1e-6).floor() as usize;
        (0..=steps).map(move |i| (i as f64 * every_m).min(size_m))
    };
    match sites {
        Sites::At(positions) => positions.clone(),
        Sites::Count(count) => even_positions(*count, extent.length_m()).collect(),
        Sites::Every(every_m) => every(*every_m, extent.width_m().unwrap_or(0.0))
            .flat_map(|y_m| every(*every_m, extent.length_m()).map(move |x_m| Position { x_m, y_m }))
            .collect(),
    }
}

pub(super) fn is_sensitive(surface: &dyn Surface, kind: SensorKind, position: Position) -> bool {
    let still = surface.insensitive_sensor(kind, position).is_some();
    let carried = kind != SensorKind::Reaction || surface.is_supported_at(position);
    !still && carried && kind != SensorKind::Raw
}

fn check_must_haves(
    candidates: &Candidates,
    design: &SensorDesign,
    extent: Extent,
) -> Result<(), DesignError> {
    for (i, first) in candidates.must_have.iter().enumerate() {
        for second in &candidates.must_have[..i] {
            let [a, b] = [first, second].map(|index| candidates.sensors[*index]);
            let reason =
                if first == second { Some(Exclusion::Same) } else { exclusion(&a, &b, design, extent) };
            if let Some(reason) = reason {
                let (first, second) = (b.position, a.position);
                let list = design.list_of(i);
                return Err(DesignError::MustHavesExclude { list, first, second, reason, extent });
            }
        }
    }
    Ok(())
}

/// One sensor, or a mirrored pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Unit {
    pub first: usize,
    pub twin: Option<usize>,
}

impl Unit {
    pub fn size(&self) -> usize {
        if self.twin.is_some() { 2 } else { 1 }
    }

    pub fn members(&self) -> impl Iterator<Item = usize> {
        [Some(self.first), self.twin].into_iter().flatten()
    }
}

pub(super) struct Pool {
    pub design: SensorDesign,
    pub extent: Extent,
    pub sensors: Vec<PlacedSensor>,
    pub units: Vec<Unit>,
    pub fixed: Vec<usize>,
    cheapest: f64,
}

impl Pool {
    pub fn new(candidates: Candidates, design: &SensorDesign, extent: Extent) -> Result<Self, DesignError> {
        let sites = candidates.sensors.len();
        if sites < design.count {
            return Err(DesignError::TooFewSites { count: design.count, sites });
        }
        let units = match design.symmetry {
            Symmetry::Wanted => mirrored_units(&candidates, design, extent),
            Symmetry::Any | Symmetry::Forbidden => {
                (0..sites).map(|first| Unit { first, twin: None }).collect()
            }
        };
        let fixed = fixed_units(&candidates, &units, design, extent)?;
        let cost = |sensor: &PlacedSensor| design.offers[sensor.offer].cost;
        let cheapest = candidates.sensors.iter().map(cost).fold(f64::INFINITY, f64::min);
        let pool =
            Self { design: design.clone(), extent, sensors: candidates.sensors, units, fixed, cheapest };
        pool.check_symmetry()?;
        Ok(pool)
    }

    pub fn candidates(&self, selection: &[usize]) -> Vec<usize> {
        selection.iter().flat_map(|unit| self.units[*unit].members()).collect()
    }

    pub fn size(&self, selection: &[usize]) -> usize {
        selection.iter().map(|unit| self.units[*unit].size()).sum()
    }

    pub fn is_whole(&self, selection: &[usize]) -> bool {
        self.size(selection) == self.design.count
    }

    pub fn all(&self) -> Vec<usize> {
        (0..self.units.len()).collect()
    }

    pub fn cost(&self, selection: &[usize]) -> f64 {
        selection.iter().map(|unit| self.unit_cost(*unit)).sum()
    }

    fn unit_cost(&self, unit: usize) -> f64 {
        let cost = |candidate: usize| self.design.offers[self.sensors[candidate].offer].cost;
        self.units[unit].members().map(cost).sum()
    }

    pub fn are_compatible(&self, a: usize, b: usize) -> bool {
        // With very many candidates this is called very often.
        if a == b || excludes_nothing(&self.design) {
            return a != b;
        }
        let (first, second) = (self.units[a], self.units[b]);
        first.members().all(|i| {
            second
                .members()
                .all(|j| exclusion(&self.sensors[i], &self.sensors[j], &self.design, self.extent).is_none())
        })
    }

    pub fn may_join(&self, selection: &[usize], unit: usize) -> bool {
        !self.joinable(selection, &[unit], None).is_empty()
    }

    /// Lists the units that can join; `selection` lacks sensors of `size`, or of any if `None`.
    pub fn joinable(&self, selection: &[usize], among: &[usize], size: Option<usize>) -> Vec<usize> {
        let room = self.design.count - self.size(selection);
        let cost = self.cost(selection);
        let fits = |unit: &usize| {
            self.keeps_pairs(room, *unit)
                && size.is_none_or(|size| size == self.units[*unit].size())
                && self.is_affordable(cost, room, *unit)
                && selection.iter().all(|other| self.are_compatible(*other, *unit))
        };
        among.iter().copied().filter(|unit| fits(unit)).collect()
    }

    /// Checks the room: a symmetric layout has pairs, and one middle sensor if its count is odd.
    fn keeps_pairs(&self, room: usize, unit: usize) -> bool {
        let alone = self.units[unit].twin.is_none();
        room >= self.units[unit].size()
            && (self.design.symmetry != Symmetry::Wanted || !alone || !room.is_multiple_of(2))
    }

    /// Checks the budget, with the cheapest sensors in the remaining room.
    fn is_affordable(&self, spent: f64, room: usize, unit: usize) -> bool {
        let rest = (room - self.units[unit].size()) as f64 * self.cheapest;
        self.design.affords(spent + self.unit_cost(unit) + rest)
    }

    fn check_symmetry(&self) -> Result<(), DesignError> {
        if self.design.symmetry != Symmetry::Wanted {
            return Ok(());
        }
        let count = self.design.count;
        let pairs = self.units.iter().filter(|unit| unit.twin.is_some()).count();
        let middle = self.units.len() - pairs;
        let possible = (0..=middle)
            .any(|alone| alone <= count && (count - alone).is_multiple_of(2) && (count - alone) / 2 <= pairs);
        if possible { Ok(()) } else { Err(DesignError::Symmetry { count, pairs, middle }) }
    }
}

fn excludes_nothing(design: &SensorDesign) -> bool {
    design.spacing_m == 0.0 && design.symmetry != Symmetry::Forbidden
}

pub(super) fn exclusion(
    a: &PlacedSensor,
    b: &PlacedSensor,
    design: &SensorDesign,
    extent: Extent,
) -> Option<Exclusion> {
    if excludes_nothing(design) {
        return None;
    }
    let takes_room = |sensor: &PlacedSensor| design.offers[sensor.offer].kind != SensorKind::Reaction;
    let slack_m = 1e-9 * extent.length_m();
    let (spacing_m, distance_m) = (design.spacing_m, a.position.distance_m(b.position));
    if distance_m < spacing_m - slack_m && takes_room(a) && takes_room(b) {
        return Some(Exclusion::Spacing { distance_m, spacing_m });
    }
    if design.symmetry == Symmetry::Forbidden && a.offer == b.offer {
        let apart_m = mirrored(a.position, extent).distance_m(b.position);
        if apart_m < mirror_distance(design, extent) - slack_m {
            return Some(Exclusion::Mirror);
        }
    }
    None
}

/// Least distance to a mirror image if forbidden: the spacing, at least half the site spacing.
fn mirror_distance(design: &SensorDesign, extent: Extent) -> f64 {
    let pitch_m = design.sites.distance_m(extent.length_m()).unwrap_or(0.0);
    design.spacing_m.max(0.5 * pitch_m).max(2e-9 * extent.length_m())
}

/// Mirrored pairs, and single candidates in the middle.
fn mirrored_units(candidates: &Candidates, design: &SensorDesign, extent: Extent) -> Vec<Unit> {
    let twins = candidates.twins(extent);
    let unit = |(first, twin): (usize, &Option<usize>)| match *twin {
        Some(twin) if twin == first => Some(Unit { first, twin: None }),
        Some(twin) if twin > first => {
            let [a, b] = [first, twin].map(|i| candidates.sensors[i]);
            exclusion(&a, &b, design, extent).is_none().then_some(Unit { first, twin: Some(twin) })
        }
        _ => None,
    };
    twins.iter().enumerate().filter_map(unit).collect()
}

fn fixed_units(
    candidates: &Candidates,
    units: &[Unit],
    design: &SensorDesign,
    extent: Extent,
) -> Result<Vec<usize>, DesignError> {
    let mut fixed: Vec<usize> = Vec::new();
    for (i, candidate) in candidates.must_have.iter().enumerate() {
        let list = design.list_of(i);
        let PlacedSensor { offer, position } = candidates.sensors[*candidate];
        let unit = units.iter().position(|unit| unit.members().any(|member| member == *candidate));
        let kind = design.offers[offer].kind;
        let without = DesignError::MustHaveWithoutTwin { list, kind, position, extent };
        let unit = unit.ok_or(without)?;
        if !fixed.contains(&unit) {
            fixed.push(unit);
        }
    }
    let listed = fixed.iter().map(|unit| units[*unit].size()).sum();
    if listed > design.count {
        let mirrored = listed > candidates.must_have.len();
        return Err(DesignError::TooManyMustHaves { listed, count: design.count, mirrored });
    }
    Ok(fixed)
}
