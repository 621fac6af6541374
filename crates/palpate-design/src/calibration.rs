//! What calibrating comes to: simulated, fitted, asked and measured, with noise.

use std::collections::VecDeque;

use serde::Serialize;

use super::sensors::WeightedContacts;
use palpate_estimators::estimator::{Estimator, FitError, Locator, Method, ReadingError};
use palpate_estimators::fit::{Fit, FitTask, SeedQueue};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::{SimulateError, simulate_at};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::ChannelModel;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{mean, median, standard_error};

/// Why a calibration cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// The bench cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The locator cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The locator does not take the readings.
    #[error(transparent)]
    Reading(#[from] ReadingError),
    /// The calibration was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// How far calibrated locators were off, on average over the contacts of a design.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// The mean error, in metres, over all calibrations.
    pub mean_error_m: f64,
    /// Its standard error, in metres, from how the calibrations differ.
    pub standard_error_m: f64,
    /// The median of the calibrations' mean errors, in metres.
    pub median_error_m: f64,
    /// Share of the contacts located within the tolerance, in %.
    pub within_tolerance_percent: f64,
    /// Calibrations.
    pub calibrations: usize,
}

/// A bench that is calibrated again and again, and the contacts that its locators are asked about.
pub(super) struct Trial<'a> {
    /// The bench as it is pressed to calibrate.
    pub pressed: Setup,
    /// The same with the force of the contacts that are located afterwards.
    pub touched: Setup,
    /// What the locator knows: without a force where it is to be unknown.
    pub used: Setup,
    /// What is fitted.
    pub estimator: &'a Estimator,
    /// The contacts.
    pub contacts: &'a WeightedContacts,
    /// Readings of each contact in a calibration.
    pub draws: usize,
    /// An error up to this is good enough, in metres.
    pub tolerance_m: f64,
}

/// Seeds one after the other: one calibration each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seeds {
    pub first: u64,
    pub count: usize,
}

impl Seeds {
    fn all(self) -> impl Iterator<Item = u64> {
        (0..self.count as u64).map(move |k| self.first.wrapping_add(k))
    }
}

/// One calibration's errors.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Calibrated {
    /// The mean error at each contact, in metres.
    pub errors_m: Vec<f64>,
    /// Share of the contacts located within the tolerance, by their weights.
    pub within: f64,
}

impl Trial<'_> {
    /// Presses at `positions`, each `repeats` times, once a seed; fits, and asks. A seed has the same noise whatever the
    /// positions.
    pub fn calibrate(
        &self,
        positions: &[Position],
        repeats: usize,
        seeds: Seeds,
        watch: Watch,
    ) -> Result<Vec<Calibrated>, CalibrationError> {
        let training: Vec<Position> =
            positions.iter().flat_map(|at| std::iter::repeat_n(*at, repeats)).collect();
        if self.is_clean() {
            return self.calibrate_side_by_side(&training, seeds, watch);
        }
        let calibrated = seeds.all().map(|seed| {
            let (recording, asked) = self.simulate(&training, seed)?;
            let task = FitTask { setup: &self.used, recording: &recording, seed, watch };
            Ok(self.ask(&self.estimator.fit_task(task)?, &asked)?)
        });
        calibrated.collect()
    }

    /// Without noise and faults all seeds press alike, and estimators that can are fitted side by side.
    fn calibrate_side_by_side(
        &self,
        training: &[Position],
        seeds: Seeds,
        watch: Watch,
    ) -> Result<Vec<Calibrated>, CalibrationError> {
        let (recording, asked) = self.simulate(training, seeds.first)?;
        let task = FitTask { setup: &self.used, recording: &recording, seed: seeds.first, watch };
        let mut queue = Queue { seeds: seeds.all().collect(), fitted: Vec::new() };
        self.estimator.fit_many(task, &mut queue)?;
        let mut fitted = queue.fitted;
        fitted.sort_by_key(|(seed, _)| *seed);
        fitted.iter().map(|(_, locator)| Ok(self.ask(locator, &asked)?)).collect()
    }

    /// Whether channels tell the truth.
    fn is_clean(&self) -> bool {
        self.pressed.layout.sensors.iter().all(|sensor| sensor.channel == ChannelModel::default())
    }

    /// The presses of one calibration, and the readings that are located afterwards by the same channels.
    fn simulate(&self, training: &[Position], seed: u64) -> Result<(Recording, Recording), SimulateError> {
        let contacts = &self.contacts.positions;
        let asked = contacts.iter().flat_map(|at| std::iter::repeat_n(*at, self.draws));
        let all: Vec<Position> = training.iter().copied().chain(asked).collect();
        let (pressed, asked): (Vec<usize>, Vec<usize>) = (0..all.len()).partition(|i| *i < training.len());
        let touched = simulate_at(&self.touched, &all, 1, seed)?;
        let recording = if self.pressed.force_n == self.touched.force_n {
            touched.subset(&pressed)
        } else {
            simulate_at(&self.pressed, training, 1, seed)?
        };
        Ok((recording, touched.subset(&asked)))
    }

    fn ask(&self, locator: &Locator, asked: &Recording) -> Result<Calibrated, ReadingError> {
        let mut errors_m = vec![0.0; self.contacts.len()];
        let mut within = 0.0;
        for (i, row) in asked.rows.iter().enumerate() {
            let contact = i / self.draws;
            let off_m = locator.locate(&row.reading)?.contact.position.distance_m(row.position);
            errors_m[contact] += off_m / self.draws as f64;
            if off_m <= self.tolerance_m {
                within += self.contacts.weights[contact] / self.draws as f64;
            }
        }
        Ok(Calibrated { errors_m, within })
    }
}

impl Verification {
    /// Sums up calibrations, at least one.
    pub(super) fn of(calibrated: &[Calibrated], contacts: &WeightedContacts) -> Self {
        let errors: Vec<f64> =
            calibrated.iter().map(|one| contacts.mean(one.errors_m.iter().copied())).collect();
        Self {
            mean_error_m: mean(errors.iter().copied()),
            standard_error_m: standard_error(&errors),
            within_tolerance_percent: 100.0 * mean(calibrated.iter().map(|one| one.within)),
            calibrations: errors.len(),
            median_error_m: median(errors).unwrap_or(f64::NAN),
        }
    }
}

/// The seeds of calibrations, and the locators that they gave.
struct Queue {
    seeds: VecDeque<u64>,
    fitted: Vec<(u64, Locator)>,
}

impl SeedQueue<Method> for Queue {
    fn next_seed(&mut self) -> Option<u64> {
        self.seeds.pop_front()
    }

    fn fitted(&mut self, seed: u64, locator: Locator) {
        self.fitted.push((seed, locator));
    }
}
