//! Errors in proportion to the Cramér–Rao bound.

use super::Evaluation;
use crate::setup::Setup;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;

/// Ill-conditioned share of the length and width at each end.
const ENDS: f64 = 1.0 / 80.0;
/// Relative to the length; larger bounds are not attained.
const LARGE_LIMIT: f64 = 1.0 / 200.0;
/// Two coordinates share the information.
const LARGE_LIMIT_ON_A_PLANE: f64 = 1.0 / 20.0;

/// Returns the mean error over the mean Cramér–Rao bound, without contacts within 1/80 of an end or side, and
/// without bounds above 1/200 of the length (plane: 1/20).
pub fn limit_ratio(setup: &Setup, evaluation: &Evaluation) -> Option<f64> {
    let limit = setup.cramer_rao_bound().ok()?;
    let extent = setup.surface().extent();
    let within =
        |at_m: f64, size_m: f64| (ENDS * size_m - 1e-9..=(1.0 - ENDS) * size_m + 1e-9).contains(&at_m);
    let is_inner = |at: Position| {
        within(at.x_m, extent.length_m()) && extent.width_m().is_none_or(|width_m| within(at.y_m, width_m))
    };
    let large = match extent {
        Extent::Line { .. } => LARGE_LIMIT,
        Extent::Plane { .. } => LARGE_LIMIT_ON_A_PLANE,
    };
    let (mut error_m, mut bound_m) = (0.0, 0.0);
    for located in &evaluation.located {
        let Some(force_n) = located.force_n.or(setup.force_n()) else { continue };
        let bound = limit.bound_at(Contact { position: located.truth, force_n }, setup.force());
        let Some(bound) = bound.filter(|bound| bound.sd_position_m <= large * extent.length_m()) else {
            continue;
        };
        if is_inner(located.truth) {
            error_m += located.error_m();
            bound_m += bound.mean_error_m();
        }
    }
    (bound_m > 0.0).then(|| error_m / bound_m)
}
