//! What a beam's section carries, and how it changes along the beam.
//!
//! Lengths here are shares of the beam's length l and stiffnesses shares of its largest bending stiffness D, so that all
//! four numbers of a state have one magnitude and one unit, that of the deflection.

use std::ops::{Add, Mul};

/// The state of one section: deflection w, slope θ = dw/dξ, moment M = r·d²w/dξ² and its derivative V = dM/dξ, with
/// ξ = x/l and r the stretch's stiffness over D. All but w are continuous wherever nothing acts, and so is w.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    pub deflection: f64,
    pub slope: f64,
    pub moment: f64,
    /// Upward loads make it jump up: D·ΔV = q·l³ for a force q in newtons.
    pub shear: f64,
}

impl State {
    pub const DEFLECTION: Self = Self { deflection: 1.0, slope: 0.0, moment: 0.0, shear: 0.0 };
    pub const SLOPE: Self = Self { deflection: 0.0, slope: 1.0, moment: 0.0, shear: 0.0 };
    pub const MOMENT: Self = Self { deflection: 0.0, slope: 0.0, moment: 1.0, shear: 0.0 };
    pub const SHEAR: Self = Self { deflection: 0.0, slope: 0.0, moment: 0.0, shear: 1.0 };

    /// The state `by` further along a stretch of this stiffness that carries no load: w is a cubic.
    pub fn advanced(self, by: f64, stiffness: f64) -> Self {
        let Self { deflection, slope, moment, shear } = self;
        Self {
            deflection: deflection + by * (slope + by * (moment / 2.0 + by * shear / 6.0) / stiffness),
            slope: slope + by * (moment + by * shear / 2.0) / stiffness,
            moment: moment + by * shear,
            shear,
        }
    }

    /// The same state, seen by someone who walks the beam from its other end.
    pub fn mirrored(self) -> Self {
        Self { slope: -self.slope, shear: -self.shear, ..self }
    }

    pub fn dot(self, other: Self) -> f64 {
        self.numbers().iter().zip(other.numbers()).map(|(a, b)| a * b).sum()
    }

    pub const fn numbers(self) -> [f64; 4] {
        [self.deflection, self.slope, self.moment, self.shear]
    }
}

impl Add for State {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            deflection: self.deflection + other.deflection,
            slope: self.slope + other.slope,
            moment: self.moment + other.moment,
            shear: self.shear + other.shear,
        }
    }
}

impl Mul<f64> for State {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            deflection: self.deflection * factor,
            slope: self.slope * factor,
            moment: self.moment * factor,
            shear: self.shear * factor,
        }
    }
}
