//! From a bench, an estimator and a recording to locators.

use super::{EstimatorConfig, Locator, LocatorProvenance, Method};
use crate::bench::Bench;
use crate::network::{
    InstructionSet, NetworkFitError, NetworkFitting, Precision, SeedQueue, TrainedNetwork, TrainingOutcome,
    train_many, train_one,
};
use crate::recording::Recording;

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
    Network(NetworkFitting),
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
        let EstimatorConfig::Network(config) = estimator;
        let (extent, model) = (bench.surface.extent(), bench.surface.model());
        let method = NetworkFitting::prepare(config, extent, model, bench.force_n, recording)?;
        Ok(Self {
            bench: bench.clone(),
            recording: recording.provenance.clone(),
            method: MethodFitting::Network(method),
        })
    }

    /// Fits once; `None` when `keep_going`, asked often, says no.
    pub fn fit(&self, seed: u64, keep_going: &mut dyn FnMut() -> bool) -> Option<Locator> {
        let MethodFitting::Network(network) = &self.method;
        train_one(Precision::F64, &network.task(), seed, keep_going)
            .map(|trained| self.locator(seed, trained))
    }

    /// Fits once for every seed of the queue, as many at once as `set` has lanes. A seed gives the same locator as
    /// [`Fitting::fit`] does in the same precision.
    pub fn fit_many(&self, set: InstructionSet, precision: Precision, queue: &mut dyn LocatorQueue) {
        let MethodFitting::Network(network) = &self.method;
        train_many(set, precision, &network.task(), &mut Seeds { fitting: self, queue });
    }

    /// The locator that an earlier fit gave, from its parameters and outcome; `None` when their number is not the
    /// method's.
    pub fn restore(&self, seed: u64, parameters: Vec<f64>, outcome: TrainingOutcome) -> Option<Locator> {
        let MethodFitting::Network(network) = &self.method;
        (parameters.len() == network.topology.weight_count()).then(|| {
            self.locator(
                seed,
                TrainedNetwork { topology: network.topology.clone(), weights: parameters, outcome },
            )
        })
    }

    /// Patterns that one epoch of iterative fitting presents.
    pub fn patterns(&self) -> usize {
        let MethodFitting::Network(network) = &self.method;
        network.patterns.count()
    }

    fn locator(&self, seed: u64, trained: TrainedNetwork) -> Locator {
        let MethodFitting::Network(network) = &self.method;
        Locator {
            bench: self.bench.clone(),
            provenance: LocatorProvenance {
                palpate: env!("CARGO_PKG_VERSION").to_owned(),
                seed,
                recording: self.recording.clone(),
            },
            method: Method::Network(network.locator(trained)),
        }
    }
}

/// A queue of networks in front of a queue of locators.
struct Seeds<'a> {
    fitting: &'a Fitting,
    queue: &'a mut dyn LocatorQueue,
}

impl SeedQueue for Seeds<'_> {
    fn next_seed(&mut self) -> Option<u64> {
        self.queue.next_seed()
    }
    fn finished(&mut self, seed: u64, network: TrainedNetwork) {
        self.queue.fitted(seed, self.fitting.locator(seed, network));
    }
    fn keep_going(&mut self) -> bool {
        self.queue.keep_going()
    }
}
