//! Quadrature.

/// Integral of `of` by the composite Simpson rule with an even number of steps.
pub(super) fn simpson((from, to): (f64, f64), steps: usize, of: impl Fn(f64) -> f64) -> f64 {
    let step = (to - from) / steps as f64;
    let weight = |i: usize| if i == 0 || i == steps { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
    (0..=steps).map(|i| weight(i) * of(from + i as f64 * step)).sum::<f64>() * step / 3.0
}
