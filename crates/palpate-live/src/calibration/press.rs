//! A planned press.

use palpate_mechanics::contact::Position;

/// A planned press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Position.
    pub position: Position,
    /// Force in newtons, if it is known.
    pub force_n: Option<f64>,
    /// Depth in metres, if a machine presses.
    pub depth_m: Option<f64>,
}
