use palpate_estimators::imperfections::Imperfections;
use palpate_estimators::setup::Setup;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::ops::Range;

/// Configuration of faults; none by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaultConfig {
    /// Share of dropped frames, 0 to 1.
    pub dropped: f64,
    /// Share of torn frames, 0 to 1.
    pub torn: f64,
    /// Step of the converters in SI units or raw, in place of the sensors' resolution.
    pub converter_step: Option<f64>,
    /// Imperfections of the bench, without their schedule.
    pub imperfections: Imperfections,
}

impl FaultConfig {
    /// Imperfections of a setup, without faults of transmission.
    pub fn of_setup(setup: &Setup) -> Self {
        let imperfections = setup.imperfections().copied().unwrap_or_default();
        Self { imperfections, ..Self::default() }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Delivery {
    Whole,
    Torn {
        /// Range of the missing bytes.
        lost: Range<usize>,
    },
    Dropped,
}

pub struct Faults {
    pub config: FaultConfig,
    rng: Xoshiro256PlusPlus,
}

impl Faults {
    pub fn new(config: FaultConfig, seed: u64) -> Self {
        // This random stream is independent of those of the noise and the finger.
        Self { config, rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xFA_0175) }
    }

    /// Draws the fate of a frame of `length` bytes.
    pub fn next(&mut self, length: usize) -> Delivery {
        let FaultConfig { dropped, torn, .. } = self.config;
        if dropped <= 0.0 && torn <= 0.0 {
            return Delivery::Whole;
        }
        let drawn: f64 = self.rng.random();
        if drawn < dropped {
            Delivery::Dropped
        } else if drawn < dropped + torn && length > 1 {
            // At least one byte stays, and at least one is lost.
            let start = self.rng.random_range(0..length);
            let most = if start == 0 { length - 1 } else { length - start };
            Delivery::Torn { lost: start..start + self.rng.random_range(1..=most) }
        } else {
            Delivery::Whole
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_come_as_often_as_they_should_and_tear_a_part() {
        let config = FaultConfig { dropped: 0.1, torn: 0.2, ..FaultConfig::default() };
        let mut faults = Faults::new(config, 1);
        let (mut dropped, mut torn) = (0, 0);
        for _ in 0..10_000 {
            match faults.next(30) {
                Delivery::Dropped => dropped += 1,
                Delivery::Torn { lost } => {
                    torn += 1;
                    assert!(!lost.is_empty() && lost.end <= 30 && lost.len() < 30, "{lost:?}");
                }
                Delivery::Whole => {}
            }
        }
        assert!((900..1100).contains(&dropped) && (1850..2150).contains(&torn), "{dropped} {torn}");
    }
}
