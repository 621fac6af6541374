//! Simulated calibrations and their evaluation.

use super::{Evaluation, EvaluationError, Split, SplitOrigin};
use crate::arrangement::{Training, all_over};
use crate::fit::{Fit, FitTask, Locate, MethodLocator, SeedList};
use crate::recording::{NoUntouchedRow, Provenance, Recording, Zero};
use crate::setup::Setup;
use crate::simulate::{
    Press, PressedBench, SimulateError, contacts_at, simulate_at_watched, simulate_contacts_watched,
    simulate_use_watched,
};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::ChannelModel;
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Watch;

/// Simulated calibration and evaluation.
///
/// ```
/// use palpate_estimators::arrangement::Training;
/// use palpate_estimators::evaluation::Calibration;
/// use palpate_estimators::influence::Influence;
/// use palpate_estimators::setup::Setup;
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::Beam;
/// use palpate_mechanics::units::{gpa, mm, newtons, um};
/// use palpate_numerics::watch::Watch;
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let calibration = Calibration::from_training(&setup, &Training::even(10).repeated(10))?;
/// let trial = calibration.run(&Influence::default(), 0, Watch::NONE)?;
/// let errors = trial.evaluation.summary(None).expect("399 contacts");
/// assert!(errors.median_m < mm(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    training_setup: Setup,
    /// Setup with the force of the evaluated contacts.
    touched: Setup,
    /// Multiples of the force, in turn.
    force_shares: &'static [f64],
    known_setup: Setup,
    presses: Vec<Position>,
    placement_sd_m: Option<f64>,
    contacts: Vec<Position>,
}

/// Locator of a simulated calibration, with its evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationTrial<M: Locate> {
    /// Seed of the simulation and the fit.
    pub seed: u64,
    /// Locator.
    pub locator: MethodLocator<M>,
    /// Evaluation over the contacts.
    pub evaluation: Evaluation,
}

/// Simulates contacts [all over](all_over) the surface after a calibration, watched, with the setup's force.
/// With imperfections and an unknown force, it is that of the ranges times [`Calibration::UNKNOWN_FORCES`].
///
/// # Errors
/// [`SimulateError`] without a model or a force, or for a cancellation.
pub fn simulate_use_all_over_watched(
    setup: &Setup,
    calibration: &Provenance,
    seed: u64,
    watch: Watch,
) -> Result<Recording, SimulateError> {
    setup.surface().model().ok_or(SimulateError::NoModel)?;
    let of_ranges = || calibration.bench.as_ref().map(|bench| bench.range_force_n);
    let force_n = setup.force_n().or_else(of_ranges).ok_or(SimulateError::NoForce)?;
    let shares: &[f64] = if setup.force_n().is_some() { &[1.0] } else { &Calibration::UNKNOWN_FORCES };
    let positions = all_over(setup.surface().extent());
    let with_share =
        |(position, share): (&Position, &f64)| Contact { position: *position, force_n: share * force_n };
    let contacts: Vec<Contact> = positions.iter().zip(shares.iter().cycle()).map(with_share).collect();
    let touches = simulate_use_watched(setup, calibration, &contacts, seed, watch)?;
    Ok(touches.subtract_zero(setup.recording_columns().zero)?)
}

impl Calibration {
    /// Multiples of the press force, in turn.
    pub const UNKNOWN_FORCES: [f64; 3] = [1.0, 0.5, 2.0];

    /// Returns a calibration without positions, of `press_force_n` or else the setup's force, with a contact
    /// at each position of [`all_over`].
    ///
    /// # Errors
    /// [`OutOfRange`] unless positive and finite.
    pub fn new(setup: &Setup, press_force_n: Option<f64>) -> Result<Self, OutOfRange> {
        let with = |force_n| setup.clone().with_force(force_n);
        let press_force_n = press_force_n.or(setup.force_n());
        Ok(Self {
            training_setup: with(press_force_n)?,
            touched: with(setup.force_n().or(press_force_n))?,
            force_shares: &[1.0],
            known_setup: setup.clone(),
            presses: Vec::new(),
            placement_sd_m: None,
            contacts: all_over(setup.surface().extent()),
        })
    }

    /// Returns a calibration with training positions and their force.
    ///
    /// # Errors
    /// [`SimulateError`] for invalid positions or force.
    pub fn from_training(setup: &Setup, training: &Training) -> Result<Self, SimulateError> {
        let positions = training.positions(setup.surface().extent())?;
        let calibration = Self::new(setup, training.force_n)?.with_presses(&positions, training.repeats);
        Ok(Self { placement_sd_m: training.placement_sd_m, ..calibration })
    }

    /// Sets the positions and repeats of presses.
    #[must_use]
    pub fn with_presses(self, positions: &[Position], repeats: usize) -> Self {
        Self { presses: repeated(positions, repeats), ..self }
    }

    /// Sets the evaluated contacts and their readings.
    #[must_use]
    pub fn with_contacts(self, contacts: &[Position], readings: usize) -> Self {
        Self { contacts: repeated(contacts, readings), ..self }
    }

    /// Sets unknown forces of contacts to [`Calibration::UNKNOWN_FORCES`].
    #[must_use]
    pub fn at_forces_of_use(self) -> Self {
        let force_shares =
            if self.known_setup.force_n().is_some() { self.force_shares } else { &Self::UNKNOWN_FORCES };
        Self { force_shares, ..self }
    }

    /// Makes the force unknown to the locator.
    #[must_use]
    pub fn unknown_force(self) -> Self {
        Self { known_setup: self.known_setup.unknown_force(), ..self }
    }

    /// Positions of presses, repeats included.
    pub fn presses(&self) -> &[Position] {
        &self.presses
    }

    /// Evaluated contacts with repeats, equal for all seeds.
    ///
    /// # Errors
    /// [`SimulateError::NoForce`].
    pub fn contacts(&self) -> Result<Vec<Contact>, SimulateError> {
        let force_n = self.touched.force_n().ok_or(SimulateError::NoForce)?;
        let with_force =
            |(position, share): (&Position, &f64)| Contact { position: *position, force_n: share * force_n };
        Ok(self.contacts.iter().zip(self.force_shares.iter().cycle()).map(with_force).collect())
    }

    /// Simulates presses and contacts with common gains and offsets, the first draws of a seed. Noise depends
    /// only on the seed and the number of earlier readings.
    ///
    /// With imperfections, equal consecutive presses are one press, and untouched rows separate presses.
    ///
    /// # Errors
    /// [`SimulateError`] without a model or a force, or off the surface.
    pub fn simulate(&self, seed: u64) -> Result<Split, SimulateError> {
        self.simulate_watched(seed, Watch::NONE)
    }

    /// [`Calibration::simulate`], watched.
    ///
    /// # Errors
    /// As there, and [`SimulateError::Cancelled`].
    pub fn simulate_watched(&self, seed: u64, watch: Watch) -> Result<Split, SimulateError> {
        let force_n = self.touched.force_n().ok_or(SimulateError::NoForce)?;
        let presses = self.presses.iter().map(|position| Contact { position: *position, force_n });
        if self.touched.imperfections().is_some() {
            return self.simulate_in_time(seed, watch);
        }
        if self.training_setup.recording_columns().zero == Zero::Last {
            return Err(NoUntouchedRow.into());
        }
        let all: Vec<Contact> = presses.chain(self.contacts()?).collect();
        let rows: Vec<usize> = (0..all.len()).collect();
        let (pressed, touched) = rows.split_at(self.presses.len());
        let recording = simulate_contacts_watched(&self.touched, &all, 1, seed, watch)?;
        let training = if self.training_setup.force_n() == self.touched.force_n() {
            recording.subset(pressed)
        } else {
            simulate_at_watched(&self.training_setup, &self.presses, 1, seed, watch)?
        };
        let held_out = recording.subset(touched);
        Ok(Split { training, held_out, offsets: None, origin: SplitOrigin::Calibration })
    }

    fn simulate_in_time(&self, seed: u64, watch: Watch) -> Result<Split, SimulateError> {
        let presses = Press::from_rows(&contacts_at(&self.training_setup, &self.presses)?);
        let mut bench = PressedBench::new(&self.training_setup, &presses, seed, watch)?;
        let zero = self.training_setup.recording_columns().zero;
        let training = bench.record(&presses, self.placement_sd_m, watch)?.subtract_zero(zero)?;
        bench.pause();
        let held_out =
            bench.record(&Press::from_rows(&self.contacts()?), None, watch)?.subtract_zero(zero)?;
        let held_out = held_out.touched().into_owned();
        Ok(Split { training, held_out, offsets: None, origin: SplitOrigin::Calibration })
    }

    /// Simulates `count` consecutive seeds.
    ///
    /// # Errors
    /// As for [`Calibration::simulate`].
    pub fn trials(&self, count: u64, seed: u64) -> Result<Vec<Split>, SimulateError> {
        self.trials_watched(count, seed, Watch::NONE)
    }

    /// [`Calibration::trials`], watched.
    ///
    /// # Errors
    /// As there, and [`SimulateError::Cancelled`].
    pub fn trials_watched(&self, count: u64, seed: u64, watch: Watch) -> Result<Vec<Split>, SimulateError> {
        (0..count).map(|k| self.simulate_watched(seed + k, watch)).collect()
    }

    /// Simulates, fits and evaluates the method alone.
    ///
    /// # Errors
    /// [`EvaluationError`].
    pub fn run<E: Fit>(
        &self,
        estimator: &E,
        seed: u64,
        watch: Watch,
    ) -> Result<CalibrationTrial<E::Method>, EvaluationError<E::Error>> {
        self.run_with(seed, watch, |task| estimator.fit_unchecked(task))
    }

    /// Simulates, fits by `fit` and evaluates.
    ///
    /// # Errors
    /// [`EvaluationError`].
    pub fn run_with<M: Locate, E: std::error::Error>(
        &self,
        seed: u64,
        watch: Watch,
        fit: impl FnOnce(FitTask) -> Result<MethodLocator<M>, E>,
    ) -> Result<CalibrationTrial<M>, EvaluationError<E>> {
        let Split { training, held_out, .. } = self.simulate_watched(seed, watch)?;
        let task = FitTask::new(&self.known_setup, &training).seed(seed).watch(watch);
        let locator = fit(task).map_err(EvaluationError::Fit)?;
        Ok(CalibrationTrial { seed, evaluation: Evaluation::new(&locator, &held_out)?, locator })
    }

    /// Runs rising seeds; without faults the estimator fits equal presses together.
    ///
    /// # Errors
    /// As for [`Calibration::run`].
    pub fn run_many<E: Fit>(
        &self,
        estimator: &E,
        seeds: impl IntoIterator<Item = u64>,
        watch: Watch,
    ) -> Result<Vec<CalibrationTrial<E::Method>>, EvaluationError<E::Error>> {
        let seeds: Vec<u64> = seeds.into_iter().collect();
        let (Some(&seed), true) = (seeds.first(), self.is_faultless()) else {
            return seeds.into_iter().map(|seed| self.run(estimator, seed, watch)).collect();
        };
        let Split { training, held_out, .. } = self.simulate_watched(seed, watch)?;
        let mut queue = SeedList::new(seeds);
        let task = FitTask::new(&self.known_setup, &training).seed(seed).watch(watch);
        estimator.fit_many(task, &mut queue).map_err(EvaluationError::Fit)?;
        let judge = |(seed, locator)| {
            Ok(CalibrationTrial { seed, evaluation: Evaluation::new(&locator, &held_out)?, locator })
        };
        queue.into_results().into_iter().map(judge).collect()
    }

    fn is_faultless(&self) -> bool {
        let channels = self.training_setup.layout().sensors();
        let are_perfect = channels.iter().all(|sensor| sensor.channel == ChannelModel::default());
        are_perfect && self.training_setup.imperfections().is_none()
    }
}

fn repeated(positions: &[Position], times: usize) -> Vec<Position> {
    positions.iter().flat_map(|at| std::iter::repeat_n(*at, times)).collect()
}
