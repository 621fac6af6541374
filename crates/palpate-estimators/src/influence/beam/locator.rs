//! Fitted influence locator of a line with a model.
//!
//! Batches of eight have the order of sums of a single reading: their estimates are bitwise equal. Readings
//! with competing minima or many steps fall back to the single search.

use super::coarse::Profile;
use super::gauss_newton::Minimum;
use super::multi_contact::locate_several;
use super::posterior::{WhitenedReading, conclude};
use super::search::{ForEight, NEGLIGIBLE, Scratch, Search};
use super::table::InfluenceTable;
use crate::fit::{Locate, LocatorFault, NoCheck};
use crate::influence::at_nodes::InfluencesAtNodes;
use crate::influence::channels::Channels;
use crate::influence::config::ForceBelief;
use crate::influence::loads::LoadChannel;
use crate::setup::Setup;
use crate::status::{FalseAlarmRate, NO_CONTACT};
use palpate_core::{Estimate, Status};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::InfluenceFunction;
use palpate_numerics::simd::{Array, EightLanes, InstructionSet, Kernel, Simd};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Locator that inverts the influence functions of a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BeamContents", into = "BeamContents")]
pub struct BeamLocator {
    stored: BeamContents,
    search: Search,
}

/// Contents of a locator file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BeamContents {
    table: InfluenceTable,
    channels: Channels,
    force: ForceBelief,
    contacts: usize,
}

impl BeamLocator {
    pub(super) fn new(
        table: InfluenceTable,
        channels: Channels,
        force: ForceBelief,
        contacts: usize,
    ) -> Self {
        BeamContents { table, channels, force, contacts }.into_locator()
    }

    /// Locates a reading with reusable memory.
    pub fn locate_with(&self, reading: &[f64], scratch: &mut Scratch) -> Estimate {
        let (search, mut estimate) = (&self.search, NO_CONTACT);
        let rows = Rows { readings: reading, channels: reading.len() };
        locate_rows(search, rows, scratch, std::slice::from_mut(&mut estimate));
        if self.stored.contacts > 1 && estimate.status == Status::OutsideModel {
            let square = scratch.whitened.channels(search.live.len()).iter().map(|d| d * d).sum();
            let single = search.minima::<Array<f64, 8, false>>(square, scratch).0[0];
            let whitened = scratch.whitened.channels(search.live.len());
            return locate_several(search, self.stored.contacts, whitened, single.misfit).unwrap_or(estimate);
        }
        estimate
    }

    /// Overwrites `estimates` with those of concatenated `readings`, and returns their number.
    pub fn locate_batch_with(
        &self,
        readings: &[f64],
        scratch: &mut Scratch,
        estimates: &mut [Estimate],
    ) -> usize {
        let channels = self.stored.table.sensors;
        let count = (readings.len() / channels).min(estimates.len());
        if self.stored.contacts == 1 {
            locate_rows(&self.search, Rows { readings, channels }, scratch, estimates);
        } else {
            for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
                *estimate = self.locate_with(reading, scratch);
            }
        }
        count
    }

    /// Returns the influence functions.
    pub fn table(&self) -> &InfluenceTable {
        &self.stored.table
    }

    pub(in crate::influence) fn channels(&self) -> &Channels {
        &self.stored.channels
    }

    /// Returns influence function, offset and noise of each channel, in its SI unit; `None` for disabled
    /// channels.
    pub fn influences(&self) -> Vec<Option<LoadChannel<'_>>> {
        let BeamContents { table, channels, .. } = &self.stored;
        let function = |channel: usize| Arc::new(table.function(channel)) as Arc<dyn InfluenceFunction + '_>;
        channels.influences(channels.live().into_iter().map(function))
    }

    /// Returns the influence functions with their uncertainty at the nodes.
    pub fn influences_at_nodes(&self) -> InfluencesAtNodes {
        let BeamContents { table, channels, .. } = &self.stored;
        let positions = (0..table.nodes()).map(|node| Position::along(table.node_m(node))).collect();
        InfluencesAtNodes::of_table(positions, channels, [&table.values, &table.variances])
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

    /// Returns the greatest number of contacts.
    pub fn contacts(&self) -> usize {
        self.stored.contacts
    }

    /// Disables channel `channel` (from 0); returns false, without a change, when no channel would remain.
    pub fn leave_out(&mut self, channel: usize) -> bool {
        let Some(channels) = self.stored.channels.without(channel) else { return false };
        *self = BeamContents { channels, ..self.stored.clone() }.into_locator();
        true
    }

    pub(super) fn search(&self) -> &Search {
        &self.search
    }
}

impl Locate for BeamLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        self.locate_with(reading, &mut Scratch::default())
    }

    fn locate_batch(&self, readings: &[f64], _: usize, estimates: &mut [Estimate]) {
        self.locate_batch_with(readings, &mut Scratch::default(), estimates);
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        LocatorFault::check_count("channels", setup.layout().len(), self.stored.table.sensors)?;
        let length_m = setup.surface().extent().length_m();
        let is_whole = |x: f64| (x - length_m).abs() <= 1e-9 * length_m;
        LocatorFault::check_numbers("length", [self.stored.table.length_m], is_whole, "that of the surface")
    }
}

#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub readings: &'a [f64],
    pub channels: usize,
}

/// Steps of eight readings together; converged ones wait for the others.
const MOST_STEPS: usize = 4;

pub(super) fn locate_rows(search: &Search, rows: Rows, scratch: &mut Scratch, estimates: &mut [Estimate]) {
    InstructionSet::best().run(LocateRows { search, rows, scratch, estimates });
}

pub(super) struct LocateRows<'a> {
    pub search: &'a Search,
    pub rows: Rows<'a>,
    pub scratch: &'a mut Scratch,
    pub estimates: &'a mut [Estimate],
}

impl Kernel for LocateRows<'_> {
    type Output = ();
    const FUSED: bool = false;

    #[inline(always)]
    fn run<S: Simd>(self) {
        locate_each::<S::F64>(self.search, self.rows, self.scratch, self.estimates);
    }
}

#[inline(always)]
fn locate_each<V: EightLanes>(
    search: &Search,
    rows: Rows,
    scratch: &mut Scratch,
    estimates: &mut [Estimate],
) {
    let channels = rows.channels.max(1);
    let count = estimates.len().min(rows.readings.len() / channels);
    let eights = count - count % 8;
    let (readings, rest) = rows.readings.split_at(eights * channels);
    let (estimates, last) = estimates.split_at_mut(eights);
    for (readings, estimates) in readings.chunks_exact(8 * channels).zip(estimates.as_chunks_mut().0) {
        locate_eight::<V>(search, Rows { readings, channels }, scratch, estimates);
    }
    for (reading, estimate) in rest.chunks_exact(channels).zip(last) {
        locate_into::<V>(search, reading, scratch, estimate);
    }
}

#[inline(always)]
fn locate_eight<V: EightLanes>(
    search: &Search,
    rows: Rows,
    scratch: &mut Scratch,
    estimates: &mut [Estimate; 8],
) {
    let groups = search.groups();
    scratch.eight.resize(groups);
    let ForEight { whitened, profiles } = &mut scratch.eight;
    let ([mut squares, mut floors], mut nodes) = ([[0.0; 8]; 2], [0; 8]);
    let readings = rows.readings.chunks_exact(rows.channels);
    for (i, (reading, profile)) in readings.clone().zip(&mut *profiles).enumerate() {
        let whitened = &mut whitened[i * groups..][..groups];
        squares[i] = search.whiten::<V>(reading, whitened);
        let lowest = search.lowest_valley::<V>(squares[i], whitened, profile);
        (nodes[i], floors[i]) = lowest.unwrap_or((0, f64::NEG_INFINITY));
    }
    let each: [&Profile; 8] = std::array::from_fn(|i| &profiles[i]);
    let start = search.coarse.start::<V, V>(&each, &nodes);
    let (minima, arrived) =
        search.gauss_newton.minimum::<V, V>(whitened, (start.x_m, start.force_n), MOST_STEPS);
    let minima = one_by_one(&minima);
    let mut hard = !arrived;
    for i in 0..8 {
        if floors[i] > minima[i].misfit + NEGLIGIBLE {
            let whitened = &whitened[i * groups..][..groups];
            let reading = WhitenedReading { whitened, square: squares[i] };
            conclude(search, reading, &minima[i..=i], &profiles[i], &mut estimates[i]);
        } else {
            hard |= 1 << i;
        }
    }
    for (i, reading) in readings.enumerate() {
        if hard >> i & 1 == 1 {
            locate_into::<V>(search, reading, scratch, &mut estimates[i]);
        }
    }
}

#[inline(always)]
fn one_by_one<V: EightLanes>(minima: &Minimum<V>) -> [Minimum; 8] {
    let [xx, xf, ff] = minima.covariance;
    let (xx, xf, ff) = (xx.to_array(), xf.to_array(), ff.to_array());
    let x_m = minima.x_m.to_array();
    let (force_n, misfit) = (minima.force_n.to_array(), minima.misfit.to_array());
    let mut each = [Minimum::<f64>::nowhere(); 8];
    for i in 0..8 {
        let covariance = [xx[i], xf[i], ff[i]];
        each[i] = Minimum { x_m: x_m[i], force_n: force_n[i], misfit: misfit[i], covariance };
    }
    each
}

/// Writes only those parts of a reused estimate that are read.
#[inline(always)]
fn locate_into<V: EightLanes>(
    search: &Search,
    reading: &[f64],
    scratch: &mut Scratch,
    estimate: &mut Estimate,
) {
    let square = search.whiten::<V>(reading, scratch.whitened.room(search.groups()));
    let (minima, count) = search.minima::<V>(square, scratch);
    let reading = WhitenedReading { whitened: scratch.whitened.groups(search.groups()), square };
    conclude(search, reading, &minima[..count], &scratch.profile, estimate);
}

impl BeamContents {
    fn into_locator(self) -> BeamLocator {
        BeamLocator { search: Search::new(&self.table, &self.channels, self.force), stored: self }
    }

    fn check(&self) -> Result<(), LocatorFault> {
        let Self { table, channels, .. } = self;
        let count = LocatorFault::check_count;
        let cells = table.sensors.saturating_mul(InfluenceTable::NODES);
        count("influence values", cells, table.values.len())?;
        count("influence slopes", cells, table.slopes.len())?;
        count("influence variances", cells, table.variances.len())?;
        channels.check(table.sensors, self.force)?;
        if !(1..=3).contains(&self.contacts) {
            return Err(LocatorFault::Count { what: "contacts at most", needed: 1, found: self.contacts });
        }
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        numbers("influence value", &table.values, |_| true, "a finite number")?;
        numbers("influence slope", &table.slopes, |_| true, "a finite number")?;
        numbers("influence variance", &table.variances, |v| v >= 0.0, "at least 0")?;
        numbers("length", &[table.length_m], |x| x > 0.0, "greater than 0")
    }
}

impl TryFrom<BeamContents> for BeamLocator {
    type Error = LocatorFault;

    fn try_from(stored: BeamContents) -> Result<Self, LocatorFault> {
        stored.check()?;
        Ok(stored.into_locator())
    }
}

impl From<BeamLocator> for BeamContents {
    fn from(locator: BeamLocator) -> Self {
        locator.stored
    }
}
