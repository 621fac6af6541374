//! From a bench, an estimator and a recording to locators.

use super::{EstimatorConfig, Locator, LocatorProvenance, Method};
use crate::centroid::CentroidFitError;
use crate::closed_form::ClosedFormFitError;
use crate::digit::DigitFitError;
use crate::gaussian_process::GaussianProcessError;
use crate::influence::InfluenceFitError;
use crate::method::{Fit, FitTask};
use crate::neighbours::NeighboursFitError;
use crate::network::{
    LevenbergMarquardtFitError, NetworkFitError, NetworkFitting, Precision, SeedQueue, TrainedNetwork,
    TrainingOutcome, train_many, train_one,
};
use crate::recording::Recording;
use crate::setup::Bench;

/// Why an estimator cannot be fitted to a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The recording's channels are not the bench's.
    #[error("the recording has {found} channels; the bench has {needed} sensors")]
    Channels {
        /// Sensors of the bench.
        needed: usize,
        /// Channels of the recording.
        found: usize,
    },
    /// What the network has to say.
    #[error(transparent)]
    Network(#[from] NetworkFitError),
    /// What the Levenberg–Marquardt networks have to say.
    #[error(transparent)]
    NetworkLm(#[from] LevenbergMarquardtFitError),
    /// What the influence estimator has to say.
    #[error(transparent)]
    Influence(#[from] InfluenceFitError),
    /// What the Gaussian process has to say.
    #[error(transparent)]
    GaussianProcess(#[from] GaussianProcessError),
    /// What the closed form has to say.
    #[error(transparent)]
    ClosedForm(#[from] ClosedFormFitError),
    /// What the digit's estimator has to say.
    #[error(transparent)]
    Digit(#[from] DigitFitError),
    /// What the nearest neighbours have to say.
    #[error(transparent)]
    Neighbours(#[from] NeighboursFitError),
    /// What the centroid has to say.
    #[error(transparent)]
    Centroid(#[from] CentroidFitError),
    /// The estimator is still to be chosen.
    #[error("the estimator is `auto`; it is chosen by cross-validation before it can be fitted")]
    Undecided,
}

/// Where [`Fitting::fit_many`] takes its seeds from and leaves its locators.
pub trait LocatorQueue {
    /// The seed of the next fit.
    fn next_seed(&mut self) -> Option<u64>;
    /// Takes a locator.
    fn fitted(&mut self, seed: u64, locator: Locator);
    /// Asked often; on `false` the fits under way are given up.
    fn keep_going(&mut self) -> bool;
}

/// An estimator that has seen its recording and is ready to be fitted from any seed.
#[derive(Clone, Debug)]
pub struct Fitting {
    bench: Bench,
    recording: crate::recording::Provenance,
    method: MethodFitting,
}

#[derive(Clone, Debug)]
enum MethodFitting {
    /// Coded once for all seeds.
    Network(NetworkFitting),
    /// Fitted from the recording as it is.
    Other(EstimatorConfig, Recording),
}

impl Fitting {
    /// Prepares an estimator for a recording of a bench.
    ///
    /// # Errors
    /// [`FitError`] when the recording does not suit the bench or the estimator.
    pub fn prepare(
        bench: &Bench,
        estimator: &EstimatorConfig,
        recording: &Recording,
    ) -> Result<Self, FitError> {
        if recording.channels.len() != bench.layout.len() {
            return Err(FitError::Channels { needed: bench.layout.len(), found: recording.channels.len() });
        }
        let method = match estimator {
            EstimatorConfig::Network(config) => {
                let (extent, model) = (bench.surface.extent(), bench.surface.model());
                let fitting = NetworkFitting::prepare(config, extent, model, bench.force_n, recording)?;
                MethodFitting::Network(fitting)
            }
            other => MethodFitting::Other(other.clone(), recording.clone()),
        };
        Ok(Self { bench: bench.clone(), recording: recording.provenance.clone(), method })
    }

    /// Fits once; `None` when `keep_going`, asked often, says no.
    ///
    /// # Errors
    /// [`FitError`] when the recording does not suit the estimator.
    pub fn fit(&self, seed: u64, keep_going: &mut dyn FnMut() -> bool) -> Result<Option<Locator>, FitError> {
        let method = match &self.method {
            MethodFitting::Network(network) => {
                let trained = train_one(&network.task(), seed, keep_going);
                trained.map(|trained| Method::Network(network.locator(trained)))
            }
            MethodFitting::Other(config, recording) => {
                fit_method(config, FitTask { bench: &self.bench, recording, seed }, keep_going)?
            }
        };
        Ok(method.map(|method| self.locator(seed, method)))
    }

    /// Trains a network for every seed of the queue, as many at once as there are lanes; takes nothing from the queue
    /// for another method. A seed gives the same locator as [`Fitting::fit`] does in the same precision.
    pub fn fit_many(&self, precision: Precision, queue: &mut dyn LocatorQueue) {
        if let MethodFitting::Network(network) = &self.method {
            train_many(InstructionSet::best(), precision, &network.task(), &mut Seeds { fitting: self, network, queue });
        }
    }

    /// The network locator that an earlier fit gave, from its weights and outcome; `None` when their number is not the
    /// network's, or for another method.
    pub fn restore(&self, seed: u64, weights: Vec<f64>, outcome: TrainingOutcome) -> Option<Locator> {
        let MethodFitting::Network(network) = &self.method else { return None };
        let topology = network.topology.clone();
        (weights.len() == topology.weight_count()).then(|| {
            let trained = TrainedNetwork { topology, weights, outcome };
            self.locator(seed, Method::Network(network.locator(trained)))
        })
    }

    /// Patterns that one epoch of training presents; 0 for a method that is not trained by epochs.
    pub fn patterns(&self) -> usize {
        match &self.method {
            MethodFitting::Network(network) => network.patterns.count(),
            MethodFitting::Other(..) => 0,
        }
    }

    fn locator(&self, seed: u64, method: Method) -> Locator {
        Locator {
            bench: self.bench.clone(),
            provenance: LocatorProvenance {
                palpate: env!("CARGO_PKG_VERSION").to_owned(),
                seed,
                recording: self.recording.clone(),
            },
            method,
        }
    }
}

/// Fits a method other than the paper's network.
fn fit_method(
    config: &EstimatorConfig,
    task: FitTask,
    keep_going: &mut dyn FnMut() -> bool,
) -> Result<Option<Method>, FitError> {
    Ok(match config {
        // Prepared networks never come here.
        EstimatorConfig::Network(_) => None,
        EstimatorConfig::NetworkLm(config) => config.fit(task, keep_going)?.map(Method::NetworkLm),
        EstimatorConfig::Influence(config) => config.fit(task, keep_going)?.map(Method::Influence),
        EstimatorConfig::GaussianProcess(config) => {
            config.fit(task, keep_going)?.map(Method::GaussianProcess)
        }
        EstimatorConfig::ClosedForm(config) => config.fit(task, keep_going)?.map(Method::ClosedForm),
        EstimatorConfig::Digit(config) => config.fit(task, keep_going)?.map(Method::Digit),
        EstimatorConfig::Neighbours(config) => config.fit(task, keep_going)?.map(Method::Neighbours),
        EstimatorConfig::Centroid(config) => config.fit(task, keep_going)?.map(Method::Centroid),
        EstimatorConfig::Auto => return Err(FitError::Undecided),
    })
}

/// A queue of networks in front of a queue of locators.
struct Seeds<'a> {
    fitting: &'a Fitting,
    network: &'a NetworkFitting,
    queue: &'a mut dyn LocatorQueue,
}

impl SeedQueue for Seeds<'_> {
    fn next_seed(&mut self) -> Option<u64> {
        self.queue.next_seed()
    }
    fn finished(&mut self, seed: u64, network: TrainedNetwork) {
        let method = Method::Network(self.network.locator(network));
        self.queue.fitted(seed, self.fitting.locator(seed, method));
    }
    fn keep_going(&mut self) -> bool {
        self.queue.keep_going()
    }
}
