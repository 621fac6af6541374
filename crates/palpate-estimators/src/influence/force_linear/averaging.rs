//! Influence functions averaged over components by their probability (Hoeting et al., Statistical Science 14,
//! 1999): mean Σ w·f and variance Σ w·(v + (f − f̄)²).

use super::component::{Component, log_sum_exp};
use super::noise_prior::{NoiseDensity, NoisePrior};
use super::posterior::{Conditions, Functions, functions};
use super::prior::Prior;
use super::systematic_sample::systematic_sample;
use crate::influence::calibration::CalibrationRows;
use crate::influence::measured::MeasuredError;
use palpate_numerics::watch::Watch;

/// Least probability of a ratio, and of a noise prior, given the component.
const LEAST: f64 = 0.01;
/// Components of the systematic sample.
const SAMPLE: usize = 32;

/// Hyperparameters with their probabilities.
#[derive(Default)]
pub(super) struct Average {
    channels: usize,
    members: Vec<Member>,
}

/// A component at one ratio ρ.
struct Member {
    prior: Prior,
    ratio: f64,
    /// Probability in each channel.
    probabilities: Vec<f64>,
    /// Noise of each channel.
    densities: Vec<NoiseDensity>,
}

impl Average {
    /// Averages a systematic sample of the components.
    pub fn new(components: &[Component], noises: &[NoisePrior]) -> Self {
        let logs: Vec<f64> = components.iter().map(Component::log_evidence).collect();
        let all = log_sum_exp(logs.iter().copied());
        let channels = components.first().map_or(0, |component| component.log_densities.dim().0);
        let drawn = systematic_sample(logs.iter().map(|log| (log - all).exp()), SAMPLE);
        let drawn = components.iter().zip(drawn).filter(|(_, drawn)| *drawn > 0);
        let members_of = |(component, drawn): (&Component, usize)| {
            Member::of_component(component, noises, drawn as f64 / SAMPLE as f64)
        };
        let mut members: Vec<Member> = drawn.flat_map(members_of).collect();
        for c in 0..channels {
            let sum: f64 = members.iter().map(|member| member.probabilities[c]).sum();
            members.iter_mut().for_each(|member| member.probabilities[c] /= sum);
        }
        Self { channels, members }
    }

    /// Offsets and influence functions of unit response.
    pub fn functions(
        &self,
        presses: &CalibrationRows,
        sensors_m: &[Vec<f64>],
        places_m: &[Vec<f64>],
        watch: Watch,
    ) -> Result<Vec<Functions>, MeasuredError> {
        let mut mixtures: Vec<Vec<(f64, Functions)>> = (0..self.channels).map(|_| Vec::new()).collect();
        for member in &self.members {
            let conditions = member.conditions();
            let found = functions(&conditions, presses, member.sensors_m(sensors_m), places_m, watch)?;
            for ((c, _), functions) in conditions.channels.iter().zip(found) {
                mixtures[*c].push((member.probabilities[*c], functions));
            }
        }
        Ok(mixtures.iter().map(|mixture| Functions::averaged(mixture)).collect())
    }

    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    pub fn has_source(&self) -> bool {
        self.members.iter().any(|member| member.prior.source.is_some())
    }

    /// Shortest length scale along an axis.
    pub fn shortest_m(&self, k: usize) -> f64 {
        self.members.iter().map(|member| member.prior.lengths_m[k]).fold(f64::INFINITY, f64::min)
    }
}

impl Member {
    /// The probable ratios of a component that has the probability `share`.
    fn of_component(component: &Component, noises: &[NoisePrior], share: f64) -> Vec<Self> {
        let by_noise = component.by_noise();
        let all = log_sum_exp(by_noise.iter().copied());
        let channels = component.log_densities.dim().0;
        let of_ratio = |(r, ratio): (usize, &f64)| {
            let (mut probabilities, mut densities) =
                (vec![0.0; channels], vec![NoiseDensity::default(); channels]);
            for c in 0..channels {
                // A noise prior's probability over the density of the channel under it.
                let relative = |k: usize| by_noise[k] - all - component.of_channel(c, k);
                let logs: Vec<f64> =
                    (0..noises.len()).map(|k| relative(k) + component.log_densities[[c, k, r]]).collect();
                let probability = log_sum_exp(logs.iter().copied()).exp();
                if probability >= LEAST {
                    probabilities[c] = share * probability;
                    let kept = (0..noises.len()).filter(|k| logs[*k].exp() >= LEAST * probability);
                    densities[c].terms = kept.map(|k| (relative(k), noises[k].scales[c])).collect();
                }
            }
            let is_probable = probabilities.iter().any(|probability| *probability > 0.0);
            is_probable.then(|| Self {
                prior: component.prior.clone(),
                ratio: *ratio,
                probabilities,
                densities,
            })
        };
        component.ratios.iter().enumerate().filter_map(of_ratio).collect()
    }

    fn conditions(&self) -> Conditions<'_> {
        let channels = (0..self.probabilities.len()).filter(|c| self.probabilities[*c] > 0.0);
        Conditions {
            prior: &self.prior,
            ratio: self.ratio,
            channels: channels.map(|c| (c, None)).collect(),
            densities: &self.densities,
        }
    }

    fn sensors_m<'a>(&self, sensors_m: &'a [Vec<f64>]) -> &'a [Vec<f64>] {
        if self.prior.source.is_some() { sensors_m } else { &[] }
    }
}
