//! From a recording to a locator.

use palpate_numerics::watch::{Cancelled, Watch};
use std::collections::HashMap;

use ndarray::{Array1, Array2};

use super::misfit::misfit;
use super::noise::Noise;
use super::posterior::Posterior;
use super::{Axis, MeasuredError, MeasuredInfluence, MeasuredLocator, NuisanceRole, Scale, Table, Whitening};
use crate::fit::{Fit, FitTask};
use crate::recording::Recording;
use crate::setup::Setup;
use palpate_mechanics::surface::Extent;
use palpate_numerics::chi_squared_bound;
use palpate_numerics::regression::{GaussianProcess, Regression, Samples};

/// Distinct positions without which a reading cannot be a function of anything.
const LEAST_POSITIONS: usize = 2;
/// Most nodes along a one-dimensional surface, along either axis of a plane, and along the nuisance coordinate.
const MOST_ALONG: usize = 400;
const MOST_OF_PLANE: usize = 80;
const MOST_HIDDEN: usize = 64;
const MOST_HIDDEN_OF_PLANE: usize = 16;
/// The least variance of noise, over the signal's.
const LEAST_NOISE: f64 = 1e-10;

impl Fit for MeasuredInfluence {
    type Method = MeasuredLocator;
    type Error = MeasuredError;

    fn fit_method(&self, task: FitTask) -> Result<MeasuredLocator, MeasuredError> {
        let FitTask { setup, recording, seed, watch } = task;
        recording.check_distinct_positions(LEAST_POSITIONS)?;
        let (role, nuisance) = nuisance_coordinate(setup, recording)?;
        let presses = Presses::of(self, setup, recording, nuisance.as_deref())?;
        let samples = Samples {
            coordinates: presses.coordinates.view(),
            outputs: presses.means.view(),
            noise_variance: None,
        };
        let regression =
            Regression { kernel: self.kernel, trend: self.trend, search_points: self.search_points, seed };
        let process = regression.fit(samples, watch)?;
        let whitening = presses.whitening(&process, role)?;
        // What repeats itself at a place, but not at its neighbours, is noise to a contact between them.
        let whitening = match misfit(&presses, &regression, &process, &whitening)? {
            Some(factor) => whitening.widened(factor),
            None => whitening,
        };
        let axes = presses.axes(&process, setup);
        let coarse = presses.table(axes, &process, &whitening, watch)?;
        let finer = presses.finer(axes, coarse.too_coarse());
        let table = if finer == axes { coarse } else { presses.table(finer, &process, &whitening, watch)? };
        // Nearly noiseless readings are compared no more sharply than the table's finest cut can tell.
        let factor = table.too_coarse();
        let (table, whitening) = (table.widened(factor), whitening.widened(factor));
        let mut locator = MeasuredLocator {
            readings: presses.readings,
            whitening,
            table,
            role,
            nuisance: presses.nuisance,
            residual_limit: f64::INFINITY,
            force_n: setup.force_n,
        };
        locator.residual_limit = residual_limit(&locator, recording);
        Ok(locator)
    }
}

/// What shapes the readings besides the position, row by row: the named column, or a force that is not always the same.
fn nuisance_coordinate(
    setup: &Setup,
    recording: &Recording,
) -> Result<(NuisanceRole, Option<Vec<f64>>), MeasuredError> {
    let all = |what, values: Vec<Option<f64>>| {
        if values.iter().all(Option::is_none) {
            return Ok(None);
        }
        let known = values
            .iter()
            .enumerate()
            .map(|(i, value)| value.ok_or(MeasuredError::NuisanceMissing { what, row: i + 1 }));
        known.collect::<Result<Vec<f64>, _>>().map(Some)
    };
    let named = all("nuisance coordinate", recording.rows.iter().map(|row| row.nuisance).collect())?;
    if named.is_some() {
        return Ok((NuisanceRole::Other, named));
    }
    // A force that is known, or always the same, shapes nothing.
    if setup.force_n.is_some() {
        return Ok((NuisanceRole::None, None));
    }
    let force = all("force", recording.rows.iter().map(|row| row.force_n).collect())?;
    Ok((if force.is_some() { NuisanceRole::Force } else { NuisanceRole::None }, force))
}

/// The recording as the process sees it: repeats of a press, at the same position and nuisance coordinate, are one.
///
/// What of a place repeats itself but is not smooth (the surface's texture, a press a little off) is noise to
/// interpolation, and its process finds it; how repeats scatter about their mean is the noise of a reading.
pub(super) struct Presses {
    readings: Scale,
    nuisance: Scale,
    /// Position along, across where the surface has a width, and hidden where there is one: n×d.
    pub coordinates: Array2<f64>,
    /// Mean scaled readings, n×m.
    pub means: Array2<f64>,
    /// To which press each row belongs.
    pub places: Vec<usize>,
    /// Scaled readings, row by row.
    pub outputs: Array2<f64>,
    pub has_nuisance: bool,
}

impl Presses {
    fn of(
        config: &MeasuredInfluence,
        setup: &Setup,
        recording: &Recording,
        nuisance: Option<&[f64]>,
    ) -> Result<Self, MeasuredError> {
        let rows = &recording.rows;
        let values = || rows.iter().flat_map(|row| row.reading.iter().copied());
        let readings = config.readings.unwrap_or_else(|| Scale::for_values(values()));
        let nuisance_values = || nuisance.unwrap_or_default().iter().copied();
        let nuisance_scale = config.nuisance.unwrap_or_else(|| Scale::for_values(nuisance_values()));

        let channels = rows.first().map_or(0, |row| row.reading.len());
        let mut outputs = Array2::zeros((rows.len(), channels));
        for ((i, j), output) in outputs.indexed_iter_mut() {
            *output = scaled(readings, "a reading", i, rows[i].reading[j])?;
        }
        let extent = setup.surface.extent();
        let mut distinct: Vec<Vec<f64>> = Vec::new();
        let mut known: HashMap<Vec<u64>, usize> = HashMap::new();
        let mut places = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let mut at: Vec<f64> = extent.coordinates_m(row.position).collect();
            if let Some(nuisance) = nuisance {
                at.push(scaled(nuisance_scale, "the nuisance coordinate", i, nuisance[i])?);
            }
            let bits = at.iter().map(|value| (value + 0.0).to_bits()).collect();
            places.push(*known.entry(bits).or_insert_with(|| {
                distinct.push(at);
                distinct.len() - 1
            }));
        }
        let coordinates =
            Array2::from_shape_fn((distinct.len(), distinct.first().map_or(0, Vec::len)), |(i, k)| {
                distinct[i][k]
            });
        let mut means = Array2::<f64>::zeros((distinct.len(), channels));
        let mut counts = vec![0.0; distinct.len()];
        for (place, output) in places.iter().zip(outputs.outer_iter()) {
            means.row_mut(*place).scaled_add(1.0, &output);
            counts[*place] += 1.0;
        }
        for (mut mean, count) in means.outer_iter_mut().zip(counts) {
            mean /= count;
        }
        let has_nuisance = nuisance.is_some();
        Ok(Self { readings, nuisance: nuisance_scale, coordinates, means, places, outputs, has_nuisance })
    }

    /// The noise from repeats, or what the process calls noise where there are too few; the signal from the process.
    fn whitening(&self, process: &GaussianProcess, role: NuisanceRole) -> Result<Whitening, MeasuredError> {
        let channels = self.means.ncols();
        let with_gain = role == NuisanceRole::None && self.readings == Scale::Linear;
        let signal: Array1<f64> = (0..channels).map(|j| process.signal_variance(j)).collect();
        // A channel that is dead, or never errs, must not make the noise singular.
        let most = signal.iter().copied().fold(0.0, f64::max);
        let floor: Vec<f64> = signal
            .iter()
            .map(|signal| if most > 0.0 { LEAST_NOISE * signal.max(LEAST_NOISE * most) } else { 1.0 })
            .collect();
        let repeats = Noise::of_repeats(&self.places, &self.outputs, &self.means, &floor, with_gain)?;
        let fitted = || {
            let variances = (0..channels).map(|j| process.noise_variance(j).unwrap_or_default() + floor[j]);
            Noise { covariance: Array2::from_diag(&Array1::from_iter(variances)), gain: 0.0 }
        };
        Ok(Whitening::of(repeats.unwrap_or_else(fitted), &Array2::from_diag(&signal))?)
    }

    /// The process at every node.
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
        let (mut mean, mut variance) = (vec![0.0; channels], vec![0.0; channels]);
        let mut white = vec![0.0; channels];
        let signal = process.signal_variance(0);
        for node in 0..nodes {
            if node % 64 == 0 {
                watch.round()?;
            }
            let place = node / nuisance.count;
            let mut at = vec![x.at((place / y.count) as f64)];
            at.extend(
                (process.coordinates() - usize::from(self.has_nuisance) == 2)
                    .then(|| y.at((place % y.count) as f64)),
            );
            at.extend(self.has_nuisance.then(|| nuisance.at((node % nuisance.count) as f64)));
            process.predict_into(&at, &mut mean, &mut variance, &mut scratch);
            whitening.apply(&mean, &mut white);
            means.extend_from_slice(&white);
            variances.push(if signal > 0.0 { variance[0] / signal } else { 0.0 });
        }
        Ok(Table::new(axes, means, variances, channels))
    }

    /// The axes of position with about `factor` times the nodes, as far as there may be so many.
    fn finer(&self, [x, y, nuisance]: [Axis; 3], factor: f64) -> [Axis; 3] {
        let most = if y.count > 1 { MOST_OF_PLANE } else { MOST_ALONG };
        [x.finer(factor, most), y.finer(factor, most), nuisance]
    }

    fn axes(&self, process: &GaussianProcess, setup: &Setup) -> [Axis; 3] {
        let extent = setup.surface.extent();
        let lengths = &process.hyperparameters().length_scales;
        let axis = |k: usize, bounds, most| {
            let values = self.coordinates.column(k).to_vec();
            Axis::over(values, bounds, lengths[k], most)
        };
        let (most, most_nuisance) = match extent {
            Extent::Line { .. } => (MOST_ALONG, MOST_HIDDEN),
            Extent::Plane { .. } => (MOST_OF_PLANE, MOST_HIDDEN_OF_PLANE),
        };
        let everywhere = (f64::NEG_INFINITY, f64::INFINITY);
        let along = axis(0, (0.0, extent.length_m()), most);
        let across = extent.width_m().map(|width_m| axis(1, (0.0, width_m), MOST_OF_PLANE));
        let nuisance =
            self.has_nuisance.then(|| axis(self.coordinates.ncols() - 1, everywhere, most_nuisance));
        [along, across.unwrap_or(Axis::NONE), nuisance.unwrap_or(Axis::NONE)]
    }
}

fn scaled(scale: Scale, what: &'static str, row: usize, value: f64) -> Result<f64, MeasuredError> {
    scale.of(value).ok_or(MeasuredError::NoLogarithm { what, row: row + 1, value })
}

/// The squared residual that a contact's reading hardly ever has: what one in a million would leave of normal noise,
/// and at least twice what one in a hundred of the recording's own readings leaves, as real noise has longer tails.
fn residual_limit(locator: &MeasuredLocator, recording: &Recording) -> f64 {
    /// Readings that are tried.
    const TRIED: usize = 400;
    let table = &locator.table;
    let fitted = [table.x, table.y, table.nuisance].iter().filter(|axis| axis.count > 1).count();
    let freedom = locator.whitening.channels().saturating_sub(fitted).max(1);
    let every = recording.rows.len().div_ceil(TRIED);
    let tried = recording.rows.iter().step_by(every);
    let mut residuals: Vec<f64> = tried
        .filter_map(|row| locator.whitened(&row.reading))
        .map(|reading| Posterior::of(locator, &reading).residual())
        .filter(|residual| residual.is_finite())
        .collect();
    residuals.sort_by(f64::total_cmp);
    let usual = residuals.get(residuals.len() * 99 / 100).copied().unwrap_or(0.0);
    chi_squared_bound(1e-6, freedom).max(2.0 * usual)
}
