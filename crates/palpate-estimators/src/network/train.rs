//! The trainer's two doors: one network, or many side by side.

mod kernel;
mod order;

use super::{BackPropagation, Patterns, Topology, TrainedNetwork};
use palpate_numerics::simd::{InstructionSet, Kernel, Simd, run_loops};

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
pub trait SeedQueue {
    /// The next network to train.
    fn next_seed(&mut self) -> Option<u64>;
    /// Takes a network whose training ended.
    fn finished(&mut self, seed: u64, network: TrainedNetwork);
    /// Asked once an epoch; on `false` the group gives up what it has not finished.
    fn keep_going(&mut self) -> bool;
}

/// Trains the queue's networks, as many at once as `precision` has lanes. A seed gives the same network in whatever lane, thread or company
/// it is trained.
pub fn train_many(set: InstructionSet, precision: Precision, task: &TrainingTask, queue: &mut dyn SeedQueue) {
    set.run(InLanes { precision, task, queue });
}

/// Trains one network: the same bits as [`train_many`] gives for the seed in 64 bits. `None` when `keep_going`, asked once an epoch, says
/// no.
pub fn train_one(
    task: &TrainingTask,
    seed: u64,
    keep_going: &mut dyn FnMut() -> bool,
) -> Option<TrainedNetwork> {
    let mut queue = OneSeed { seed: Some(seed), keep_going, network: None };
    run_loops(Alone { task, queue: &mut queue });
    queue.network
}

/// Networks side by side, one a lane.
struct InLanes<'a> {
    precision: Precision,
    task: &'a TrainingTask<'a>,
    queue: &'a mut dyn SeedQueue,
}

impl Kernel for InLanes<'_> {
    type Output = ();
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) {
        match self.precision {
            Precision::F64 => kernel::train::<S, S::F64, 8>(self.task, self.queue),
            Precision::F32 => kernel::train::<S, S::F32, 16>(self.task, self.queue),
        }
    }
}

/// Networks one after the other, in one lane: two thirds faster than in a vector whose other lanes are idle.
struct Alone<'a> {
    task: &'a TrainingTask<'a>,
    queue: &'a mut dyn SeedQueue,
}

impl Kernel for Alone<'_> {
    type Output = ();
    const FUSED: bool = true;

    #[inline(always)]
    fn run<S: Simd>(self) {
        kernel::train::<S, S::Array<f64, 1>, 1>(self.task, self.queue);
    }
}

/// The queue of one seed.
struct OneSeed<'a> {
    seed: Option<u64>,
    keep_going: &'a mut dyn FnMut() -> bool,
    network: Option<TrainedNetwork>,
}

impl SeedQueue for OneSeed<'_> {
    fn next_seed(&mut self) -> Option<u64> {
        self.seed.take()
    }
    fn finished(&mut self, _: u64, network: TrainedNetwork) {
        self.network = Some(network);
    }
    fn keep_going(&mut self) -> bool {
        (self.keep_going)()
    }
}

#[cfg(test)]
mod tests;
