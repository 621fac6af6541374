//! Sensitivities of sensors to contacts: the rows of the criteria.

use std::ops::ControlFlow;
use std::sync::Arc;

use ndarray::Array2;

use super::candidates::PlacedSensor;
use super::design::{DesignCriterion, DesignError, SensorDesign};
use super::limit_objective::LimitObjective;
use super::objective::{Block, LANES, Objective};
use crate::contacts::WeightedContacts;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::{ChannelModel, Sensor, SensorKind};
use palpate_mechanics::surface::{
    ContactLoad, ReadingsByContact, ResponseFunction, ResponseGradient, Solving, Surface,
};
use palpate_numerics::watch::{Cancelled, Watch};

/// Largest size of all candidates' rows, bytes.
const MOST_BYTES: f64 = 4e9;
/// Response functions per batch, with about 200 kB each on a plate.
const TOGETHER: usize = 48;
/// Largest number of contacts for principal components.
const MOST_SNAPSHOTS: usize = 64;

/// Estimated work and memory of a sensor design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignCost {
    /// Number of candidate sensors.
    pub candidates: usize,
    /// Peak memory of the design, bytes.
    pub memory_bytes: f64,
    /// Time of the searches at about 3 GHz, s; without simulated calibrations.
    pub seconds: f64,
}

#[derive(Clone, Copy)]
pub(super) struct SensorAt<'a> {
    pub kind: SensorKind,
    pub position: Position,
    pub channel: &'a ChannelModel,
}

impl<'a> SensorAt<'a> {
    pub fn of_design(placed: &[PlacedSensor], design: &'a SensorDesign) -> Vec<Self> {
        let at = |PlacedSensor { offer, position }: &PlacedSensor| {
            let offer = &design.offers[*offer];
            Self { kind: offer.kind, position: *position, channel: &offer.channel }
        };
        placed.iter().map(at).collect()
    }
}

impl<'a> From<&'a Sensor> for SensorAt<'a> {
    fn from(Sensor { kind, position, channel, .. }: &'a Sensor) -> Self {
        Self { kind: *kind, position: *position, channel }
    }
}

#[derive(Clone)]
pub(super) struct Sensitivity<'a> {
    pub surface: &'a dyn Surface,
    pub contacts: WeightedContacts,
    pub force_n: f64,
    pub force: Force,
}

impl Sensitivity<'_> {
    /// Excludes contacts over a support if the force is unknown, as
    /// [`palpate_mechanics::limit::LimitCurve::summary`].
    pub fn is_judged(&self, position: Position) -> bool {
        self.force == Force::Known
            || self.surface.insensitive_sensor(SensorKind::Deflection, position).is_none()
    }

    /// Weights in the score; 0 for excluded contacts.
    pub fn score_weights(&self) -> Vec<f64> {
        let WeightedContacts { positions, weights } = &self.contacts;
        let mut judged = weights.clone();
        let left_out = positions.iter().zip(&mut judged).filter(|(position, _)| !self.is_judged(**position));
        let left_out: f64 = left_out.map(|(_, weight)| std::mem::take(weight)).sum();
        if left_out > 0.0 {
            judged.iter_mut().for_each(|weight| *weight /= 1.0 - left_out);
        }
        judged
    }

    fn unknowns(&self) -> usize {
        usize::from(self.force == Force::Unknown) + self.surface.extent().dimensions()
    }

    fn row_size(&self) -> usize {
        self.unknowns() * self.contacts.len().div_ceil(LANES)
    }

    /// Rows: derivatives of whitened readings by ln W (unknown force), x, and y (plane); 0 where saturated.
    pub fn rows(&self, sensors: &[SensorAt]) -> Vec<Vec<Block>> {
        let mut rows = vec![vec![[0.0; LANES]; self.row_size()]; sensors.len()];
        let filled = for_each_response(self.surface, sensors, Watch::NONE, |i, response| {
            self.fill_row(&mut rows[i], response, sensors[i].channel);
            Ok(())
        });
        debug_assert_eq!(filled, Ok(()), "the watch does not stop it");
        rows
    }

    fn fill_row(&self, row: &mut [Block], response: &dyn ResponseFunction, channel: &ChannelModel) {
        for (i, &position) in self.contacts.positions.iter().enumerate() {
            let contact = Contact { position, force_n: self.force_n };
            self.put(row, i, response.at(contact), response.gradient(contact), channel);
        }
    }

    fn put(
        &self,
        row: &mut [Block],
        contact: usize,
        reading: f64,
        gradient: ResponseGradient,
        channel: &ChannelModel,
    ) {
        let blocks = self.contacts.len().div_ceil(LANES);
        let free = channel.range.is_none_or(|(low, high)| low < reading && reading < high);
        let weight = if free { 1.0 / channel.reading_sd() } else { 0.0 };
        let ResponseGradient { position: [along, across], force } = gradient;
        let first = usize::from(self.force == Force::Known);
        let told = &[self.force_n * force, along, across][first..first + self.unknowns()];
        for (column, value) in told.iter().enumerate() {
            row[column * blocks + contact / LANES][contact % LANES] = weight * value;
        }
    }

    /// Rows of all candidates by the faster of two solvers.
    pub fn table(&self, candidates: &[SensorAt], watch: Watch) -> Result<Vec<Block>, DesignError> {
        self.table_by(Solving::cheaper(candidates.len(), self.contacts.len()), candidates, watch)
    }

    pub(super) fn table_by(
        &self,
        solving: Solving,
        candidates: &[SensorAt],
        watch: Watch,
    ) -> Result<Vec<Block>, DesignError> {
        const STAGE: &str = "sensitivities of the sites";
        let (sites, contacts, bytes) =
            (candidates.len(), self.contacts.len(), self.table_bytes(candidates.len()));
        if bytes > MOST_BYTES {
            return Err(DesignError::TooLarge { sites, contacts, bytes, most: MOST_BYTES });
        }
        let size = self.row_size();
        let mut table = vec![[0.0; LANES]; sites * size];
        let row = |sensor: usize| sensor * size..(sensor + 1) * size;
        match self.by_contact(solving, candidates) {
            Some(readings) => {
                readings.for_each_contact(
                    &self.contacts.positions,
                    STAGE,
                    watch,
                    |contact, influences| {
                        for (i, sensor) in candidates.iter().enumerate() {
                            let [at, along, across] = influences.each_ref().map(|each| each[i]);
                            let position = [self.force_n * along, self.force_n * across];
                            let gradient = ResponseGradient { position, force: at };
                            self.put(
                                &mut table[row(i)],
                                contact,
                                self.force_n * at,
                                gradient,
                                sensor.channel,
                            );
                        }
                        ControlFlow::Continue(())
                    },
                )?;
            }
            None => for_each_response(self.surface, candidates, watch, |i, response| {
                if i.is_multiple_of(TOGETHER) {
                    watch.counted(STAGE, "sensors", i, sites)?;
                }
                self.fill_row(&mut table[row(i)], response, candidates[i].channel);
                Ok(())
            })?,
        }
        Ok(table)
    }

    pub fn cost(&self, candidates: usize, count: usize) -> DesignCost {
        /// Passes over all candidates per sensor, and seconds per number in one pass.
        const PASSES: f64 = 12.0;
        const SECONDS_EACH: f64 = 1e-9;
        /// Cost of the refinement per sensor, in batched solutions.
        const REFINING: f64 = 200.0;
        let table = self.table_bytes(candidates);
        let sums = PASSES * count as f64 * table / size_of::<f64>() as f64;
        // Whitened readings, their transposed copy, and components.
        let snapshots = self.contacts.len().min(MOST_SNAPSHOTS);
        let readings = (3 * snapshots * candidates * size_of::<f64>()) as f64;
        let solving = Solving::cheaper(candidates, self.contacts.len());
        let (at_once, solutions) = match solving {
            Solving::BySensor => (TOGETHER, candidates),
            Solving::ByContact => (candidates, ContactLoad::EACH * (self.contacts.len() + snapshots)),
        };
        let solution = self.surface.solution_cost(at_once, solving);
        DesignCost {
            candidates,
            memory_bytes: table + readings + solution.map_or(0.0, |cost| cost.memory_bytes),
            seconds: sums * SECONDS_EACH
                + solution.map_or(0.0, |cost| {
                    cost.seconds_once + (solutions as f64 + REFINING * count as f64) * cost.seconds_each
                }),
        }
    }

    fn table_bytes(&self, candidates: usize) -> f64 {
        (candidates * self.row_size() * size_of::<Block>()) as f64
    }

    fn by_contact(&self, solving: Solving, sensors: &[SensorAt]) -> Option<Arc<dyn ReadingsByContact + '_>> {
        if solving == Solving::BySensor {
            return None;
        }
        let places: Vec<_> = sensors.iter().map(|sensor| (sensor.kind, sensor.position)).collect();
        self.surface.readings_by_contact(&places)
    }

    pub fn objective(
        &self,
        table: Arc<Vec<Block>>,
        criterion: DesignCriterion,
        tolerance_m: f64,
    ) -> Box<dyn Objective> {
        let sides_m: Vec<f64> = self.surface.extent().sides_m().collect();
        let weights = &self.score_weights();
        match (self.force, sides_m.len()) {
            (Force::Known, 1) => {
                Box::new(LimitObjective::<1, 0>::new(table, weights, &sides_m, criterion, tolerance_m))
            }
            (Force::Unknown, 1) => {
                Box::new(LimitObjective::<2, 1>::new(table, weights, &sides_m, criterion, tolerance_m))
            }
            (Force::Known, _) => {
                Box::new(LimitObjective::<2, 0>::new(table, weights, &sides_m, criterion, tolerance_m))
            }
            (Force::Unknown, _) => {
                Box::new(LimitObjective::<3, 1>::new(table, weights, &sides_m, criterion, tolerance_m))
            }
        }
    }

    /// Whitened readings, a row per contact (a sample of many), times the root of its share.
    pub fn readings(&self, candidates: &[SensorAt], watch: Watch) -> Result<Array2<f64>, Cancelled> {
        let sample = self.contacts.sample(MOST_SNAPSHOTS);
        self.readings_by(Solving::cheaper(candidates.len(), sample.len()), candidates, &sample, watch)
    }

    fn readings_by(
        &self,
        solving: Solving,
        candidates: &[SensorAt],
        contacts: &WeightedContacts,
        watch: Watch,
    ) -> Result<Array2<f64>, Cancelled> {
        const STAGE: &str = "readings of the sites";
        let mut readings = Array2::zeros((contacts.len(), candidates.len()));
        let whitened = |contact: usize, sensor: usize, reading: f64| {
            contacts.weights[contact].sqrt() * reading / candidates[sensor].channel.reading_sd()
        };
        match self.by_contact(solving, candidates) {
            Some(by_contact) => {
                by_contact.for_each_contact(&contacts.positions, STAGE, watch, |row, [at, ..]| {
                    for (i, influence) in at.iter().enumerate() {
                        readings[[row, i]] = whitened(row, i, self.force_n * influence);
                    }
                    ControlFlow::Continue(())
                })?;
            }
            None => for_each_response(self.surface, candidates, watch, |i, response| {
                if i.is_multiple_of(TOGETHER) {
                    watch.counted(STAGE, "sensors", i, candidates.len())?;
                }
                for (row, &position) in contacts.positions.iter().enumerate() {
                    let reading = response.at(Contact { position, force_n: self.force_n });
                    readings[[row, i]] = whitened(row, i, reading);
                }
                Ok(())
            })?,
        }
        Ok(readings)
    }
}

fn for_each_response(
    surface: &dyn Surface,
    sensors: &[SensorAt],
    watch: Watch,
    mut take: impl FnMut(usize, &dyn ResponseFunction) -> Result<(), Cancelled>,
) -> Result<(), Cancelled> {
    let mut first = 0;
    for of_a_kind in sensors.chunk_by(|a, b| a.kind == b.kind) {
        for few in of_a_kind.chunks(TOGETHER) {
            let positions: Vec<Position> = few.iter().map(|sensor| sensor.position).collect();
            let responses = surface.response_functions_watched(few[0].kind, &positions, watch)?;
            for (i, response) in responses.iter().enumerate() {
                take(first + i, &**response)?;
            }
            first += few.len();
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contacts::ContactPrior;
    use crate::fixtures::plate;
    use palpate_mechanics::sensing::SensorKind::{Deflection, Slope, Strain};
    use palpate_mechanics::surface::Extent;

    fn sensors<'a>(channels: &'a [ChannelModel; 2], extent: Extent) -> Vec<SensorAt<'a>> {
        let place = |i: usize| {
            let [x, y] = [i as f64 * 0.618, i as f64 * 0.755].map(|share| share.fract().clamp(0.01, 0.99));
            Position { x_m: x * extent.length_m(), y_m: y * extent.width_m().unwrap_or_default() }
        };
        let kinds = [(Deflection, 60), (Slope, 50), (Strain, 7), (Deflection, 3)].into_iter();
        let of_kinds = kinds.flat_map(|(kind, count)| std::iter::repeat_n(kind, count));
        let sensor = |(i, kind)| SensorAt { kind, position: place(i), channel: &channels[i % 2] };
        of_kinds.enumerate().map(sensor).collect()
    }

    #[test]
    fn solutions_by_sensor_and_by_contact_agree() {
        let setup = plate(12).setup;
        let surface = setup.surface().model().unwrap();
        let noisy = ChannelModel { noise_sd: 5e-6, ..ChannelModel::default() };
        let channels = [noisy, ChannelModel { noise_sd: 2e-6, range: Some((-2e-4, 2e-4)), ..noisy }];
        let candidates = sensors(&channels, surface.extent());
        let extent = surface.extent();
        let prior = ContactPrior { every_m: 0.037, ..ContactPrior::over_surface(extent) };
        let contacts = WeightedContacts::from_prior(&prior, extent).unwrap();
        for force in [Force::Known, Force::Unknown] {
            let sensitivity = Sensitivity { surface, contacts: contacts.clone(), force_n: 5.0, force };
            let [one, other] = [Solving::BySensor, Solving::ByContact].map(|solving| {
                let table = sensitivity.table_by(solving, &candidates, Watch::NONE).unwrap();
                let readings = sensitivity.readings_by(solving, &candidates, &contacts, Watch::NONE).unwrap();
                (table, readings)
            });
            let rows = sensitivity.rows(&candidates).concat();
            assert_eq!(rows, one.0);
            // All numbers of one sensor and one unknown have one unit.
            let blocks = contacts.len().div_ceil(LANES);
            for (i, (a, b)) in one.0.chunks(blocks).zip(other.0.chunks(blocks)).enumerate() {
                let (a, b) = (a.as_flattened(), b.as_flattened());
                let scale = a.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
                let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(scale > 0.0 && apart < 1e-9 * scale, "{i}: {apart} of {scale}");
            }
            let saturated = one.0.chunks(blocks).filter(|row| row[0].contains(&0.0)).count();
            assert!((1..candidates.len()).contains(&saturated), "{saturated}");
            let largest = one.1.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
            assert!(one.1.iter().zip(&other.1).all(|(a, b)| (a - b).abs() < 1e-9 * largest));
        }
    }

    #[test]
    fn progress_counts_up_and_stops() {
        use palpate_numerics::watch::Progress;
        use std::sync::Mutex;
        let setup = plate(8).setup;
        let surface = setup.surface().model().unwrap();
        let channels = [ChannelModel { noise_sd: 5e-6, ..ChannelModel::default() }; 2];
        let candidates = sensors(&channels, surface.extent());
        let prior = ContactPrior::over_surface(surface.extent());
        let contacts = WeightedContacts::from_prior(&prior, surface.extent()).unwrap();
        let sensitivity = Sensitivity { surface, contacts, force_n: 5.0, force: Force::Known };
        for solving in [Solving::BySensor, Solving::ByContact] {
            let seen = Mutex::new(Vec::new());
            let stop_at_third = |progress| {
                let Progress::Counted { done, of, .. } = progress else { return true };
                let mut seen = seen.lock().unwrap();
                seen.push((done, of));
                seen.len() < 3
            };
            let stopped = sensitivity.table_by(solving, &candidates, Watch::new(&stop_at_third));
            assert_eq!(stopped, Err(DesignError::Cancelled(Cancelled)));
            let seen = seen.into_inner().unwrap();
            assert!(
                seen[0].0 == 0 && seen.is_sorted() && seen.iter().all(|(done, of)| done < of),
                "{seen:?}"
            );
        }
    }
}
