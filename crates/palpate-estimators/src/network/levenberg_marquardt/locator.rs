//! An ensemble that locates.

use ndarray::{Array1, ArrayView2};
use serde::{Deserialize, Serialize};

use super::NetworkInputs;
use super::perceptron::jacobians;
use super::training::Trained;
use crate::fit::{Locate, LocatorFault};
use crate::network::Topology;
use crate::setup::Setup;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::normal_interval_95;

/// Networks that locate; see [`LevenbergMarquardt`](super::LevenbergMarquardt).
///
/// The estimate is the mean of the members. Its covariance is that of the mixture: the spread of the members, and the mean over
/// them of g·A⁻¹·gᵀ, by which the weights are unsure (g an output's derivatives by the weights, A the curvature), and of
/// the noise 1/β that training left. The 95 % interval is the mean ± 1.96 standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevenbergMarquardtLocator {
    /// The surface.
    pub extent: Extent,
    /// The contact's force in newtons, where the bench knows it.
    pub force_n: Option<f64>,
    /// From a reading to inputs.
    pub inputs: NetworkInputs,
    /// Shape of every member.
    pub topology: Topology,
    /// What the outputs stand for: x, then y on a two-dimensional surface, then the force where it is an output.
    pub scales: Vec<OutputScale>,
    /// The networks, the one with the greatest evidence first.
    pub members: Vec<Member>,
}

/// An output a stands for mean + sd·a, in metres or newtons.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputScale {
    /// Mean over the training recording.
    pub mean: f64,
    /// Standard deviation over the training recording; greater than 0.
    pub sd: f64,
}

/// One network, and how sure it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// Its weights, in the order that [`Topology`] states.
    pub weights: Vec<f64>,
    /// L of the curvature A = L·Lᵀ of the training objective around the weights: rows of the lower triangle, one after the other.
    pub curvature_factor: Vec<f64>,
    /// Variance 1/β of each output's noise, in units of the output's own variance.
    pub noise: Vec<f64>,
    /// γ, how many of the weights the recording determines.
    pub effective_parameters: f64,
    /// Logarithm of the evidence, up to a constant that is the same for all members.
    pub log_evidence: f64,
    /// Iterations that training took.
    pub iterations: u32,
}

impl Member {
    pub(super) fn of(trained: Trained) -> Self {
        let lower = trained.curvature.lower();
        let rows = lower.outer_iter().enumerate();
        Self {
            weights: trained.weights,
            curvature_factor: rows
                .flat_map(|(i, row)| row.iter().copied().take(i + 1).collect::<Vec<_>>())
                .collect(),
            noise: trained.hyperparameters.betas.iter().map(|beta| 1.0 / beta).collect(),
            effective_parameters: trained.effective_parameters,
            log_evidence: trained.log_evidence,
            iterations: trained.iterations,
        }
    }

    /// L⁻¹·g.
    fn solve_lower(&self, mut gradient: Vec<f64>) -> Vec<f64> {
        let mut rows = self.curvature_factor.as_slice();
        for i in 0..gradient.len() {
            let (row, rest) = rows.split_at(i + 1);
            rows = rest;
            let (done, rest) = gradient.split_at_mut(i);
            let sum: f64 = row.iter().zip(&*done).map(|(l, x)| l * x).sum();
            rest[0] = (rest[0] - sum) / row[i];
        }
        gradient
    }
}

/// Mean and covariance of the outputs.
struct Prediction {
    mean: Vec<f64>,
    /// A row an output.
    covariance: Vec<Vec<f64>>,
}

impl LevenbergMarquardtLocator {
    /// Mean and covariance of the mixture, in units of the outputs' scales.
    fn predict(&self, inputs: &[f64]) -> Option<Prediction> {
        let count = self.topology.outputs();
        let inputs = ArrayView2::from_shape((1, inputs.len()), inputs).ok()?;
        let share = 1.0 / self.members.len() as f64;
        let mut outputs: Vec<Array1<f64>> = Vec::with_capacity(self.members.len());
        let mut covariance = vec![vec![0.0; count]; count];
        for member in &self.members {
            let (output, gradients) = jacobians(&self.topology, &member.weights, &inputs);
            let sent: Vec<Vec<f64>> = gradients
                .into_iter()
                .map(|gradient| member.solve_lower(gradient.into_raw_vec_and_offset().0))
                .collect();
            for i in 0..count {
                for j in 0..count {
                    let weights: f64 = sent[i].iter().zip(&sent[j]).map(|(a, b)| a * b).sum();
                    covariance[i][j] += share * (weights + if i == j { member.noise[i] } else { 0.0 });
                }
            }
            outputs.push(output.row(0).to_owned());
        }
        let mean: Vec<f64> = (0..count).map(|k| share * outputs.iter().map(|o| o[k]).sum::<f64>()).collect();
        for output in &outputs {
            for i in 0..count {
                for j in 0..count {
                    covariance[i][j] += share * (output[i] - mean[i]) * (output[j] - mean[j]);
                }
            }
        }
        Some(Prediction { mean, covariance })
    }

    fn contact(&self, prediction: &Prediction) -> ContactEstimate {
        let value = |k: usize| self.scales[k].mean + self.scales[k].sd * prediction.mean[k];
        let covariance =
            |i: usize, j: usize| self.scales[i].sd * self.scales[j].sd * prediction.covariance[i][j];
        let y = self.extent.width_m.map(|_| 1);
        let force = (self.scales.len() > 1 + usize::from(y.is_some())).then(|| self.scales.len() - 1);
        let both = |a: Option<usize>, b: Option<usize>| a.zip(b).map_or(0.0, |(i, j)| covariance(i, j));
        let interval = |k: usize| normal_interval_95(value(k), covariance(k, k).sqrt());
        let x = Some(0);
        ContactEstimate {
            position: Position { x_m: value(0), y_m: y.map_or(0.0, value) },
            force_n: self.force_n.or(force.map(value)),
            uncertainty: Some(Uncertainty {
                covariance: [
                    both(x, x),
                    both(x, y),
                    both(x, force),
                    both(y, y),
                    both(y, force),
                    both(force, force),
                ],
                x_95_m: interval(0),
                y_95_m: y.map_or((0.0, 0.0), interval),
            }),
        }
    }
}

impl Locate for LevenbergMarquardtLocator {
    fn locate(&self, reading: &[f64]) -> Estimate {
        let prediction = self.predict(&self.inputs.values(reading));
        let Some(prediction) = prediction else {
            return Estimate::of_position(Position::default(), Status::NoContact);
        };
        let contact = self.contact(&prediction);
        let on_surface = self.extent.contains(contact.position);
        Estimate::of_contact(contact, if on_surface { Status::Located } else { Status::OutsideSurface })
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.inputs.check(setup.layout.len())?;
        let sizes = &self.topology.sizes;
        LocatorFault::check_numbers(
            "layer",
            sizes.iter().map(|n| *n as f64),
            |n| n >= 1.0,
            "at least 1 node",
        )?;
        LocatorFault::check_numbers("count of layers", [sizes.len() as f64], |n| n >= 2.0, "at least 2")?;
        LocatorFault::check_count("inputs", self.inputs.axes.len(), self.topology.inputs())?;
        LocatorFault::check_count("outputs", self.scales.len(), self.topology.outputs())?;
        let axes = 1 + usize::from(self.extent.width_m.is_some());
        let most = axes + usize::from(self.force_n.is_none());
        LocatorFault::check_count("outputs", self.scales.len().clamp(axes, most), self.scales.len())?;
        let scales = self.scales.iter().map(|s| s.mean);
        LocatorFault::check_numbers("output mean", scales, |_| true, "a finite number")?;
        let scales = self.scales.iter().map(|s| s.sd);
        LocatorFault::check_numbers("output scale", scales, |sd| sd > 0.0, "greater than 0")?;
        LocatorFault::check_numbers(
            "count of members",
            [self.members.len() as f64],
            |n| n >= 1.0,
            "at least 1",
        )?;
        self.members.iter().try_for_each(|member| self.check_member(member))
    }
}

impl LevenbergMarquardtLocator {
    fn check_member(&self, member: &Member) -> Result<(), LocatorFault> {
        let weights = self.topology.weight_count();
        LocatorFault::check_count("weights", weights, member.weights.len())?;
        LocatorFault::check_count(
            "curvature numbers",
            weights * (weights + 1) / 2,
            member.curvature_factor.len(),
        )?;
        LocatorFault::check_count("noise variances", self.scales.len(), member.noise.len())?;
        let finite = member.weights.iter().chain(&member.curvature_factor).copied();
        LocatorFault::check_numbers("weight or curvature", finite, |_| true, "a finite number")?;
        let pivots = (0..weights).map(|i| member.curvature_factor[i * (i + 3) / 2]);
        LocatorFault::check_numbers("curvature pivot", pivots, |d| d > 0.0, "greater than 0")?;
        LocatorFault::check_numbers(
            "noise variance",
            member.noise.iter().copied(),
            |v| v >= 0.0,
            "at least 0",
        )
    }
}
