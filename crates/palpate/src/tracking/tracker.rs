//! The filter: each reading as it comes.

use super::bank::{Bank, Step};
use super::config::TrackerConfig;
use super::gaussian::{Gaussian, V, W, X};
use super::hypothesis::{Hypothesis, are_one, births};
use crate::method::Likelihood;
use crate::numerics::normal_distribution;
use palpate_core::Estimate;

/// The most contacts that are held possible at once.
const MOST_HYPOTHESES: usize = 12;
/// A hypothesis this many times less probable than the best is dropped, as its logarithm.
const NEGLIGIBLE: f64 = 16.0;
/// Below this share of the probability, one hypothesis does not speak for all.
const SURE: f64 = 0.98;
/// Half the width of a normal distribution's 95 % interval, in standard deviations.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Follows one contact on a one-dimensional surface through readings in time.
pub struct Tracker<'a> {
    likelihood: &'a dyn Likelihood,
    config: TrackerConfig,
    /// ln of the probability that nothing touches.
    nothing: f64,
    hypotheses: Vec<Hypothesis>,
    time_s: Option<f64>,
    next_id: u64,
    whitened: Vec<f64>,
}

/// What is known at one reading.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// When the reading was taken, in seconds.
    pub time_s: f64,
    /// The probability that something touches.
    pub touching: f64,
    /// The contact, where something rather touches than not.
    pub tracked: Option<Tracked>,
    /// What the reading says by itself.
    pub alone: Estimate,
}

/// A contact that is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracked {
    /// Where it is, in metres.
    pub x_m: f64,
    /// How fast it moves, in m/s.
    pub speed_m_per_s: f64,
    /// How hard it presses, in newtons.
    pub force_n: f64,
    /// Standard deviations of the three, the position's with what calibration leaves.
    pub sd: [f64; 3],
    /// The 95 % interval of the position, in metres.
    pub x_95_m: (f64, f64),
}

/// A reading that cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Time does not go on.
    #[error("the reading is of {time_s} s; it must be later than the one before, of {before_s} s")]
    Time {
        /// Its time, in seconds.
        time_s: f64,
        /// The time of the one before.
        before_s: f64,
    },
}

impl<'a> Tracker<'a> {
    /// A tracker that has seen nothing.
    pub fn new(likelihood: &'a dyn Likelihood, config: TrackerConfig) -> Self {
        Self {
            likelihood,
            config,
            nothing: 0.0,
            hypotheses: Vec::new(),
            time_s: None,
            next_id: 0,
            whitened: Vec::new(),
        }
    }

    /// Takes the next reading: one finite value a channel, at `time_s` seconds.
    ///
    /// # Errors
    /// [`TrackError`] when the time is not later than before; the reading is then as if it had not been.
    pub fn follow(&mut self, time_s: f64, reading: &[f64]) -> Result<Track, TrackError> {
        let duration_s = self.duration(time_s)?;
        let silence = self.likelihood.whiten(reading, &mut self.whitened);
        let alone = self.likelihood.locate_alone(reading);
        let newborn = self.let_time_pass(duration_s);
        self.weigh(silence);
        self.give_birth(newborn, &alone);
        self.tidy();
        self.time_s = Some(time_s);
        Ok(self.track(time_s, alone))
    }

    /// The hypotheses, the most probable first.
    pub(super) fn hypotheses(&self) -> &[Hypothesis] {
        &self.hypotheses
    }

    /// How this tracker's contacts move in a step.
    pub(super) fn step(&self, duration_s: f64, force_n: f64) -> Step {
        Step::new(&self.config, duration_s, force_n, self.likelihood.known_force_n().is_none())
    }

    fn duration(&self, time_s: f64) -> Result<Option<f64>, TrackError> {
        match self.time_s {
            Some(before_s) if time_s > before_s => Ok(Some(time_s - before_s)),
            Some(before_s) => Err(TrackError::Time { time_s, before_s }),
            None => Ok(None),
        }
    }

    /// Moves every hypothesis, and lets contacts come and go; ln of the probability that one has just come.
    fn let_time_pass(&mut self, duration_s: Option<f64>) -> f64 {
        // Before the first reading, a contact is as probable as none.
        let Some(duration_s) = duration_s else {
            self.nothing = 0.5f64.ln();
            return self.nothing;
        };
        let changes = 0.5 * (1.0 - (-2.0 * self.config.changes_per_s * duration_s).exp());
        let jumps = 1.0 - (-self.config.jumps_per_s * duration_s).exp();
        let touching: f64 = self.hypotheses.iter().map(|hypothesis| hypothesis.weight.exp()).sum();
        let nothing = self.nothing.exp();
        for i in 0..self.hypotheses.len() {
            let step = self.step(duration_s, self.hypotheses[i].bank.mixed().mean[W]);
            let hypothesis = &mut self.hypotheses[i];
            hypothesis.bank = hypothesis.bank.predicted(&step);
            hypothesis.weight += (1.0 - changes).ln() + (1.0 - jumps).ln();
        }
        self.nothing = (nothing * (1.0 - changes) + touching * changes).ln();
        (nothing * changes + touching * (1.0 - changes) * jumps).ln()
    }

    /// Weighs what there is by the reading, and moves it.
    fn weigh(&mut self, silence: f64) {
        self.nothing -= 0.5 * silence;
        for hypothesis in &mut self.hypotheses {
            match hypothesis.bank.updated(self.likelihood, &self.whitened, self.config.inertia_s2()) {
                Some((bank, fit, evidence)) => {
                    (hypothesis.bank, hypothesis.fit) = (bank, fit);
                    hypothesis.weight += evidence;
                }
                None => hypothesis.weight = f64::NEG_INFINITY,
            }
        }
    }

    fn give_birth(&mut self, newborn: f64, alone: &Estimate) {
        for (evidence, belief, fit) in births(self.likelihood, &self.config, &self.whitened, alone) {
            let (id, weight) = (self.next_id, newborn + evidence);
            self.hypotheses.push(Hypothesis { id, weight, bank: Bank::of(belief), fit });
            self.next_id += 1;
        }
    }

    /// Makes the weights probabilities again, drops what is improbable, and lets the more probable of two that are one
    /// stand for both.
    fn tidy(&mut self) {
        self.hypotheses.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let mut kept: Vec<(Hypothesis, Gaussian)> = Vec::with_capacity(MOST_HYPOTHESES);
        let best = self.hypotheses.first().map_or(f64::NEG_INFINITY, |first| first.weight);
        for hypothesis in self.hypotheses.drain(..) {
            let probable = hypothesis.weight > best - NEGLIGIBLE;
            if !probable || kept.len() == MOST_HYPOTHESES {
                break;
            }
            let belief = hypothesis.bank.mixed();
            match kept.iter_mut().find(|(_, other)| are_one(other, &belief)) {
                Some((other, _)) => other.weight += (hypothesis.weight - other.weight).exp().ln_1p(),
                None => kept.push((hypothesis, belief)),
            }
        }
        self.hypotheses.extend(kept.into_iter().map(|(hypothesis, _)| hypothesis));
        let most = self.nothing.max(best);
        let sum = (self.nothing - most).exp()
            + self.hypotheses.iter().map(|hypothesis| (hypothesis.weight - most).exp()).sum::<f64>();
        let all = most + sum.ln();
        self.nothing = (self.nothing - all).max(f64::MIN);
        self.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.weight -= all);
    }

    fn track(&self, time_s: f64, alone: Estimate) -> Track {
        let touching = (1.0 - self.nothing.exp()).clamp(0.0, 1.0);
        let tracked = self.hypotheses.first().filter(|_| touching > 0.5).map(|best| {
            let floor_m2 = best.fit.calibration_m2;
            let mut tracked = Tracked::of(&best.bank.mixed(), floor_m2, self.likelihood.length_m());
            if best.weight < touching.ln() + SURE.ln() {
                tracked.x_95_m = self.interval(floor_m2);
            }
            tracked
        });
        Track { time_s, touching, tracked, alone }
    }

    /// The 95 % interval over all hypotheses.
    fn interval(&self, floor_m2: f64) -> (f64, f64) {
        let beliefs: Vec<(f64, f64, f64)> = self
            .hypotheses
            .iter()
            .map(|hypothesis| {
                let belief = hypothesis.bank.mixed();
                (hypothesis.weight.exp(), belief.mean[X], (belief.covariance[X][X] + floor_m2).sqrt())
            })
            .collect();
        let all: f64 = beliefs.iter().map(|(weight, ..)| weight).sum();
        let below = |x_m: f64| -> f64 {
            beliefs
                .iter()
                .map(|(weight, mean, sd)| weight * normal_distribution((x_m - mean) / sd))
                .sum::<f64>()
                / all
        };
        let quantile = |share: f64| {
            let (mut low, mut high) = (0.0, self.likelihood.length_m());
            for _ in 0..24 {
                let middle = 0.5 * (low + high);
                if below(middle) < share { low = middle } else { high = middle }
            }
            0.5 * (low + high)
        };
        (quantile(0.025), quantile(0.975))
    }
}

impl Tracked {
    /// The contact that a belief is about, of a surface of length `length_m`.
    pub(super) fn of(belief: &Gaussian, floor_m2: f64, length_m: f64) -> Self {
        let [x_m, speed_m_per_s, _, force_n] = belief.mean;
        let variance = |i: usize| belief.covariance[i][i].max(0.0);
        let sd = [(variance(X) + floor_m2).sqrt(), variance(V).sqrt(), variance(W).sqrt()];
        let half_m = NORMAL_95 * sd[0];
        Self {
            x_m,
            speed_m_per_s,
            force_n,
            sd,
            x_95_m: ((x_m - half_m).max(0.0), (x_m + half_m).min(length_m)),
        }
    }
}
