//! Modal superposition for moving loads on the simply supported beam.
//!
//! The downward deflection is w(x, t) = Σ_k φ_k(x)·q_k(t), φ_k(x) = sin(kπx/l), under loads W_j(t) at a_j(t)
//! (L. Frýba, *Vibration of Solids and Structures under Moving Loads*, 3rd ed. 1999, chapter 1):
//!
//! q̈_k + 2ζω_k·q̇_k + ω_k²·q_k = Σ_j W_j·φ_k(a_j)/m_k, with ω_k = (kπ/l)²·√(E·I/(ρ·A)) and m_k = ρ·A·l/2.
//!
//! A reading is its static value plus dynamic modes (mode acceleration, D. Williams, 1945). Loads have no
//! mass.

use std::f64::consts::PI;

use super::{Beam, Surface};
use crate::contact::{Contact, Position};
use crate::sensing::SensorKind;

/// A [`Beam`] with inertia and damping.
///
/// ```
/// use palpate_mechanics::surface::{Beam, modal::ModalBeam};
///
/// let steel = ModalBeam::new(Beam::new(0.4, 0.04, 1.2e-3, 200e9)?, 7850.0, 0.01)?;
/// assert!((steel.frequency_hz(1) - 17.17).abs() < 0.01);
/// assert!((steel.critical_speed_m_per_s() - 13.73).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModalBeam {
    beam: Beam,
    density_kg_per_m3: f64,
    damping_ratio: f64,
}

/// Error of an invalid beam.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ModalBeamError {
    /// The density is not positive and finite.
    #[error("the density is {density_kg_per_m3} kg/m3; it must be greater than 0 and finite")]
    Density {
        /// Density.
        density_kg_per_m3: f64,
    },
    /// The damping ratio is negative or at least 1.
    #[error("the damping ratio is {damping_ratio}; it must be at least 0 and below 1")]
    Damping {
        /// Damping ratio.
        damping_ratio: f64,
    },
    /// The first natural frequency is not positive and finite.
    #[error("the first natural frequency is {frequency_hz} Hz; it must be greater than 0 and finite")]
    Frequency {
        /// Frequency.
        frequency_hz: f64,
    },
}

impl ModalBeam {
    /// Default for thin metal on wedges.
    pub const USUAL_DAMPING_RATIO: f64 = 0.01;

    /// Creates a beam of density ρ and damping ratio ζ.
    ///
    /// # Errors
    /// [`ModalBeamError`].
    pub fn new(beam: Beam, density_kg_per_m3: f64, damping_ratio: f64) -> Result<Self, ModalBeamError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(density_kg_per_m3) {
            return Err(ModalBeamError::Density { density_kg_per_m3 });
        }
        if !(0.0..1.0).contains(&damping_ratio) {
            return Err(ModalBeamError::Damping { damping_ratio });
        }
        let modal = Self { beam, density_kg_per_m3, damping_ratio };
        let frequency_hz = modal.frequency_hz(1);
        if positive(frequency_hz) { Ok(modal) } else { Err(ModalBeamError::Frequency { frequency_hz }) }
    }

    /// The static beam.
    pub fn beam(&self) -> &Beam {
        &self.beam
    }

    /// Damping ratio ζ.
    pub fn damping_ratio(&self) -> f64 {
        self.damping_ratio
    }

    /// ρ·A, in kg/m.
    pub fn mass_per_length(&self) -> f64 {
        self.density_kg_per_m3 * self.beam.width_m() * self.beam.thickness_m()
    }

    /// Undamped ω_k of mode `k` ≥ 1, in rad/s.
    pub fn angular_frequency(&self, k: usize) -> f64 {
        self.wave_number(k).powi(2) * (self.beam.bending_stiffness() / self.mass_per_length()).sqrt()
    }

    /// Undamped frequency of mode `k` ≥ 1.
    pub fn frequency_hz(&self, k: usize) -> f64 {
        self.angular_frequency(k) / (2.0 * PI)
    }

    /// Critical speed (π/l)·√(E·I/(ρ·A)).
    pub fn critical_speed_m_per_s(&self) -> f64 {
        self.angular_frequency(1) / self.wave_number(1)
    }

    /// Returns the beam at rest with `modes` dynamic modes.
    pub fn at_rest(&self, modes: usize, loads: &[Contact]) -> ModalResponse {
        let mut response = ModalResponse {
            beam: *self,
            loads: loads.to_vec(),
            modes: vec![State::default(); modes],
            oscillators: Vec::new(),
            step_s: 0.0,
        };
        for k in 1..=modes {
            response.modes[k - 1].displacement = response.static_displacement(k, loads);
        }
        response
    }

    fn wave_number(&self, k: usize) -> f64 {
        k as f64 * PI / self.beam.length_m()
    }

    fn modal_mass(&self) -> f64 {
        0.5 * self.mass_per_length() * self.beam.length_m()
    }
}

/// Largest phase per step, for an error of 1/8 of its square, 10⁻⁵.
const MOST_RADIANS: f64 = 0.01;

/// A beam under moving loads.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalResponse {
    beam: ModalBeam,
    loads: Vec<Contact>,
    modes: Vec<State>,
    /// Oscillators of the last step length.
    oscillators: Vec<Oscillator>,
    step_s: f64,
}

impl ModalResponse {
    /// Advances by `duration_s` > 0, with as many loads that change linearly to `loads`.
    pub fn advance(&mut self, loads: &[Contact], duration_s: f64) {
        let steps = self.steps(loads);
        self.prepare(duration_s / steps as f64);
        let start = std::mem::replace(&mut self.loads, loads.to_vec());
        let mut before = start.clone();
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let after: Vec<Contact> =
                start.iter().zip(loads).map(|(from, to)| interpolated(*from, *to, share)).collect();
            for k in 1..=self.modes.len() {
                let (from, to) = (self.acceleration(k, &before), self.acceleration(k, &after));
                self.modes[k - 1] = self.oscillators[k - 1].step(self.modes[k - 1], from, to);
            }
            before = after;
        }
    }

    /// Replaces the loads instantly.
    pub fn change_loads(&mut self, loads: &[Contact]) {
        self.loads = loads.to_vec();
    }

    /// Error-free reading; 0 for a raw channel.
    pub fn reading(&self, kind: SensorKind, sensor: Position) -> f64 {
        let beam = &self.beam.beam;
        let at_once = |load: &Contact| load.force_n * beam.influence(kind, sensor, load.position);
        let late = |k: usize| self.modes[k - 1].displacement - self.static_displacement(k, &self.loads);
        let at_once: f64 = self.loads.iter().map(at_once).sum();
        at_once + (1..=self.modes.len()).map(|k| self.shape(k, kind, sensor.x_m) * late(k)).sum::<f64>()
    }

    fn shape(&self, k: usize, kind: SensorKind, x_m: f64) -> f64 {
        let beam = &self.beam.beam;
        let wave = self.beam.wave_number(k);
        let (sin, cos) = (wave * x_m).sin_cos();
        match kind {
            SensorKind::Deflection => -sin,
            SensorKind::Slope => -wave * cos,
            SensorKind::Strain => 0.5 * beam.thickness_m() * wave * wave * sin,
            SensorKind::Reaction if beam.is_supported_at(Position::along(x_m)) => {
                let inward = if 2.0 * x_m < beam.length_m() { 1.0 } else { -1.0 };
                inward * beam.bending_stiffness() * wave.powi(3) * cos
            }
            SensorKind::Reaction | SensorKind::Raw => 0.0,
        }
    }

    fn acceleration(&self, k: usize, loads: &[Contact]) -> f64 {
        let wave = self.beam.wave_number(k);
        let force_n: f64 = loads.iter().map(|load| load.force_n * (wave * load.position.x_m).sin()).sum();
        force_n / self.beam.modal_mass()
    }

    fn static_displacement(&self, k: usize, loads: &[Contact]) -> f64 {
        self.acceleration(k, loads) / self.beam.angular_frequency(k).powi(2)
    }

    fn steps(&self, loads: &[Contact]) -> usize {
        let moved = |(from, to): (&Contact, &Contact)| (to.position.x_m - from.position.x_m).abs();
        let farthest_m = self.loads.iter().zip(loads).map(moved).fold(0.0, f64::max);
        let radians = self.beam.wave_number(self.modes.len()) * farthest_m;
        (radians / MOST_RADIANS).ceil().clamp(1.0, 1e6) as usize
    }

    fn prepare(&mut self, step_s: f64) {
        if step_s != self.step_s {
            let (beam, zeta) = (&self.beam, self.beam.damping_ratio);
            let oscillator = |k| Oscillator::new(beam.angular_frequency(k), zeta, step_s);
            self.oscillators = (1..=self.modes.len()).map(oscillator).collect();
            self.step_s = step_s;
        }
    }
}

fn interpolated(from: Contact, to: Contact, share: f64) -> Contact {
    let mix = |from: f64, to: f64| from + share * (to - from);
    Contact {
        position: Position::along(mix(from.position.x_m, to.position.x_m)),
        force_n: mix(from.force_n, to.force_n),
    }
}

/// A damped oscillator q̈ + 2ζω·q̇ + ω²·q = p, exact in steps of linear p (N. C. Nigam and P. C. Jennings,
/// Bull. Seismol. Soc. Am. 59, 1969).
///
/// p = p₀ + ṗ·t has the solution A + B·t, B = ṗ/ω², A = p₀/ω² − 2ζṗ/ω³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oscillator {
    omega: f64,
    zeta: f64,
    step_s: f64,
    free: [[f64; 2]; 2],
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct State {
    pub displacement: f64,
    pub velocity: f64,
}

impl Oscillator {
    /// Creates an oscillator with ω in rad/s and 0 ≤ ζ < 1.
    pub fn new(omega: f64, zeta: f64, step_s: f64) -> Self {
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let decay = (-zeta * omega * step_s).exp();
        let (sin, cos) = (damped * step_s).sin_cos();
        let lag = zeta * omega / damped;
        let free = [
            [decay * (cos + lag * sin), decay * sin / damped],
            [-decay * omega * omega / damped * sin, decay * (cos - lag * sin)],
        ];
        Self { omega, zeta, step_s, free }
    }

    /// Transition matrix of (q, q̇) without load.
    pub fn free(&self) -> [[f64; 2]; 2] {
        self.free
    }

    fn step(&self, state: State, from: f64, to: f64) -> State {
        let square = self.omega * self.omega;
        let slope = (to - from) / self.step_s;
        let b = slope / square;
        let a = from / square - 2.0 * self.zeta * b / self.omega;
        let (displacement, velocity) = (state.displacement - a, state.velocity - b);
        let [[pp, ps], [sp, ss]] = self.free;
        State {
            displacement: a + b * self.step_s + pp * displacement + ps * velocity,
            velocity: b + sp * displacement + ss * velocity,
        }
    }
}

#[cfg(test)]
mod tests;
