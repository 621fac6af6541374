//! From a recording to an ensemble of networks.

use ndarray::Array2;
use palpate_numerics::watch::{Cancelled, Watch};

use super::training::{Trained, Training};
use super::{LevenbergMarquardtLocator, Member, NetworkInputs, OutputScale};
use crate::features::NoFeatures;
use crate::fit::{ChannelMismatch, Fit, FitTask};
use crate::network::{Activation, Topology};
use crate::recording::{Recording, TooFewPositions};
use crate::setup::Setup;
use palpate_numerics::mean_and_variance;

/// An ensemble of networks with tanh hidden layers and linear outputs, trained by Levenberg–Marquardt with Bayesian regularisation.
///
/// Outputs are the position and, where the bench does not know the force but every row of the recording does, the force.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LevenbergMarquardt {
    /// Nodes of each hidden layer, input side first; at least 1 each.
    pub hidden: Vec<usize>,
    /// Networks in the ensemble, at least 1: those with the greatest evidence of twice as many that are trained.
    pub ensemble: usize,
    /// Each training is capped after this many iterations.
    pub max_iterations: u32,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        Self { hidden: vec![10], ensemble: 5, max_iterations: 200 }
    }
}

/// A network learns from at most this many presses, drawn at random, each of an ensemble from others (Bühlmann and Yu,
/// *Analyzing bagging*, Annals of Statistics 30, 2002): a step costs presses × weights², and what more presses tell goes into the
/// ensemble.
const MOST_PRESSES: usize = 1000;

/// Why networks cannot be fitted to a recording.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LevenbergMarquardtFitError {
    /// One position has nothing to teach.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// A layer or an ensemble of nothing.
    #[error("a network with {what} 0 cannot be trained; it must be at least 1")]
    Zero {
        /// What is 0.
        what: &'static str,
    },
    /// Readings that never change.
    #[error(transparent)]
    Features(#[from] NoFeatures),
    /// Readings that differ by no more than noise.
    #[error(
        "the recording's readings do not differ by more than noise; a network has nothing to tell positions by"
    )]
    Alike,
    /// No training kept to the numbers.
    #[error("none of {trainings} trainings gave a network with finite weights")]
    Diverged {
        /// How many were tried.
        trainings: usize,
    },
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for LevenbergMarquardt {
    type Method = LevenbergMarquardtLocator;
    type Error = LevenbergMarquardtFitError;

    fn fit_method(&self, task: FitTask) -> Result<LevenbergMarquardtLocator, LevenbergMarquardtFitError> {
        self.check()?;
        task.recording.check_distinct_positions(2)?;
        let inputs = NetworkInputs::of(&task.setup.layout, task.recording)?;
        let input_rows = input_rows(&inputs, task.recording)?;
        let scales = output_scales(task.setup, task.recording);
        let targets = target_rows(task.setup, task.recording, &scales);
        let topology = self.topology(inputs.axes.len(), scales.len());
        let training = Training {
            topology: &topology,
            inputs: input_rows,
            targets,
            max_iterations: self.max_iterations,
        };
        let members = self.ensemble(&training, task.seed, task.watch)?;
        Ok(LevenbergMarquardtLocator {
            extent: task.setup.surface.extent(),
            force_n: task.setup.force_n,
            inputs,
            topology,
            scales,
            members,
        })
    }
}

impl LevenbergMarquardt {
    fn check(&self) -> Result<(), LevenbergMarquardtFitError> {
        let zero = |what| Err(LevenbergMarquardtFitError::Zero { what });
        match self {
            Self { hidden, .. } if hidden.contains(&0) => zero("hidden nodes"),
            Self { ensemble: 0, .. } => zero("networks in its ensemble"),
            _ => Ok(()),
        }
    }

    fn topology(&self, inputs: usize, outputs: usize) -> Topology {
        let sizes = std::iter::once(inputs).chain(self.hidden.iter().copied()).chain([outputs]);
        Topology {
            sizes: sizes.collect(),
            biases: true,
            hidden_activation: Activation::Tanh,
            output_activation: Activation::Linear,
        }
    }

    /// Trains twice the ensemble and keeps the half with the greatest evidence: a poor local minimum has little.
    fn ensemble(
        &self,
        training: &Training,
        seed: u64,
        watch: Watch,
    ) -> Result<Vec<Member>, LevenbergMarquardtFitError> {
        let trainings = 2 * self.ensemble;
        let mut trained: Vec<Trained> = Vec::new();
        for i in 0..trainings as u64 {
            let seed = seed.wrapping_mul(trainings as u64).wrapping_add(i);
            trained.extend(training.of_some(MOST_PRESSES, seed).run(seed, watch)?);
        }
        if trained.is_empty() {
            return Err(LevenbergMarquardtFitError::Diverged { trainings });
        }
        trained.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        trained.truncate(self.ensemble);
        Ok(trained.into_iter().map(Member::of).collect())
    }
}

fn input_rows(
    inputs: &NetworkInputs,
    recording: &Recording,
) -> Result<Array2<f64>, LevenbergMarquardtFitError> {
    let width = inputs.axes.len();
    if width == 0 {
        return Err(LevenbergMarquardtFitError::Alike);
    }
    let mut rows = Array2::zeros((recording.rows.len(), width));
    for (i, row) in recording.rows.iter().enumerate() {
        rows.row_mut(i).iter_mut().zip(inputs.values(&row.reading)).for_each(|(input, value)| *input = value);
    }
    Ok(rows)
}

/// x, y where the surface has one, and the force where it is an output.
fn truths<'a>(setup: &Setup, recording: &'a Recording) -> Vec<Box<dyn Fn(usize) -> f64 + 'a>> {
    let rows = &recording.rows;
    let mut truths: Vec<Box<dyn Fn(usize) -> f64>> = vec![Box::new(|i| rows[i].position.x_m)];
    if setup.surface.extent().width_m.is_some() {
        truths.push(Box::new(|i| rows[i].position.y_m));
    }
    if setup.force_n.is_none() && rows.iter().all(|row| row.force_n.is_some()) {
        truths.push(Box::new(|i| rows[i].force_n.unwrap_or_default()));
    }
    truths
}

/// Mean and standard deviation of every output over the recording.
fn output_scales(setup: &Setup, recording: &Recording) -> Vec<OutputScale> {
    let count = recording.rows.len();
    let scale = |truth: &dyn Fn(usize) -> f64| {
        let (mean, variance) = mean_and_variance((0..count).map(truth));
        OutputScale { mean, sd: if variance > 0.0 { variance.sqrt() } else { 1.0 } }
    };
    truths(setup, recording).iter().map(|truth| scale(truth.as_ref())).collect()
}

fn target_rows(setup: &Setup, recording: &Recording, scales: &[OutputScale]) -> Array2<f64> {
    let truths = truths(setup, recording);
    Array2::from_shape_fn((recording.rows.len(), scales.len()), |(i, k)| {
        (truths[k](i) - scales[k].mean) / scales[k].sd
    })
}
