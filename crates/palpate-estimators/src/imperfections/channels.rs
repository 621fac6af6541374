//! State of imperfect channels over time.

use super::Imperfections;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

/// Imperfect channels of a bench, with their state.
#[derive(Clone, Debug)]
pub struct ImperfectChannels {
    imperfections: Imperfections,
    /// Untouched reading and range of each channel.
    levels: Vec<(f64, f64)>,
    states: Vec<ChannelState>,
    time_s: f64,
    rng: Xoshiro256PlusPlus,
}

/// Final state of a simulated recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BenchState {
    /// Seed of gains, offsets and sensor positions.
    pub seed: u64,
    /// Force that sets the channels' ranges.
    pub range_force_n: f64,
    /// Time since the start.
    pub time_s: f64,
    /// State of each channel.
    pub channels: Vec<ChannelState>,
}

/// State of one channel, in its unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelState {
    /// Output of the play operator.
    pub play: f64,
    /// Creep deviations.
    pub crept: [f64; 2],
    /// Residue of touches.
    pub residue: f64,
    /// Random walk.
    pub walk: f64,
}

/// Distinguishes random streams of one seed.
const WALKS: u64 = 0xA6_E109;

impl ImperfectChannels {
    /// Returns channels at rest at time 0.
    pub fn new(imperfections: Imperfections, untouched: &[f64], ranges: &[f64], seed: u64) -> Self {
        Self {
            imperfections,
            levels: untouched.iter().copied().zip(ranges.iter().copied()).collect(),
            states: vec![ChannelState::default(); untouched.len()],
            time_s: 0.0,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ WALKS),
        }
    }

    /// Continues from a state, with fresh random walks.
    #[must_use]
    pub fn resumed(mut self, state: &BenchState) -> Self {
        self.states.iter_mut().zip(&state.channels).for_each(|(own, left)| *own = *left);
        self.time_s = state.time_s;
        self.rng.jump();
        self
    }

    /// Imperfections.
    pub const fn imperfections(&self) -> &Imperfections {
        &self.imperfections
    }

    /// Time since the start.
    pub const fn time_s(&self) -> f64 {
        self.time_s
    }

    /// State of each channel.
    pub fn states(&self) -> &[ChannelState] {
        &self.states
    }

    /// Advances time under constant contacts, and returns the reading with imperfections.
    pub fn advance(&mut self, clean: &[f64], step_s: f64) -> Vec<f64> {
        self.time_s += step_s;
        let Imperfections { drift, common_drift, .. } = self.imperfections;
        let common = self.draw(common_drift.walk_per_root_s.number() != 0.0);
        let mut reading = Vec::with_capacity(clean.len());
        for (i, value) in clean.iter().enumerate() {
            let own = self.draw(drift.walk_per_root_s.number() != 0.0);
            let (Some(&(untouched, range)), Some(state)) = (self.levels.get(i), self.states.get_mut(i))
            else {
                break;
            };
            let walks = own * drift.walk_per_root_s.of_range(range)
                + common * common_drift.walk_per_root_s.of_range(range);
            state.walk += walks * step_s.sqrt();
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let line = sign * drift.line_per_s.of_range(range) + common_drift.line_per_s.of_range(range);
            let gain =
                sign * self.imperfections.gain_drift_per_s + self.imperfections.common_gain_drift_per_s;
            let deviation = state.deform(value - untouched, range, &self.imperfections, step_s);
            let offset = line * self.time_s + state.walk;
            reading.push(untouched + (1.0 + gain * self.time_s) * deviation + offset);
        }
        reading
    }

    fn draw(&mut self, is_needed: bool) -> f64 {
        if is_needed { self.rng.sample(StandardNormal) } else { 0.0 }
    }
}

impl ChannelState {
    fn deform(&mut self, x: f64, range: f64, imperfections: &Imperfections, step_s: f64) -> f64 {
        let saturated = saturate(x, range, imperfections.saturation);
        let half = 0.5 * imperfections.hysteresis * range;
        self.play = self.play.max(saturated - half).min(saturated + half);
        self.creep(self.play, imperfections, step_s) + self.leave_residue(self.play, imperfections, step_s)
    }

    /// z' = (x − z)/τ for each share c: (1 − Σc)·x + Σ c·z.
    fn creep(&mut self, x: f64, imperfections: &Imperfections, step_s: f64) -> f64 {
        let mut crept = x;
        for (creep, z) in
            imperfections.creep.iter().zip(&mut self.crept).filter(|(creep, _)| creep.share > 0.0)
        {
            *z = x + (*z - x) * creep.remainder(step_s);
            crept += creep.share * (*z - x);
        }
        crept
    }

    fn leave_residue(&mut self, x: f64, imperfections: &Imperfections, step_s: f64) -> f64 {
        let residue = imperfections.residue;
        if residue.share > 0.0 {
            self.residue *= residue.remainder(step_s);
            let of_touch = residue.share * x;
            if of_touch.abs() > self.residue.abs() {
                self.residue = of_touch;
            }
        }
        self.residue
    }
}

/// x/(1 + a·|x|/R), a = s/(1 − s).
fn saturate(x: f64, range: f64, share: f64) -> f64 {
    if share > 0.0 && range > 0.0 { x / (1.0 + share / (1.0 - share) * x.abs() / range) } else { x }
}
