//! The posterior as its formula says: the likelihood summed over every part of every cell, integrated along every stretch of the nuisance
//! coordinate.

use super::super::MeasuredLocator;
use crate::influence::grid::{parts_of, weights_around};
use palpate_numerics::normal_between;
use std::f64::consts::PI;

/// Mean, covariance and least residual of a posterior.
#[derive(Clone, Copy, Debug)]
pub struct Posterior {
    pub mean_m: [f64; 2],
    /// xx, xy and yy.
    pub covariance_m2: [f64; 3],
    pub residual: f64,
}

/// The posterior of a reading, every cell cut into so many parts along each axis.
pub fn posterior(locator: &MeasuredLocator, reading: &[f64], parts: usize) -> Posterior {
    let table = &locator.table;
    let whitened = locator.whitened(reading).unwrap();
    let axes = [table.x, table.y];
    let places: Vec<(f64, f64)> =
        (0..table.places()).flat_map(|place| parts_of(axes, parts, place)).collect();
    let stretches: Vec<Vec<(f64, f64)>> =
        places.iter().map(|&at| stretches(locator, &whitened, at)).collect();
    let residual = stretches.iter().flatten().map(|(residual, _)| *residual).fold(f64::INFINITY, f64::min);
    let mut sums = [0.0; 6];
    for ((x, y), stretches) in places.into_iter().zip(stretches) {
        let weight: f64 =
            stretches.iter().map(|(across, length)| (-0.5 * (across - residual)).exp() * length).sum();
        let (x, y) = (table.x.value(x), table.y.value(y));
        for (sum, value) in sums.iter_mut().zip([1.0, x, y, x * x, x * y, y * y]) {
            *sum += weight * value;
        }
    }
    let [_, x, y, xx, xy, yy] = sums.map(|sum| sum / sums[0]);
    Posterior { mean_m: [x, y], covariance_m2: [xx - x * x, xy - x * y, yy - y * y], residual }
}

/// Of every stretch of a place the least residual, and the integral over it relative to that.
fn stretches(locator: &MeasuredLocator, whitened: &[f64], at: (f64, f64)) -> Vec<(f64, f64)> {
    let (table, noise) = (&locator.table, &locator.whitening);
    let (channels, nodes) = (whitened.len(), table.nuisance.count);
    let node = |k: usize| {
        let (mut mean, mut variance) = (vec![0.0; channels], 0.0);
        for (place, weight) in weights_around([table.x, table.y], at) {
            let node = place * nodes + k;
            variance += weight * table.variances[node];
            let means = &table.means[node * channels..(node + 1) * channels];
            mean.iter_mut().zip(means).for_each(|(sum, value)| *sum += weight * value);
        }
        (mean, f64::max(variance, 0.0))
    };
    let along = (0..nodes).map(node).collect::<Vec<_>>();
    let stretch = |k: usize| {
        let ((from, v), (to, w)) = (&along[k], &along[(k + 1).min(nodes - 1)]);
        let [mut aa, mut ad, mut dd, mut mm, mut ma] = [0.0; 5];
        for c in 0..channels {
            let variance = 1.0 + 0.5 * (v + w) * noise.signal[c];
            let (a, d) = (whitened[c] - from[c], to[c] - from[c]);
            aa += a * a / variance;
            ad += a * d / variance;
            dd += d * d / variance;
            mm += from[c] * from[c] / variance;
            ma += from[c] * a / variance;
        }
        let gain2 = noise.gain * noise.gain;
        aa -= gain2 * ma * ma / (1.0 + gain2 * mm);
        let length = dd.sqrt();
        if length < 1e-4 {
            return (aa.max(0.0), 1.0);
        }
        let foot = (ad / dd).clamp(0.0, 1.0);
        let least = aa - 2.0 * foot * ad + foot * foot * dd;
        let part = normal_between(-ad / length, length - ad / length);
        let across = aa - ad * ad / dd;
        let integral = (part.share.ln() + 0.5 * (least - across)).exp();
        (least, if part.share > 0.0 { (2.0 * PI).sqrt() / length * integral } else { 0.0 })
    };
    (0..nodes.saturating_sub(1).max(1)).map(stretch).collect()
}
