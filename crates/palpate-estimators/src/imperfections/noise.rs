//! Correlated or heavy-tailed noise.

use super::Imperfections;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal, StudentT};

#[derive(Clone, Copy, Debug)]
pub(crate) struct StandardNoise {
    /// Roots of the common and independent variance.
    weights: (f64, f64),
    heavy: Option<(StudentT<f64>, f64)>,
}

impl StandardNoise {
    pub fn new(imperfections: Option<&Imperfections>) -> Self {
        let correlation = imperfections.map_or(0.0, |imperfections| imperfections.noise_correlation);
        // A t variable of ν degrees of freedom has the variance ν/(ν − 2).
        let heavy = imperfections.and_then(|imperfections| imperfections.noise_freedom).and_then(|freedom| {
            let distribution = StudentT::new(freedom).ok()?;
            Some((distribution, ((freedom - 2.0) / freedom).sqrt()))
        });
        Self { weights: (correlation.sqrt(), (1.0 - correlation).sqrt()), heavy }
    }

    pub fn draw(&self, channels: usize, rng: &mut impl Rng) -> Vec<f64> {
        let (common, own) = self.weights;
        let shared: f64 = if common > 0.0 { rng.sample(StandardNormal) } else { 0.0 };
        let channel = |_| {
            let drawn: f64 = match self.heavy {
                None => rng.sample(StandardNormal),
                Some((distribution, scale)) => scale * distribution.sample(rng),
            };
            common * shared + own * drawn
        };
        (0..channels).map(channel).collect()
    }
}
