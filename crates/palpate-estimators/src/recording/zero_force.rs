//! Recognition of forces that are 0 except for load-cell noise.
//!
//! A gap separates untouched rows from large forces, and their forces do not explain their readings.

use super::Row;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_numerics::{chi_squared_critical_value, mean, normal_quantile};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Probability that noise exceeds the gap, and that its standard deviation is underestimated.
const LEVEL: f64 = 0.01;
/// Standard error of a share that distinguishes 0 from 1.
const MOST_UNSURE: f64 = 0.25;

/// Rows with force 0 except for noise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ZeroForce {
    /// Greatest magnitude, in newtons.
    pub zero_n: f64,
    /// Row count.
    pub rows: usize,
    /// Least force, in newtons.
    pub low_n: f64,
    /// Greatest force, in newtons.
    pub high_n: f64,
}

// No force is NaN: the reader accepts only finite numbers.
impl Eq for ZeroForce {}

impl fmt::Display for ZeroForce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let newton = |force_n: f64| SensorKind::Reaction.unit().format_si(force_n);
        write!(
            f,
            "{} rows of {} to {} N taken as untouched, as their forces are noise (`force_zero = \"{} N\"` in [recording] decides)",
            self.rows,
            newton(self.low_n),
            newton(self.high_n),
            newton(self.zero_n)
        )
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<'a> {
    pub row: &'a Row,
    /// Rows without one are not presses.
    pub has_position: bool,
}

pub(super) fn recognise(samples: &[Sample]) -> Option<ZeroForce> {
    let force = |sample: &Sample| sample.row.force_n.filter(|force_n| *force_n != 0.0);
    let mut forces_n: Vec<f64> = samples.iter().filter_map(force).map(f64::abs).collect();
    forces_n.sort_by(f64::total_cmp);
    let zero_n = gap(&forces_n)?;
    let is_small = |sample: &&Sample| force(sample).is_some_and(|force_n| force_n.abs() <= zero_n);
    let small: Vec<Sample> = samples.iter().filter(is_small).copied().collect();
    if !are_untouched(&small, samples, zero_n) {
        return None;
    }
    let small_n = || small.iter().filter_map(force);
    let (low_n, high_n) =
        (small_n().fold(f64::INFINITY, f64::min), small_n().fold(f64::NEG_INFINITY, f64::max));
    Some(ZeroForce { zero_n, rows: small.len(), low_n, high_n })
}

/// A force within the widest gap of sorted magnitudes.
///
/// Noise of k values with root mean square s reaches z·s·√(k/χ²), with z the normal quantile for all values
/// and χ² the lower quantile for k degrees of freedom. The gap must end beyond this value.
fn gap(forces_n: &[f64]) -> Option<f64> {
    let quantile = normal_quantile(1.0 - LEVEL / (2.0 * forces_n.len() as f64));
    let mut squares = 0.0;
    let gaps = forces_n.windows(2).enumerate().filter_map(|(i, pair)| {
        squares += pair[0] * pair[0];
        // A gap is at least as wide as the magnitudes below it.
        if pair[1] < 2.0 * pair[0] {
            return None;
        }
        let reach_n = quantile * (squares / chi_squared_critical_value(1.0 - LEVEL, i + 1)).sqrt();
        Some((pair[1] / reach_n, pair[0], pair[1]))
    });
    let (ratio, low_n, high_n) = gaps.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (ratio > 1.0 && ratio.is_finite()).then(|| round_within(low_n, high_n))
}

/// Least of 1, 2 and 5 times a power of ten above the geometric mean, or the mean.
fn round_within(low: f64, high: f64) -> f64 {
    let middle = low.sqrt() * high.sqrt();
    let exponent = middle.log10().floor() as i32;
    let steps = [1, 2, 5, 10].map(|digit| format!("{digit}e{exponent}").parse().unwrap_or(f64::INFINITY));
    steps.into_iter().find(|step| (middle..high).contains(step)).unwrap_or(middle)
}

/// Presses change readings by force times influence, estimated from the nearest presses: the least-squares
/// share is 1 for presses and 0 for noise. If undetermined, at least one force must have the sign that no
/// press has.
fn are_untouched(small: &[Sample], samples: &[Sample], zero_n: f64) -> bool {
    let placed: Vec<Sample> = small.iter().filter(|sample| sample.has_position).copied().collect();
    if placed.is_empty() {
        return true;
    }
    match confirmed_share(&placed, samples, zero_n) {
        Some((share, error)) if error <= MOST_UNSURE => share < 0.5,
        _ => signs_are_mixed(&placed, samples, zero_n),
    }
}

fn signs_are_mixed(placed: &[Sample], samples: &[Sample], zero_n: f64) -> bool {
    let presses_n =
        || samples.iter().filter_map(|sample| sample.row.force_n).filter(|force_n| force_n.abs() > zero_n);
    let small_n = || placed.iter().filter_map(|sample| sample.row.force_n);
    (presses_n().all(|force_n| force_n > 0.0) && small_n().any(|force_n| force_n < 0.0))
        || (presses_n().all(|force_n| force_n < 0.0) && small_n().any(|force_n| force_n > 0.0))
}

/// Share of the forces that the readings confirm, with standard error.
fn confirmed_share(placed: &[Sample], samples: &[Sample], zero_n: f64) -> Option<(f64, f64)> {
    let channels = placed.first()?.row.reading.len();
    let baseline: Vec<f64> =
        (0..channels).map(|c| mean(placed.iter().map(|sample| sample.row.reading[c]))).collect();
    let influences = Influences::new(samples, &baseline, zero_n);
    let (mut explained, mut squares) = (0.0, 0.0);
    for (c, baseline) in baseline.iter().enumerate() {
        let off: Vec<f64> = placed.iter().map(|sample| sample.row.reading[c] - baseline).collect();
        let variance = mean(off.iter().map(|off| off * off));
        let pressed: Option<Vec<f64>> = placed
            .iter()
            .map(|sample| Some(sample.row.force_n? * influences.nearest(sample.row.position)?[c]))
            .collect();
        let pressed = pressed?;
        let middle = mean(pressed.iter().copied());
        // A channel without noise is constant and has no weight.
        if variance > 0.0 {
            explained += off
                .iter()
                .zip(&pressed)
                .map(|(off, pressed)| off * (pressed - middle) / variance)
                .sum::<f64>();
            squares += pressed.iter().map(|pressed| (pressed - middle).powi(2) / variance).sum::<f64>();
        }
    }
    (squares > 0.0).then(|| (explained / squares, squares.sqrt().recip()))
}

/// Change per newton at the presses, sorted by x.
struct Influences(Vec<(Position, Vec<f64>)>);

impl Influences {
    fn new(samples: &[Sample], baseline: &[f64], zero_n: f64) -> Self {
        let is_press = |sample: &&Sample| {
            sample.has_position && sample.row.force_n.is_some_and(|force_n| force_n.abs() > zero_n)
        };
        let mut presses: Vec<&Row> = samples.iter().filter(is_press).map(|sample| sample.row).collect();
        presses.sort_by(|a, b| a.position.cmp_by_x_then_y(&b.position));
        let same = |a: &&Row, b: &&Row| a.position.cmp_by_x_then_y(&b.position).is_eq();
        let influence = |rows: &[&Row]| {
            let per_newton = |c: usize, row: &&Row| {
                row.force_n.map_or(0.0, |force_n| (row.reading[c] - baseline[c]) / force_n)
            };
            let channels = (0..baseline.len()).map(|c| mean(rows.iter().map(|row| per_newton(c, row))));
            (rows[0].position, channels.collect())
        };
        Self(presses.chunk_by(same).map(influence).collect())
    }

    fn nearest(&self, position: Position) -> Option<&[f64]> {
        let after = self.0.partition_point(|(at, _)| at.x_m < position.x_m);
        let mut best: Option<(f64, &[f64])> = None;
        let (before, after) = self.0.split_at(after);
        for side in
            [&mut before.iter().rev() as &mut dyn Iterator<Item = &(Position, Vec<f64>)>, &mut after.iter()]
        {
            for (at, influence) in side {
                let distance_m = (at.x_m - position.x_m).hypot(at.y_m - position.y_m);
                if best.is_some_and(|(least_m, _)| (at.x_m - position.x_m).abs() > least_m) {
                    break;
                }
                if best.is_none_or(|(least_m, _)| distance_m < least_m) {
                    best = Some((distance_m, influence));
                }
            }
        }
        best.map(|(_, influence)| influence)
    }
}
