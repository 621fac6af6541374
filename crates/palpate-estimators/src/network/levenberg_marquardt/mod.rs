//! Ensembles of networks by Levenberg–Marquardt with Bayesian regularisation.

mod training;

use ndarray::{Array1, Array2, ArrayView2};
use serde::{Deserialize, Serialize};

use crate::features::{ChannelScale, FeatureKind, FeatureSource, Features, NoFeatures};
use crate::fit::{ChannelMismatch, Fit, FitTask, Locate, LocatorFault, NoCheck};
use crate::network::{Activation, Topology};
use crate::recording::{Recording, Row, TooFewPositions};
use crate::setup::Setup;
use crate::status::{NO_CONTACT, on_surface};
use palpate_core::{ContactEstimate, Estimate, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{mean, mean_and_variance, normal_interval_95, symmetric_eigen};

use training::{Training, jacobians};

/// Ensemble with tanh hidden layers and linear outputs: position, and a recorded unknown force.
///
/// ```
/// use palpate_estimators::{arrangement::Training, fit::Fit, setup::Setup, network::LevenbergMarquardt};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(20), 0)?;
/// let estimate = LevenbergMarquardt { ensemble: 1, ..LevenbergMarquardt::default() }.fit(&setup, &presses)?.locate(&presses.rows[9].reading)?;
/// assert!((estimate.contact.position.x_m - mm(190.0)).abs() < mm(2.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LevenbergMarquardt {
    /// Nodes of each hidden layer; at least 1 each.
    pub hidden: Vec<usize>,
    /// Networks, at least 1: the half of greatest evidence.
    pub ensemble: usize,
    /// Cap of iterations.
    pub max_iterations: u32,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        Self { hidden: vec![10], ensemble: 5, max_iterations: 200 }
    }
}

/// Random presses per network (Bühlmann and Yu, *Analyzing bagging*, Annals of Statistics 30, 2002), as a
/// step costs presses × weights².
pub(crate) const MOST_PRESSES: usize = 1000;

/// Recording that the networks do not suit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LevenbergMarquardtFitError {
    /// Too few positions.
    #[error(transparent)]
    Positions(#[from] TooFewPositions),
    /// Layer or ensemble of size 0.
    #[error("a network with {what} 0 cannot be trained; it must be at least 1")]
    Zero {
        /// Name of the number.
        what: &'static str,
    },
    /// Constant readings.
    #[error(transparent)]
    Features(#[from] NoFeatures),
    /// Readings within noise.
    #[error(
        "the recording's readings differ by no more than noise, so a network cannot distinguish positions"
    )]
    Alike,
    /// Trainings that all diverged.
    #[error("all {trainings} trainings diverged, and no network has finite weights")]
    Diverged {
        /// Number of trainings.
        trainings: usize,
    },
    /// Channel mismatch.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for LevenbergMarquardt {
    type Method = LevenbergMarquardtLocator;
    type Error = LevenbergMarquardtFitError;

    fn fit_method(
        &self,
        FitTask { setup, recording, seed, watch, .. }: FitTask,
    ) -> Result<LevenbergMarquardtLocator, LevenbergMarquardtFitError> {
        let zero = |what| Err(LevenbergMarquardtFitError::Zero { what });
        if self.hidden.contains(&0) {
            return zero("hidden nodes");
        }
        if self.ensemble == 0 {
            return zero("networks in its ensemble");
        }
        recording.check_distinct_positions(2)?;
        let inputs = NetworkInputs::fit(setup, recording)?;
        if inputs.axes.is_empty() {
            return Err(LevenbergMarquardtFitError::Alike);
        }
        let outputs = outputs(setup, recording);
        let scales: Vec<OutputScale> = outputs.iter().map(|output| OutputScale::fit(output)).collect();
        let (rows, extent, force_n) = (recording.rows.len(), setup.surface().extent(), setup.force_n());
        let sizes =
            std::iter::once(inputs.axes.len()).chain(self.hidden.iter().copied()).chain([scales.len()]);
        let topology = Topology {
            sizes: sizes.collect(),
            biases: true,
            hidden_activation: Activation::Tanh,
            output_activation: Activation::Linear,
        };
        let input_rows: Vec<Vec<f64>> =
            recording.rows.iter().map(|row| inputs.values(&row.reading)).collect();
        let training = Training {
            topology: &topology,
            inputs: Array2::from_shape_fn((rows, inputs.axes.len()), |(i, k)| input_rows[i][k]),
            targets: Array2::from_shape_fn((rows, scales.len()), |(i, k)| {
                (outputs[k][i] - scales[k].mean) / scales[k].sd
            }),
            max_iterations: self.max_iterations,
        };
        let members = self.ensemble(&training, seed, watch)?;
        Ok(LevenbergMarquardtLocator { extent, force_n, inputs, topology, scales, members })
    }
}

impl LevenbergMarquardt {
    /// Keeps the half of greatest evidence.
    fn ensemble(
        &self,
        training: &Training,
        seed: u64,
        watch: Watch,
    ) -> Result<Vec<Member>, LevenbergMarquardtFitError> {
        let trainings = 2 * self.ensemble;
        let mut trained: Vec<Member> = Vec::new();
        for i in 0..trainings as u64 {
            let seed = seed.wrapping_mul(trainings as u64).wrapping_add(i);
            trained.extend(training.subsampled(MOST_PRESSES, seed).run(seed, watch)?);
        }
        if trained.is_empty() {
            return Err(LevenbergMarquardtFitError::Diverged { trainings });
        }
        trained.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
        trained.truncate(self.ensemble);
        Ok(trained)
    }
}

pub(crate) fn network_size(setup: &Setup, recording: &Recording) -> Option<[usize; 2]> {
    let inputs = NetworkInputs::fit(setup, recording).ok()?;
    Some([inputs.axes.len(), outputs(setup, recording).len()])
}

fn outputs(setup: &Setup, recording: &Recording) -> Vec<Vec<f64>> {
    let column = |of: fn(&Row) -> f64| recording.rows.iter().map(of).collect();
    let mut outputs = vec![column(|row| row.position.x_m)];
    if let Extent::Plane { .. } = setup.surface().extent() {
        outputs.push(column(|row| row.position.y_m));
    }
    let has_several = recording.rows.windows(2).any(|pair| pair[0].force_n != pair[1].force_n);
    if setup.force_n().is_none() && has_several && recording.rows.iter().all(|row| row.force_n.is_some()) {
        outputs.push(column(|row| row.force_n.unwrap_or_default()));
    }
    outputs
}

/// Whitened inputs: principal axes of load-invariant [`Features`], as only directions distinguish the ends of
/// a beam.
///
/// Axes of noise are omitted: below four times the known noise variance, else below 10⁻⁸ of the largest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkInputs {
    /// Features.
    pub features: Features,
    /// Factors of the features, a row per input.
    pub axes: Vec<Vec<f64>>,
}

impl NetworkInputs {
    fn fit(setup: &Setup, recording: &Recording) -> Result<Self, NoFeatures> {
        let features = Features::fit(FeatureKind::load_invariant(setup, recording), recording)?;
        let mut inputs = Self { features, axes: Vec::new() };
        let noise = inputs.feature_noise(setup.layout(), recording);
        // In units of a known noise, the noise has variance 1 along every axis.
        let unit = noise.clone().unwrap_or_else(|| Array1::ones(inputs.features.len()));
        let mut covariance = Array2::zeros((unit.len(), unit.len()));
        for row in &recording.rows {
            let values = Array1::from(inputs.features.apply(&row.reading)) / &unit;
            let column = values.view().insert_axis(ndarray::Axis(1));
            covariance += &column.dot(&column.t());
        }
        covariance /= recording.rows.len() as f64;
        let (variances, axes) = symmetric_eigen(&covariance);
        let least = if noise.is_some() { 4.0 } else { 1e-8 * variances[0] };
        let seen = variances.iter().zip(axes.columns()).filter(|(variance, _)| **variance > least);
        inputs.axes = seen.map(|(variance, axis)| (&axis / &unit / variance.sqrt()).to_vec()).collect();
        Ok(inputs)
    }

    /// Noise to first order: σ/|r| for r/|r|, at most as large for ln |r|.
    fn feature_noise(&self, layout: &Layout, recording: &Recording) -> Option<Array1<f64>> {
        let Features { channels, features, .. } = &self.features;
        let sd = |scale: &ChannelScale| layout.sensors()[scale.channel].channel.reading_sd() / scale.divisor;
        let scaled: Vec<f64> = channels.iter().map(sd).collect();
        if scaled.contains(&0.0) {
            return None;
        }
        let largest = scaled.iter().fold(0.0, |m: f64, s| m.max(*s));
        let norm = mean(recording.rows.iter().map(|row| self.features.norm(&row.reading)));
        let of_feature = |source| match source {
            FeatureSource::Channel(i) => scaled[i],
            FeatureSource::LogNorm => largest,
        };
        Some(
            features
                .iter()
                .map(|feature| of_feature(feature.source) / norm / feature.standard_deviation)
                .collect(),
        )
    }

    /// Returns the inputs for a reading.
    pub fn values(&self, reading: &[f64]) -> Vec<f64> {
        let features = self.features.apply(reading);
        self.axes.iter().map(|axis| axis.iter().zip(&features).map(|(w, f)| w * f).sum()).collect()
    }

    fn check(&self, channels: usize) -> Result<(), LocatorFault> {
        self.features.check(channels)?;
        for axis in &self.axes {
            LocatorFault::check_count("numbers of an axis", self.features.len(), axis.len())?;
            LocatorFault::check_numbers("axis", axis, |_| true, "a finite number")?;
        }
        Ok(())
    }
}

/// Fitted [`LevenbergMarquardt`].
///
/// The covariance is that between members, plus the mean g·A⁻¹·gᵀ (g derivatives by the weights, A
/// curvature), plus the noise 1/β.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevenbergMarquardtLocator {
    /// Surface.
    pub extent: Extent,
    /// Known force.
    pub force_n: Option<f64>,
    /// Inputs.
    pub inputs: NetworkInputs,
    /// Topology of members.
    pub topology: Topology,
    /// Scales of x, y and an estimated force.
    pub scales: Vec<OutputScale>,
    /// Members by falling evidence.
    pub members: Vec<Member>,
}

/// Scale of an output a: mean + sd·a.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputScale {
    /// Mean over the recording.
    pub mean: f64,
    /// Standard deviation over the recording; greater than 0.
    pub sd: f64,
}

impl OutputScale {
    fn fit(output: &[f64]) -> Self {
        let (mean, variance) = mean_and_variance(output.iter().copied());
        Self { mean, sd: if variance > 0.0 { variance.sqrt() } else { 1.0 } }
    }
}

/// Network with curvature and noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// Weights in the order of [`Topology`].
    pub weights: Vec<f64>,
    /// Row-wise lower triangle of the curvature A = L·Lᵀ.
    pub curvature_factor: Vec<f64>,
    /// Scaled noise variance 1/β.
    pub noise: Vec<f64>,
    /// Number γ of effective parameters.
    pub effective_parameters: f64,
    /// Log evidence, up to a constant.
    pub log_evidence: f64,
    /// Iterations of the training.
    pub iterations: u32,
}

impl Member {
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

impl LevenbergMarquardtLocator {
    fn predict(&self, inputs: &[f64]) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
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
        Some((mean, covariance))
    }

    fn force_output(&self) -> Option<usize> {
        (self.scales.len() > self.extent.dimensions()).then(|| self.scales.len() - 1)
    }

    /// True where estimates have a force.
    pub fn estimates_force(&self) -> bool {
        self.force_n.is_some() || self.force_output().is_some()
    }

    fn contact(&self, mean: &[f64], covariance: &[Vec<f64>]) -> ContactEstimate {
        let value = |k: usize| self.scales[k].mean + self.scales[k].sd * mean[k];
        let covariance = |i: usize, j: usize| self.scales[i].sd * self.scales[j].sd * covariance[i][j];
        let (x, y) = (Some(0), self.extent.width_m().map(|_| 1));
        let force = self.force_output();
        let pairs = [(x, x), (x, y), (x, force), (y, y), (y, force), (force, force)];
        let interval = |k: usize| normal_interval_95(value(k), covariance(k, k).sqrt());
        ContactEstimate {
            position: Position { x_m: value(0), y_m: y.map_or(0.0, value) },
            force_n: self.force_n.or(force.map(value)),
            uncertainty: Some(Uncertainty {
                covariance: pairs.map(|(a, b)| a.zip(b).map_or(0.0, |(i, j)| covariance(i, j))),
                x_95_m: interval(0),
                y_95_m: y.map_or((0.0, 0.0), interval),
                force_95_n: None,
            }),
        }
    }
}

impl Locate for LevenbergMarquardtLocator {
    type Check = NoCheck;

    fn locate(&self, reading: &[f64]) -> Estimate {
        match self.predict(&self.inputs.values(reading)) {
            Some((mean, covariance)) => on_surface(self.contact(&mean, &covariance), self.extent),
            None => NO_CONTACT,
        }
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.inputs.check(setup.layout().len())?;
        let sizes = &self.topology.sizes;
        let nodes = sizes.iter().map(|n| *n as f64);
        LocatorFault::check_numbers("layer", nodes, |n| n >= 1.0, "at least 1 node")?;
        LocatorFault::check_numbers("count of layers", [sizes.len() as f64], |n| n >= 2.0, "at least 2")?;
        LocatorFault::check_count("inputs", self.inputs.axes.len(), self.topology.inputs())?;
        LocatorFault::check_count("outputs", self.scales.len(), self.topology.outputs())?;
        let axes = self.extent.dimensions();
        let most = axes + usize::from(self.force_n.is_none());
        LocatorFault::check_count("outputs", self.scales.len().clamp(axes, most), self.scales.len())?;
        let scales = self.scales.iter().map(|s| s.mean);
        LocatorFault::check_numbers("output mean", scales, |_| true, "a finite number")?;
        let scales = self.scales.iter().map(|s| s.sd);
        LocatorFault::check_numbers("output scale", scales, |sd| sd > 0.0, "greater than 0")?;
        let members = [self.members.len() as f64];
        LocatorFault::check_numbers("count of members", members, |n| n >= 1.0, "at least 1")?;
        self.members.iter().try_for_each(|member| self.check_member(member))
    }
}

impl LevenbergMarquardtLocator {
    fn check_member(&self, member: &Member) -> Result<(), LocatorFault> {
        let weights = self.topology.checked_weight_count().unwrap_or(usize::MAX);
        LocatorFault::check_count("weights", weights, member.weights.len())?;
        let (needed, found) = (weights.saturating_mul(weights + 1) / 2, member.curvature_factor.len());
        LocatorFault::check_count("curvature numbers", needed, found)?;
        LocatorFault::check_count("noise variances", self.scales.len(), member.noise.len())?;
        let finite = member.weights.iter().chain(&member.curvature_factor);
        LocatorFault::check_numbers("weight or curvature", finite, |_| true, "a finite number")?;
        let pivots = (0..weights).map(|i| member.curvature_factor[i * (i + 3) / 2]);
        LocatorFault::check_numbers("curvature pivot", pivots, |d| d > 0.0, "greater than 0")?;
        LocatorFault::check_numbers("noise variance", &member.noise, |v| v >= 0.0, "at least 0")
    }
}

#[cfg(test)]
mod tests;
