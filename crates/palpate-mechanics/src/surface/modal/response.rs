//! How the beam moves under its loads, and what a sensor reads of it.

use super::beam::ModalBeam;
use super::oscillator::{Oscillator, State};
use crate::contact::{Contact, Position};
use crate::sensing::SensorKind;
use crate::surface::Surface;

/// The highest mode's force turns by at most this many radians in a step of the integration, so that between its ends it
/// is as good as linear: its middle is off by 1/8 of the square, 10⁻⁵.
const MOST_RADIANS: f64 = 0.01;

/// A beam under moving loads, at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalResponse {
    beam: ModalBeam,
    /// The loads at this instant.
    loads: Vec<Contact>,
    modes: Vec<State>,
    /// The oscillators of the last step, which is mostly like the one before.
    oscillators: Vec<Oscillator>,
    step_s: f64,
}

impl ModalResponse {
    pub(super) fn at_rest(beam: ModalBeam, modes: usize, loads: &[Contact]) -> Self {
        let mut response = Self {
            beam,
            loads: loads.to_vec(),
            modes: vec![State::default(); modes],
            oscillators: Vec::new(),
            step_s: 0.0,
        };
        for k in 1..=modes {
            response.modes[k - 1].place = response.static_place(k, &response.loads);
        }
        response
    }

    /// Lets `duration_s` pass, greater than 0, in which every load goes evenly in place and force to what `loads` says;
    /// they are as many as before, those that do not touch with force 0.
    pub fn advance(&mut self, loads: &[Contact], duration_s: f64) {
        let steps = self.steps(loads);
        self.prepare(duration_s / steps as f64);
        let start = std::mem::replace(&mut self.loads, loads.to_vec());
        let mut before = start.clone();
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let after: Vec<Contact> =
                start.iter().zip(loads).map(|(from, to)| between(*from, *to, share)).collect();
            for k in 1..=self.modes.len() {
                let (from, to) = (self.acceleration(k, &before), self.acceleration(k, &after));
                self.modes[k - 1] = self.oscillators[k - 1].step(self.modes[k - 1], from, to);
            }
            before = after;
        }
    }

    /// Puts other loads on all at once, before anything has moved: a load let go, or one that drops on.
    pub fn change_loads(&mut self, loads: &[Contact]) {
        self.loads = loads.to_vec();
    }

    /// What a sensor of a kind at `sensor` reads, without any fault, in its SI unit; 0 for a raw channel.
    pub fn reading(&self, kind: SensorKind, sensor: Position) -> f64 {
        let beam = &self.beam.beam;
        let at_once = |load: &Contact| load.force_n * beam.influence(kind, sensor, load.position);
        let late = |k: usize| self.modes[k - 1].place - self.static_place(k, &self.loads);
        let at_once: f64 = self.loads.iter().map(at_once).sum();
        at_once + (1..=self.modes.len()).map(|k| self.shape(k, kind, sensor.x_m) * late(k)).sum::<f64>()
    }

    /// Kinetic and elastic energy of the modes, in joules.
    pub fn energy_j(&self) -> f64 {
        let energy = |(i, mode): (usize, &State)| {
            let omega = self.beam.angular_frequency(i + 1);
            0.5 * self.beam.modal_mass() * (mode.speed.powi(2) + (omega * mode.place).powi(2))
        };
        self.modes.iter().enumerate().map(energy).sum()
    }

    /// The power that the loads put into the modes, in watts: Σ W_j·ẇ(a_j).
    pub fn power_w(&self) -> f64 {
        let speed_at = |x_m: f64| -> f64 {
            (1..=self.modes.len())
                .map(|k| (self.beam.wave_number(k) * x_m).sin() * self.modes[k - 1].speed)
                .sum()
        };
        self.loads.iter().map(|load| load.force_n * speed_at(load.position.x_m)).sum()
    }

    /// What a sensor reads per metre of q_k, with the sign conventions of [`Beam`](crate::surface::Beam): of the downward
    /// deflection sin(kπx/l), the upward deflection, its derivative, t/2 times its second derivative, and at the supports
    /// E·I times the third, as a force upward.
    fn shape(&self, k: usize, kind: SensorKind, x_m: f64) -> f64 {
        let beam = &self.beam.beam;
        let wave = self.beam.wave_number(k);
        let (sin, cos) = (wave * x_m).sin_cos();
        match kind {
            SensorKind::Deflection => -sin,
            SensorKind::Slope => -wave * cos,
            SensorKind::Strain => 0.5 * beam.thickness_m * wave * wave * sin,
            SensorKind::Reaction if beam.is_supported_at(Position::along(x_m)) => {
                let inward = if 2.0 * x_m < beam.length_m { 1.0 } else { -1.0 };
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
    fn static_place(&self, k: usize, loads: &[Contact]) -> f64 {
        self.acceleration(k, loads) / self.beam.angular_frequency(k).powi(2)
    }

    /// Steps in which the way to `loads` is gone.
    fn steps(&self, loads: &[Contact]) -> usize {
        let moved = |(from, to): (&Contact, &Contact)| (to.position.x_m - from.position.x_m).abs();
        let farthest_m = self.loads.iter().zip(loads).map(moved).fold(0.0, f64::max);
        let radians = self.beam.wave_number(self.modes.len()) * farthest_m;
        (radians / MOST_RADIANS).ceil().clamp(1.0, 1e6) as usize
    }

    /// Has oscillators ready for steps of a length.
    fn prepare(&mut self, step_s: f64) {
        if step_s != self.step_s {
            let (beam, zeta) = (&self.beam, self.beam.damping_ratio);
            let oscillator = |k| Oscillator::new(beam.angular_frequency(k), zeta, step_s);
            self.oscillators = (1..=self.modes.len()).map(oscillator).collect();
            self.step_s = step_s;
        }
    }
}

/// A load on its way.
fn between(from: Contact, to: Contact, share: f64) -> Contact {
    let mix = |from: f64, to: f64| from + share * (to - from);
    Contact {
        position: Position::along(mix(from.position.x_m, to.position.x_m)),
        force_n: mix(from.force_n, to.force_n),
    }
}
