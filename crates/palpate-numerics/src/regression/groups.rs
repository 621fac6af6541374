//! Samples, checked and grouped by distinct points.

use std::cmp::Ordering;

use ndarray::{Array2, ArrayView1, ArrayView2, Axis};

use super::RegressionError;

/// Samples of n rows.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// x, n×d, finite.
    pub coordinates: ArrayView2<'a, f64>,
    /// y, n×m, finite.
    pub outputs: ArrayView2<'a, f64>,
    /// Noise variance of every row; `None` to fit it.
    pub noise_variance: Option<&'a [f64]>,
}

/// Distinct points.
///
/// Rows of relative noise v_r collapse to precision p = Σ 1/v_r, mean ȳ = Σ y_r/v_r / p and scatter Σ
/// (y_r − ȳ)²/v_r.
#[derive(Clone, Debug)]
pub(super) struct Groups {
    pub coordinates: Array2<f64>,
    /// Mean of each coordinate.
    pub centre: Vec<f64>,
    /// Standard deviation, or 1.
    pub standard_deviations: Vec<f64>,
    /// ȳ, n×m, standardized.
    pub means: Array2<f64>,
    pub scatter: Array2<f64>,
    pub precision: Vec<f64>,
    pub rows: Vec<usize>,
    /// Σ ln v_r.
    pub log_variance: Vec<f64>,
    /// Mean of each output.
    pub offset: Vec<f64>,
    /// Divisor of each output; 1 for given noise.
    pub scale: Vec<f64>,
    pub noise_given: bool,
}

/// Rounding error, relative to the outputs' variance.
const LEAST_VARIANCE: f64 = 1e-14;

impl Groups {
    pub fn new(samples: Samples) -> Result<Self, RegressionError> {
        check(samples)?;
        let outputs = samples.outputs;
        let (offset, variance) = moments(&outputs, Axis(1));
        let pooled = variance.iter().sum::<f64>() / variance.len() as f64;
        let scale = match samples.noise_variance {
            Some(_) => vec![1.0; variance.len()],
            None => variance.iter().map(|v| if *v > 0.0 { v.sqrt() } else { 1.0 }).collect(),
        };
        let least = if pooled > 0.0 { LEAST_VARIANCE * pooled } else { LEAST_VARIANCE };
        let relative: Vec<f64> = match samples.noise_variance {
            Some(given) => given.iter().map(|v| v.max(least)).collect(),
            None => vec![1.0; outputs.nrows()],
        };
        let standardized =
            Array2::from_shape_fn(outputs.dim(), |(r, j)| (outputs[[r, j]] - offset[j]) / scale[j]);
        let mut groups = collapse(&samples.coordinates, &standardized, &relative);
        (groups.offset, groups.scale) = (offset, scale);
        groups.noise_given = samples.noise_variance.is_some();
        Ok(groups)
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn total_rows(&self) -> usize {
        self.rows.iter().sum()
    }

    /// η/p_i for η = `ratio`.
    pub fn noise_ratios(&self, ratio: f64) -> Vec<f64> {
        self.precision.iter().map(|p| ratio / p).collect()
    }

    /// Mean square of standardized outputs.
    pub fn mean_square(&self) -> f64 {
        let weights = self.rows.iter().map(|rows| *rows as f64);
        let sum: f64 =
            self.means.outer_iter().zip(weights).map(|(y, rows)| rows * y.mapv(|y| y * y).sum()).sum();
        sum / (self.total_rows() * self.means.ncols()) as f64
    }

    pub fn subset(&self, chosen: &[usize]) -> Self {
        Self {
            coordinates: self.coordinates.select(Axis(1), chosen),
            centre: self.centre.clone(),
            standard_deviations: self.standard_deviations.clone(),
            means: self.means.select(Axis(0), chosen),
            scatter: self.scatter.select(Axis(0), chosen),
            precision: chosen.iter().map(|i| self.precision[*i]).collect(),
            rows: chosen.iter().map(|i| self.rows[*i]).collect(),
            log_variance: chosen.iter().map(|i| self.log_variance[*i]).collect(),
            offset: self.offset.clone(),
            scale: self.scale.clone(),
            noise_given: self.noise_given,
        }
    }
}

fn collapse(coordinates: &ArrayView2<f64>, outputs: &Array2<f64>, relative: &[f64]) -> Groups {
    let members = members(coordinates);
    let (count, dimensions) = (members.len(), coordinates.ncols());
    let points = Array2::from_shape_fn((dimensions, count), |(k, i)| coordinates[[members[i][0], k]]);
    let (centre, variance) = moments(&points.view(), Axis(0));
    let mut groups = Groups {
        coordinates: points,
        centre,
        standard_deviations: variance.iter().map(|v| if *v > 0.0 { v.sqrt() } else { 1.0 }).collect(),
        means: Array2::zeros((count, outputs.ncols())),
        scatter: Array2::zeros((count, outputs.ncols())),
        precision: members.iter().map(|rows| rows.iter().map(|r| 1.0 / relative[*r]).sum()).collect(),
        rows: members.iter().map(Vec::len).collect(),
        log_variance: members.iter().map(|rows| rows.iter().map(|r| relative[*r].ln()).sum()).collect(),
        offset: Vec::new(),
        scale: Vec::new(),
        noise_given: false,
    };
    for (i, rows) in members.iter().enumerate() {
        for j in 0..outputs.ncols() {
            let weighted = rows.iter().map(|r| outputs[[*r, j]] / relative[*r]);
            let mean = weighted.sum::<f64>() / groups.precision[i];
            let scatter = rows.iter().map(|r| (outputs[[*r, j]] - mean).powi(2) / relative[*r]);
            groups.means[[i, j]] = mean;
            // The scatter of a single row is 0, except for rounding.
            groups.scatter[[i, j]] = if rows.len() > 1 { scatter.sum() } else { 0.0 };
        }
    }
    groups
}

fn moments(table: &ArrayView2<f64>, axis: Axis) -> (Vec<f64>, Vec<f64>) {
    let moments = |lane: ArrayView1<f64>| {
        let count = lane.len() as f64;
        let mean = lane.sum() / count;
        let variance = lane.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        // The variance of equal values is 0, except for rounding.
        let rounding = (4.0 * f64::EPSILON * mean).powi(2);
        (mean, if variance > rounding { variance } else { 0.0 })
    };
    table.axis_iter(axis).map(moments).unzip()
}

/// Rows of distinct points, in the order of first rows.
fn members(coordinates: &ArrayView2<f64>) -> Vec<Vec<usize>> {
    // −0 and 0 are equal.
    let order = |a: &usize, b: &usize| {
        let (a, b) = (coordinates.row(*a), coordinates.row(*b));
        let by_coordinate = a.iter().zip(b).map(|(a, b)| (a + 0.0).total_cmp(&(b + 0.0)));
        by_coordinate.fold(Ordering::Equal, Ordering::then)
    };
    let mut sorted: Vec<usize> = (0..coordinates.nrows()).collect();
    sorted.sort_by(order);
    let mut members: Vec<Vec<usize>> =
        sorted.chunk_by(|a, b| order(a, b).is_eq()).map(<[usize]>::to_vec).collect();
    members.sort_by_key(|rows| rows[0]);
    members
}

fn check(samples: Samples) -> Result<(), RegressionError> {
    let (rows, coordinates) = samples.coordinates.dim();
    let outputs = samples.outputs.ncols();
    if rows == 0 || coordinates == 0 || outputs == 0 {
        return Err(RegressionError::Empty { rows, coordinates, outputs });
    }
    let count = |what, found| {
        if found == rows { Ok(()) } else { Err(RegressionError::Count { what, needed: rows, found }) }
    };
    count("rows of outputs", samples.outputs.nrows())?;
    for (what, table) in [("coordinate", samples.coordinates), ("output", samples.outputs)] {
        if let Some(((row, column), value)) = table.indexed_iter().find(|(_, value)| !value.is_finite()) {
            let (row, column, value) = (row + 1, column + 1, *value);
            return Err(RegressionError::NotFinite { what, row, column, value });
        }
    }
    let Some(given) = samples.noise_variance else { return Ok(()) };
    count("noise variances", given.len())?;
    match given.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
        Some(i) => Err(RegressionError::NoiseVariance { row: i + 1, value: given[i] }),
        None => Ok(()),
    }
}
