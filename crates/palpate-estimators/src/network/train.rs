//! Training by back-propagation: one network, or many side by side.

mod kernel;
mod order;

use super::{BackPropagation, Patterns, Topology, TrainedNetwork};
use palpate_numerics::simd::{InstructionSet, Kernel, Simd, run_loops};
use palpate_numerics::watch::{Cancelled, Watch};

/// Width of a floating-point number in training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 64 bits.
    #[default]
    F64,
    /// 32 bits: twice the lanes.
    F32,
}

impl Precision {
    /// Networks that train side by side.
    pub fn lanes(self) -> usize {
        match self {
            Self::F64 => 8,
            Self::F32 => 16,
        }
    }
}

/// What every network of a group is trained on.
#[derive(Clone, Copy, Debug)]
pub struct TrainingTask<'a> {
    /// Shape of the network; its inputs and outputs are those of the patterns.
    pub topology: &'a Topology,
    /// What it is shown: between 1 and [`Patterns::MOST`] patterns.
    pub patterns: &'a Patterns,
    /// How its weights are found.
    pub rule: &'a BackPropagation,
}

/// Where a lane group takes its seeds from and leaves its networks.
pub trait TrainingQueue {
    /// The next network to train.
    fn next_seed(&mut self) -> Option<u64>;
    /// Takes a network whose training ended.
    fn finished(&mut self, seed: u64, network: TrainedNetwork);
}

/// Trains the queue's networks, as many at once as `precision` has lanes. A seed gives the same network in whatever lane, thread or company
/// it is trained.
///
/// # Errors
/// [`Cancelled`] when `watch`, told of every epoch, stops it; what was not finished is given up.
pub fn train_many(
    set: InstructionSet,
    precision: Precision,
    task: &TrainingTask,
    queue: &mut dyn TrainingQueue,
    watch: Watch,
) -> Result<(), Cancelled> {
    set.run(InLanes(Training { precision, task, queue, watch }))
}

/// Trains one network: the same bits as [`train_many`] gives for the seed.
///
/// # Errors
/// [`Cancelled`] when `watch`, told of every epoch, stops it.
pub fn train_one(
    precision: Precision,
    task: &TrainingTask,
    seed: u64,
    watch: Watch,
) -> Result<TrainedNetwork, Cancelled> {
    let mut queue = OneSeed { seed: Some(seed), network: None };
    run_loops(Alone(Training { precision, task, queue: &mut queue, watch }))?;
    Ok(queue.network.expect("a queue that nobody stops is trained to its end"))
}

struct Training<'a> {
    precision: Precision,
    task: &'a TrainingTask<'a>,
    queue: &'a mut dyn TrainingQueue,
    watch: Watch<'a>,
}

/// Networks side by side, one a lane.
struct InLanes<'a>(Training<'a>);

impl Kernel for InLanes<'_> {
    type Output = Result<(), Cancelled>;
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) -> Result<(), Cancelled> {
        let Training { precision, task, queue, watch } = self.0;
        match precision {
            Precision::F64 => kernel::train::<S, S::F64, 8>(task, queue, watch),
            Precision::F32 => kernel::train::<S, S::F32, 16>(task, queue, watch),
        }
    }
}

/// Networks one after the other: one is trained faster alone than among lanes that are idle.
struct Alone<'a>(Training<'a>);

impl Kernel for Alone<'_> {
    type Output = Result<(), Cancelled>;
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) -> Result<(), Cancelled> {
        let Training { precision, task, queue, watch } = self.0;
        match precision {
            Precision::F64 => kernel::train::<S, S::Array<f64, 1>, 1>(task, queue, watch),
            Precision::F32 => kernel::train::<S, S::Array<f32, 1>, 1>(task, queue, watch),
        }
    }
}

struct OneSeed {
    seed: Option<u64>,
    network: Option<TrainedNetwork>,
}

impl TrainingQueue for OneSeed {
    fn next_seed(&mut self) -> Option<u64> {
        self.seed.take()
    }
    fn finished(&mut self, _: u64, network: TrainedNetwork) {
        self.network = Some(network);
    }
}

#[cfg(test)]
mod tests;
