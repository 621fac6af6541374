//! What locating answers.

use crate::Position;

/// Where a locator believes that the surface is touched.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate {
    /// The contact's position.
    pub position: Position,
    /// The contact's force in newtons, positive downward, where the locator estimates it.
    pub force_n: Option<f64>,
    /// How far the estimate is to be believed.
    pub status: Status,
}

/// How far an estimate is to be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Status {
    /// A position on the surface.
    Located,
    /// A position beyond the surface's edge, which no contact can have.
    OutsideSurface,
}

impl Status {
    /// Its name in files and on streams.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Located => "located",
            Self::OutsideSurface => "outside_surface",
        }
    }
}
