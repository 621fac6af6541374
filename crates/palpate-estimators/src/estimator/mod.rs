//! All estimators as one type, so that evaluations, studies, reports and listeners treat them alike.

mod auto;
mod compare;
mod contenders;
mod cost;
mod locator_file;
mod memory;
mod settings;
mod trial_splits;

pub use crate::fit::{LocatorProvenance, ReadingError};
pub use crate::load_profile::{
    Cells, CentreOfPressure, ForceBounds, LoadProfile, LoadSensors, LoadSensorsError, Patch, PatchLimit,
    Profiler, Resolution, patch_limits,
};
pub use crate::tracking::{
    Across, Creep, Drift, SmoothTracker, Swing, Track, TrackError, Tracked, Tracker, TrackerConfig,
};
pub use crate::tried::Tried;
pub use auto::{Auto, CHOICE_FOLDS, Choice, TimeLimit, take_off_drift};
pub use compare::{CompareOptions, Compared, Comparison, compare};
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
use crate::digit::{DigitEstimator, DigitFitError, DigitLocator, DigitShape, DigitTheory};
use crate::evaluation::EvaluationError;
use crate::fit::{ChannelMismatch, Fit, FitTask, Fitted, Locate, LocatorFault, Mapped, NoCheck, SeedQueue};
use crate::gaussian_process::{GaussianProcessError, GaussianProcessEstimator, GaussianProcessLocator};
use crate::influence::{
    BeamLikelihood, ForceLinearLocator, Influence, InfluenceFitError, InfluenceLocator, InfluencesAtNodes,
    LearningMemo, PlateLikelihood, Structure,
};
use crate::lightest_touch::LightestTouch;
use crate::likelihood::{Likelihood, UntouchedSurface};
use crate::load_profile::LoadChannel;
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
use palpate_numerics::watch::{Cancelled, Watch};

/// Defines the types that represent any estimator, from one list of all estimators.
macro_rules! estimators {
    ($($(#[doc = $doc:literal])* $kind:literal $variant:ident($config:ty) $method:ty, $error:ty;)*) => {
        /// A configured method; fitting it to a recording gives a locator.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Estimator {
            $($(#[doc = $doc])* #[doc = concat!("(`kind = \"", $kind, "\"`).")] $variant($config),)*
            /// Choice among the others at held-out positions (`kind = "auto"`).
            Auto(Auto),
        }

        /// The methods that can locate.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "kebab-case")]
        #[expect(clippy::large_enum_variant, reason = "a program has one locator, or a few")]
        pub enum Method {
            $($(#[doc = $doc])* #[doc = concat!("(`", $kind, "`).")] $variant($method),)*
        }

        /// An estimator that cannot be fitted to a recording.
        #[derive(Clone, Debug, PartialEq, thiserror::Error)]
        pub enum FitError {
            /// The recording's channels are not the setup's.
            #[error(transparent)]
            Channels(#[from] ChannelMismatch),
            /// The fit was stopped.
            #[error("{0}")]
            Cancelled(#[from] Cancelled),
            /// The time limit passed before the choice finished an estimator.
            #[error("no estimator was done within the {seconds} s that the choice may take ({} was stopped): give it more time, or name an estimator", stopped.map_or_else(|| "the search for a drift".to_owned(), |kind| format!("`{kind}`")))]
            NotInTime {
                /// The time limit.
                seconds: f64,
                /// The estimator that was being tried; `None` before the first.
                stopped: Option<&'static str>,
            },
            /// The estimators that `only` names do not suit the surface.
            #[error("no estimator that `only` names suits the surface")]
            NoCandidate,
            /// No estimator suits the recording; contains the last one's error.
            #[error("no estimator suits the recording: {0}")]
            Choice(Box<EvaluationError<FitError>>),
            $(#[doc = concat!("Why `", $kind, "` does not suit it.")]
            #[error(transparent)]
            $variant(#[from] $error),)*
        }

        impl Estimator {
            /// Every `kind` that a rig can name.
            pub const KINDS: &'static [&'static str] = &[$($kind,)* "auto"];

            /// The `kind` under which a rig names this estimator.
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
                    Self::Auto(_) => self.decided(asked)?.fit_method(asked),
                }
            }

            fn fit_task(&self, task: FitTask) -> Result<Locator, FitError> {
                let memo = LearningMemo::new(task.setup);
                let task = task.memo(&memo);
                let choice = self.decide(task, None)?;
                self.fit_decided(task, choice.as_ref())
            }

            fn drift_course(&self, task: FitTask, asked: &Recording) -> Option<OffsetCourse> {
                let by_evidence = Influence::default();
                let influence = if let Self::Influence(influence) = self { influence } else { &by_evidence };
                influence.drift_course(task, asked)
            }

            /// Fits with a seed, watched. A learnt method gets a [`ReadingCheck`] as well.
            fn fit_without_interval_check(&self, task: FitTask) -> Result<Locator, FitError> {
                if let Self::Auto(_) = self {
                    return self.decided(task)?.fit_without_interval_check(task);
                }
                self.fit_beside(task, || ReadingCheck::fit(task))
            }

            fn fit_many(&self, task: FitTask, queue: &mut dyn SeedQueue<Locator>) -> Result<(), FitError> {
                let asked = task;
                let learnt_from = self.learnt_from(task.recording);
                let task = FitTask { recording: &learnt_from, ..task };
                match self {
                    $(Self::$variant(estimator) => {
                        let map = |_, locator: Fitted<$method>| locator.into_locator();
                        Ok(estimator.fit_many(task, &mut Mapped { queue, map })?)
                    })*
                    Self::Auto(_) => self.decided(asked)?.fit_many(asked, queue),
                }
            }
        }

        impl Method {
            /// The `kind` under which a rig names its estimator.
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

/// True for kinds that map a reading to a position without a model of readings: these have a [`ReadingCheck`].
pub(crate) fn is_learnt(kind: &str) -> bool {
    matches!(kind, "network" | "network-lm" | "gaussian-process" | "neighbours" | "centroid")
}

impl Estimator {
    /// Fits the method and, where it is learnt, adds the reading check that `check` fits to the same recording.
    fn fit_beside(
        &self,
        task: FitTask,
        check: impl FnOnce() -> Result<Option<ReadingCheck>, Cancelled>,
    ) -> Result<Locator, FitError> {
        task.check_channels()?;
        let method = self.fit_method(task)?;
        let mut check = if is_learnt(self.kind()) { check()? } else { None };
        if method.knows_its_errors()
            && let Some(by) = check
        {
            check = Some(by.keeping_intervals(task, |reading| method.locate(reading))?);
        }
        let locator = Fitted { check: check.map(Box::new), ..Fitted::new(task, method) };
        Ok(locator.with_scatter_of(task.recording))
    }
}

impl Method {
    /// True for a method with intervals from errors at held-out positions, reading by reading.
    fn knows_its_errors(&self) -> bool {
        matches!(self, Self::GaussianProcess(locator) if locator.widths.is_some())
    }
}

impl Estimator {
    /// The rows that a method learns from. Rows without contact determine offset and noise, which methods that map a reading to a position do not
    /// have.
    fn learnt_from<'a>(&self, recording: &'a Recording) -> Cow<'a, Recording> {
        match self {
            Self::Influence(_) | Self::ClosedForm(_) | Self::Digit(_) | Self::Auto(_) => {
                Cow::Borrowed(recording)
            }
            _ => recording.touched(),
        }
    }

    /// Name in comparisons: the kind, with the structure where an influence estimator states one.
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

    /// Every method that can locate on a bench, each with its default settings, the best guess first. On a surface without a model each structure of
    /// the readings is a method of its own.
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

    /// The default estimator of a bench, where the rig names none: on a surface without a model the [quick](Auto::quick) choice, elsewhere the
    /// default network.
    pub fn usual(setup: &Setup) -> Self {
        match setup.surface().model() {
            Some(_) => Self::default(),
            None => Self::Auto(Auto::quick()),
        }
    }

    /// A digit's estimator by the linear theory of bending, for comparison.
    pub const LINEAR_DIGIT: Self = Self::Digit(DigitEstimator::of_theory(DigitTheory::Linear));

    /// Distinct contact positions that a recording must have for fitting.
    pub fn positions_needed(&self) -> usize {
        match self {
            Self::ClosedForm(_) | Self::Digit(_) => 1,
            _ => 2,
        }
    }

    /// False-alarm rate of its locators; `None` for locators without `no_contact`, and for `auto`.
    pub fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        match self {
            Self::Influence(config) => Some(config.false_alarm_rate),
            Self::ClosedForm(config) => Some(config.false_alarm_rate),
            Self::Digit(config) => Some(config.false_alarm_rate),
            _ => None,
        }
    }

    /// Upper bound of the rounds of one fit; 0 where it is unknown.
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

/// A locator of any estimator, as in files.
pub type Locator = Fitted<Method>;

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

impl<M: Locate> Fitted<M>
where
    Method: From<M>,
{
    /// Converts the locator into one of any estimator.
    pub fn into_locator(self) -> Locator {
        self.map(Method::from)
    }
}

/// A locator without an untouched reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "a locator of kind `{kind}` has no reading of the untouched surface: its recording has no rows of force 0"
)]
pub struct NoBaseline {
    /// The locator's kind.
    pub kind: &'static str,
}

/// A channel that cannot be disabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LeaveOutError {
    /// The channel does not exist.
    #[error("channel {channel} does not exist; the locator has channels 1 to {channels}")]
    NoChannel {
        /// Number of the named channel, from 1.
        channel: usize,
        /// Channels of the locator.
        channels: usize,
    },
    /// The method needs the channel.
    #[error("a locator of kind `{kind}` needs every channel: fit it again without the dead one")]
    Needed {
        /// The locator's kind.
        kind: &'static str,
    },
    /// The channel is the last one.
    #[error("it is the last living channel; at least 1 must be left")]
    NoneLeft,
}

impl Locator {
    /// Largest number of contacts of an estimate; 1 on a plane.
    pub fn most_contacts(&self) -> usize {
        match &self.method {
            Method::Influence(InfluenceLocator::Beam(beam)) => beam.contacts(),
            _ => 1,
        }
    }

    /// Shape of the surface under an estimated contact, at `steps` + 1 points; `None` for a method without shapes.
    pub fn shape(&self, estimate: &Estimate, steps: usize) -> Option<DigitShape> {
        match &self.method {
            Method::Digit(digit) => Some(digit.shape(&estimate.contact, steps)),
            _ => None,
        }
    }

    /// Disables a dead channel from now on, without fitting again.
    ///
    /// # Errors
    /// [`LeaveOutError`] when the channel does not exist, or the method needs it.
    pub fn leave_out(&mut self, channel: usize) -> Result<(), LeaveOutError> {
        let channels = self.setup.layout().len();
        if channel >= channels {
            return Err(LeaveOutError::NoChannel { channel: channel + 1, channels });
        }
        let kind = self.kind();
        match &mut self.method {
            Method::Influence(influence) => {
                if matches!(influence, InfluenceLocator::ForceLinear(_) | InfluenceLocator::Measured(_)) {
                    return Err(LeaveOutError::Needed { kind });
                }
                if !influence.leave_out(channel) {
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
        self.setup.set_dead(channel, true);
        if let Some(scatter) = &mut self.untouched_scatter {
            scatter.disable(channel);
        }
        Ok(())
    }

    /// The `kind` under which a rig names its estimator.
    pub fn kind(&self) -> &'static str {
        self.method.kind()
    }

    /// Untouched reading of each channel, as calibration left it: the offsets of the influence functions, the mean of the
    /// recording's rows without contact, or 0 where a model gives what a contact adds.
    ///
    /// # Errors
    /// [`NoBaseline`] without all of them.
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

    /// A tare of its readings, with the baseline that calibration left. When it follows, it takes the latest untouched reading where the calibration
    /// did ([`Zero::Last`]); the first reading is untouched then.
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
    /// [`NoBaseline`] where the calibration has no untouched reading.
    pub fn tare(&self) -> Result<Tare<Vec<f64>>, NoBaseline> {
        let tare = Tare::new(self.untouched_reading()?);
        let channels = self.layout().len();
        let tare = match (self.setup.recording_columns().zero, &self.untouched_drift) {
            // The calibration has no offsets: the first reading in use is the first zero, at any value.
            (Zero::Last, _) => tare.and_then(|tare| {
                tare.with_last_zero().with_drift(vec![0.0; channels], vec![f64::INFINITY; channels])
            }),
            (Zero::None, Some(drift)) => {
                tare.and_then(|tare| tare.with_drift(drift.last.clone(), drift.reach(self.layout())))
            }
            (Zero::None, None) => tare,
        };
        // Channels and values of a locator are valid.
        tare.map_err(|_| NoBaseline { kind: self.kind() })
    }

    /// Locates a reading by its own tare, which follows the baseline as [`Tare::follow`] does. Afterwards `tared` contains the tared reading.
    ///
    /// # Errors
    /// [`TareError`] for another number of channels or a value that is not finite.
    pub fn locate_following(
        &self,
        tare: &mut Tare<Vec<f64>>,
        reading: &[f64],
        tared: &mut [f64],
    ) -> Result<Estimate, TareError> {
        // A locator accepts every tared reading: the tare has checked its channels and values.
        tare.follow(reading, tared, |tared| self.locate(tared).unwrap_or_else(|_| self.anywhere()))
    }

    /// The smallest detectable force of this locator, from that by noise alone: contacts must exceed the scatter of the untouched rows too.
    #[must_use]
    pub fn beyond_scatter<'a>(&self, touch: LightestTouch<'a>) -> LightestTouch<'a> {
        match &self.untouched_scatter {
            Some(scatter) => touch.beyond(scatter),
            None => touch,
        }
    }

    /// False-alarm rate; `None` for a method without `no_contact`.
    pub fn false_alarm_rate(&self) -> Option<FalseAlarmRate> {
        let of_check = || self.check.as_ref()?.false_alarm_rate();
        let of_scatter = || self.untouched_scatter.as_ref().map(|_| FalseAlarmRate::default());
        self.method.false_alarm_rate().or_else(of_check).or_else(of_scatter)
    }

    /// True for a locator with forces in its estimates, known or estimated.
    ///
    /// ```
    /// use palpate_estimators::{arrangement::Training, fit::Fit, network::Network, influence::Influence, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let presses = setup.simulate(&Training::even(10), 0)?;
    /// assert!(Influence::default().fit(&setup, &presses)?.into_locator().tells_force());
    /// assert!(!Network::default().fit(&setup, &presses)?.into_locator().tells_force());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn tells_force(&self) -> bool {
        match &self.method {
            Method::Influence(influence) => influence.tells_force(),
            Method::ClosedForm(_) | Method::Digit(_) => true,
            Method::Network(_) => false,
            Method::NetworkLm(networks) => networks.tells_force(),
            Method::GaussianProcess(process) => process.force_n.is_some(),
            Method::Neighbours(neighbours) => neighbours.force_n.is_some(),
            Method::Centroid(centroid) => centroid.force_n.is_some(),
        }
    }

    /// The influence functions of a surface without a model that are proportional to force, or to a power of it; `None` for any other locator.
    pub fn force_linear(&self) -> Option<&ForceLinearLocator> {
        match &self.method {
            Method::Influence(InfluenceLocator::ForceLinear(linear)) => Some(linear),
            _ => None,
        }
    }

    /// The learnt influence functions, with their uncertainty; `None` for a method without any.
    pub fn influences_at_nodes(&self) -> Option<InfluencesAtNodes> {
        match &self.method {
            Method::Influence(influence) => influence.influences_at_nodes(),
            _ => None,
        }
    }

    /// Setup with the learnt noise, if any, and with unused channels dead.
    ///
    /// # Errors
    /// [`SetupError`] for an invalid noise.
    pub fn learnt_setup(&self) -> Result<Setup, SetupError> {
        let mut setup = self.setup.clone();
        if let Some(linear) = self.force_linear() {
            setup.edit_sensors(|sensors| {
                sensors.iter_mut().for_each(|sensor| sensor.channel.dead = true);
                for (channel, _, noise_sd) in linear.channels() {
                    sensors[channel].channel.dead = false;
                    sensors[channel].channel.noise_sd = noise_sd;
                }
            })?;
        }
        Ok(setup)
    }

    /// The weights of a network; empty for another method.
    pub fn weights(&self) -> &[f64] {
        match &self.method {
            Method::Network(network) => &network.parts().weights,
            _ => &[],
        }
    }

    /// Outcome of the training, for a method trained by epochs.
    pub fn training_outcome(&self) -> Option<TrainingOutcome> {
        match &self.method {
            Method::Network(network) => Some(network.parts().outcome),
            _ => None,
        }
    }
}

impl Locator {
    /// Channels that read a spread load: by the fitted influence functions of an influence locator, with its offsets and noise, and
    /// by the mechanics of the bench for any other.
    ///
    /// # Errors
    /// [`LoadSensorsError`] for a measured surface, a live sensor without noise, or a layout of dead sensors.
    pub fn load_sensors(&self) -> Result<LoadSensors<'_>, LoadSensorsError> {
        self.load_sensors_watched(Watch::NONE)
    }

    /// Channels that read a spread load, as of [`Locator::load_sensors`], watched while the surface is solved.
    ///
    /// # Errors
    /// As for [`Locator::load_sensors`] and [`LoadSensors::new_watched`].
    pub fn load_sensors_watched(&self, watch: Watch) -> Result<LoadSensors<'_>, LoadSensorsError> {
        match &self.method {
            Method::Influence(InfluenceLocator::Beam(beam)) => {
                let channels = beam.influences().map(|channel| {
                    let (influence, offset, noise_sd) = channel?;
                    Some(LoadChannel { influence: Arc::new(influence), offset, noise_sd })
                });
                Ok(LoadSensors { extent: self.setup.surface().extent(), channels: channels.collect() })
            }
            _ => LoadSensors::from_setup_watched(&self.setup, watch),
        }
    }
}

/// Likelihood of a locator, for a tracker.
pub struct Tracking {
    likelihood: Arc<dyn Likelihood>,
}

/// A locator that cannot track moving contacts, or not with this configuration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotTrackable {
    /// The method has no likelihood of readings.
    #[error("a moving contact is followed by an influence locator of a surface with a model; this one is of kind `{kind}`{}", if *measured { ", on a measured surface" } else { "" })]
    Kind {
        /// The locator's kind.
        kind: &'static str,
        /// Whether its surface has no model.
        measured: bool,
    },
    /// The first mode of its surface is not known.
    #[error(
        "inertia is modelled only for a beam on two simple supports; this surface has other supports: track it without a natural frequency"
    )]
    Mode,
}

impl Tracking {
    /// The likelihood for tracking contacts.
    pub fn likelihood(&self) -> Arc<dyn Likelihood> {
        Arc::clone(&self.likelihood)
    }
}

impl Locator {
    /// Likelihood for a tracker of this configuration.
    ///
    /// # Errors
    /// [`NotTrackable`] for a method without a likelihood, or for a swing of a surface without known modes.
    pub fn tracking(&self, config: &TrackerConfig) -> Result<Tracking, NotTrackable> {
        if config.swing.is_some() && !matches!(self.setup.surface(), SurfaceSpec::Beam(_)) {
            return Err(NotTrackable::Mode);
        }
        let untouched = UntouchedSurface::beside_walk(
            self.untouched_scatter.clone(),
            self.untouched_drift.clone(),
            &self.noise_sd().unwrap_or_default(),
        );
        match &self.method {
            Method::Influence(InfluenceLocator::Beam(beam)) => {
                let likelihood = BeamLikelihood::new(beam)
                    .with_untouched(untouched)
                    .with_interval_check(self.interval_check);
                Ok(Tracking { likelihood: Arc::new(likelihood) })
            }
            Method::Influence(InfluenceLocator::Plane(plane)) => {
                let likelihood = PlateLikelihood::new(plane)
                    .with_untouched(untouched)
                    .with_interval_check(self.interval_check);
                Ok(Tracking { likelihood: Arc::new(likelihood) })
            }
            method => Err(NotTrackable::Kind {
                kind: self.kind(),
                measured: matches!(method, Method::Influence(_)),
            }),
        }
    }
}
