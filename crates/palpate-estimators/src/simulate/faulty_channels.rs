//! Faulty channels of a simulated bench.

use rand_xoshiro::Xoshiro256PlusPlus;

use super::draw_faults;
use crate::imperfections::{ImperfectChannels, StandardNoise};
use crate::setup::Setup;
use palpate_mechanics::sensing::{ChannelErrors, Layout, measure_with_noise};

pub(super) struct FaultyChannels {
    pub layout: Layout,
    errors: ChannelErrors,
    pub rng: Xoshiro256PlusPlus,
    pub noise: StandardNoise,
    pub imperfect: Option<ImperfectChannels>,
}

impl FaultyChannels {
    /// Displaced sensors, and channels without imperfections.
    pub fn draw(setup: &Setup, seed: u64) -> (Layout, Self) {
        let (placed, errors, rng) = draw_faults(setup, seed);
        let noise = StandardNoise::new(None);
        (placed, Self { layout: setup.layout().clone(), errors, rng, noise, imperfect: None })
    }

    pub fn advance(&mut self, clean: &[f64], step_s: f64) -> Vec<f64> {
        match &mut self.imperfect {
            Some(channels) => channels.advance(clean, step_s),
            None => clean.to_vec(),
        }
    }

    pub fn measure(&mut self, values: &[f64]) -> Vec<f64> {
        let noise = self.noise.draw(self.layout.len(), &mut self.rng);
        measure_with_noise(&self.layout, values, &self.errors, &noise)
    }
}
