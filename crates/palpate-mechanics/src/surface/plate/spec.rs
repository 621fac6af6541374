//! A plate as data.

use serde::{Deserialize, Serialize};

use crate::contact::Position;
use crate::surface::Extent;

/// A rectangular plate: x runs along its length from the left edge to the right one, y along its width from the bottom edge
/// to the top one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlateSpec {
    /// Length along x, in metres.
    pub length_m: f64,
    /// Width along y, in metres.
    pub width_m: f64,
    /// Thickness t, in metres; small beside the sides (below a tenth or so), or shear matters, which is left out.
    pub thickness_m: f64,
    /// Young's modulus E, in pascals.
    pub youngs_modulus_pa: f64,
    /// Poisson's ratio ν, greater than −1 and at most 0.5.
    pub poissons_ratio: f64,
    /// How the edges are held.
    pub edges: Edges,
    /// What holds it at points.
    pub supports: Vec<PointSupport>,
    /// Elements along the longer side.
    pub elements: usize,
}

/// How each edge is held; free where nothing is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Edges {
    /// The edge x = 0.
    pub left: Edge,
    /// The edge x = length.
    pub right: Edge,
    /// The edge y = 0.
    pub bottom: Edge,
    /// The edge y = width.
    pub top: Edge,
}

/// How an edge is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// Its deflection is zero, and it can turn.
    Simple,
    /// Its deflection and its slope are zero.
    Clamped,
    /// Nothing holds it.
    #[default]
    Free,
}

/// A support at one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSupport {
    /// Where it is.
    pub position: Position,
    /// What it does.
    pub kind: PointSupportKind,
}

/// What a support at one point does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointSupportKind {
    /// It does not move, and the plate can turn on it.
    Simple,
    /// It gives in proportion to the force.
    Elastic {
        /// Stiffness k, in newtons per metre; greater than 0.
        stiffness_n_per_m: f64,
    },
}

impl PlateSpec {
    /// Elements along the longer side where nothing else is said: the error of deflections is then about 10⁻⁴ of the
    /// largest deflection (docs/plates.md).
    pub const DEFAULT_ELEMENTS: usize = 128;

    /// Flexural rigidity D = E·t³/(12·(1 − ν²)), in N·m.
    pub fn flexural_rigidity(&self) -> f64 {
        self.youngs_modulus_pa * self.thickness_m.powi(3) / (12.0 * (1.0 - self.poissons_ratio.powi(2)))
    }

    /// The area that can be touched.
    pub fn extent(&self) -> Extent {
        Extent::Plane { length_m: self.length_m, width_m: self.width_m }
    }
}

impl Edges {
    /// The same on all sides.
    pub const fn all(edge: Edge) -> Self {
        Self { left: edge, right: edge, bottom: edge, top: edge }
    }
}

impl PointSupport {
    /// Whether it does not give.
    pub(super) fn is_rigid(&self) -> bool {
        matches!(self.kind, PointSupportKind::Simple)
    }
}
