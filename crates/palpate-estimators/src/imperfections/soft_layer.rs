//! Soft layer that spreads a contact.

use palpate_mechanics::contact::{Contact, Extent, Position};
use palpate_mechanics::surface::midpoints;

/// By the midpoint rule the second moment is 1/64 too small.
const POINTS: usize = 8;

/// Equal point contacts over the width, truncated at the edges.
pub(crate) fn distribute_contact(contact: Contact, width_m: f64, extent: Extent) -> Vec<Contact> {
    if width_m <= 0.0 {
        return vec![contact];
    }
    let Position { x_m, y_m } = contact.position;
    let half_m = 0.5 * width_m;
    let within = |at_m: f64, side_m: f64| [(at_m - half_m).max(0.0), (at_m + half_m).min(side_m)];
    let [left_m, right_m] = within(x_m, extent.length_m());
    let ([low_m, high_m], rows) =
        extent.width_m().map_or(([y_m, y_m], 1), |side_m| (within(y_m, side_m), POINTS));
    let (from, to) = (Position { x_m: left_m, y_m: low_m }, Position { x_m: right_m, y_m: high_m });
    let points = midpoints(from, to, [POINTS, rows]);
    let force_n = contact.force_n / points.len() as f64;
    points.into_iter().map(|position| Contact { position, force_n }).collect()
}
