//! A fitted influence locator of a surface with a model.

use super::answer::{locate_one, locate_several};
use super::batch::Rows;
use super::belief::ForceBelief;
use super::channels;
use super::lanes;
use super::scratch::Scratch;
use super::search::Search;
use super::table::InfluenceTable;
use super::table_function::FittedInfluence;
use crate::fit::{Locate, LocatorFault};
use crate::setup::Setup;
use palpate_core::Estimate;
use serde::{Deserialize, Serialize};

/// Influence functions in a table, ready to be inverted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored", into = "Stored")]
pub struct BeamLocator {
    stored: Stored,
    search: Search,
}

/// What fitting finds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BeamParts {
    /// Influence functions.
    pub table: InfluenceTable,
    /// Offset of each channel, in its SI unit.
    pub offsets: Vec<f64>,
    /// Noise of each channel, in its SI unit.
    pub noise_sd: Vec<f64>,
}

/// What a locator file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    parts: BeamParts,
    /// Channels that are left out.
    dead: Vec<bool>,
    force: ForceBelief,
    /// Mean force of the calibration, in newtons.
    reference_force_n: f64,
    /// The most contacts at once.
    contacts: usize,
}

impl BeamLocator {
    pub(super) fn new(
        parts: BeamParts,
        dead: Vec<bool>,
        force: ForceBelief,
        reference_force_n: f64,
        contacts: usize,
    ) -> Self {
        let stored = Stored { parts, dead, force, reference_force_n, contacts };
        Self { search: stored.search(), stored }
    }

    /// The influence functions.
    pub fn table(&self) -> &InfluenceTable {
        &self.stored.parts.table
    }

    #[cfg(test)]
    pub(super) fn search(&self) -> &Search {
        &self.search
    }

    /// What fitting found, and which channels are left out.
    pub(super) fn parts(&self) -> (&BeamParts, &[bool]) {
        (&self.stored.parts, &self.stored.dead)
    }

    /// Mean force of the calibration, in newtons.
    pub(super) fn reference_force_n(&self) -> f64 {
        self.stored.reference_force_n
    }

    /// Influence function, offset and noise of each channel, in its SI unit; `None` for those that are left out.
    pub fn channels(&self) -> impl Iterator<Item = Option<(FittedInfluence<'_>, f64, f64)>> {
        let BeamParts { table, offsets, noise_sd } = &self.stored.parts;
        let channel =
            move |i: usize| (!self.stored.dead[i]).then(|| (table.function(i), offsets[i], noise_sd[i]));
        (0..table.sensors).map(channel)
    }

    /// What is known of the force.
    pub fn force(&self) -> ForceBelief {
        self.stored.force
    }

    /// The most contacts that it looks for.
    pub fn contacts(&self) -> usize {
        self.stored.contacts
    }

    /// Leaves channel `channel` (from 0) out of all sums from now on; false when no channel would be left, and then
    /// nothing changes.
    pub fn leave_out(&mut self, channel: usize) -> bool {
        let Some(dead) = channels::without(&self.stored.dead, channel) else { return false };
        let stored = Stored { dead, ..self.stored.clone() };
        *self = Self { search: stored.search(), stored };
        true
    }

    /// [`Locate::locate`] with memory of the caller's.
    pub fn locate_with(&self, reading: &[f64], scratch: &mut Scratch) -> Estimate {
        match self.stored.contacts {
            1 => locate_one(&self.search, reading, scratch),
            most => locate_several(&self.search, most, reading, scratch),
        }
    }

    /// Locates a contact in each reading: `readings` are one after the other, each with a value for every channel, and
    /// each estimate is written over. As many as both hold are located, and their number is returned.
    ///
    /// An estimate is the one that [`BeamLocator::locate_with`] gives; of one that is used again, no more is written than
    /// what is read.
    pub fn locate_batch(&self, readings: &[f64], scratch: &mut Scratch, estimates: &mut [Estimate]) -> usize {
        let channels = self.stored.parts.table.sensors;
        let count = (readings.len() / channels).min(estimates.len());
        let rows = Rows { readings, channels };
        match self.stored.contacts {
            1 => lanes::locate_rows(&self.search, rows, scratch, estimates),
            most => {
                for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
                    *estimate = locate_several(&self.search, most, reading, scratch);
                }
            }
        }
        count
    }
}

impl Locate for BeamLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        self.locate_with(reading, &mut Scratch::default())
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("channels", setup.layout.len(), self.stored.parts.table.sensors)
    }
}

impl Stored {
    fn search(&self) -> Search {
        let BeamParts { table, offsets, noise_sd } = &self.parts;
        Search::new(table, offsets, noise_sd, &self.dead, self.force, self.reference_force_n)
    }

    /// Checks what a file may have got wrong.
    fn check(&self) -> Result<(), LocatorFault> {
        let BeamParts { table, offsets, noise_sd } = &self.parts;
        let count = LocatorFault::check_count;
        let cells = table.sensors.saturating_mul(InfluenceTable::NODES);
        count("influence values", cells, table.values.len())?;
        count("influence slopes", cells, table.slopes.len())?;
        count("influence variances", cells, table.variances.len())?;
        channels::check(table.sensors, offsets, noise_sd, &self.dead, self.force)?;
        if !(1..=3).contains(&self.contacts) {
            return Err(LocatorFault::Count { what: "contacts at most", needed: 1, found: self.contacts });
        }
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        numbers("influence value", &table.values, |_| true, "a finite number")?;
        numbers("influence slope", &table.slopes, |_| true, "a finite number")?;
        numbers("influence variance", &table.variances, |v| v >= 0.0, "at least 0")?;
        let positive = [table.length_m, self.reference_force_n];
        numbers("length or force", &positive, |x| x > 0.0, "greater than 0")
    }
}

impl TryFrom<Stored> for BeamLocator {
    type Error = LocatorFault;

    fn try_from(stored: Stored) -> Result<Self, LocatorFault> {
        stored.check()?;
        Ok(Self { search: stored.search(), stored })
    }
}

impl From<BeamLocator> for Stored {
    fn from(locator: BeamLocator) -> Self {
        locator.stored
    }
}
