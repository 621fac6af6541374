//! Contacts.

/// A point, measured from the left support or lower left corner.
///
/// ```
/// use palpate_core::Position;
///
/// let (contact, estimate) = (Position { x_m: 0.1, y_m: 0.2 }, Position { x_m: 0.103, y_m: 0.204 });
/// assert!((contact.distance_m(estimate) - 0.005).abs() < 1e-12);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Position {
    /// Distance along the length in metres.
    pub x_m: f64,
    /// Distance across the width in metres.
    pub y_m: f64,
}

impl Position {
    /// Returns a point on a one-dimensional surface.
    pub const fn along(x_m: f64) -> Self {
        Self { x_m, y_m: 0.0 }
    }

    /// Compares by x, then by y.
    pub fn cmp_by_x_then_y(&self, other: &Self) -> core::cmp::Ordering {
        self.x_m.total_cmp(&other.x_m).then(self.y_m.total_cmp(&other.y_m))
    }

    /// Returns the distance to `other` in metres.
    pub fn distance_m(self, other: Self) -> f64 {
        libm::hypot(self.x_m - other.x_m, self.y_m - other.y_m)
    }
}

/// A force at a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    /// Position of the force.
    pub position: Position,
    /// Force in newtons, positive into the surface.
    pub force_n: f64,
}
