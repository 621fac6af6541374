//! A planned press.

use palpate_mechanics::contact::Position;

/// A press that is planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Position.
    pub position: Position,
    /// Its force in newtons, where it is known.
    pub force_n: Option<f64>,
    /// Depth in metres, where a machine presses.
    pub depth_m: Option<f64>,
}
