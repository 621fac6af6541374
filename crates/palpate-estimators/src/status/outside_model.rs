//! Critical values of χ² of the best contact.

use super::critical_values::CriticalValues;
use crate::recording::Recording;
use crate::thinning::thinned;

/// Share of contacts that are `outside_model` by noise.
pub const OUTSIDE_MODEL_RATE: f64 = 1e-3;

/// Share of point contacts that seem distributed by noise.
pub const SPREAD_RATE: f64 = 2e-3;

/// Critical value of χ² with at least 1 degree of freedom, as bounds of force and surface restrict every
/// contact.
pub(crate) fn chi_squared_bound(freedom: usize) -> f64 {
    static BOUNDS: CriticalValues = CriticalValues::new(OUTSIDE_MODEL_RATE);
    BOUNDS.at(freedom)
}

/// Bounds of at least twice the recording's 99th percentile, as real noise has longer tails.
pub(crate) fn recording_bounds<const N: usize>(
    normal: [f64; N],
    recording: &Recording,
    residuals: impl Fn(&[f64]) -> [f64; N],
) -> [f64; N] {
    const ROWS: usize = 400;
    let rows = &recording.rows;
    let rows_tested: Vec<[f64; N]> = thinned(rows.len(), ROWS).map(|i| residuals(&rows[i].reading)).collect();
    std::array::from_fn(|k| {
        let mut values: Vec<f64> =
            rows_tested.iter().map(|row| row[k]).filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let high = values.get(values.len() * 99 / 100).copied().unwrap_or(0.0);
        normal[k].max(2.0 * high)
    })
}
