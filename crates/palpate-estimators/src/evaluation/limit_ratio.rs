//! Errors over what physics allows.

use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;

use super::Evaluation;
use crate::setup::Setup;

/// Share of the length at either end, and of the width, where left and right cannot be told apart at usual noise.
const ENDS: f64 = 1.0 / 80.0;
/// Where the limit is larger than this share of the length, an estimator cannot reach it: it is a bound for small errors.
const LARGE_LIMIT: f64 = 1.0 / 200.0;
/// The same on a plane, whose two directions share the readings.
const LARGE_LIMIT_ON_A_PLANE: f64 = 1.0 / 20.0;

/// Mean error over the limit's mean error, for the bench's noise; `None` where there is no limit. Counted are contacts
/// at least 1/80 of the length from both ends, on a plane also of the width from both sides, where the limit is at most
/// 1/200 of the length, on a plane 1/20.
pub fn limit_ratio(setup: &Setup, evaluation: &Evaluation) -> Option<f64> {
    let limit = setup.cramer_rao_bound().ok()?;
    let force = if setup.force_n.is_some() { Force::Known } else { Force::Unknown };
    let extent = setup.surface.extent();
    let within =
        |at_m: f64, size_m: f64| (ENDS * size_m - 1e-9..=(1.0 - ENDS) * size_m + 1e-9).contains(&at_m);
    let is_inner = |at: Position| {
        within(at.x_m, extent.length_m) && extent.width_m.is_none_or(|width_m| within(at.y_m, width_m))
    };
    let large = if extent.is_plane() { LARGE_LIMIT_ON_A_PLANE } else { LARGE_LIMIT };
    let (mut error_m, mut bound_m) = (0.0, 0.0);
    for located in &evaluation.located {
        let Some(force_n) = located.force_n.or(setup.force_n) else { continue };
        let bound = limit.at(Contact { position: located.truth, force_n }, force);
        let Some(bound) = bound.filter(|bound| bound.sd_position_m <= large * extent.length_m) else {
            continue;
        };
        if is_inner(located.truth) {
            error_m += located.error_m();
            bound_m += bound.mean_error_m();
        }
    }
    (bound_m > 0.0).then(|| error_m / bound_m)
}
