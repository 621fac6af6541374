//! Faults of a simulated board: frames that are lost or torn, channels that drift, soft surfaces that creep.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::Range;

/// Configuration of a simulated board's faults; none by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaultConfig {
    /// Share of frames that are left out, 0 to 1.
    pub dropped: f64,
    /// Share of frames of which a part is missing, 0 to 1.
    pub torn: f64,
    /// Drift of each channel in a second, in its SI unit or raw: that of a line, upward and downward channels in turn.
    pub drift_per_s: f64,
    /// Standard deviation of a random walk of each channel after a second, in its SI unit or raw.
    pub walk_per_root_s: f64,
    /// Share of a reading that follows the contact slowly, 0 to 1: the creep of a soft surface.
    pub creep: f64,
    /// Time constant of the creep, in s, greater than 0 where there is some.
    pub creep_s: f64,
}

/// Fate of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It is sent as it is.
    Whole,
    /// A part of its bytes is missing.
    Torn {
        /// Those bytes.
        lost: Range<usize>,
    },
    /// It is not sent.
    Dropped,
}

/// Faults of the way from the board.
pub struct Faults {
    /// Their configuration.
    pub config: FaultConfig,
    rng: Xoshiro256PlusPlus,
}

impl Faults {
    /// Faults of this configuration, drawn by a seed.
    pub fn new(config: FaultConfig, seed: u64) -> Self {
        // A stream of its own, beside those of the noise and the finger.
        Self { config, rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xFA_0175) }
    }

    /// The fate of a frame of so many bytes.
    pub fn next(&mut self, length: usize) -> Fate {
        let FaultConfig { dropped, torn, .. } = self.config;
        if dropped <= 0.0 && torn <= 0.0 {
            return Fate::Whole;
        }
        let drawn: f64 = self.rng.random();
        if drawn < dropped {
            Fate::Dropped
        } else if drawn < dropped + torn && length > 1 {
            // At least one byte stays, and one is lost.
            let start = self.rng.random_range(0..length);
            let most = if start == 0 { length - 1 } else { length - start };
            Fate::Torn { lost: start..start + self.rng.random_range(1..=most) }
        } else {
            Fate::Whole
        }
    }
}

/// Slow changes of what the sensors read.
pub struct Ageing {
    rng: Xoshiro256PlusPlus,
    offsets: Vec<f64>,
    crept: Vec<f64>,
}

impl Ageing {
    /// Channels without any change so far.
    pub fn new(channels: usize, seed: u64) -> Self {
        let rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xA6_E109);
        Self { rng, offsets: vec![0.0; channels], crept: vec![0.0; channels] }
    }

    /// Lets a step of time pass, and changes a faultless reading as it does.
    ///
    /// Of a reading r, the share c creeps: z' = (r − z)/τ, and (1 − c)·r + c·z is read.
    pub fn act(&mut self, reading: &mut [f64], config: &FaultConfig, step_s: f64) {
        let walk = config.walk_per_root_s * step_s.sqrt();
        for (i, value) in reading.iter_mut().enumerate() {
            if config.creep > 0.0 {
                let share = -(-step_s / config.creep_s).exp_m1();
                self.crept[i] += share * (*value - self.crept[i]);
                *value = (1.0 - config.creep) * *value + config.creep * self.crept[i];
            }
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            self.offsets[i] += sign * config.drift_per_s * step_s;
            if walk > 0.0 {
                let drawn: f64 = StandardNormal.sample(&mut self.rng);
                self.offsets[i] += walk * drawn;
            }
            *value += self.offsets[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_a_creep_are_what_their_formulas_say() {
        let config = FaultConfig { drift_per_s: 0.5, creep: 0.2, creep_s: 2.0, ..FaultConfig::default() };
        let mut ageing = Ageing::new(2, 0);
        let mut reading = [0.0; 2];
        for _ in 0..1000 {
            reading = [10.0, 10.0];
            ageing.act(&mut reading, &config, 3e-3);
        }
        // After 3 s: the creep lacks exp(−3/2) of its share, and the lines are at ±1.5.
        let crept = 10.0 - 2.0 * (-1.5_f64).exp();
        assert!((reading[0] - (crept + 1.5)).abs() < 1e-9, "{reading:?}");
        assert!((reading[1] - (crept - 1.5)).abs() < 1e-9, "{reading:?}");
    }

    #[test]
    fn a_walk_spreads_with_the_root_of_time() {
        let config = FaultConfig { walk_per_root_s: 2.0, ..FaultConfig::default() };
        let mut ageing = Ageing::new(400, 7);
        let mut reading = vec![0.0; 400];
        for _ in 0..900 {
            reading.fill(0.0);
            ageing.act(&mut reading, &config, 0.01);
        }
        let variance = reading.iter().map(|x| x * x).sum::<f64>() / 400.0;
        // 9 s of a variance of 4 a second; the variance of 400 draws is known to 7 %.
        assert!((variance / 36.0 - 1.0).abs() < 0.25, "{variance}");
    }

    #[test]
    fn faults_come_as_often_as_they_should_and_tear_a_part() {
        let config = FaultConfig { dropped: 0.1, torn: 0.2, ..FaultConfig::default() };
        let mut faults = Faults::new(config, 1);
        let (mut dropped, mut torn) = (0, 0);
        for _ in 0..10_000 {
            match faults.next(30) {
                Fate::Dropped => dropped += 1,
                Fate::Torn { lost } => {
                    torn += 1;
                    assert!(!lost.is_empty() && lost.end <= 30 && lost.len() < 30, "{lost:?}");
                }
                Fate::Whole => {}
            }
        }
        assert!((900..1100).contains(&dropped) && (1850..2150).contains(&torn), "{dropped} {torn}");
    }
}
