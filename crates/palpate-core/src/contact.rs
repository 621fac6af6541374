//! Where and how hard a surface is touched.

/// A point on the surface, measured from its left support or lower left corner.
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
    /// Distance along the length, in metres.
    pub x_m: f64,
    /// Distance across the width, in metres; 0 on a one-dimensional surface.
    pub y_m: f64,
}

impl Position {
    /// The point at `x_m` metres along a one-dimensional surface.
    pub const fn along(x_m: f64) -> Self {
        Self { x_m, y_m: 0.0 }
    }

    /// The order by x, then by y.
    pub fn cmp_by_x_then_y(&self, other: &Self) -> core::cmp::Ordering {
        self.x_m.total_cmp(&other.x_m).then(self.y_m.total_cmp(&other.y_m))
    }

    /// The straight distance to `other`, in metres.
    pub fn distance_m(self, other: Self) -> f64 {
        libm::hypot(self.x_m - other.x_m, self.y_m - other.y_m)
    }
}

/// One touch: a force at a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Contact {
    /// Position at which the force acts.
    pub position: Position,
    /// The force, in newtons, positive downward, into the surface.
    pub force_n: f64,
}
