//! The Cramér–Rao bound of patches: what no unbiased estimator of their centres and forces can beat.

use ndarray::Array2;
use serde::Serialize;

use super::LoadSensors;
use palpate_mechanics::surface::UniformLoad;
use palpate_numerics::Cholesky;

/// Least standard deviations for one of several patches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PatchLimit {
    /// Of its centre along x, in metres.
    pub sd_x_m: f64,
    /// Of its centre along y, in metres; 0 on a line.
    pub sd_y_m: f64,
    /// Of its force, in newtons.
    pub sd_force_n: f64,
}

/// The limits of patches that are each loaded evenly, of known number and sizes: the diagonal of the inverse of the Fisher
/// information Σ_i ∇m_i·∇m_iᵀ/σ_i², where m_i is what sensor i reads of all patches and ∇ goes over all centres and forces
/// (Kay, *Fundamentals of Statistical Signal Processing: Estimation Theory*, 1993, section 3.9). `None` where the readings do
/// not tell them all.
pub fn patch_limits(sensors: &LoadSensors, loads: &[UniformLoad]) -> Option<Vec<PatchLimit>> {
    let plane = sensors.extent.width_m.is_some();
    let each = if plane { 3 } else { 2 };
    let alive: Vec<_> = sensors.alive().collect();
    let mut slopes = Array2::zeros((alive.len(), each * loads.len()));
    for (channel, mut row) in alive.iter().zip(slopes.outer_iter_mut()) {
        for (number, load) in loads.iter().enumerate() {
            let [along, across] = load.mean_gradient(&*channel.influence);
            let first = each * number;
            row[first] = load.mean(&*channel.influence) / channel.noise_sd;
            row[first + 1] = load.force_n * along / channel.noise_sd;
            if plane {
                row[first + 2] = load.force_n * across / channel.noise_sd;
            }
        }
    }
    // Columns of length 1, so that newtons and metres weigh alike.
    let lengths: Vec<f64> = slopes.columns().into_iter().map(|column| column.dot(&column).sqrt()).collect();
    for (mut column, length) in slopes.columns_mut().into_iter().zip(&lengths) {
        column /= *length;
    }
    let inverse = Cholesky::factor(slopes.t().dot(&slopes)).ok()?.inverse();
    let sd = |parameter: usize| inverse[[parameter, parameter]].sqrt() / lengths[parameter];
    let limit = |number: usize| {
        let first = each * number;
        let sd_y_m = if plane { sd(first + 2) } else { 0.0 };
        PatchLimit { sd_x_m: sd(first + 1), sd_y_m, sd_force_n: sd(first) }
    };
    Some((0..loads.len()).map(limit).collect())
}
