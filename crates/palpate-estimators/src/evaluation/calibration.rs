//! Simulated calibrations: press a setup with faulty sensors, fit, touch it, locate.

use super::{Evaluation, EvaluationError, Split, SplitOrigin};
use crate::arrangement::{Training, all_over};
use crate::fit::{Fit, FitTask, Fitted, Locate, SeedList};
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

/// A calibration to simulate: where a setup is pressed and how hard, whether the locator is given the force, and the contacts
/// that it is judged by.
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
/// let judged = calibration.run(&Influence::default(), 0, Watch::NONE)?;
/// let errors = judged.evaluation.summary(None).expect("399 contacts");
/// assert!(errors.median_m < mm(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The setup with the force of the presses.
    pressed: Setup,
    /// The setup with the force of the contacts that are located afterwards, or with its middle.
    touched: Setup,
    /// Forces of these contacts in turn, as multiples of that force.
    force_shares: &'static [f64],
    /// The setup as the locator has it, with the force or without.
    known: Setup,
    /// Positions of the presses, each as often as it is pressed.
    presses: Vec<Position>,
    /// Standard deviation in each direction of the pressed place about the asked one, in metres, on a setup with imperfections.
    placement_sd_m: Option<f64>,
    /// Positions of the contacts afterwards, each as often as it is read.
    contacts: Vec<Position>,
}

/// A locator from a simulated calibration, and its evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibrated<M: Locate> {
    /// The seed of the simulation and of the fit.
    pub seed: u64,
    /// The locator.
    pub locator: Fitted<M>,
    /// Evaluation over the contacts.
    pub evaluation: Evaluation,
}

/// Touches a calibrated bench in use all over its surface, and records it, watched: for the paper's beam at every millimetre, on a plane in the middles of
/// about 400 cells. Contacts have the force of the setup. Where that is unknown, a bench with imperfections is touched by the force of its ranges times
/// [`Calibration::UNKNOWN_FORCES`] in turn. See [`simulate_use_watched`].
///
/// # Errors
/// [`SimulateError`] when the bench lacks a model or a force, or the watch stopped it.
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
    Ok(touches.zeroed(setup.recording_columns().zero)?)
}

impl Calibration {
    /// Forces of contacts in turn, as multiples of the force of the presses, by which locators without a known force are compared.
    pub const UNKNOWN_FORCES: [f64; 3] = [1.0, 0.5, 2.0];

    /// A calibration by presses of `press_force_n`, or else of the setup's force, without positions yet. Contacts have the setup's force, or
    /// that of the presses where the setup's force is unknown; there is one at each position of [`all_over`].
    ///
    /// # Errors
    /// [`OutOfRange`] for a force of the presses that is not greater than 0 and finite.
    pub fn new(setup: &Setup, press_force_n: Option<f64>) -> Result<Self, OutOfRange> {
        let with = |force_n| setup.clone().with_force(force_n);
        let press_force_n = press_force_n.or(setup.force_n());
        Ok(Self {
            pressed: with(press_force_n)?,
            touched: with(setup.force_n().or(press_force_n))?,
            force_shares: &[1.0],
            known: setup.clone(),
            presses: Vec::new(),
            placement_sd_m: None,
            contacts: all_over(setup.surface().extent()),
        })
    }

    /// A calibration at training positions, with the force of these presses.
    ///
    /// # Errors
    /// [`SimulateError`] when the positions cannot be laid out on the surface, or for a force out of its range.
    pub fn from_training(setup: &Setup, training: &Training) -> Result<Self, SimulateError> {
        let positions = training.positions(setup.surface().extent())?;
        let calibration = Self::new(setup, training.force_n)?.pressed_at(&positions, training.repeats);
        Ok(Self { placement_sd_m: training.placement_sd_m, ..calibration })
    }

    /// This calibration with presses at other positions, `repeats` at each.
    #[must_use]
    pub fn pressed_at(self, positions: &[Position], repeats: usize) -> Self {
        Self { presses: repeated(positions, repeats), ..self }
    }

    /// This calibration judged by other contacts, with `readings` of each.
    #[must_use]
    pub fn judged_at(self, contacts: &[Position], readings: usize) -> Self {
        Self { contacts: repeated(contacts, readings), ..self }
    }

    /// This calibration judged by contacts with [`Calibration::UNKNOWN_FORCES`] in turn, where the setup's force is unknown.
    #[must_use]
    pub fn at_forces_of_use(self) -> Self {
        let force_shares =
            if self.known.force_n().is_some() { self.force_shares } else { &Self::UNKNOWN_FORCES };
        Self { force_shares, ..self }
    }

    /// This calibration for a locator without the force of its contacts.
    #[must_use]
    pub fn unknown_force(self) -> Self {
        Self { known: self.known.unknown_force(), ..self }
    }

    /// Positions of the presses, each as often as it is pressed.
    pub fn presses(&self) -> &[Position] {
        &self.presses
    }

    /// The contacts to judge by, each as often as it is read, with their forces; they do not depend on the seed.
    ///
    /// # Errors
    /// [`SimulateError::NoForce`] where neither presses nor contacts have a force.
    pub fn contacts(&self) -> Result<Vec<Contact>, SimulateError> {
        let force_n = self.touched.force_n().ok_or(SimulateError::NoForce)?;
        let with_force =
            |(position, share): (&Position, &f64)| Contact { position: *position, force_n: share * force_n };
        Ok(self.contacts.iter().zip(self.force_shares.iter().cycle()).map(with_force).collect())
    }

    /// Recordings of the presses to fit and of the contacts to judge. Both are read by the same faulty channels: their gains and offsets are the
    /// first draws of a seed. A reading's noise depends only on the seed and on the number of readings before it.
    ///
    /// With imperfections one bench makes both recordings, one after the other: equal presses in a row are one press that is read so often, and
    /// untouched rows stand between presses.
    ///
    /// # Errors
    /// [`SimulateError`] when the setup has no model or no force, or a position lies off the surface.
    pub fn simulate(&self, seed: u64) -> Result<Split, SimulateError> {
        self.simulate_watched(seed, Watch::NONE)
    }

    /// Simulates the calibration and the contacts to judge by, watched.
    ///
    /// # Errors
    /// As for [`Calibration::simulate`], and [`SimulateError::Cancelled`].
    pub fn simulate_watched(&self, seed: u64, watch: Watch) -> Result<Split, SimulateError> {
        let force_n = self.touched.force_n().ok_or(SimulateError::NoForce)?;
        let presses = self.presses.iter().map(|position| Contact { position: *position, force_n });
        if self.touched.imperfections().is_some() {
            return self.simulate_in_time(seed, watch);
        }
        if self.pressed.recording_columns().zero == Zero::Last {
            return Err(NoUntouchedRow.into());
        }
        let all: Vec<Contact> = presses.chain(self.contacts()?).collect();
        let rows: Vec<usize> = (0..all.len()).collect();
        let (pressed, touched) = rows.split_at(self.presses.len());
        let recording = simulate_contacts_watched(&self.touched, &all, 1, seed, watch)?;
        let training = if self.pressed.force_n() == self.touched.force_n() {
            recording.subset(pressed)
        } else {
            simulate_at_watched(&self.pressed, &self.presses, 1, seed, watch)?
        };
        let judged = recording.subset(touched);
        Ok(Split { training, judged, offsets: None, origin: SplitOrigin::Calibration })
    }

    /// Recordings of a bench with imperfections.
    fn simulate_in_time(&self, seed: u64, watch: Watch) -> Result<Split, SimulateError> {
        let presses = Press::from_rows(&contacts_at(&self.pressed, &self.presses)?);
        let mut bench = PressedBench::new(&self.pressed, &presses, seed, watch)?;
        let zero = self.pressed.recording_columns().zero;
        let training = bench.record(&presses, self.placement_sd_m, watch)?.zeroed(zero)?;
        bench.pause();
        let judged = bench.record(&Press::from_rows(&self.contacts()?), None, watch)?.zeroed(zero)?;
        let judged = judged.touched().into_owned();
        Ok(Split { training, judged, offsets: None, origin: SplitOrigin::Calibration })
    }

    /// Recordings with `count` seeds from the first on, as [`Calibration::simulate`] makes them.
    ///
    /// # Errors
    /// [`SimulateError`] as for [`Calibration::simulate`].
    pub fn trials(&self, count: u64, seed: u64) -> Result<Vec<Split>, SimulateError> {
        self.trials_watched(count, seed, Watch::NONE)
    }

    /// Simulates the trials of [`Calibration::trials`], watched.
    ///
    /// # Errors
    /// As for [`Calibration::trials`], and [`SimulateError::Cancelled`].
    pub fn trials_watched(&self, count: u64, seed: u64, watch: Watch) -> Result<Vec<Split>, SimulateError> {
        (0..count).map(|k| self.simulate_watched(seed + k, watch)).collect()
    }

    /// Simulates, fits and judges the method alone.
    ///
    /// # Errors
    /// [`EvaluationError`] when the setup cannot be simulated or the estimator not be fitted, or the watch stopped it.
    pub fn run<E: Fit>(
        &self,
        estimator: &E,
        seed: u64,
        watch: Watch,
    ) -> Result<Calibrated<E::Method>, EvaluationError<E::Error>> {
        self.run_with(seed, watch, |task| estimator.fit_alone(task))
    }

    /// Simulates, gets a locator by `fit`, and judges it.
    ///
    /// # Errors
    /// [`EvaluationError`] when the setup cannot be simulated or `fit` returns an error.
    pub fn run_with<M: Locate, E: std::error::Error>(
        &self,
        seed: u64,
        watch: Watch,
        fit: impl FnOnce(FitTask) -> Result<Fitted<M>, E>,
    ) -> Result<Calibrated<M>, EvaluationError<E>> {
        let Split { training, judged, .. } = self.simulate_watched(seed, watch)?;
        let task = FitTask::new(&self.known, &training).seed(seed).watch(watch);
        let locator = fit(task).map_err(EvaluationError::Fit)?;
        Ok(Calibrated { seed, evaluation: Evaluation::new(&locator, &judged)?, locator })
    }

    /// Runs the calibration for some rising seeds. Without faults the presses of all seeds are alike, and the estimator fits them all at once, side by
    /// side where it can.
    ///
    /// # Errors
    /// [`EvaluationError`] as for [`Calibration::run`].
    pub fn run_many<E: Fit>(
        &self,
        estimator: &E,
        seeds: impl IntoIterator<Item = u64>,
        watch: Watch,
    ) -> Result<Vec<Calibrated<E::Method>>, EvaluationError<E::Error>> {
        let seeds: Vec<u64> = seeds.into_iter().collect();
        let (Some(&seed), true) = (seeds.first(), self.is_faultless()) else {
            return seeds.into_iter().map(|seed| self.run(estimator, seed, watch)).collect();
        };
        let Split { training, judged, .. } = self.simulate_watched(seed, watch)?;
        let mut queue = SeedList::new(seeds);
        let task = FitTask::new(&self.known, &training).seed(seed).watch(watch);
        estimator.fit_many(task, &mut queue).map_err(EvaluationError::Fit)?;
        let judge = |(seed, locator)| {
            Ok(Calibrated { seed, evaluation: Evaluation::new(&locator, &judged)?, locator })
        };
        queue.into_results().into_iter().map(judge).collect()
    }

    /// Whether every channel reports what its sensor reads.
    fn is_faultless(&self) -> bool {
        let channels = self.pressed.layout().sensors();
        let are_perfect = channels.iter().all(|sensor| sensor.channel == ChannelModel::default());
        are_perfect && self.pressed.imperfections().is_none()
    }
}

fn repeated(positions: &[Position], times: usize) -> Vec<Position> {
    positions.iter().flat_map(|at| std::iter::repeat_n(*at, times)).collect()
}
