//! Fitted influence locator of a plane with a model.

use super::posterior::{Scratch, locate};
use super::search::Search;
use super::table::PlaneTable;
use crate::fit::{Locate, LocatorFault, NoCheck};
use crate::influence::at_nodes::InfluencesAtNodes;
use crate::influence::channels::Channels;
use crate::influence::config::ForceBelief;
use crate::influence::loads::LoadChannel;
use crate::setup::Setup;
use crate::status::FalseAlarmRate;
use palpate_core::Estimate;
use palpate_mechanics::surface::InfluenceFunction;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Locator that inverts the influence functions of a plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "PlaneContents", into = "PlaneContents")]
pub struct PlaneLocator {
    stored: PlaneContents,
    search: Search,
}

/// Contents of a locator file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneContents {
    table: PlaneTable,
    channels: Channels,
    force: ForceBelief,
}

/// Reusable memory for locating readings on a plane.
#[derive(Clone, Debug, Default)]
pub struct PlaneScratch(Scratch);

impl PlaneLocator {
    pub(super) fn new(table: PlaneTable, channels: Channels, force: ForceBelief) -> Self {
        PlaneContents { table, channels, force }.into_locator()
    }

    /// Returns the influence functions.
    pub fn table(&self) -> &PlaneTable {
        &self.stored.table
    }

    /// Returns the influence functions with their uncertainty at the nodes.
    pub fn influences_at_nodes(&self) -> InfluencesAtNodes {
        let PlaneContents { table, channels, .. } = &self.stored;
        let positions = (0..table.nodes()).map(|node| table.node(node)).collect();
        InfluencesAtNodes::of_table(positions, channels, [&table.values, &table.variances])
    }

    /// Returns influence function, offset and noise of each channel, in its SI unit; `None` for disabled
    /// channels.
    pub fn influences(&self) -> Vec<Option<LoadChannel<'_>>> {
        let Self { stored: PlaneContents { channels, .. }, search } = self;
        let function = |(k, channel): (usize, &usize)| {
            let function = search.patches.function(k, channels.noise_sd[*channel]);
            Arc::new(function) as Arc<dyn InfluenceFunction + '_>
        };
        channels.influences(search.live.iter().enumerate().map(function))
    }

    pub(in crate::influence) fn channels(&self) -> &Channels {
        &self.stored.channels
    }

    /// Returns the prior of the force.
    pub fn force(&self) -> ForceBelief {
        self.stored.force
    }

    /// Returns the offset of each channel, in its SI unit.
    pub fn offsets(&self) -> &[f64] {
        &self.stored.channels.offsets
    }

    /// Returns the false-alarm rate of untouched readings.
    pub fn false_alarm_rate(&self) -> FalseAlarmRate {
        self.stored.channels.false_alarm_rate
    }

    /// Disables channel `channel` (from 0); returns false, without a change, when no channel would remain.
    pub fn leave_out(&mut self, channel: usize) -> bool {
        let Some(channels) = self.stored.channels.without(channel) else { return false };
        *self = PlaneContents { channels, ..self.stored.clone() }.into_locator();
        true
    }

    pub(super) fn search_with(&self, force: ForceBelief) -> Search {
        Search::new(&self.stored.table, &self.stored.channels, force)
    }

    /// Locates a reading with reusable memory.
    pub fn locate_with(&self, reading: &[f64], scratch: &mut PlaneScratch) -> Estimate {
        locate(&self.search, reading, &mut scratch.0)
    }
}

impl Locate for PlaneLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        self.locate_with(reading, &mut PlaneScratch::default())
    }

    fn locate_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate]) {
        let mut scratch = PlaneScratch::default();
        for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
            *estimate = self.locate_with(reading, &mut scratch);
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("channels", setup.layout().len(), self.stored.table.sensors)
    }
}

impl PlaneContents {
    fn into_locator(self) -> PlaneLocator {
        PlaneLocator { search: Search::new(&self.table, &self.channels, self.force), stored: self }
    }

    fn check(&self) -> Result<(), LocatorFault> {
        let Self { table, channels, force } = self;
        let count = LocatorFault::check_count;
        let cells = table.sensors.saturating_mul(table.columns).saturating_mul(table.rows);
        count("influence values", cells, table.values.len())?;
        count("influence variances", cells, table.variances.len())?;
        channels.check(table.sensors, *force)?;
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        let sides = [table.columns, table.rows].map(|side| side as f64);
        let is_side = |side: f64| side >= PlaneTable::LEAST_SIDE as f64 && side % 2.0 == 1.0;
        numbers("side of the grid", &sides, is_side, "odd and at least 9")?;
        numbers("influence value", &table.values, |_| true, "a finite number")?;
        numbers("influence variance", &table.variances, |v| v >= 0.0, "at least 0")?;
        let positive = [table.length_m, table.width_m];
        numbers("length or width", &positive, |x| x > 0.0, "greater than 0")
    }
}

impl TryFrom<PlaneContents> for PlaneLocator {
    type Error = LocatorFault;

    fn try_from(stored: PlaneContents) -> Result<Self, LocatorFault> {
        stored.check()?;
        Ok(stored.into_locator())
    }
}

impl From<PlaneLocator> for PlaneContents {
    fn from(locator: PlaneLocator) -> Self {
        locator.stored
    }
}
