//! A beam that has mass and loses energy.

use std::f64::consts::PI;

use super::response::ModalResponse;
use crate::contact::Contact;
use crate::surface::Beam;

/// A [`Beam`] with inertia and damping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModalBeam {
    /// Shape and stiffness.
    pub beam: Beam,
    /// Density ρ of the material, in kg/m³; greater than 0.
    pub density_kg_per_m3: f64,
    /// Share ζ of the critical damping that every mode has; at least 0 and below 1.
    pub damping_ratio: f64,
}

/// Why a beam's motion cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ModalBeamError {
    /// The density is not a positive, finite number.
    #[error("the density is {density_kg_per_m3} kg/m3; it must be greater than 0 and finite")]
    Density {
        /// Its value, in kg/m³.
        density_kg_per_m3: f64,
    },
    /// The damping ratio is not one of a beam that swings.
    #[error("the damping ratio is {damping_ratio}; it must be at least 0 and below 1")]
    Damping {
        /// Its value.
        damping_ratio: f64,
    },
    /// The first natural frequency is not a positive, finite number.
    #[error("the first natural frequency is {frequency_hz} Hz; it must be greater than 0 and finite")]
    Frequency {
        /// Its value, in hertz.
        frequency_hz: f64,
    },
}

impl ModalBeam {
    /// The damping ratio of thin metal on wedges, where nobody measured it.
    pub const USUAL_DAMPING_RATIO: f64 = 0.01;

    /// Checks density, damping and the frequency that follows.
    ///
    /// # Errors
    /// [`ModalBeamError`], with the value that is out of its bounds.
    pub fn validate(&self) -> Result<(), ModalBeamError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let Self { density_kg_per_m3, damping_ratio, .. } = *self;
        if !positive(density_kg_per_m3) {
            return Err(ModalBeamError::Density { density_kg_per_m3 });
        }
        if !(0.0..1.0).contains(&damping_ratio) {
            return Err(ModalBeamError::Damping { damping_ratio });
        }
        let frequency_hz = self.frequency_hz(1);
        if positive(frequency_hz) { Ok(()) } else { Err(ModalBeamError::Frequency { frequency_hz }) }
    }

    /// Mass per length ρ·A, in kg/m.
    pub fn mass_per_length(&self) -> f64 {
        self.density_kg_per_m3 * self.beam.width_m * self.beam.thickness_m
    }

    /// Angular frequency ω_k = (kπ/l)²·√(E·I/(ρ·A)) of mode `k` (from 1) without damping, in rad/s.
    pub fn angular_frequency(&self, k: usize) -> f64 {
        self.wave_number(k).powi(2) * (self.beam.bending_stiffness() / self.mass_per_length()).sqrt()
    }

    /// The same in hertz.
    pub fn frequency_hz(&self, k: usize) -> f64 {
        self.angular_frequency(k) / (2.0 * PI)
    }

    /// The speed v_cr = (π/l)·√(E·I/(ρ·A)) at which a steady load passes from support to support within half a period of
    /// the first mode, in m/s; the load that goes with the first mode's own wave.
    pub fn critical_speed_m_per_s(&self) -> f64 {
        self.angular_frequency(1) / self.wave_number(1)
    }

    /// The beam in balance under `loads`, at rest; `modes` of its modes move.
    pub fn at_rest(&self, modes: usize, loads: &[Contact]) -> ModalResponse {
        ModalResponse::at_rest(*self, modes, loads)
    }

    /// kπ/l, in 1/m.
    pub(super) fn wave_number(&self, k: usize) -> f64 {
        k as f64 * PI / self.beam.length_m
    }

    /// m_k = ρ·A·l/2, in kg, the same for every mode.
    pub(super) fn modal_mass(&self) -> f64 {
        0.5 * self.mass_per_length() * self.beam.length_m
    }
}
