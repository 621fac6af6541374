//! Creep of the surface: standard linear solid (W. N. Findley and others, *Creep and Relaxation of Nonlinear
//! Viscoelastic Materials*, 1976, chapter 5).
//!
//! A channel reads y = s + c·z with its fresh reading s, that calibration learns, and the creep state z, τ·ż =
//! s − z. In a step T, z moves by the share a = 1 − exp(−T/τ) to s, so s = (y − c·(1 − a)·z)/(1 + c·a).

/// Creep of a soft surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// Final growth over the fresh reading, 0 to 1.
    pub share: f64,
    /// Time constant in seconds, positive.
    pub time_s: f64,
}

#[derive(Clone, Debug)]
pub(super) struct CreepFilter {
    creep: Creep,
    /// z of each channel.
    states: Vec<f64>,
}

impl CreepFilter {
    pub fn new(creep: Creep, channels: usize) -> Self {
        Self { creep, states: vec![0.0; channels] }
    }

    /// Share a of a step; 0 at the first reading, as the surface is assumed untouched long before it.
    pub fn step_share(&self, duration_s: Option<f64>) -> f64 {
        duration_s.map_or(0.0, |duration_s| -(-duration_s / self.creep.time_s).exp_m1())
    }

    /// Returns the fresh reading s of a channel, and updates its state.
    pub fn subtract(&mut self, channel: usize, reading: f64, step_share: f64) -> f64 {
        let (share, state) = (self.creep.share, &mut self.states[channel]);
        let fresh = (reading - share * (1.0 - step_share) * *state) / (1.0 + share * step_share);
        *state += step_share * (fresh - *state);
        fresh
    }

    pub fn reset(&mut self) {
        self.states.fill(0.0);
    }
}
