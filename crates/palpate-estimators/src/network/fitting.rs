//! From a recording to training patterns, and from trained weights to a locator.

use super::{
    InputScale, Network, NetworkLocator, NetworkParts, OutputCoding, Patterns, Topology, TrainedNetwork,
    TrainingOutcome, TrainingQueue, TrainingTask, train_many, train_one,
};
use crate::fit::{ChannelMismatch, Fit, FitTask, Fitted, SeedQueue};
use crate::network::locator::ChannelScaling;
use crate::recording::Recording;
use palpate_mechanics::surface::{Extent, Surface};
use palpate_numerics::mean_and_variance;
use palpate_numerics::simd::InstructionSet;
use palpate_numerics::watch::Cancelled;

/// Why a network cannot be fitted to a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NetworkFitError {
    /// Too many rows for the presentation order.
    #[error("the recording has {found} rows; a network is trained on at most {most}")]
    TooManyRows {
        /// Rows.
        found: usize,
        /// Bound.
        most: usize,
    },
    /// Nothing to learn from.
    #[error("the recording has no rows; a network needs at least 1")]
    NoRows,
    /// A channel's readings do not scale.
    #[error(
        "channel `{channel}` cannot be scaled: its {what} is {value}; it must be a number greater than 0"
    )]
    Unscalable {
        /// The channel's name.
        channel: String,
        /// What was to divide it.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// A network that is ready to be trained: its patterns and how readings and positions were coded into them.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkFitting {
    /// Shape of the network.
    pub topology: Topology,
    /// What it is shown.
    pub patterns: Patterns,
    /// How its weights are found.
    pub rule: super::BackPropagation,
    scaling: Vec<ChannelScaling>,
    output_scale_m: Vec<f64>,
    extent: Extent,
}

impl Fit for Network {
    type Method = NetworkLocator;
    type Error = NetworkFitError;

    fn fit_method(&self, task: FitTask) -> Result<NetworkLocator, NetworkFitError> {
        let fitting = NetworkFitting::of(self, task)?;
        let network = train_one(self.precision, &fitting.task(), task.seed, task.watch)?;
        Ok(fitting.locator(network))
    }

    /// Trains as many networks side by side as there are lanes.
    fn fit_many(
        &self,
        task: FitTask,
        queue: &mut dyn SeedQueue<NetworkLocator>,
    ) -> Result<(), NetworkFitError> {
        task.check_channels()?;
        let fitting = NetworkFitting::of(self, task)?;
        let mut queue = Coded { fitting: &fitting, task, queue };
        let set = InstructionSet::best();
        Ok(train_many(set, self.precision, &fitting.task(), &mut queue, task.watch)?)
    }
}

impl Network {
    /// The locator that an earlier fit gave, from its weights and outcome; `None` when their number is not the network's.
    ///
    /// # Errors
    /// [`NetworkFitError`] when the recording cannot be coded.
    pub fn restore(
        &self,
        task: FitTask,
        weights: Vec<f64>,
        outcome: TrainingOutcome,
    ) -> Result<Option<Fitted<NetworkLocator>>, NetworkFitError> {
        task.check_channels()?;
        let fitting = NetworkFitting::of(self, task)?;
        let topology = fitting.topology.clone();
        Ok((weights.len() == topology.weight_count()).then(|| {
            let network = TrainedNetwork { topology, weights, outcome };
            Fitted::new(task, fitting.locator(network))
        }))
    }
}

/// A queue of trained networks in front of a queue of locators.
struct Coded<'a> {
    fitting: &'a NetworkFitting,
    task: FitTask<'a>,
    queue: &'a mut dyn SeedQueue<NetworkLocator>,
}

impl TrainingQueue for Coded<'_> {
    fn next_seed(&mut self) -> Option<u64> {
        self.queue.next_seed()
    }

    fn finished(&mut self, seed: u64, network: TrainedNetwork) {
        self.queue.fitted(seed, Fitted::new(self.task.seed(seed), self.fitting.locator(network)));
    }
}

impl NetworkFitting {
    /// Codes the recording of a fit.
    ///
    /// # Errors
    /// [`NetworkFitError`] as for [`NetworkFitting::prepare`].
    pub fn of(config: &Network, task: FitTask) -> Result<Self, NetworkFitError> {
        let surface = &task.setup.surface;
        Self::prepare(config, surface.extent(), surface.model(), task.setup.force_n, task.recording)
    }

    /// Codes a recording of a surface (with its model, where it has one, and its known force in newtons).
    ///
    /// # Errors
    /// [`NetworkFitError`] when there are no rows, too many, or a channel whose scale is 0.
    pub fn prepare(
        config: &Network,
        extent: Extent,
        model: Option<&dyn Surface>,
        force_n: Option<f64>,
        recording: &Recording,
    ) -> Result<Self, NetworkFitError> {
        let rows = recording.rows.len();
        if rows == 0 {
            return Err(NetworkFitError::NoRows);
        }
        if rows > Patterns::MOST {
            return Err(NetworkFitError::TooManyRows { found: rows, most: Patterns::MOST });
        }
        let scaling = channel_scaling(config.input_scale, model, force_n, recording)?;
        let output_scale_m = output_scale_m(config.output, extent);
        let mut patterns = Patterns {
            inputs: recording.channels.len(),
            outputs: output_scale_m.len(),
            input_values: Vec::with_capacity(rows * recording.channels.len()),
            target_values: Vec::with_capacity(rows * output_scale_m.len()),
        };
        for row in &recording.rows {
            let scaled = row.reading.iter().zip(&scaling).map(|(value, channel)| channel.apply(*value));
            patterns.input_values.extend(scaled);
            let coordinates = [row.position.x_m, row.position.y_m];
            patterns
                .target_values
                .extend(coordinates.iter().zip(&output_scale_m).map(|(x, scale)| x / scale));
        }
        let topology = Topology::new(config, patterns.inputs, patterns.outputs);
        Ok(Self { topology, patterns, rule: config.training, scaling, output_scale_m, extent })
    }

    /// What a trainer asks for.
    pub fn task(&self) -> TrainingTask<'_> {
        TrainingTask { topology: &self.topology, patterns: &self.patterns, rule: &self.rule }
    }

    /// The locator that a trained network makes.
    pub fn locator(&self, network: TrainedNetwork) -> NetworkLocator {
        NetworkLocator::from(NetworkParts {
            topology: network.topology,
            weights: network.weights,
            scaling: self.scaling.clone(),
            output_scale_m: self.output_scale_m.clone(),
            extent: self.extent,
            outcome: network.outcome,
        })
    }
}

/// The length that an output of 1 stands for, by coordinate.
fn output_scale_m(coding: OutputCoding, extent: Extent) -> Vec<f64> {
    let sizes = std::iter::once(extent.length_m).chain(extent.width_m);
    sizes.map(|size_m| if coding == OutputCoding::Position { 1.0 } else { size_m }).collect()
}

fn channel_scaling(
    scale: InputScale,
    model: Option<&dyn Surface>,
    force_n: Option<f64>,
    recording: &Recording,
) -> Result<Vec<ChannelScaling>, NetworkFitError> {
    let column = |c: usize| recording.rows.iter().map(move |row| row.reading[c]);
    let largest = || recording.rows.iter().flat_map(|row| &row.reading).fold(0.0, |m: f64, r| m.max(r.abs()));
    let one = |c: usize| -> Result<ChannelScaling, NetworkFitError> {
        let (offset, divisor, what) = match (scale, model.zip(force_n)) {
            (InputScale::DivideBy(divisor), _) => (0.0, divisor, "divisor"),
            (InputScale::FullScale, Some((surface, force_n))) => {
                (0.0, surface.full_scale(recording.kinds[c]) * force_n, "full scale")
            }
            (InputScale::FullScale, None) => (0.0, largest(), "largest reading"),
            (InputScale::Standardized, _) => {
                let (mean, variance) = mean_and_variance(column(c));
                (mean, variance.sqrt(), "standard deviation")
            }
        };
        if !(divisor.is_finite() && divisor > 0.0) {
            let channel = recording.channels[c].clone();
            return Err(NetworkFitError::Unscalable { channel, what, value: divisor });
        }
        Ok(ChannelScaling { offset, divisor })
    };
    (0..recording.channels.len()).map(one).collect()
}
