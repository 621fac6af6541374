//! Fit of a measured surface.

use super::config::{MeasuredError, MeasuredInfluence, Scale};
use super::locator::{MeasuredContents, MeasuredLocator, NuisanceRole};
use super::presses::{Presses, nuisance_coordinates};
use super::table::Table;
use crate::fit::{Fit, FitTask};
use crate::influence::grid::Axis;
use crate::influence::inversion::{Layers, Stencil};
use crate::influence::noise::{Noise, Whitening};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::status::{chi_squared_bound, recording_bounds};
use crate::thinning::thinned;
use ndarray::{Array1, Array2, s};
use palpate_mechanics::surface::Extent;
use palpate_numerics::regression::{GaussianProcess, Regression, Samples};
use palpate_numerics::small::Ldl;
use palpate_numerics::watch::{Cancelled, Watch};
use std::cmp::Ordering;

const LEAST_POSITIONS: usize = 2;
const MOST_ALONG: usize = 400;
const MOST_OF_PLANE: usize = 80;
const MOST_OF_NUISANCE: usize = 64;
const MOST_OF_NUISANCE_OF_PLANE: usize = 16;
/// Tolerated interpolation error over the noise.
const MOST_MISSED: f64 = 0.2;
/// Least noise variance over the signal's.
const LEAST_NOISE: f64 = 1e-10;

pub(crate) const fn most_nodes(extent: Extent) -> usize {
    match extent {
        Extent::Line { .. } => MOST_ALONG,
        Extent::Plane { .. } => MOST_OF_PLANE * MOST_OF_PLANE,
    }
}

pub(crate) const fn most_nuisance_nodes(extent: Extent) -> usize {
    match extent {
        Extent::Line { .. } => MOST_OF_NUISANCE,
        Extent::Plane { .. } => MOST_OF_NUISANCE_OF_PLANE,
    }
}

impl Fit for MeasuredInfluence {
    type Method = MeasuredLocator;
    type Error = MeasuredError;

    fn fit_method(&self, task: FitTask) -> Result<MeasuredLocator, MeasuredError> {
        let FitTask { setup, recording, seed, watch, .. } = task;
        recording.check_distinct_positions(LEAST_POSITIONS)?;
        let (role, nuisances) = nuisance_coordinates(setup, recording)?;
        let presses = Presses::average(self, setup, recording, &nuisances)?;
        let samples = Samples {
            coordinates: presses.coordinates.view(),
            outputs: presses.means.view(),
            noise_variance: None,
        };
        let regression =
            Regression { kernel: self.kernel, trend: self.trend, search_points: self.search_points, seed };
        let process = regression.fit(samples, watch)?;
        let whitening = presses.whitening(&regression, &process, role, watch)?;
        let axes = presses.axes(&process, setup);
        let mut table = presses.table(axes, &process, &whitening, watch)?;
        let mut missed = presses.missed(&table, &process, &whitening);
        let finer = presses.finer(axes, missed);
        if finer != axes {
            table = presses.table(finer, &process, &whitening, watch)?;
            missed = presses.missed(&table, &process, &whitening);
        }
        // Interpolation errors of the table count as noise.
        let factor = missed[0].hypot(missed[1]).hypot(1.0);
        let locator = MeasuredContents {
            readings: presses.readings,
            whitening: whitening.widened(factor),
            table: table.widened(factor),
            role,
            nuisance: presses.nuisance,
            residual_limit: f64::INFINITY,
            force_n: setup.force_n(),
            missing: Vec::new(),
        }
        .into_locator();
        let limit = residual_limit(&locator, recording);
        Ok(locator.with_residual_limit(limit))
    }
}

impl Presses {
    fn whitening(
        &self,
        regression: &Regression,
        process: &GaussianProcess,
        role: NuisanceRole,
        watch: Watch,
    ) -> Result<Whitening, MeasuredError> {
        let signal =
            Array2::from_diag(&Array1::from_shape_fn(self.means.ncols(), |j| process.signal_variance(j)));
        let noise = self.noise(process, role)?;
        let known = Whitening::from_covariances(noise.clone(), &signal)?;
        // Texture that repeats at a position, but not at its neighbours, is noise to a contact between them.
        let factor = misfit(self, regression, process, &known, watch)?.unwrap_or(1.0);
        if self.further.is_empty() {
            return Ok(known.widened(factor));
        }
        let square = factor * factor;
        let covariance = noise.covariance * square + self.covariance_of_further(process);
        let noise = Noise { covariance, gain: noise.gain * factor };
        Ok(Whitening::from_covariances(noise, &(signal * square))?)
    }

    /// Covariance by unknown further nuisance coordinates, to first order: the mean of Σ s²·J·Jᵀ, with
    /// variances s² and derivatives J.
    fn covariance_of_further(&self, process: &GaussianProcess) -> Array2<f64> {
        const TRIED: usize = 1000;
        let (channels, d) = (process.outputs(), process.coordinates());
        let (mut means, mut gradients) = (vec![0.0; channels], vec![0.0; channels * d]);
        let mut scratch = process.scratch();
        let mut sum = Array2::<f64>::zeros((channels, channels));
        let tried = thinned(self.coordinates.nrows(), TRIED);
        let count = tried.len() as f64;
        for at in tried.map(|i| self.coordinates.row(i)) {
            process.mean_and_gradient_into(&at.to_vec(), &mut means, &mut gradients, &mut scratch);
            for (k, further) in (self.searched()..d).zip(&self.further) {
                let slope = |channel: usize| gradients[channel * d + k];
                for ((i, j), sum) in sum.indexed_iter_mut() {
                    *sum += further.variance * slope(i) * slope(j);
                }
            }
        }
        sum / count
    }

    /// Noise by repeats, or by the process with too few.
    fn noise(&self, process: &GaussianProcess, role: NuisanceRole) -> Result<Noise, MeasuredError> {
        let channels = self.means.ncols();
        let with_gain = role == NuisanceRole::None && self.readings == Scale::Linear;
        let signal: Array1<f64> = (0..channels).map(|j| process.signal_variance(j)).collect();
        // A missing or error-free channel must not make the noise singular.
        let most = signal.iter().copied().fold(0.0, f64::max);
        let floor: Vec<f64> = signal
            .iter()
            .map(|signal| if most > 0.0 { LEAST_NOISE * signal.max(LEAST_NOISE * most) } else { 1.0 })
            .collect();
        let repeats = Noise::of_repeats(&self.places, &self.outputs, &self.means, &floor, with_gain)?;
        let fitted = || {
            // Outputs of the process are means of this many rows.
            let rows = self.outputs.nrows() as f64 / self.means.nrows() as f64;
            let variances =
                (0..channels).map(|j| rows * process.noise_variance(j).unwrap_or_default() + floor[j]);
            Noise { covariance: Array2::from_diag(&Array1::from_iter(variances)), gain: 0.0 }
        };
        Ok(repeats.unwrap_or_else(fitted))
    }

    fn table(
        &self,
        axes: [Axis; 3],
        process: &GaussianProcess,
        whitening: &Whitening,
        watch: Watch,
    ) -> Result<Table, Cancelled> {
        let [x, y, nuisance] = axes;
        let channels = self.means.ncols();
        let nodes = x.count * y.count * nuisance.count;
        let (mut means, mut variances) = (Vec::with_capacity(nodes * channels), Vec::with_capacity(nodes));
        let mut scratch = process.scratch();
        let (mut mean, mut white) = (vec![0.0; channels], vec![0.0; channels]);
        for node in 0..nodes {
            if node % 64 == 0 {
                watch.round()?;
            }
            let (place, along_line) = (node / nuisance.count, node % nuisance.count);
            let at = [place / y.count, place % y.count, along_line].map(|node| node as f64);
            variances.push(process.tabulate_into(&self.coordinates_at(axes, at), &mut mean, &mut scratch));
            whitening.apply(&mean, &mut white);
            means.extend_from_slice(&white);
        }
        Ok(Table { x, y, nuisance, means, variances })
    }

    /// Coordinates at node `at`, with further nuisance coordinates at their means.
    fn coordinates_at(&self, [x, y, nuisance]: [Axis; 3], at: [f64; 3]) -> Vec<f64> {
        let mut coordinates = vec![x.value(at[0])];
        coordinates.extend((self.dimensions() == 2).then(|| y.value(at[1])));
        coordinates.extend(self.has_nuisance.then(|| nuisance.value(at[2])));
        coordinates.extend(self.further.iter().map(|further| further.mean));
        coordinates
    }

    /// Interpolation error over the noise: between positions, and between nuisance nodes.
    fn missed(&self, table: &Table, process: &GaussianProcess, whitening: &Whitening) -> [f64; 2] {
        const TRIED: usize = 300;
        let Table { x, y, nuisance, .. } = table;
        let channels = whitening.channels();
        let layers =
            Layers::new([*x, *y], nuisance.count, channels, |place, node, c| table.mean(place, node, c));
        let half = |axis: &Axis, node: usize| node as f64 + if node + 1 < axis.count { 0.5 } else { 0.0 };
        let (mut raw, mut white, mut between) = (vec![0.0; channels], vec![0.0; channels], Vec::new());
        let mut scratch = process.scratch();
        let mut squares = [0.0; 2];
        let nodes = table.places() * nuisance.count;
        let tried = thinned(nodes, TRIED);
        for node in tried.clone() {
            let (place, k) = (node / nuisance.count, node % nuisance.count);
            let (i, j) = (place / y.count, place % y.count);
            let middles = [[half(x, i), half(y, j), k as f64], [i as f64, j as f64, half(nuisance, k)]];
            for (square, at) in squares.iter_mut().zip(middles) {
                process.mean_into(&self.coordinates_at([*x, *y, *nuisance], at), &mut raw, &mut scratch);
                whitening.apply(&raw, &mut white);
                let Stencil { first, used, weights, .. } = Stencil::new(at[2], nuisance.count);
                layers.interpolate([at[0], at[1]], first..first + used, &mut between);
                let of_nodes = between.as_flattened().chunks(between.as_flattened().len() / used);
                for (weight, mean) in weights.iter().zip(of_nodes) {
                    white.iter_mut().zip(mean).for_each(|(w, mean)| *w -= weight * mean);
                }
                *square += white.iter().map(|w| w * w).sum::<f64>();
            }
        }
        let count = (tried.len() * channels) as f64;
        squares.map(|square| (square / count).sqrt())
    }

    /// Refines axes by the fourth-order error of cubic interpolation.
    fn finer(&self, [x, y, nuisance]: [Axis; 3], missed: [f64; 2]) -> [Axis; 3] {
        let is_plane = y.count > 1;
        let (most, most_nuisance) = if is_plane {
            (MOST_OF_PLANE, MOST_OF_NUISANCE_OF_PLANE)
        } else {
            (MOST_ALONG, MOST_OF_NUISANCE)
        };
        let [places, nodes] = missed.map(|missed| (missed / MOST_MISSED).sqrt().sqrt());
        [x.finer(places, most), y.finer(places, most), nuisance.finer(nodes, most_nuisance)]
    }

    fn axes(&self, process: &GaussianProcess, setup: &Setup) -> [Axis; 3] {
        let extent = setup.surface().extent();
        let lengths = &process.hyperparameters().length_scales;
        let values = |k: usize| self.coordinates.column(k).to_vec();
        let positions = |k: usize, most| Axis::of_positions(values(k), (extent, k), lengths[k], most);
        let [along, across] = match extent {
            Extent::Line { .. } => [positions(0, MOST_ALONG), Axis::NONE],
            Extent::Plane { .. } => [0, 1].map(|k| positions(k, MOST_OF_PLANE)),
        };
        let first = self.dimensions();
        let nuisance =
            self.has_nuisance.then(|| Axis::over(values(first), lengths[first], most_nuisance_nodes(extent)));
        [along, across, nuisance.unwrap_or(Axis::NONE)]
    }
}

fn residual_limit(locator: &MeasuredLocator, recording: &Recording) -> f64 {
    let freedom = locator.table().freedom(locator.whitening().channels());
    let [limit] =
        recording_bounds([chi_squared_bound(freedom)], recording, |reading| [locator.misfit(reading)]);
    limit
}

/// Positions from which every fifth is held out; with fewer, each inner one in turn.
const MANY_TO_JUDGE: usize = 15;
const LEAST_TO_JUDGE: usize = 5;
/// With fewer rows, a factor below 1 is unreliable.
const FACTORS: (f64, f64) = (1.0, 5.0);

/// Overdispersion of held-out position errors, as a standard-deviation factor; `None` with too few positions.
///
/// For a residual r of covariance V and derivatives J by the coordinates, the error is δ =
/// (Jᵀ·V⁻¹·J)⁻¹·Jᵀ·V⁻¹·r with covariance (Jᵀ·V⁻¹·J)⁻¹. The factor is the root mean square of standardized
/// position errors.
pub(super) fn misfit(
    presses: &Presses,
    regression: &Regression,
    process: &GaussianProcess,
    whitening: &Whitening,
    watch: Watch,
) -> Result<Option<f64>, MeasuredError> {
    let (dimensions, searched) = (presses.dimensions(), presses.searched());
    let (mut square, mut count) = (0.0, 0);
    for held in held_out(presses, dimensions) {
        let kept: Vec<usize> = (0..held.len()).filter(|i| !held[*i]).collect();
        let coordinates = presses.coordinates.select(ndarray::Axis(0), &kept);
        let means = presses.means.select(ndarray::Axis(0), &kept);
        let samples =
            Samples { coordinates: coordinates.view(), outputs: means.view(), noise_variance: None };
        let other = regression.condition(samples, process.hyperparameters(), watch)?;

        let mut known: Vec<Option<Prediction>> = vec![None; held.len()];
        for (place, output) in presses.places.iter().zip(presses.outputs.outer_iter()) {
            if !held[*place] {
                continue;
            }
            let at = presses.coordinates.row(*place).to_vec();
            let prediction =
                known[*place].get_or_insert_with(|| Prediction::new(&other, &at, searched, whitening));
            if let Some(score) = prediction.score(&output.to_vec(), whitening, dimensions) {
                square += score;
                count += dimensions;
            }
        }
    }
    let factor = (square / count as f64).sqrt();
    Ok(factor.is_finite().then(|| factor.clamp(FACTORS.0, FACTORS.1)))
}

fn held_out(presses: &Presses, dimensions: usize) -> Vec<Vec<bool>> {
    let places: Vec<Vec<f64>> =
        presses.coordinates.outer_iter().map(|at| at.slice(s![..dimensions]).to_vec()).collect();
    let order = |a: &Vec<f64>, b: &Vec<f64>| {
        a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
    };
    let mut positions = places.clone();
    positions.sort_by(order);
    positions.dedup();
    let index = |place: &Vec<f64>| positions.partition_point(|other| order(other, place).is_lt());
    let of_index =
        |is_held: &dyn Fn(usize) -> bool| places.iter().map(|place| is_held(index(place))).collect();
    match positions.len() {
        ..LEAST_TO_JUDGE => Vec::new(),
        count @ ..MANY_TO_JUDGE => (1..count - 1).map(|held| of_index(&|index| index == held)).collect(),
        _ => vec![of_index(&|index| index % 5 == 2)],
    }
}

#[derive(Clone, Debug)]
struct Prediction {
    mean: Vec<f64>,
    /// J by coordinates.
    slopes: Vec<Vec<f64>>,
    /// v.
    variance: f64,
}

impl Prediction {
    /// Slopes are by the first `searched` coordinates; the others are known.
    fn new(process: &GaussianProcess, at: &[f64], searched: usize, whitening: &Whitening) -> Self {
        let (channels, d) = (process.outputs(), process.coordinates());
        let (raw, variances) = process.predict(at);
        let (mut unused, mut gradients) = (vec![0.0; channels], vec![0.0; channels * d]);
        process.mean_and_gradient_into(at, &mut unused, &mut gradients, &mut process.scratch());
        let white = |values: &[f64]| {
            let mut white = vec![0.0; channels];
            whitening.apply(values, &mut white);
            white
        };
        let slope = |k: usize| white(&gradients.iter().skip(k).step_by(d).copied().collect::<Vec<f64>>());
        let signal = process.signal_variance(0);
        let variance = if signal > 0.0 { variances[0] / signal } else { 0.0 };
        Self { mean: white(&raw), slopes: (0..searched).map(slope).collect(), variance }
    }

    /// Squared standardized error; `None` where the position is unidentifiable.
    fn score(&self, output: &[f64], whitening: &Whitening, dimensions: usize) -> Option<f64> {
        let mut residual = vec![0.0; output.len()];
        whitening.apply(output, &mut residual);
        residual.iter_mut().zip(&self.mean).for_each(|(r, mean)| *r -= mean);
        let (mut information, mut score) = ([[0.0; 3]; 3], [0.0; 3]);
        for (i, slope) in self.slopes.iter().enumerate() {
            score[i] = self.product(slope, &residual, whitening);
            for (j, other) in self.slopes.iter().enumerate() {
                information[i][j] = self.product(slope, other, whitening);
            }
        }
        let factors = Ldl::of_free(&information, std::array::from_fn(|i| i < self.slopes.len()))?;
        let of_position = Ldl::of_free(&factors.inverse(), std::array::from_fn(|i| i < dimensions))?;
        let score = of_position.quadratic(factors.solve(score));
        score.is_finite().then_some(score)
    }

    /// aᵀ·V⁻¹·b, with V = I + v·diag(d) + γ²·μ·μᵀ.
    fn product(&self, a: &[f64], b: &[f64], whitening: &Whitening) -> f64 {
        let diagonal = |a: &[f64], b: &[f64]| -> f64 {
            let products = a.iter().zip(b).zip(&whitening.signal);
            products.map(|((a, b), signal)| a * b / (1.0 + self.variance * signal)).sum()
        };
        let gain2 = whitening.gain * whitening.gain;
        let growth = 1.0 + gain2 * diagonal(&self.mean, &self.mean);
        diagonal(a, b) - gain2 * diagonal(a, &self.mean) * diagonal(b, &self.mean) / growth
    }
}
