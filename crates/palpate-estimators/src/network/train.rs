//! The trainer's two doors: one network, or many side by side.

use super::lanes::{InstructionSet, Precision, train_lanes, train_scalar};
use super::{BackPropagation, Patterns, Topology, TrainedNetwork};
use palpate_numerics::watch::{Cancelled, Watch};

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

/// Trains the queue's networks, as many at once as the machine has lanes. A seed gives the same network in whatever
/// lane, thread or company it is trained.
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
    train_lanes(set, precision, task, queue, watch)
}

/// Trains one network by the scalar twin: the same bits as [`train_many`] gives for the seed.
///
/// # Errors
/// [`Cancelled`] when `watch`, told of every epoch, stops it.
pub fn train_one(
    precision: Precision,
    task: &TrainingTask,
    seed: u64,
    watch: Watch,
) -> Result<TrainedNetwork, Cancelled> {
    train_scalar(precision, task, seed, watch)
}

#[cfg(test)]
mod tests;
