//! Channels in the course of time: saturation, hysteresis, creep, residue, drift of gain and offset.

use super::Imperfections;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

/// Channels of a bench, with their state.
#[derive(Clone, Debug)]
pub struct ImperfectChannels {
    imperfections: Imperfections,
    /// Untouched reading of each channel, and its largest deviation from that.
    levels: Vec<(f64, f64)>,
    states: Vec<ChannelState>,
    time_s: f64,
    /// Random stream of the walks, separate from those of noise and places.
    rng: Xoshiro256PlusPlus,
}

/// State of a simulated bench after a recording, from which a later one continues.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BenchState {
    /// Seed of gains, offsets and places of the bench.
    pub seed: u64,
    /// Force for the ranges of its channels, in newtons.
    pub range_force_n: f64,
    /// Time since its start, in seconds.
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
    /// Deviations that follow slowly.
    pub crept: [f64; 2],
    /// Residue of touches.
    pub residue: f64,
    /// Random walk.
    pub walk: f64,
}

/// Distinguishes the stream of the walks from those of noise, finger and lost frames, which have the same seed.
const WALKS: u64 = 0xA6_E109;

impl ImperfectChannels {
    /// Channels with these untouched readings and ranges, at rest at time 0; their random walks are drawn by the seed.
    pub fn new(imperfections: Imperfections, untouched: &[f64], ranges: &[f64], seed: u64) -> Self {
        Self {
            imperfections,
            levels: untouched.iter().copied().zip(ranges.iter().copied()).collect(),
            states: vec![ChannelState::default(); untouched.len()],
            time_s: 0.0,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ WALKS),
        }
    }

    /// The channels in the final state of an earlier recording, with fresh random walks from there on.
    #[must_use]
    pub fn resumed(mut self, state: &BenchState) -> Self {
        self.states.iter_mut().zip(&state.channels).for_each(|(own, left)| *own = *left);
        self.time_s = state.time_s;
        self.rng.jump();
        self
    }

    /// The imperfections.
    pub const fn imperfections(&self) -> &Imperfections {
        &self.imperfections
    }

    /// Time since the start, in seconds.
    pub const fn time_s(&self) -> f64 {
        self.time_s
    }

    /// State of each channel.
    pub fn states(&self) -> &[ChannelState] {
        &self.states
    }

    /// Advances time by a step under constant contacts with the faultless reading `clean`; returns the reading at its end, without noise.
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

    /// A step of a walk of standard deviation 1; 0, without a draw, where it is not needed.
    fn draw(&mut self, is_needed: bool) -> f64 {
        if is_needed { self.rng.sample(StandardNormal) } else { 0.0 }
    }
}

impl ChannelState {
    /// Saturation, hysteresis, creep and residue of a deviation x of a channel of this range.
    fn deform(&mut self, x: f64, range: f64, imperfections: &Imperfections, step_s: f64) -> f64 {
        let saturated = saturate(x, range, imperfections.saturation);
        let half = 0.5 * imperfections.hysteresis * range;
        self.play = self.play.max(saturated - half).min(saturated + half);
        self.creep(self.play, imperfections, step_s) + self.leave_residue(self.play, imperfections, step_s)
    }

    /// The share c of each creep follows by z' = (x − z)/τ: (1 − Σc)·x + Σ c·z.
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

    /// A share of the largest deviation of a touch, which fades by its time constant.
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

/// x/(1 + a·|x|/R) with a = s/(1 − s), which falls short of x by the share s at the range R.
fn saturate(x: f64, range: f64, share: f64) -> f64 {
    if share > 0.0 && range > 0.0 { x / (1.0 + share / (1.0 - share) * x.abs() / range) } else { x }
}
