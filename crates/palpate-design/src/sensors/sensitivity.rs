//! Sensitivities of sensors to contacts: the rows that criteria work on.

use std::sync::Arc;

use ndarray::Array2;

use super::candidates::PlacedSensor;
use super::design::DesignError;
use super::design::{DesignCriterion, SensorDesign};
use super::limit_objective::LimitObjective;
use super::objective::{Block, LANES, Objective};
use crate::contacts::WeightedContacts;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::{ChannelModel, SensorKind};
use palpate_mechanics::surface::{ResponseGradient, Surface};
use palpate_numerics::watch::Watch;

/// More bytes than the rows of all candidates may take.
const MOST_BYTES: f64 = 4e9;
/// Candidates between two questions whether to go on.
const ASK_EVERY: usize = 64;
/// Contacts that principal components are taken over, at most.
const MOST_SNAPSHOTS: usize = 64;

/// The contacts of a design on its surface: what sensitivities are to.
#[derive(Clone)]
pub(super) struct Sensitivity<'a> {
    pub surface: &'a dyn Surface,
    pub contacts: WeightedContacts,
    pub force_n: f64,
    pub force: Force,
}

impl Sensitivity<'_> {
    /// Number of unknowns of a contact.
    fn unknowns(&self) -> usize {
        usize::from(self.force == Force::Unknown) + self.surface.extent().dimensions()
    }

    /// Number of blocks in the row of a sensor.
    fn row_size(&self) -> usize {
        self.unknowns() * self.contacts.len().div_ceil(LANES)
    }

    /// Row of a sensor: derivatives of its whitened reading at every contact by ln W where the force is unknown, by x, and by y on a
    /// plane; 0 where it is saturated.
    pub fn row(&self, kind: SensorKind, position: Position, channel: &ChannelModel) -> Vec<Block> {
        let mut row = vec![[0.0; LANES]; self.row_size()];
        self.fill(&mut row, kind, position, channel);
        row
    }

    /// Writes the row of a sensor where zeros are.
    fn fill(&self, row: &mut [Block], kind: SensorKind, position: Position, channel: &ChannelModel) {
        let response = self.surface.response_function(kind, position);
        let sd = channel.reading_sd();
        let blocks = self.contacts.len().div_ceil(LANES);
        let first = usize::from(self.force == Force::Known);
        let unknown = first..first + self.unknowns();
        for (i, &position) in self.contacts.positions.iter().enumerate() {
            let contact = Contact { position, force_n: self.force_n };
            let free = channel.range.is_none_or(|(low, high)| {
                let reading = response.at(contact);
                low < reading && reading < high
            });
            let weight = if free { 1.0 / sd } else { 0.0 };
            let ResponseGradient { position: [along, across], force } = response.gradient(contact);
            let told = [self.force_n * force, along, across];
            for (column, value) in told[unknown.clone()].iter().enumerate() {
                row[column * blocks + i / LANES][i % LANES] = weight * value;
            }
        }
    }

    /// The rows of all candidates, one after the other.
    pub fn table(
        &self,
        sensors: &[PlacedSensor],
        design: &SensorDesign,
        watch: Watch,
    ) -> Result<Vec<Block>, DesignError> {
        let (sites, contacts) = (sensors.len(), self.contacts.len());
        let size = self.row_size();
        let bytes = (sites * size * LANES * 8) as f64;
        if bytes > MOST_BYTES {
            return Err(DesignError::TooLarge { sites, contacts, bytes, most: MOST_BYTES });
        }
        let mut table = vec![[0.0; LANES]; sites * size];
        for (done, (sensor, row)) in sensors.iter().zip(table.chunks_exact_mut(size.max(1))).enumerate() {
            if done.is_multiple_of(ASK_EVERY) {
                watch.stage("sensitivities of the sites", done as f64 / sites as f64)?;
            }
            let offer = &design.offers[sensor.offer];
            self.fill(row, offer.kind, sensor.position, &offer.channel);
        }
        Ok(table)
    }

    /// A criterion on such rows.
    pub fn objective(
        &self,
        table: Arc<Vec<Block>>,
        criterion: DesignCriterion,
        tolerance_m: f64,
    ) -> Box<dyn Objective> {
        let sides_m: Vec<f64> = self.surface.extent().sides_m().collect();
        let weights = &self.contacts.weights;
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

    /// Whitened readings of all candidates, a contact a row, each row times the root of the contact's share; of many contacts
    /// an even sample.
    pub fn readings(&self, sensors: &[PlacedSensor], design: &SensorDesign) -> Array2<f64> {
        let contacts = self.contacts.sample(MOST_SNAPSHOTS);
        let mut readings = Array2::zeros((contacts.len(), sensors.len()));
        for (column, sensor) in sensors.iter().enumerate() {
            let offer = &design.offers[sensor.offer];
            let response = self.surface.response_function(offer.kind, sensor.position);
            for (row, (&position, weight)) in contacts.positions.iter().zip(&contacts.weights).enumerate() {
                let reading = response.at(Contact { position, force_n: self.force_n });
                readings[[row, column]] = weight.sqrt() * reading / offer.channel.reading_sd();
            }
        }
        readings
    }
}
