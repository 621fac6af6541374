//! The largest magnitude of an influence over all sensor positions.

/// Sensor positions looked at in an element.
const STEPS: u32 = 32;
/// Steps of the golden section around the best of them.
const HALVINGS: u32 = 60;

/// The largest value of `at` from 0 to `length`: of evenly spaced places the best, and the best around it by golden section.
///
/// Exact to rounding where `at` has one maximum between neighbouring places, as the smooth functions of the sensor's position
/// on one element have, which bend at most a few times on it.
pub(super) fn largest(length: f64, at: impl Fn(f64) -> f64) -> f64 {
    let place = |step: u32| length * f64::from(step) / f64::from(STEPS);
    let (best, value) = (0..=STEPS)
        .map(|step| (step, at(place(step))))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, f64::NAN));
    let around = (place(best.saturating_sub(1)), place((best + 1).min(STEPS)));
    value.max(golden_section(around, at))
}

/// The largest value that golden section meets (Kiefer, Proc. Am. Math. Soc. 4, 1953).
fn golden_section((mut low, mut high): (f64, f64), at: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut left, mut right) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut left_value, mut right_value) = (at(left), at(right));
    for _ in 0..HALVINGS {
        if left_value > right_value {
            (high, right, right_value) = (right, left, left_value);
            left = high - ratio * (high - low);
            left_value = at(left);
        } else {
            (low, left, left_value) = (left, right, right_value);
            right = low + ratio * (high - low);
            right_value = at(right);
        }
    }
    left_value.max(right_value)
}
