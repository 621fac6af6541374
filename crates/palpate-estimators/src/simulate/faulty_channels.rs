//! Channels of a simulated bench.

use rand_xoshiro::Xoshiro256PlusPlus;

use super::draw_faults;
use crate::imperfections::{ImperfectChannels, StandardNoise};
use crate::setup::Setup;
use palpate_mechanics::sensing::{ChannelErrors, Layout, measure_with_noise};

/// Channels of a simulated bench: gains and offsets that are drawn once, noise for each reading, and imperfections in the course of time.
pub(super) struct FaultyChannels {
    pub layout: Layout,
    errors: ChannelErrors,
    pub rng: Xoshiro256PlusPlus,
    pub noise: StandardNoise,
    pub imperfect: Option<ImperfectChannels>,
}

impl FaultyChannels {
    /// The layout with the sensors at their drawn places, and the channels without imperfections.
    pub fn draw(setup: &Setup, seed: u64) -> (Layout, Self) {
        let (placed, errors, rng) = draw_faults(setup, seed);
        let noise = StandardNoise::new(None);
        (placed, Self { layout: setup.layout().clone(), errors, rng, noise, imperfect: None })
    }

    /// Advances time by a step under constant contacts with the faultless reading `clean`. Returns the reading at the end of the step with the
    /// imperfections, without noise.
    pub fn advance(&mut self, clean: &[f64], step_s: f64) -> Vec<f64> {
        match &mut self.imperfect {
            Some(channels) => channels.advance(clean, step_s),
            None => clean.to_vec(),
        }
    }

    /// A reading with fresh noise.
    pub fn measure(&mut self, values: &[f64]) -> Vec<f64> {
        let noise = self.noise.draw(self.layout.len(), &mut self.rng);
        measure_with_noise(&self.layout, values, &self.errors, &noise)
    }
}
