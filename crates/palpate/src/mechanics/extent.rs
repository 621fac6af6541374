//! How large a surface is.

use serde::{Deserialize, Serialize};

use crate::contact::Position;

/// The line or rectangle on which contacts lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Length along x, in metres; greater than 0.
    pub length_m: f64,
    /// Width along y, in metres, greater than 0; `None` for a one-dimensional surface, where y is 0.
    pub width_m: Option<f64>,
}

impl Extent {
    /// Whether `position` lies on it, the boundary included.
    ///
    /// Positions are forgiven a rounding error of 10⁻⁹ of the length.
    pub fn contains(&self, position: Position) -> bool {
        let slack_m = 1e-9 * self.length_m;
        let within = |value: f64, size: f64| value >= -slack_m && value <= size + slack_m;
        within(position.x_m, self.length_m) && within(position.y_m, self.width_m.unwrap_or(0.0))
    }
}
