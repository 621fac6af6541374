//! Common type of all estimators.

mod auto;
mod compare;
mod contenders;
mod cost;
mod locator_file;
mod memory;
mod settings;
mod trial_splits;

pub use crate::candidate_errors::CandidateErrors;
pub use crate::fit::{LocatorProvenance, ReadingError};
pub use crate::load_profile::{
    Cells, CentreOfPressure, ForceBounds, LoadProfile, LoadSensors, LoadSensorsError, Patch, PatchLimit,
    Profiler, Resolution, patch_limits,
};
pub use crate::tracking::{
    Creep, Drift, SmoothTracker, Swing, Track, TrackError, TrackedContact, Tracker, TrackerConfig,
    TransverseMotion,
};
pub use auto::{Auto, CHOICE_FOLDS, Choice, TimeLimit, subtract_drift};
pub use compare::{CompareOptions, Comparison, ComparisonResult, compare};
pub use contenders::{UnknownEstimator, contenders, select};
pub use cost::FitCost;
pub use locator_file::{FORMAT_VERSION, LocatorFileError};
pub use memory::{MemoryExceeded, MemoryLimit, MemoryLimitError, Size};
pub use palpate_core::{ContactEstimate, Estimate, Mode, Status, Tare, TareError, Uncertainty};
pub use settings::Setting;

use std::borrow::Cow;
use std::sync::Arc;

use crate::centroid::{Centroid, CentroidFitError, CentroidLocator};
use crate::closed_form::{ClosedForm, ClosedFormFitError, ClosedFormLocator};
use crate::detectable_force::DetectableForce;
use crate::digit::{DigitEstimator, DigitFitError, DigitLocator, DigitShape, DigitTheory};
use crate::evaluation::EvaluationError;
use crate::fit::{
    ChannelMismatch, Fit, FitTask, Locate, LocatorFault, MappedQueue, MethodLocator, NoCheck, SeedQueue,
};
use crate::fit_memo::FitMemo;
use crate::gaussian_process::{GaussianProcessError, GaussianProcessEstimator, GaussianProcessLocator};
use crate::influence::{
    BeamLikelihood, ForceLinearLikelihood, ForceLinearLocator, Influence, InfluenceFitError,
    InfluenceLocator, InfluencesAtNodes, PlateLikelihood, Structure,
};
use crate::likelihood::{Likelihood, LocatorChecks};
use crate::neighbours::{Neighbours, NeighboursFitError, NeighboursLocator};
use crate::network::{
    LevenbergMarquardt, LevenbergMarquardtFitError, LevenbergMarquardtLocator, Network, NetworkFitError,
    NetworkLocator, TrainingOutcome,
};
use crate::offset_course::OffsetCourse;
use crate::reading_check::ReadingCheck;
use crate::recording::{Recording, Zero};
use crate::setup::{Setup, SetupError};
use crate::status::FalseAlarmRate;

use palpate_mechanics::surface::SurfaceSpec;
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::watch::{Cancelled, Watch};

/// Common types of a list of estimators.
macro_rules! estimators {
    ($($(#[doc = $doc:literal])* $kind:literal $variant:ident($config:ty) $method:ty, $error:ty;)*) => {
        /// Configured method.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Estimator {
            $($(#[doc = $doc])* #[doc = concat!("(`kind = \"", $kind, "\"`).")] $variant($config),)*
            /// Choice by cross-validation (`kind = "auto"`).
            Auto(Auto),
        }

        /// Fitted method.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "kebab-case")]
        #[expect(clippy::large_enum_variant, reason = "a program has one locator, or a few")]
        pub enum Method {
            $($(#[doc = $doc])* #[doc = concat!("(`", $kind, "`).")] $variant($method),)*
        }

        /// Error of a fit.
        #[derive(Clone, Debug, PartialEq, thiserror::Error)]
        pub enum FitError {
            /// Channel mismatch.
            #[error(transparent)]
            Channels(#[from] ChannelMismatch),
            /// Cancelled.
            #[error("{0}")]
            Cancelled(#[from] Cancelled),
            /// Time limit without a completed estimator.
            #[error("no estimator was done within the {seconds} s that the choice may take ({} was stopped): give it more time, or name an estimator", stopped.map_or_else(|| "the search for a drift".to_owned(), |kind| format!("`{kind}`")))]
            NotInTime {
                /// Time limit.
                seconds: f64,
                /// Stopped estimator; `None` ahead of the first.
                stopped: Option<&'static str>,
            },
            /// `only` without a suitable estimator.
            #[error("no estimator that `only` names suits the surface")]
            NoCandidate,
            /// No suitable estimator; contains the last error.
            #[error("no estimator suits the recording: {0}")]
            Choice(Box<EvaluationError<FitError>>),
            $(#[doc = concat!("Why `", $kind, "` does not suit it.")]
            #[error(transparent)]
            $variant(#[from] $error),)*
        }

        impl Estimator {
            /// Every valid `kind`.
            pub const KINDS: &'static [&'static str] = &[$($kind,)* "auto"];

            /// `kind` in a rig.
            pub fn kind(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $kind,)*
                    Self::Auto(_) => "auto",
                }
            }
        }

        impl Fit for Estimator {
            type Method = Method;
            type Error = FitError;

            fn fit_method(&self, task: FitTask) -> Result<Method, FitError> {
                let asked = task;
                let learnt_from = self.learnt_from(task.recording);
                let task = FitTask { recording: &learnt_from, ..task };
                match self {
                    $(Self::$variant(estimator) => Ok(estimator.fit_method(task)?.into()),)*
                    Self::Auto(_) => self.choose_estimator(asked)?.fit_method(asked),
                }
            }

            fn fit_task(&self, task: FitTask) -> Result<Locator, FitError> {
                let memo = FitMemo::new(task.setup);
                let task = task.memo(&memo);
                let choice = self.decide(task, None)?;
                self.fit_decided(task, choice.as_ref())
            }

            fn drift_course(&self, task: FitTask, asked: &Recording) -> Option<OffsetCourse> {
                let by_evidence = Influence::default();
                let influence = if let Self::Influence(influence) = self { influence } else { &by_evidence };
                influence.drift_course(task, asked)
            }

            fn fit_without_interval_check(&self, task: FitTask) -> Result<Locator, FitError> {
                if let Self::Auto(_) = self {
                    return self.choose_estimator(task)?.fit_without_interval_check(task);
                }
                self.fit_with_check(task, || ReadingCheck::fit(task))
            }

            fn fit_many(&self, task: FitTask, queue: &mut dyn SeedQueue<Locator>) -> Result<(), FitError> {
                let asked = task;
                let learnt_from = self.learnt_from(task.recording);
                let task = FitTask { recording: &learnt_from, ..task };
                match self {
                    $(Self::$variant(estimator) => {
                        let map = |_, locator: MethodLocator<$method>| locator.into_locator();
                        Ok(estimator.fit_many(task, &mut MappedQueue { queue, map })?)
                    })*
                    Self::Auto(_) => self.choose_estimator(asked)?.fit_many(asked, queue),
                }
            }
        }

        impl Method {
            /// `kind` in a rig.
            pub fn kind(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $kind,)*
                }
            }

            fn as_locate(&self) -> &dyn Locate<Check = NoCheck> {
                match self {
                    $(Self::$variant(method) => method,)*
                }
            }
        }

        $(impl From<$method> for Method {
            fn from(method: $method) -> Self {
                Self::$variant(method)
            }
        })*
    };
}

estimators! {
    /// The founding paper's network
    "network" Network(Network) NetworkLocator, NetworkFitError;
    /// Networks trained by Levenberg–Marquardt with Bayesian regularisation
    "network-lm" NetworkLm(LevenbergMarquardt) LevenbergMarquardtLocator, LevenbergMarquardtFitError;
    /// Influence functions, inverted
    "influence" Influence(Influence) InfluenceLocator, InfluenceFitError;
    /// Gaussian-process regression of the position
    "gaussian-process" GaussianProcess(GaussianProcessEstimator) GaussianProcessLocator, GaussianProcessError;
    /// The beam's own equations
    "closed-form" ClosedForm(ClosedForm) ClosedFormLocator, ClosedFormFitError;
    /// The bending finger's own equations
    "digit" Digit(DigitEstimator) DigitLocator, DigitFitError;
    /// Nearest neighbours
    "neighbours" Neighbours(Neighbours) NeighboursLocator, NeighboursFitError;
    /// The calibrated centroid of array sensors
    "centroid" Centroid(Centroid) CentroidLocator, CentroidFitError;
}

/// True for kinds without a forward model.
pub(crate) fn is_learnt(kind: &str) -> bool {
    matches!(kind, "network" | "network-lm" | "gaussian-process" | "neighbours" | "centroid")
}

impl Estimator {
    fn fit_with_check(
        &self,
        task: FitTask,
        check: impl FnOnce() -> Result<Option<ReadingCheck>, Cancelled>,
    ) -> Result<Locator, FitError> {
        task.check_channels()?;
        let method = self.fit_method(task)?;
        let mut check = if is_learnt(self.kind()) { check()? } else { None };
        if method.has_error_model()
            && let Some(by) = check
        {
            check = Some(by.keeping_intervals(task, |reading| method.locate(reading))?);
        }
        let locator = MethodLocator { check: check.map(Box::new), ..MethodLocator::new(task, method) };
        Ok(locator.with_scatter_of(task.recording))
    }
}

impl Method {
    fn has_error_model(&self) -> bool {
        matches!(self, Self::GaussianProcess(locator) if locator.widths.is_some())
    }
}

impl Estimator {
    /// Untouched rows determine offsets and noise, which learnt methods do not model.
    fn learnt_from<'a>(&self, recording: &'a Recording) -> Cow<'a, Recording> {
        match self {
            Self::Influence(_) | Self::ClosedForm(_) | Self::Digit(_) | Self::Auto(_) => {
                Cow::Borrowed(recording)
            }
            _ => recording.touched(),
        }
    }

    /// Name in comparisons, with the structure.
    pub fn name(&self) -> &'static str {
        let Self::Influence(Influence { structure, .. }) = self else { return self.kind() };
        match structure {
            Structure::Auto => self.kind(),
            Structure::ForceLinear => "influence force-linear",
            Structure::ForceSaturating => "influence force-saturating",
            Structure::ForceMonotone => "influence force-monotone",
            Structure::Free => "influence free",
        }
    }

    /// Returns the suitable methods by preference, one per structure without a model.
    pub fn contenders(setup: &Setup) -> Vec<Self> {
        let structures: &[Structure] = match setup.surface().model() {
            Some(_) => &[Structure::Auto],
            None => &Structure::STATED,
        };
        let with = |structure: &Structure| {
            Self::Influence(Influence { structure: *structure, ..Influence::default() })
        };
        let mut contenders: Vec<Self> = structures.iter().map(with).collect();
        contenders.push(Self::GaussianProcess(GaussianProcessEstimator::default()));
        if matches!(setup.surface(), SurfaceSpec::Beam(_)) {
            contenders.push(Self::ClosedForm(ClosedForm::default()));
        }
        if matches!(setup.surface(), SurfaceSpec::Digit(_)) {
            contenders.insert(0, Self::Digit(DigitEstimator::default()));
        }
        contenders.extend([
            Self::Neighbours(Neighbours::default()),
            Self::Centroid(Centroid),
            Self::NetworkLm(LevenbergMarquardt::default()),
            Self::Network(Network::default()),
        ]);
        contenders
    }

    /// Returns the default: [quick](Auto::quick) without a model, else the network.
    pub fn default_for(setup: &Setup) -> Self {
        match setup.surface().model() {
            Some(_) => Self::default(),
            None => Self::Auto(Auto::quick()),
        }
    }

    /// Digit estimator by the linear theory, for comparison.
    pub const LINEAR_DIGIT: Self = Self::Digit(DigitEstimator::of_theory(DigitTheory::Linear));

    /// Number of positions that a fit needs.
    pub fn positions_needed(&self) -> usize {
        match self {
            Self::ClosedForm(_) | Self::Digit(_) => 1,
            _ => 2,
        }
    }

    /// False-alarm rate of detection.
    pub fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        match self {
            Self::Influence(config) => Some(config.false_alarm_rate),
            Self::ClosedForm(config) => Some(config.false_alarm_rate),
            Self::Digit(config) => Some(config.false_alarm_rate),
            _ => None,
        }
    }

    /// Upper bound of rounds; 0 where unknown.
    pub fn most_rounds(&self) -> u64 {
        match self {
            Self::Network(config) => u64::from(config.training.max_epochs),
            _ => 0,
        }
    }
}

impl Default for Estimator {
    fn default() -> Self {
        Self::Network(Network::default())
    }
}

/// Locator of any estimator, as in files.
pub type Locator = MethodLocator<Method>;

impl Locate for Method {
    type Check = ReadingCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        self.as_locate().locate(reading)
    }

    fn locate_batch(&self, readings: &[f64], channels: usize, estimates: &mut [Estimate]) {
        self.as_locate().locate_batch(readings, channels, estimates);
    }

    fn offsets(&self) -> Option<Vec<f64>> {
        self.as_locate().offsets()
    }

    fn noise_sd(&self) -> Option<Vec<Option<f64>>> {
        self.as_locate().noise_sd()
    }

    fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        self.as_locate().false_alarm_rate()
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.as_locate().check(setup)
    }
}

impl<M: Locate> MethodLocator<M>
where
    Method: From<M>,
{
    /// Converts the locator to the common type.
    pub fn into_locator(self) -> Locator {
        self.map(Method::from)
    }
}

/// Locator without an untouched reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a locator of kind `{kind}` has no reading of the untouched surface: its recording has no rows of force 0"
)]
pub struct NoBaseline {
    /// Kind of the locator.
    pub kind: &'static str,
}

/// Error of disabling a channel.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LeaveOutError {
    /// Channel that does not exist.
    #[error("channel {channel} does not exist; the locator has channels 1 to {channels}")]
    NoChannel {
        /// Channel number, from 1.
        channel: usize,
        /// Channels of the locator.
        channels: usize,
    },
    /// Method that needs every channel.
    #[error("a locator of kind `{kind}` needs every channel: fit it again without the channel")]
    Needed {
        /// Kind of the locator.
        kind: &'static str,
    },
    /// Channel without which contacts are unidentifiable.
    #[error("too few channels would remain in use")]
    NoneLeft,
    /// Noise covariance from which the others' does not follow.
    #[error(
        "the noise of the other channels does not follow from the locator ({0}): fit it again without the channel"
    )]
    Noise(#[from] NotPositiveDefinite),
}

impl Locator {
    /// Largest number of contacts.
    pub fn most_contacts(&self) -> usize {
        match &self.method {
            Method::Influence(InfluenceLocator::Beam(beam)) => beam.contacts(),
            _ => 1,
        }
    }

    /// Returns the shape under an estimate at `steps` + 1 points.
    pub fn shape(&self, estimate: &Estimate, steps: usize) -> Option<DigitShape> {
        match &self.method {
            Method::Digit(digit) => Some(digit.shape(&estimate.contact, steps)),
            _ => None,
        }
    }

    /// Disables a channel without a new fit.
    ///
    /// # Errors
    /// [`LeaveOutError`] for an unknown or required channel.
    pub fn leave_out(&mut self, channel: usize) -> Result<(), LeaveOutError> {
        let channels = self.setup.layout().len();
        if channel >= channels {
            return Err(LeaveOutError::NoChannel { channel: channel + 1, channels });
        }
        let kind = self.kind();
        match &mut self.method {
            Method::Influence(influence) => {
                if !influence.leave_out(channel)? {
                    return Err(LeaveOutError::NoneLeft);
                }
            }
            Method::Digit(digit) => {
                if !digit.leave_out(channel) {
                    return Err(LeaveOutError::NoneLeft);
                }
            }
            _ => return Err(LeaveOutError::Needed { kind }),
        }
        self.setup.set_disabled(channel, true);
        if let Some(scatter) = &mut self.untouched_scatter {
            scatter.disable(channel);
        }
        Ok(())
    }

    /// `kind` in a rig.
    pub fn kind(&self) -> &'static str {
        self.method.kind()
    }

    /// Untouched reading: learnt offsets, mean of untouched rows, or 0 for a model of changes.
    ///
    /// # Errors
    /// [`NoBaseline`].
    pub fn untouched_reading(&self) -> Result<Vec<f64>, NoBaseline> {
        let offsets = match &self.method {
            Method::Influence(influence) => influence.offsets(),
            Method::ClosedForm(_) | Method::Digit(_) => {
                self.method.offsets().or_else(|| Some(vec![0.0; self.setup.layout().len()]))
            }
            _ => None,
        };
        let of_model = || self.setup.surface().model().map(|_| vec![0.0; self.setup.layout().len()]);
        let of_check = || self.check.as_ref().and_then(|check| check.offsets());
        let known = offsets.or_else(|| self.untouched.clone()).or_else(of_check).or_else(of_model);
        known.ok_or(NoBaseline { kind: self.kind() })
    }

    /// Tare with the calibration's baseline. With [`Zero::Last`] it follows the latest untouched reading,
    /// from the first.
    ///
    /// ```
    /// use palpate_estimators::{arrangement::Training, fit::Fit, influence::Influence, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let presses = setup.simulate(&Training::even(10), 0)?;
    /// let locator = Influence::default().fit(&setup, &presses)?.into_locator();
    ///
    /// // The sensors have slipped by 0.1 mm since.
    /// let mut tare = locator.tare()?;
    /// tare.add_untouched(&[mm(0.1); 8])?;
    /// let slipped: Vec<f64> = presses.rows[4].reading.iter().map(|reading| reading + mm(0.1)).collect();
    /// let mut tared = vec![0.0; 8];
    /// tare.apply(&slipped, &mut tared)?;
    /// assert!((locator.locate(&tared)?.contact.position.x_m - mm(180.0)).abs() < mm(1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`NoBaseline`].
    pub fn tare(&self) -> Result<Tare<Vec<f64>>, NoBaseline> {
        let tare = Tare::new(self.untouched_reading()?);
        let channels = self.layout().len();
        let tare = match (self.setup.recording_columns().zero, &self.untouched_drift) {
            // Without offsets, the first reading in use is the first zero.
            (Zero::Last, _) => tare.and_then(|tare| {
                tare.with_last_zero().with_drift(vec![0.0; channels], vec![f64::INFINITY; channels])
            }),
            (Zero::None, Some(drift)) => tare
                .and_then(|tare| tare.with_drift(drift.last.clone(), drift.largest_changes(self.layout()))),
            (Zero::None, None) => tare,
        };
        // Channels and values of a locator are valid.
        tare.map_err(|_| NoBaseline { kind: self.kind() })
    }

    /// Locates a reading by a following tare (see [`Tare::locate_and_update`]), with the result in `tared`.
    ///
    /// # Errors
    /// [`TareError`] for an invalid reading.
    pub fn locate_following(
        &self,
        tare: &mut Tare<Vec<f64>>,
        reading: &[f64],
        tared: &mut [f64],
    ) -> Result<Estimate, TareError> {
        // The tare has checked the channels and values.
        tare.locate_and_update(reading, tared, |tared| {
            self.locate(tared).unwrap_or_else(|_| self.whole_surface_estimate())
        })
    }

    /// Adds the scatter of untouched rows to the smallest detectable force.
    #[must_use]
    pub fn add_scatter<'a>(&self, touch: DetectableForce<'a>) -> DetectableForce<'a> {
        match &self.untouched_scatter {
            Some(scatter) => touch.with_scatter(scatter),
            None => touch,
        }
    }

    /// False-alarm rate of detection.
    pub fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        let of_check = || self.check.as_ref()?.false_alarm_rate();
        let of_scatter = || self.untouched_scatter.as_ref().map(|_| FalseAlarmRate::default());
        self.method.false_alarm_rate().or_else(of_check).or_else(of_scatter)
    }

    /// True for known or estimated forces.
    ///
    /// ```
    /// use palpate_estimators::{arrangement::Training, fit::Fit, network::Network, influence::Influence, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let presses = setup.simulate(&Training::even(10), 0)?;
    /// assert!(Influence::default().fit(&setup, &presses)?.into_locator().estimates_force());
    /// assert!(!Network::default().fit(&setup, &presses)?.into_locator().estimates_force());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn estimates_force(&self) -> bool {
        match &self.method {
            Method::Influence(influence) => influence.estimates_force(),
            Method::ClosedForm(_) | Method::Digit(_) => true,
            Method::Network(_) => false,
            Method::NetworkLm(networks) => networks.estimates_force(),
            Method::GaussianProcess(process) => process.force_n.is_some(),
            Method::Neighbours(neighbours) => neighbours.force_n.is_some(),
            Method::Centroid(centroid) => centroid.force_n.is_some(),
        }
    }

    /// Force-linear influence functions of a surface without a model.
    pub fn force_linear(&self) -> Option<&ForceLinearLocator> {
        match &self.method {
            Method::Influence(InfluenceLocator::ForceLinear(linear)) => Some(linear),
            _ => None,
        }
    }

    /// Learnt influence functions with uncertainty.
    pub fn influences_at_nodes(&self) -> Option<InfluencesAtNodes> {
        match &self.method {
            Method::Influence(influence) => influence.influences_at_nodes(),
            _ => None,
        }
    }

    /// Setup with learnt noise and disabled unused channels.
    ///
    /// # Errors
    /// [`SetupError`] for an invalid noise.
    pub fn learnt_setup(&self) -> Result<Setup, SetupError> {
        let mut setup = self.setup.clone();
        if let Some(linear) = self.force_linear() {
            setup.edit_sensors(|sensors| {
                sensors.iter_mut().for_each(|sensor| sensor.channel.disabled = true);
                for (channel, _, noise_sd) in linear.channels() {
                    sensors[channel].channel.disabled = false;
                    sensors[channel].channel.noise_sd = noise_sd;
                }
            })?;
        }
        Ok(setup)
    }

    /// Weights of a network.
    pub fn weights(&self) -> &[f64] {
        match &self.method {
            Method::Network(network) => &network.parts().weights,
            _ => &[],
        }
    }

    /// Outcome of training by epochs.
    pub fn training_outcome(&self) -> Option<TrainingOutcome> {
        match &self.method {
            Method::Network(network) => Some(network.parts().outcome),
            _ => None,
        }
    }
}

impl Locator {
    /// Sensors of a distributed load, by learnt influence functions, offsets and noise, or, for an estimator
    /// without them, by mechanics.
    ///
    /// # Errors
    /// [`LoadSensorsError`] without influence functions, noise or enabled sensors, and for readings that are not
    /// proportional to the force.
    pub fn load_sensors(&self) -> Result<LoadSensors<'_>, LoadSensorsError> {
        self.load_sensors_watched(Watch::NONE)
    }

    /// [`Locator::load_sensors`], watched.
    ///
    /// # Errors
    /// As there, and [`LoadSensors::new_watched`].
    pub fn load_sensors_watched(&self, watch: Watch) -> Result<LoadSensors<'_>, LoadSensorsError> {
        match &self.method {
            Method::Influence(influence) => {
                let channels = influence.influences()?;
                Ok(LoadSensors { extent: self.setup.surface().extent(), channels })
            }
            _ => LoadSensors::from_setup_watched(&self.setup, watch),
        }
    }
}

/// Likelihood of a locator, for a tracker.
pub struct Tracking {
    likelihood: Arc<dyn Likelihood>,
}

/// Locator that cannot track contacts with this configuration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotTrackable {
    /// Method without a likelihood.
    #[error("a locator of kind `influence` tracks contacts; this one is of kind `{kind}`")]
    Kind {
        /// Kind of the locator.
        kind: &'static str,
    },
    /// Readings of the free structure.
    #[error(
        "a moving contact is tracked where readings follow the force; this locator has the structure `free`: record the force of every press, and fit the structure `force-linear`"
    )]
    Free,
    /// Unknown force with a prior mean of 0 or less.
    #[error("tracked contacts press; the calibration forces have a mean of 0 N or less")]
    Pull,
    /// Surface with an unknown first mode.
    #[error(
        "inertia is modelled only for a beam on two simple supports: track this surface without a natural frequency"
    )]
    Mode,
}

impl Tracking {
    /// Likelihood.
    pub fn likelihood(&self) -> Arc<dyn Likelihood> {
        Arc::clone(&self.likelihood)
    }
}

impl Locator {
    /// Returns the likelihood for a tracker.
    ///
    /// # Errors
    /// [`NotTrackable`] without a likelihood, or for inertia without known modes.
    pub fn tracking(&self, config: &TrackerConfig) -> Result<Tracking, NotTrackable> {
        if config.swing.is_some() && !matches!(self.setup.surface(), SurfaceSpec::Beam(_)) {
            return Err(NotTrackable::Mode);
        }
        let checks = LocatorChecks::without_walk(
            self.untouched_scatter.clone(),
            self.untouched_drift.clone(),
            &self.noise_sd().unwrap_or_default(),
        )
        .with_intervals(self.interval_check);
        let Method::Influence(influence) = &self.method else {
            return Err(NotTrackable::Kind { kind: self.kind() });
        };
        let likelihood: Arc<dyn Likelihood> = match influence {
            InfluenceLocator::Beam(beam) => Arc::new(BeamLikelihood::new(beam).with_checks(checks)),
            InfluenceLocator::Plane(plane) => Arc::new(PlateLikelihood::new(plane).with_checks(checks)),
            InfluenceLocator::ForceLinear(linear) => {
                let likelihood = ForceLinearLikelihood::new(linear).ok_or(NotTrackable::Pull)?;
                Arc::new(likelihood.with_checks(checks))
            }
            InfluenceLocator::Measured(_) => return Err(NotTrackable::Free),
        };
        Ok(Tracking { likelihood })
    }
}
