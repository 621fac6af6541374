//! Goodness-of-fit bounds of a locator without a channel.

use crate::status::chi_squared_bound;

/// Scales the bound of a squared residual from `before` to `after` degrees of freedom.
///
/// The bound is φ times the critical value of χ², with the overdispersion φ ≥ 1 of the recording's residuals,
/// which does not depend on the number of channels.
pub(super) fn residual_limit_after(limit: f64, before: usize, after: usize) -> f64 {
    limit * chi_squared_bound(after) / chi_squared_bound(before)
}
