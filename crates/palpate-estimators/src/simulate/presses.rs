//! Scheduled presses of a bench with imperfections.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{STAGE, SimulateError, SimulatedBench};
use crate::imperfections::{BenchState, Imperfections};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use palpate_mechanics::contact::{Contact, Extent, Position};
use palpate_numerics::watch::Watch;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Press {
    pub contact: Contact,
    pub rows: usize,
}

pub(crate) struct PressedBench<'a> {
    setup: &'a Setup,
    imperfections: Imperfections,
    bench: SimulatedBench<'a>,
    places: Xoshiro256PlusPlus,
    seed: u64,
}

/// Distinguishes random streams of one seed.
const PLACES: u64 = 0x91_ACE5;

impl Press {
    /// Groups equal consecutive contacts.
    pub fn from_rows(contacts: &[Contact]) -> Vec<Self> {
        let equal = contacts.chunk_by(|one, next| one == next);
        equal.filter_map(|rows| Some(Self { contact: *rows.first()?, rows: rows.len() })).collect()
    }
}

impl<'a> PressedBench<'a> {
    /// Without a stated force, channel ranges are for the largest press.
    pub fn new(setup: &'a Setup, presses: &[Press], seed: u64, watch: Watch) -> Result<Self, SimulateError> {
        let imperfections = setup.imperfections().copied().unwrap_or_default();
        let largest_n = presses.iter().map(|press| press.contact.force_n.abs()).reduce(f64::max);
        let force_n = setup.force_n().or(largest_n.filter(|force_n| *force_n > 0.0));
        let force_n = imperfections.range_force_n.or(force_n).ok_or(SimulateError::NoForce)?;
        Self::with_range_force(setup, force_n, seed, watch)
    }

    fn with_range_force(
        setup: &'a Setup,
        force_n: f64,
        seed: u64,
        watch: Watch,
    ) -> Result<Self, SimulateError> {
        let imperfections = setup.imperfections().copied().unwrap_or_default();
        let bench = SimulatedBench::perfect_watched(setup, seed, watch)?;
        let bench = bench.with_imperfections(imperfections, force_n);
        let places = Xoshiro256PlusPlus::seed_from_u64(seed ^ PLACES);
        Ok(Self { setup, imperfections, bench, places, seed })
    }

    pub fn resumed(
        setup: &'a Setup,
        state: &BenchState,
        seed: u64,
        watch: Watch,
    ) -> Result<Self, SimulateError> {
        let pressed = Self::with_range_force(setup, state.range_force_n, state.seed, watch)?;
        Ok(Self { bench: pressed.bench.resumed(state, seed), seed, ..pressed })
    }

    pub fn pause(&mut self) {
        let untouched = self.bench.clean(&[]);
        self.bench.advance(&untouched, self.imperfections.schedule.pause_s);
    }

    pub fn record(
        &mut self,
        presses: &[Press],
        placement_sd_m: Option<f64>,
        watch: Watch,
    ) -> Result<Recording, SimulateError> {
        let extent = self.setup.surface().extent();
        let mut rows = Vec::new();
        for (i, Press { contact, rows: count }) in presses.iter().enumerate() {
            watch.counted(STAGE, "presses", i, presses.len())?;
            self.rest(contact.position, &mut rows);
            let position = self.place_with_error(contact.position, placement_sd_m, extent);
            let clean = self.bench.clean_through_layer(&[Contact { position, ..*contact }]);
            let settle_s = self.imperfections.schedule.settle_s;
            self.record_window(*contact, &clean, settle_s, *count, &mut rows);
        }
        if let Some(last) = presses.last() {
            self.rest(last.contact.position, &mut rows);
        }
        let mut recording = Recording::new(self.setup.layout(), "simulation", rows).seeded(self.seed);
        recording.provenance.placement_sd_m = placement_sd_m;
        recording.provenance.bench = self.bench.state();
        Ok(recording)
    }

    fn rest(&mut self, next: Position, rows: &mut Vec<Row>) {
        let schedule = self.imperfections.schedule;
        let count = schedule.untouched_rows as usize;
        let recorded_s = count.saturating_sub(1) as f64 * schedule.row_s();
        let untouched = self.bench.clean(&[]);
        let no_contact = Contact { position: next, force_n: 0.0 };
        self.record_window(no_contact, &untouched, (schedule.rest_s - recorded_s).max(0.0), count, rows);
    }

    /// Waits under a contact, then records `count` rows.
    fn record_window(
        &mut self,
        contact: Contact,
        clean: &[f64],
        before_s: f64,
        count: usize,
        rows: &mut Vec<Row>,
    ) {
        let mut values = self.bench.advance(clean, before_s);
        let mut reading = Vec::new();
        for i in 0..count {
            if i > 0 {
                values = self.bench.advance(clean, self.imperfections.schedule.row_s());
            }
            if i.is_multiple_of(1 + self.imperfections.repeated_readings as usize) {
                reading = self.bench.measure(&values);
            }
            rows.push(Row {
                position: contact.position,
                force_n: Some(contact.force_n),
                nuisances: Vec::new(),
                time_s: self.bench.time_s(),
                reading: reading.clone(),
            });
        }
    }

    fn place_with_error(&mut self, asked: Position, sd_m: Option<f64>, extent: Extent) -> Position {
        let Some(sd_m) = sd_m else { return asked };
        let mut beside = |at_m: f64, side_m: f64| {
            let error: f64 = self.places.sample(StandardNormal);
            (at_m + sd_m * error).clamp(0.0, side_m)
        };
        let x_m = beside(asked.x_m, extent.length_m());
        Position { x_m, y_m: extent.width_m().map_or(asked.y_m, |side_m| beside(asked.y_m, side_m)) }
    }
}
