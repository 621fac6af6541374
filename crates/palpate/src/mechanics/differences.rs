//! Derivatives with respect to the contact position where a model has no closed form for them.

use super::Extent;
use crate::contact::Position;

/// The step as a share of the surface's size: the cube root of 3·ε.
///
/// A central difference with step h errs by h²·|f‴|/6 from the curve and by ε·|f|/h from rounding. Where f changes over
/// the size of the surface, |f‴| ≈ |f| in units of that size, and the sum is smallest at h = (3·ε)^⅓ ≈ 9·10⁻⁶, where it
/// is about 4·10⁻¹¹ of |f|.
const STEP: f64 = 8.733e-6;

/// (∂f/∂x, ∂f/∂y) at `at`; 0 along y where the surface has no width. f is asked for positions on the surface only.
pub(super) fn gradient(extent: Extent, at: Position, f: impl Fn(Position) -> f64) -> [f64; 2] {
    let along = derivative(at.x_m, extent.length_m, |x_m| f(Position { x_m, ..at }));
    let across =
        extent.width_m.map_or(0.0, |width_m| derivative(at.y_m, width_m, |y_m| f(Position { y_m, ..at })));
    [along, across]
}

/// f′(at) on the interval from 0 to `size`: central, and next to an end one-sided of the same order.
fn derivative(at: f64, size: f64, f: impl Fn(f64) -> f64) -> f64 {
    let step = STEP * size;
    let one_sided = |h: f64| (4.0 * f(at + h) - 3.0 * f(at) - f(at + 2.0 * h)) / (2.0 * h);
    if at - step < 0.0 {
        one_sided(step)
    } else if at + step > size {
        one_sided(-step)
    } else {
        (f(at + step) - f(at - step)) / (2.0 * step)
    }
}
