//! Loads that move along the simply supported beam, with its inertia and damping: modal superposition.
//!
//! The beam's downward deflection is w(x, t) = Σ_k φ_k(x)·q_k(t) over the modes φ_k(x) = sin(kπx/l). Loads W_j(t) at
//! a_j(t) drive each mode independently (L. Frýba, *Vibration of Solids and Structures under Moving Loads*, 3rd ed. 1999,
//! chapter 1):
//!
//! q̈_k + 2ζω_k·q̇_k + ω_k²·q_k = Σ_j W_j·φ_k(a_j)/m_k, with ω_k = (kπ/l)²·√(E·I/(ρ·A)) and m_k = ρ·A·l/2.
//!
//! The remainder beyond finitely many modes follows the load without delay, so it is added in closed form. A sensor reads its
//! static value, plus its share of each mode's departure from the mode's static value (the mode acceleration method of
//! D. Williams, 1945). The readings for a slowly moving load are therefore as exact as those of [`Beam`] itself.
//!
//! The load has a force and no mass; the weight of the beam is tared.

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

/// Error of a beam with a motion that cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ModalBeamError {
    /// The density is not a positive, finite number.
    #[error("the density is {density_kg_per_m3} kg/m3; it must be greater than 0 and finite")]
    Density {
        /// Value, in kg/m³.
        density_kg_per_m3: f64,
    },
    /// The damping ratio is negative, or not below critical damping.
    #[error("the damping ratio is {damping_ratio}; it must be at least 0 and below 1")]
    Damping {
        /// Value.
        damping_ratio: f64,
    },
    /// The first natural frequency is not a positive, finite number.
    #[error("the first natural frequency is {frequency_hz} Hz; it must be greater than 0 and finite")]
    Frequency {
        /// Value, in hertz.
        frequency_hz: f64,
    },
}

impl ModalBeam {
    /// Default damping ratio, for thin metal on wedges without a measured value.
    pub const USUAL_DAMPING_RATIO: f64 = 0.01;

    /// `beam` of a material of density ρ, in kg/m³, with the damping ratio ζ in every mode.
    ///
    /// # Errors
    /// [`ModalBeamError`] for a density that is not greater than 0 and finite, for ζ below 0 or not below 1, and for a
    /// first natural frequency that is not greater than 0 and finite.
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

    /// The beam's shape and stiffness.
    pub fn beam(&self) -> &Beam {
        &self.beam
    }

    /// Damping ratio ζ of every mode.
    pub fn damping_ratio(&self) -> f64 {
        self.damping_ratio
    }

    /// Mass per length ρ·A, in kg/m.
    pub fn mass_per_length(&self) -> f64 {
        self.density_kg_per_m3 * self.beam.width_m() * self.beam.thickness_m()
    }

    /// Angular frequency ω_k = (kπ/l)²·√(E·I/(ρ·A)) of mode `k` (from 1) without damping, in rad/s.
    pub fn angular_frequency(&self, k: usize) -> f64 {
        self.wave_number(k).powi(2) * (self.beam.bending_stiffness() / self.mass_per_length()).sqrt()
    }

    /// Frequency of mode `k` (from 1) without damping, in hertz.
    pub fn frequency_hz(&self, k: usize) -> f64 {
        self.angular_frequency(k) / (2.0 * PI)
    }

    /// The speed v_cr = (π/l)·√(E·I/(ρ·A)) of a steady load that passes from support to support within half a period of
    /// the first mode, in m/s; it equals the wave speed of the first mode.
    pub fn critical_speed_m_per_s(&self) -> f64 {
        self.angular_frequency(1) / self.wave_number(1)
    }

    /// The beam in balance under `loads`, at rest, with `modes` dynamic modes.
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

    /// kπ/l, in 1/m.
    fn wave_number(&self, k: usize) -> f64 {
        k as f64 * PI / self.beam.length_m()
    }

    /// m_k = ρ·A·l/2, in kg, for every mode.
    fn modal_mass(&self) -> f64 {
        0.5 * self.mass_per_length() * self.beam.length_m()
    }
}

/// Largest phase, in radians, by which a step of the integration advances the highest mode's force. The force is then linear
/// within a step to 1/8 of the square, 10⁻⁵.
const MOST_RADIANS: f64 = 0.01;

/// A beam under moving loads, at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalResponse {
    beam: ModalBeam,
    /// The loads at this instant.
    loads: Vec<Contact>,
    modes: Vec<State>,
    /// The oscillators of the last step, cached because the step length rarely changes.
    oscillators: Vec<Oscillator>,
    step_s: f64,
}

impl ModalResponse {
    /// Advances the beam by `duration_s`, greater than 0. Each load changes linearly in place and force to its value in `loads`.
    /// The number of loads stays the same; a load without contact has force 0.
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

    /// Replaces the loads instantly, before any motion: a released load, or a dropped one.
    pub fn change_loads(&mut self, loads: &[Contact]) {
        self.loads = loads.to_vec();
    }

    /// Reading of a sensor of a kind at `sensor` without channel faults, in its SI unit; 0 for a raw channel.
    pub fn reading(&self, kind: SensorKind, sensor: Position) -> f64 {
        let beam = &self.beam.beam;
        let at_once = |load: &Contact| load.force_n * beam.influence(kind, sensor, load.position);
        let late = |k: usize| self.modes[k - 1].displacement - self.static_displacement(k, &self.loads);
        let at_once: f64 = self.loads.iter().map(at_once).sum();
        at_once + (1..=self.modes.len()).map(|k| self.shape(k, kind, sensor.x_m) * late(k)).sum::<f64>()
    }

    /// Reading of a sensor per metre of q_k, with the sign conventions of [`Beam`](crate::surface::Beam). For the downward
    /// deflection sin(kπx/l) it is the upward deflection, its derivative, or t/2 times its second derivative. At the supports it is
    /// E·I times the third derivative, as an upward force.
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

    /// Σ W·φ_k(a)/m_k, in m/s².
    fn acceleration(&self, k: usize, loads: &[Contact]) -> f64 {
        let wave = self.beam.wave_number(k);
        let force_n: f64 = loads.iter().map(|load| load.force_n * (wave * load.position.x_m).sin()).sum();
        force_n / self.beam.modal_mass()
    }

    /// q_k in balance, in metres.
    fn static_displacement(&self, k: usize, loads: &[Contact]) -> f64 {
        self.acceleration(k, loads) / self.beam.angular_frequency(k).powi(2)
    }

    /// Number of integration steps on the way to `loads`.
    fn steps(&self, loads: &[Contact]) -> usize {
        let moved = |(from, to): (&Contact, &Contact)| (to.position.x_m - from.position.x_m).abs();
        let farthest_m = self.loads.iter().zip(loads).map(moved).fold(0.0, f64::max);
        let radians = self.beam.wave_number(self.modes.len()) * farthest_m;
        (radians / MOST_RADIANS).ceil().clamp(1.0, 1e6) as usize
    }

    /// Prepares oscillators for steps of `step_s`.
    fn prepare(&mut self, step_s: f64) {
        if step_s != self.step_s {
            let (beam, zeta) = (&self.beam, self.beam.damping_ratio);
            let oscillator = |k| Oscillator::new(beam.angular_frequency(k), zeta, step_s);
            self.oscillators = (1..=self.modes.len()).map(oscillator).collect();
            self.step_s = step_s;
        }
    }
}

/// A contact between two contacts, at a share of the way.
fn interpolated(from: Contact, to: Contact, share: f64) -> Contact {
    let mix = |from: f64, to: f64| from + share * (to - from);
    Contact {
        position: Position::along(mix(from.position.x_m, to.position.x_m)),
        force_n: mix(from.force_n, to.force_n),
    }
}

/// A damped oscillator q̈ + 2ζω·q̇ + ω²·q = p over steps of one length.
///
/// While p is linear in time, q_p = A + B·t with B = ṗ/ω² and A = p₀/ω² − 2ζṗ/ω³ solves the equation. The remainder of
/// place and velocity oscillates freely. Both have closed forms, so a step of any length is exact (N. C. Nigam
/// and P. C. Jennings, Bull. Seismol. Soc. Am. 59, 1969).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oscillator {
    /// ω, in rad/s.
    omega: f64,
    /// ζ, below 1.
    zeta: f64,
    step_s: f64,
    free: [[f64; 2]; 2],
}

/// Displacement and velocity of an oscillator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct State {
    /// q.
    pub displacement: f64,
    /// q̇.
    pub velocity: f64,
}

impl Oscillator {
    /// An oscillator with angular frequency ω = `omega`, in rad/s, and damping ratio ζ = `zeta`, at least 0 and below 1, in
    /// steps of `step_s` seconds.
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

    /// Transition matrix of (q, q̇) over one step without a load, by rows.
    pub fn free(&self) -> [[f64; 2]; 2] {
        self.free
    }

    /// One step, over which p changes linearly from `from` to `to`.
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
