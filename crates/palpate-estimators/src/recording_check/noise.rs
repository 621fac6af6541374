//! Test of the scatter of repeats.

use super::{FALSE_ALARM, Mismatch};
use crate::recording::Recording;
use crate::setup::Setup;
use palpate_mechanics::units::Quantity;
use palpate_numerics::{chi_squared_survival, mean_and_variance};

/// Least reported ratio of standard deviations.
const DIFFERENCE: f64 = 2.0;

/// Scatter at least twice or at most half of the noise, by χ² tests.
pub fn compare(setup: &Setup, recording: &Recording) -> Vec<Mismatch> {
    let sensors = setup.layout().sensors();
    let repeats = recording.repeats();
    let live: Vec<usize> = (0..sensors.len().min(recording.channels.len()))
        .filter(|c| !sensors[*c].channel.disabled && sensors[*c].channel.noise_sd > 0.0)
        .collect();
    let ratios = live.iter().filter_map(|c| {
        let sd = sensors[*c].channel.reading_sd();
        let (scatter, freedom) = pooled_variance(recording, &repeats, *c)?;
        let ratio = (scatter / (sd * sd)).sqrt();
        let survival = chi_squared_survival(freedom as f64 * ratio * ratio, freedom);
        // Two tails per channel.
        let tail = FALSE_ALARM / (2 * live.len()) as f64;
        let is_other =
            ratio >= DIFFERENCE && survival < tail || ratio <= 1.0 / DIFFERENCE && 1.0 - survival < tail;
        is_other.then_some((*c, ratio))
    });
    let ratios: Vec<(usize, f64)> = ratios.collect();
    [true, false].into_iter().filter_map(|above| mismatch(setup, &ratios, above, live.len())).collect()
}

fn mismatch(setup: &Setup, ratios: &[(usize, f64)], above: bool, of: usize) -> Option<Mismatch> {
    let sensors = setup.layout().sensors();
    let ratios = || ratios.iter().filter(|(_, ratio)| (*ratio > 1.0) == above);
    let distance = |ratio: f64| ratio.max(1e-300).ln().abs();
    let (worst, ratio) = ratios().max_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))?;
    let sd = sensors[*worst].channel.reading_sd();
    let quantity = |value: f64| Quantity { value, dimension: sensors[*worst].kind.dimension() };
    Some(Mismatch::Noise {
        channels: ratios().map(|(c, _)| sensors[*c].name.clone()).collect(),
        of,
        measured: quantity(super::rounded(ratio * sd)),
        setup: quantity(sd),
    })
}

/// With degrees of freedom.
fn pooled_variance(recording: &Recording, repeats: &[Vec<usize>], channel: usize) -> Option<(f64, usize)> {
    let freedom: usize = repeats.iter().map(|rows| rows.len() - 1).sum();
    let squares = repeats.iter().map(|rows| {
        let values = rows.iter().map(|i| recording.rows[*i].reading[channel]);
        mean_and_variance(values).1 * rows.len() as f64
    });
    let sum: f64 = squares.sum();
    (freedom > 0 && sum.is_finite()).then(|| (sum / freedom as f64, freedom))
}
