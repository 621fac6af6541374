//! Feed-forward networks by back-propagation (founding paper) or Levenberg–Marquardt.
//!
//! Forward passes:
//!
//! - [`palpate_core::Network`]: the reference, for chips.
//! - [`PreparedNetwork`]: location, with weights in columns.
//! - [`train_many`] and [`train_one`]: training side by side, with a fused first layer.
//! - [`LevenbergMarquardt`]: keeps the outputs of every layer.

mod levenberg_marquardt;
mod logistic;
mod prepared;
mod train;

pub use levenberg_marquardt::{
    LevenbergMarquardt, LevenbergMarquardtFitError, LevenbergMarquardtLocator, Member, NetworkInputs,
    OutputScale,
};
pub(crate) use levenberg_marquardt::{MOST_PRESSES, network_size};
pub use palpate_core::Activation;
pub use prepared::PreparedNetwork;
pub use train::{Precision, TrainingTask, train_many, train_one};

use crate::fit::{
    ChannelMismatch, Fit, FitTask, Locate, LocatorFault, MappedQueue, MethodLocator, NoCheck, SeedQueue,
};
use crate::recording::{Recording, Row};
use crate::setup::Setup;
use crate::status::on_surface;
use palpate_core::{ContactEstimate, Estimate};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean_and_variance;
use palpate_numerics::simd::InstructionSet;
use palpate_numerics::watch::Cancelled;

/// Feed-forward network, by default the founding paper's: ten logistic hidden nodes, learning rate 0.7,
/// momentum 0.9.
///
/// ```
/// use palpate_estimators::{arrangement::Training, fit::Fit, setup::Setup, network::Network};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(10), 0)?;
/// let mut network = Network::default();
/// network.training.aggregate_error = 1e-2;
/// let estimate = network.fit(&setup, &presses)?.locate(&presses.rows[4].reading)?;
/// assert!((estimate.contact.position.x_m - mm(180.0)).abs() < mm(40.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Nodes of each hidden layer, input side first.
    pub hidden: Vec<usize>,
    /// Activation of the hidden layers.
    pub hidden_activation: Activation,
    /// Activation of the output layer.
    pub output_activation: Activation,
    /// True for nodes with biases.
    pub biases: bool,
    /// Coding of the output.
    pub output: OutputCoding,
    /// Scaling of inputs.
    pub input_scale: InputScale,
    /// Training rule.
    pub training: BackPropagation,
    /// Precision of training; estimates are in 64 bits.
    pub precision: Precision,
}

impl Default for Network {
    fn default() -> Self {
        Self {
            hidden: vec![10],
            hidden_activation: Activation::Logistic,
            output_activation: Activation::Logistic,
            biases: true,
            output: OutputCoding::Normalized,
            input_scale: InputScale::FullScale,
            training: BackPropagation::default(),
            precision: Precision::F64,
        }
    }
}

/// Coding of the network's output (paper, section 2.3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutputCoding {
    /// The contact position in metres; a logistic output can overshoot a surface shorter than 1 m.
    Position,
    /// The contact position divided by the surface's length.
    Normalized,
}

/// Scaling of readings; not given in the paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InputScale {
    /// Largest reading of each kind under the contact force; without a model, in the recording.
    FullScale,
    /// Mean 0 and standard deviation 1 over the recording.
    Standardized,
    /// Division by a fixed reading, SI or raw.
    DivideBy(f64),
}

/// Back-propagation with momentum, one update per pattern (Rumelhart, Hinton and Williams 1986).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BackPropagation {
    /// Learning rate η; greater than 0.
    pub learning_rate: f64,
    /// Momentum α; 0 ≤ α < 1.
    pub momentum: f64,
    /// Converged sum of squared output errors.
    pub aggregate_error: f64,
    /// Cap of epochs; see [`BackPropagation::most_epochs`].
    pub max_epochs: u32,
    /// Order of patterns.
    pub order: PresentationOrder,
    /// Weights start uniform within ± this.
    pub initial_weights: f64,
}

impl Default for BackPropagation {
    fn default() -> Self {
        Self {
            learning_rate: 0.7,
            momentum: 0.9,
            aggregate_error: 1e-5,
            max_epochs: 1_000_000,
            order: PresentationOrder::Shuffled,
            initial_weights: 0.5,
        }
    }
}

impl BackPropagation {
    /// Returns `max_epochs`, and for more than 65,536 patterns at most 200 million presentations.
    pub fn most_epochs(&self, patterns: usize) -> u32 {
        const FEW_PATTERNS: usize = 1 << 16;
        const MOST_PRESENTATIONS: usize = 200_000_000;
        if patterns <= FEW_PATTERNS {
            return self.max_epochs;
        }
        self.max_epochs.min((MOST_PRESENTATIONS / patterns).max(1) as u32)
    }
}

/// Order of patterns in an epoch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PresentationOrder {
    /// A fresh random permutation every epoch.
    Shuffled,
    /// As recorded, every epoch alike.
    Fixed,
}

/// Topology of a fully connected network.
///
/// Weights are a flat list by layer and node, each node's bias last.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Topology {
    /// Nodes of every layer, inputs first.
    pub sizes: Vec<usize>,
    /// True for nodes with biases.
    pub biases: bool,
    /// Activation of the hidden layers.
    pub hidden_activation: Activation,
    /// Activation of the output layer.
    pub output_activation: Activation,
}

impl Topology {
    /// Returns the topology of `config`.
    pub fn new(config: &Network, inputs: usize, outputs: usize) -> Self {
        let sizes = std::iter::once(inputs).chain(config.hidden.iter().copied()).chain([outputs]).collect();
        Self {
            sizes,
            biases: config.biases,
            hidden_activation: config.hidden_activation,
            output_activation: config.output_activation,
        }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.sizes.first().copied().unwrap_or(0)
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.sizes.last().copied().unwrap_or(0)
    }

    /// Number of weighted layers.
    pub fn layers(&self) -> usize {
        self.sizes.len().saturating_sub(1)
    }

    /// Returns the weights per node of a layer, bias included.
    pub fn row_len(&self, layer: usize) -> usize {
        self.sizes[layer] + usize::from(self.biases)
    }

    /// Returns the nodes of weighted layer `layer`.
    pub fn rows(&self, layer: usize) -> usize {
        self.sizes[layer + 1]
    }

    /// Returns the activation of a weighted layer.
    pub fn activation(&self, layer: usize) -> Activation {
        if layer + 1 == self.layers() { self.output_activation } else { self.hidden_activation }
    }

    /// Number of weights, biases included.
    pub fn weight_count(&self) -> usize {
        (0..self.layers()).map(|layer| self.rows(layer) * self.row_len(layer)).sum()
    }

    pub(crate) fn checked_weight_count(&self) -> Option<usize> {
        self.sizes.windows(2).try_fold(0usize, |sum, pair| {
            pair[1].checked_mul(pair[0].checked_add(usize::from(self.biases))?)?.checked_add(sum)
        })
    }

    /// Returns the network for chips.
    pub fn network<'a>(&'a self, weights: &'a [f64]) -> palpate_core::Network<'a> {
        palpate_core::Network {
            sizes: &self.sizes,
            biases: self.biases,
            hidden_activation: self.hidden_activation,
            output_activation: self.output_activation,
            weights,
        }
    }
}

/// Scaled training patterns.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainingSet {
    /// Inputs per pattern.
    pub inputs: usize,
    /// Outputs per pattern.
    pub outputs: usize,
    /// Inputs by pattern.
    pub input_values: Vec<f64>,
    /// Targets by pattern.
    pub target_values: Vec<f64>,
}

impl TrainingSet {
    /// Limit of patterns, picked by 32 random bits equally often to 0.4 %.
    pub const MOST: usize = 1 << 24;

    /// Number of patterns.
    pub fn count(&self) -> usize {
        self.target_values.len() / self.outputs.max(1)
    }
}

/// Recording that a network does not suit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NetworkFitError {
    /// Too many rows.
    #[error("the recording has {found} rows; a network is trained on at most {most}")]
    TooManyRows {
        /// Rows.
        found: usize,
        /// Limit.
        most: usize,
    },
    /// No rows.
    #[error("the recording has no rows; a network needs at least 1")]
    NoRows,
    /// Channel that cannot be scaled.
    #[error(
        "channel `{channel}` cannot be scaled: its {what} is {value}; it must be a number greater than 0"
    )]
    Unscalable {
        /// Channel name.
        channel: String,
        /// Name of the divisor.
        what: &'static str,
        /// Value.
        value: f64,
    },
    /// Channel mismatch.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for Network {
    type Method = NetworkLocator;
    type Error = NetworkFitError;

    fn fit_method(&self, task: FitTask) -> Result<NetworkLocator, NetworkFitError> {
        let coded = CodedTraining::new(self, task)?;
        let network = train_one(self.precision, &coded.task(), task.seed, task.watch)?;
        Ok(coded.locator(network))
    }

    fn fit_many(
        &self,
        task: FitTask,
        queue: &mut dyn SeedQueue<MethodLocator<NetworkLocator>>,
    ) -> Result<(), NetworkFitError> {
        task.check_channels()?;
        let coded = CodedTraining::new(self, task)?;
        let map = |seed, network| MethodLocator::new(task.seed(seed), coded.locator(network));
        let set = InstructionSet::best();
        Ok(train_many(set, self.precision, &coded.task(), &mut MappedQueue { queue, map }, task.watch)?)
    }
}

impl Network {
    /// Restores the locator of an earlier fit; `None` for the wrong number of weights.
    ///
    /// # Errors
    /// [`NetworkFitError`] for an unsuitable recording.
    pub fn restore(
        &self,
        task: FitTask,
        weights: Vec<f64>,
        outcome: TrainingOutcome,
    ) -> Result<Option<MethodLocator<NetworkLocator>>, NetworkFitError> {
        task.check_channels()?;
        let coded = CodedTraining::new(self, task)?;
        let topology = coded.topology.clone();
        Ok((weights.len() == topology.weight_count()).then(|| {
            let network = TrainedNetwork { topology, weights, outcome };
            MethodLocator::new(task, coded.locator(network))
        }))
    }
}

struct CodedTraining<'a> {
    topology: Topology,
    patterns: TrainingSet,
    rule: &'a BackPropagation,
    scaling: Vec<ChannelScaling>,
    output_scale_m: Vec<f64>,
    extent: Extent,
}

impl<'a> CodedTraining<'a> {
    fn new(config: &'a Network, FitTask { setup, recording, .. }: FitTask) -> Result<Self, NetworkFitError> {
        let rows = recording.rows.len();
        if rows == 0 {
            return Err(NetworkFitError::NoRows);
        }
        if rows > TrainingSet::MOST {
            return Err(NetworkFitError::TooManyRows { found: rows, most: TrainingSet::MOST });
        }
        let scaling = channel_scaling(config.input_scale, setup, recording)?;
        let extent = setup.surface().extent();
        let scale_m = |size_m| if config.output == OutputCoding::Position { 1.0 } else { size_m };
        let output_scale_m: Vec<f64> = extent.sides_m().map(scale_m).collect();
        let inputs = |row: &Row| -> Vec<f64> {
            row.reading.iter().zip(&scaling).map(|(value, channel)| channel.apply(*value)).collect()
        };
        let targets = |row: &Row| -> Vec<f64> {
            extent.coordinates_m(row.position).zip(&output_scale_m).map(|(x, scale)| x / scale).collect()
        };
        let patterns = TrainingSet {
            inputs: recording.channels.len(),
            outputs: output_scale_m.len(),
            input_values: recording.rows.iter().flat_map(inputs).collect(),
            target_values: recording.rows.iter().flat_map(targets).collect(),
        };
        let topology = Topology::new(config, patterns.inputs, patterns.outputs);
        Ok(Self { topology, patterns, rule: &config.training, scaling, output_scale_m, extent })
    }

    fn task(&self) -> TrainingTask<'_> {
        TrainingTask { topology: &self.topology, patterns: &self.patterns, rule: self.rule }
    }

    fn locator(&self, TrainedNetwork { topology, weights, outcome }: TrainedNetwork) -> NetworkLocator {
        let (scaling, output_scale_m) = (self.scaling.clone(), self.output_scale_m.clone());
        let extent = self.extent;
        NetworkParts { topology, weights, scaling, output_scale_m, extent, outcome }.into()
    }
}

fn channel_scaling(
    scale: InputScale,
    setup: &Setup,
    recording: &Recording,
) -> Result<Vec<ChannelScaling>, NetworkFitError> {
    let column = |c: usize| recording.rows.iter().map(move |row| row.reading[c]);
    let largest = || recording.rows.iter().flat_map(|row| &row.reading).fold(0.0, |m: f64, r| m.max(r.abs()));
    let one = |c: usize| {
        let (offset, divisor, what) = match (scale, setup.surface().model().zip(setup.force_n())) {
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
        if divisor.is_finite() && divisor > 0.0 {
            return Ok(ChannelScaling { offset, divisor });
        }
        let channel = recording.channels[c].clone();
        Err(NetworkFitError::Unscalable { channel, what, value: divisor })
    };
    (0..recording.channels.len()).map(one).collect()
}

/// Status of a completed training.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrainingStatus {
    /// Aggregate error within the tolerance.
    Converged,
    /// Epoch cap.
    Capped,
    /// Infinite weight.
    Diverged,
}

impl std::fmt::Display for TrainingStatus {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            Self::Converged => "converged",
            Self::Capped => "capped",
            Self::Diverged => "diverged",
        })
    }
}

/// Outcome of a training.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrainingOutcome {
    /// Status.
    pub status: TrainingStatus,
    /// Number of epochs.
    pub epochs: u32,
    /// Sum of squared output errors.
    pub aggregate_error: f64,
}

impl Default for TrainingOutcome {
    fn default() -> Self {
        Self { status: TrainingStatus::Converged, epochs: 0, aggregate_error: 0.0 }
    }
}

impl TrainingOutcome {
    fn after_epoch(epochs: u32, error: f64, task: &TrainingTask) -> Option<Self> {
        let status = if !error.is_finite() {
            TrainingStatus::Diverged
        } else if error <= task.rule.aggregate_error {
            TrainingStatus::Converged
        } else if epochs >= task.rule.most_epochs(task.patterns.count()) {
            TrainingStatus::Capped
        } else {
            return None;
        };
        Some(Self { status, epochs, aggregate_error: error })
    }
}

/// Trained network.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainedNetwork {
    /// Topology.
    pub topology: Topology,
    /// Weights in the order of [`Topology`].
    pub weights: Vec<f64>,
    /// Outcome of the training.
    pub outcome: TrainingOutcome,
}

/// Scaling (r − offset) / divisor.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelScaling {
    /// Offset, SI or raw.
    pub offset: f64,
    /// Divisor, SI or raw; greater than 0.
    pub divisor: f64,
}

impl ChannelScaling {
    /// Returns the input for a reading.
    pub fn apply(self, reading: f64) -> f64 {
        (reading - self.offset) / self.divisor
    }
}

/// Trained network in a locator file.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkParts {
    /// Topology.
    pub topology: Topology,
    /// Weights in the order of [`Topology`].
    pub weights: Vec<f64>,
    /// Scaling of each channel.
    pub scaling: Vec<ChannelScaling>,
    /// Position of an output of 1, by coordinate.
    pub output_scale_m: Vec<f64>,
    /// Surface.
    pub extent: Extent,
    /// Outcome of the training.
    pub outcome: TrainingOutcome,
}

/// Fitted [`Network`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(from = "NetworkParts", into = "NetworkParts")]
pub struct NetworkLocator {
    parts: NetworkParts,
    /// `None` for an inconsistent file.
    network: Option<PreparedNetwork>,
}

impl From<NetworkParts> for NetworkLocator {
    fn from(parts: NetworkParts) -> Self {
        Self { network: PreparedNetwork::new(&parts.topology, &parts.weights), parts }
    }
}

impl From<NetworkLocator> for NetworkParts {
    fn from(locator: NetworkLocator) -> Self {
        locator.parts
    }
}

impl NetworkParts {
    fn check_numbers(&self, channels: usize) -> Result<(), LocatorFault> {
        let sizes = &self.topology.sizes;
        let count = LocatorFault::check_count;
        if sizes.len() < 2 {
            return Err(LocatorFault::Count { what: "layers", needed: 2, found: sizes.len() });
        }
        let nodes = sizes.iter().map(|nodes| *nodes as f64);
        LocatorFault::check_numbers("layer", nodes, |nodes| nodes > 0.0, "of at least 1 node")?;
        count("inputs", channels, self.topology.inputs())?;
        count("channel scalings", channels, self.scaling.len())?;
        count("output scales", self.topology.outputs(), self.output_scale_m.len())?;
        count("outputs", self.extent.dimensions(), self.topology.outputs())?;
        let weights = self.topology.checked_weight_count();
        count("weights", weights.unwrap_or(usize::MAX), self.weights.len())?;
        let finite = "a finite number";
        LocatorFault::check_numbers("weight", &self.weights, |_| true, finite)?;
        let offsets = self.scaling.iter().map(|scaling| scaling.offset);
        LocatorFault::check_numbers("scaling's offset", offsets, |_| true, finite)?;
        let scales =
            self.scaling.iter().map(|scaling| scaling.divisor).chain(self.output_scale_m.iter().copied());
        LocatorFault::check_numbers("scale", scales, |scale| scale > 0.0, "greater than 0")
    }
}

const FEW_CHANNELS: usize = 16;

impl NetworkLocator {
    /// Parts of the network.
    pub fn parts(&self) -> &NetworkParts {
        &self.parts
    }

    /// Returns the position for a reading.
    pub fn position(&self, reading: &[f64]) -> Option<Position> {
        let (mut few, mut many) = ([0.0; FEW_CHANNELS], Vec::new());
        let inputs = if let Some(inputs) = few.get_mut(..reading.len()) {
            inputs
        } else {
            many.resize(reading.len(), 0.0);
            &mut many[..]
        };
        for ((input, r), scaling) in inputs.iter_mut().zip(reading).zip(&self.parts.scaling) {
            *input = scaling.apply(*r);
        }
        let mut outputs = [0.0; 2];
        let outputs = outputs.get_mut(..self.parts.topology.outputs())?;
        self.network.as_ref()?.forward_into(inputs, outputs).ok()?;
        let mut coordinates = outputs.iter().zip(&self.parts.output_scale_m).map(|(a, scale)| a * scale);
        Some(Position { x_m: coordinates.next()?, y_m: coordinates.next().unwrap_or(0.0) })
    }
}

impl Locate for NetworkLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        let position = self.position(reading).unwrap_or(Position::along(f64::NAN));
        on_surface(ContactEstimate { position, ..ContactEstimate::default() }, self.parts.extent)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.parts.check_numbers(setup.layout().len())
    }
}
