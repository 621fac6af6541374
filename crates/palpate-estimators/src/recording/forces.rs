//! Equality of forces.

/// Relative bound, above rounding by conversion and text.
const ROUNDING: f64 = 1e-9;

/// True for forces equal except for rounding.
///
/// ```
/// use palpate_estimators::recording::is_same_force;
///
/// assert!(is_same_force(98.1, 9.81 * 10.0));
/// assert!(!is_same_force(98.1, 98.2) && !is_same_force(0.0, 1e-300));
/// ```
pub fn is_same_force(a_n: f64, b_n: f64) -> bool {
    (a_n - b_n).abs() <= ROUNDING * a_n.abs().max(b_n.abs())
}

/// True if all forces are equal.
pub fn is_one_force(forces_n: impl IntoIterator<Item = f64>) -> bool {
    let mut forces_n = forces_n.into_iter();
    forces_n.next().is_none_or(|first_n| forces_n.all(|force_n| is_same_force(force_n, first_n)))
}
