//! How large a surface is.

use serde::{Deserialize, Serialize};

use crate::contact::Position;
use crate::units::format_length_mm;

/// The line or rectangle on which contacts lie.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// Length along x, in metres; greater than 0.
    pub length_m: f64,
    /// Width along y, in metres, greater than 0; `None` for a one-dimensional surface, where y is 0.
    pub width_m: Option<f64>,
}

impl Extent {
    /// Whether contacts lie on a plane, and have two coordinates.
    pub fn is_plane(&self) -> bool {
        self.width_m.is_some()
    }

    /// Its sides, in metres: the length, and the width of a plane; as many as a contact has coordinates.
    pub fn sides_m(&self) -> impl Iterator<Item = f64> + use<> {
        std::iter::once(self.length_m).chain(self.width_m)
    }

    /// A position in words: "75 mm", or "75 mm, 40 mm" on a plane, and of what is beside a line.
    pub fn place_in_words(&self, position: Position) -> String {
        let x = format_length_mm(position.x_m);
        if self.is_plane() || position.y_m != 0.0 {
            format!("{x}, {}", format_length_mm(position.y_m))
        } else {
            x
        }
    }

    /// Where positions may be, in words: "0 and 400 mm", or "0 and 300 mm along, 0 and 200 mm across" on a plane.
    pub fn bounds_in_words(&self) -> String {
        let along = format!("0 and {}", format_length_mm(self.length_m));
        match self.width_m {
            None => along,
            Some(width_m) => format!("{along} along, 0 and {} across", format_length_mm(width_m)),
        }
    }

    /// Whether `position` lies on it, the boundary included.
    ///
    /// Positions are forgiven a rounding error of 10⁻⁹ of the length.
    pub fn contains(&self, position: Position) -> bool {
        let slack_m = 1e-9 * self.length_m;
        let within = |value: f64, size: f64| value >= -slack_m && value <= size + slack_m;
        within(position.x_m, self.length_m) && within(position.y_m, self.width_m.unwrap_or(0.0))
    }
}
