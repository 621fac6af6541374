//! Euler's elastica: a thin finger under one force.
//!
//! The finger is clamped at σ = 0 and straight beyond the contact at σ = s. The downward rotation ψ before
//! the contact:
//!
//! ψ″(σ) = −q·cos(ψ − α), ψ(0) = 0, ψ′(s) = 0, q = F/(E·I),
//!
//! with the angle α of the force from the clamp's normal: 0 for a vertical force, ψ(s) for a normal one. With
//! ω = π/2 + ψ − α and u = √q·(s − σ):
//!
//! sin(ω/2) = √m·cd(u | m), ψ′ = 2·√q·√(m·m′)·sd(u | m), m = sin²(ω(s)/2), m′ = 1 − m
//!
//! (Love, *A Treatise on the Mathematical Theory of Elasticity*, §§ 262–263). For a normal force m = ½; for a
//! vertical one sin ψ(s) = tanh w, m = 1/(1 + e⁻²ʷ), and
//!
//! F·s²/(E·I) = (1 − e⁻²ʷ)·R_F(e⁻²ʷ, 2/(1 + e²ʷ), 1)²
//!
//! (Bisshopp and Drucker, *Large deflection of cantilever beams*, 1945, in Carlson's form).

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use palpate_numerics::{Jacobi, carlson_rd, carlson_rf};

/// Direction of a contact force on a finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ForceDirection {
    /// Normal to the bent finger: a contact without friction.
    Normal,
    /// Normal to the straight finger: a weight on a horizontal finger.
    Vertical,
}

impl ForceDirection {
    /// Name in a rig.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Vertical => "vertical",
        }
    }
}

/// Largest w, at loads above 10⁵.
const MOST_TURN: f64 = 300.0;
/// Bound of the Newton steps; about six are necessary.
const MOST_STEPS: usize = 60;

/// Shape of a finger under one force.
///
/// ```
/// use palpate_mechanics::surface::{Elastica, ForceDirection};
///
/// // Bisshopp and Drucker: a vertical load F·s²/(E·I) of 1 lowers the tip by 0.302 of the length.
/// let shape = Elastica::new(ForceDirection::Vertical, 1.0, 1.0, 1.0);
/// assert!((shape.point(1.0)[1] + 0.3017).abs() < 1e-4);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastica {
    direction: ForceDirection,
    /// s.
    contact_m: f64,
    /// E·I.
    stiffness_n_m2: f64,
    sign: f64,
    q: f64,
    complement: f64,
    half_cosine: f64,
    /// dm/d(q·s²).
    modulus_by_load: f64,
    /// α.
    force_angle: f64,
}

impl Elastica {
    /// Creates the shape for E·I > 0 and a force at `contact_m` ≥ 0.
    ///
    /// Valid for vertical loads F·s²/(E·I) ≤ 10⁵, and normal loads ≤ (2·K(½))² = 13.75 (half a turn).
    pub fn new(direction: ForceDirection, stiffness_n_m2: f64, contact_m: f64, force_n: f64) -> Self {
        let q = force_n.abs() / stiffness_n_m2;
        let mut shape = Self {
            direction,
            contact_m,
            stiffness_n_m2,
            sign: if force_n < 0.0 { -1.0 } else { 1.0 },
            q,
            complement: 0.5,
            half_cosine: 0.5,
            modulus_by_load: 0.0,
            force_angle: 0.0,
        };
        match direction {
            ForceDirection::Normal => shape.force_angle = FRAC_PI_2 - shape.pendulum_angle(0.0),
            ForceDirection::Vertical => {
                let Turn { w, by_load } = Turn::of_load(q * contact_m * contact_m);
                let m = 1.0 / (1.0 + (-2.0 * w).exp());
                shape.complement = 1.0 / (1.0 + (2.0 * w).exp());
                shape.half_cosine = (m * shape.complement).sqrt();
                shape.modulus_by_load = 2.0 * m * shape.complement * by_load;
            }
        }
        shape
    }

    /// Downward rotation at `at_m`, in radians.
    pub fn angle(&self, at_m: f64) -> f64 {
        self.sign * (self.pendulum_angle(at_m) - FRAC_PI_2 + self.force_angle)
    }

    /// Downward curvature ψ′, in 1/m; 0 beyond the contact.
    pub fn curvature(&self, at_m: f64) -> f64 {
        if at_m >= self.contact_m {
            return 0.0;
        }
        let Jacobi { sn, dn, .. } = self.jacobi(at_m);
        self.sign * 2.0 * self.q.sqrt() * self.half_cosine * sn / dn
    }

    /// Derivatives of the curvature by contact position and force; 0 beyond the contact.
    pub fn curvature_gradient(&self, at_m: f64) -> [f64; 2] {
        if at_m > self.contact_m {
            return [0.0; 2];
        }
        let (q, s, d) = (self.q, self.contact_m, self.contact_m - at_m);
        let root = q.sqrt();
        let Jacobi { sn, cn, dn, epsilon } = self.jacobi(at_m);
        let (sd, sd_by_u) = (sn / dn, cn / (dn * dn));
        let by_distance = 2.0 * q * self.half_cosine * sd_by_u;
        let by_q = self.half_cosine * (if root > 0.0 { sd / root } else { d } + d * sd_by_u);
        // ∂am(u)/∂m follows from ∂F(φ, m)/∂m (Byrd and Friedman, 710.07), and sd from am.
        let (m, complement) = (1.0 - self.complement, self.complement);
        let amplitude_by_m =
            dn * (root * d / (2.0 * m) - epsilon / (2.0 * m * complement)) + sn * cn / (2.0 * complement);
        let sd_by_m = amplitude_by_m * cn / dn
            + sn * (sn * sn + 2.0 * m * sn * cn * amplitude_by_m) / (2.0 * dn.powi(3));
        let by_m =
            2.0 * root * ((1.0 - 2.0 * m) / (2.0 * self.half_cosine) * sd + self.half_cosine * sd_by_m);
        let by_load = by_m * self.modulus_by_load;
        [self.sign * (by_distance + by_load * 2.0 * q * s), (by_q + by_load * s * s) / self.stiffness_n_m2]
    }

    /// Position along the straight finger and upward, in metres.
    pub fn point(&self, at_m: f64) -> [f64; 2] {
        let bent_m = at_m.min(self.contact_m);
        let ([x0, y0], [x1, y1]) = (self.vector_to_contact(0.0), self.vector_to_contact(bent_m));
        let (sine, cosine) = self.angle(self.contact_m).sin_cos();
        let straight_m = at_m - bent_m;
        [x0 - x1 + straight_m * cosine, -self.sign * (y0 - y1) - straight_m * sine]
    }

    /// (S·cos α + C·sin α, S·sin α − C·cos α), with S = ∫ sin ω = ψ′/q and C = ∫ cos ω =
    /// (2·(ℰ − m·sn·cd) − u)/√q.
    fn vector_to_contact(&self, at_m: f64) -> [f64; 2] {
        if self.q == 0.0 {
            return [self.contact_m - at_m, 0.0];
        }
        let root = self.q.sqrt();
        let Jacobi { sn, cn, dn, epsilon } = self.jacobi(at_m);
        let m = 1.0 - self.complement;
        let sines = 2.0 * self.half_cosine * sn / dn / root;
        let cosines = (2.0 * (epsilon - m * sn * cn / dn) - root * (self.contact_m - at_m)) / root;
        let (sin_a, cos_a) = self.force_angle.sin_cos();
        [sines * cos_a + cosines * sin_a, sines * sin_a - cosines * cos_a]
    }

    fn pendulum_angle(&self, at_m: f64) -> f64 {
        let Jacobi { cn, .. } = self.jacobi(at_m.min(self.contact_m));
        let m = 1.0 - self.complement;
        2.0 * (m.sqrt() * cn).atan2(self.complement.sqrt())
    }

    fn jacobi(&self, at_m: f64) -> Jacobi {
        Jacobi::new(self.q.sqrt() * (self.contact_m - at_m), self.complement)
    }
}

#[derive(Clone, Copy)]
struct Turn {
    w: f64,
    by_load: f64,
}

impl Turn {
    /// Newton's method. The load is convex in w, ≥ 2·w and ≥ (w − 1)², so all iterates are above the root.
    fn of_load(load: f64) -> Self {
        let mut turn = Self { w: (0.5 * load).min(load.sqrt() + 1.0).min(MOST_TURN), by_load: 0.5 };
        for _ in 0..MOST_STEPS {
            if turn.w <= 0.0 {
                break;
            }
            let (at_w, slope) = load_of_turn(turn.w);
            turn.by_load = 1.0 / slope;
            let next = (turn.w - (at_w - load) / slope).clamp(0.0, MOST_TURN);
            let moved = (next - turn.w).abs();
            turn.w = next;
            if moved <= 4.0 * f64::EPSILON * next {
                break;
            }
        }
        turn
    }
}

/// The load F·s²/(E·I) at w > 0, and its derivative.
///
/// √load = F(φ, m) with cos φ = e⁻ʷ; dF = dφ/Δ + (E − m′·F − m·sin φ·cos φ/Δ)·dw, Δ² = 1 − m·sin² φ =
/// 1 − tanh w.
fn load_of_turn(w: f64) -> (f64, f64) {
    let squared_cosine = (-2.0 * w).exp();
    let squared_sine = -(-2.0 * w).exp_m1();
    let complement = 1.0 / (1.0 + (2.0 * w).exp());
    let m = 1.0 - complement;
    let squared_delta = 2.0 * complement;
    let (sine, cosine, delta) = (squared_sine.sqrt(), squared_cosine.sqrt(), squared_delta.sqrt());
    let first = sine * carlson_rf(squared_cosine, squared_delta, 1.0);
    let second = first - m * sine * squared_sine / 3.0 * carlson_rd(squared_cosine, squared_delta, 1.0);
    let by_angle = cosine / (sine * delta);
    let slope = by_angle + second - complement * first - m * sine * cosine / delta;
    (first * first, 2.0 * first * slope)
}

#[cfg(test)]
mod tests;
