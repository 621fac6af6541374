//! Distortions of the readings of a simulated board: hysteresis, creep, residue, drift and the steps of a converter.

use super::faults::FaultConfig;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Distortions of all channels, in the course of time.
pub struct Distortion {
    rng: Xoshiro256PlusPlus,
    channels: Vec<Channel>,
}

/// State of one channel.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    /// Untouched reading, and largest deviation from it under the finger.
    untouched: f64,
    range: f64,
    /// Output of the play operator.
    play: f64,
    /// Deviation that follows slowly.
    crept: f64,
    residue: f64,
    offset: f64,
}

impl Distortion {
    /// Channels with these untouched readings, and these ranges under the finger; their random walk is drawn by the seed.
    pub fn new(untouched: &[f64], ranges: &[f64], seed: u64) -> Self {
        let channel = |(untouched, range): (&f64, &f64)| Channel {
            untouched: *untouched,
            range: *range,
            ..Channel::default()
        };
        Self {
            rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xA6_E109),
            channels: untouched.iter().zip(ranges).map(channel).collect(),
        }
    }

    /// Lets a step of time pass, and distorts a faultless reading.
    pub fn act(&mut self, reading: &mut [f64], config: &FaultConfig, step_s: f64) {
        let walk = config.walk_per_root_s * step_s.sqrt();
        for (i, (value, channel)) in reading.iter_mut().zip(&mut self.channels).enumerate() {
            let deviation = channel.hysteresis(*value - channel.untouched, config);
            let deviation = channel.slow(deviation, config, step_s);
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            channel.offset += sign * config.drift_per_s * step_s;
            if walk > 0.0 {
                let drawn: f64 = StandardNormal.sample(&mut self.rng);
                channel.offset += walk * drawn;
            }
            *value = channel.untouched + deviation + channel.offset;
        }
    }
}

impl Channel {
    /// Play operator of width w: y' = min(max(y, x − w/2), x + w/2).
    fn hysteresis(&mut self, x: f64, config: &FaultConfig) -> f64 {
        let half = 0.5 * config.hysteresis * self.range;
        self.play = self.play.max(x - half).min(x + half);
        self.play
    }

    /// Creep and residue of a deviation x.
    ///
    /// The share c creeps: z' = (x − z)/τ, and (1 − c)·x + c·z is read. A residue is a share of the largest x of a touch, and fades by its time constant.
    fn slow(&mut self, x: f64, config: &FaultConfig, step_s: f64) -> f64 {
        let mut deviation = x;
        if config.creep > 0.0 {
            self.crept -= (-step_s / config.creep_s).exp_m1() * (x - self.crept);
            deviation = (1.0 - config.creep) * x + config.creep * self.crept;
        }
        if config.residue > 0.0 {
            self.residue *= (-step_s / config.residue_s).exp();
            let of_touch = config.residue * x;
            if of_touch.abs() > self.residue.abs() {
                self.residue = of_touch;
            }
            deviation += self.residue;
        }
        deviation
    }
}

/// Rounds a reading to the steps of the channels' converters.
pub fn convert(reading: &mut [f64], config: &FaultConfig) {
    if config.converter_step > 0.0 {
        reading
            .iter_mut()
            .for_each(|value| *value = (*value / config.converter_step).round() * config.converter_step);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_and_creep_follow_their_formulas() {
        let config = FaultConfig { drift_per_s: 0.5, creep: 0.2, creep_s: 2.0, ..FaultConfig::default() };
        let mut distortion = Distortion::new(&[0.0; 2], &[10.0; 2], 0);
        let mut reading = [0.0; 2];
        for _ in 0..1000 {
            reading = [10.0, 10.0];
            distortion.act(&mut reading, &config, 3e-3);
        }
        // After 3 s: the creep lacks exp(−3/2) of its share, and the lines are at ±1.5.
        let crept = 10.0 - 2.0 * (-1.5_f64).exp();
        assert!((reading[0] - (crept + 1.5)).abs() < 1e-9, "{reading:?}");
        assert!((reading[1] - (crept - 1.5)).abs() < 1e-9, "{reading:?}");
    }

    #[test]
    fn random_walk_grows_with_the_root_of_time() {
        let config = FaultConfig { walk_per_root_s: 2.0, ..FaultConfig::default() };
        let mut distortion = Distortion::new(&[0.0; 400], &[1.0; 400], 7);
        let mut reading = vec![0.0; 400];
        for _ in 0..900 {
            reading.fill(0.0);
            distortion.act(&mut reading, &config, 0.01);
        }
        let variance = reading.iter().map(|x| x * x).sum::<f64>() / 400.0;
        // 9 s of a variance of 4 a second; the variance of 400 draws is known to 7 %.
        assert!((variance / 36.0 - 1.0).abs() < 0.25, "{variance}");
    }

    #[test]
    fn hysteresis_leaves_half_its_width_after_a_touch() {
        let config = FaultConfig { hysteresis: 0.02, ..FaultConfig::default() };
        let mut distortion = Distortion::new(&[100.0], &[50.0], 0);
        let mut read = |value: f64| {
            let mut reading = [value];
            distortion.act(&mut reading, &config, 0.01);
            reading[0]
        };
        assert_eq!(
            [read(100.0), read(150.0), read(100.0), read(50.0), read(100.0)],
            [100.0, 149.5, 100.5, 50.5, 99.5]
        );
    }

    #[test]
    fn residue_fades_after_a_touch() {
        let config = FaultConfig { residue: 0.1, residue_s: 2.0, ..FaultConfig::default() };
        let mut distortion = Distortion::new(&[0.0], &[1.0], 0);
        let mut reading = [20.0];
        distortion.act(&mut reading, &config, 1.0);
        assert_eq!(reading, [22.0]);
        reading = [0.0];
        distortion.act(&mut reading, &config, 1.0);
        assert!((reading[0] - 2.0 * (-0.5_f64).exp()).abs() < 1e-12, "{reading:?}");
    }

    #[test]
    fn a_converter_rounds_to_its_step() {
        let mut reading = [3.4, -1.6];
        convert(&mut reading, &FaultConfig { converter_step: 2.0, ..FaultConfig::default() });
        assert_eq!(reading, [4.0, -2.0]);
    }
}
