//! Filter and smoother of hypotheses.

use super::bank::Step;
use super::belief::{Belief, Moments, Observation};
use super::birth::BirthModel;
use super::slow::{SlowState, widen};
use super::{Track, TrackError, TrackedContact, TrackerConfig};
use crate::force_prior::ForcePrior;
use crate::likelihood::{Geometry, Likelihood};
use ndarray::Array2;
use palpate_core::{Estimate, Status};
use palpate_numerics::watch::{Cancelled, Watch};
use std::sync::Arc;

/// Greatest number of hypotheses.
const MOST_HYPOTHESES: usize = 12;
/// Greatest log ratio of the best hypothesis to a retained one.
const MOST_LOG_RATIO: f64 = 16.0;
/// Greatest number of contacts.
const MOST_CONTACTS: usize = 2;

/// Fainter contacts end with probability ½ at the next reading, because they could be anywhere. Squared
/// change over noise variance, summed over channels.
const UNSEEN: f64 = 9.0;

/// Filter of up to two contacts on a line, or one on a plane.
///
/// ```
/// use palpate_estimators::estimator::{Tracker, TrackerConfig};
/// use palpate_estimators::{arrangement::Training, fit::Fit, influence::Influence, setup::Setup};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(10).repeated(5), 0)?;
/// let locator = Influence::default().fit(&setup, &presses)?.into_locator();
/// let config = TrackerConfig::default();
/// let tracking = locator.tracking(&config)?;
/// let mut tracker = Tracker::new(tracking.likelihood(), config);
/// tracker.update(0.0, &presses.rows[20].reading)?;
/// let track = tracker.update(0.01, &presses.rows[21].reading)?;
/// assert!((track.contacts[0].x_m - mm(180.0)).abs() < mm(1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Tracker {
    likelihood: Arc<dyn Likelihood>,
    config: TrackerConfig,
    /// `None` for a known force.
    force_prior: Option<ForcePrior>,
    hypotheses: Vec<Hypothesis>,
    time_s: Option<f64>,
    next_id: u64,
    whitened: Vec<f64>,
    /// Drift and creep, created at the first reading.
    slow: Option<SlowState>,
}

/// Contacts that came at some time.
#[derive(Clone, Debug, PartialEq)]
struct Hypothesis {
    id: u64,
    /// ln of the probability.
    weight: f64,
    belief: Belief,
    /// Contacts that readings barely determine.
    unseen: [bool; MOST_CONTACTS],
}

/// Log birth probabilities.
#[derive(Clone, Copy, Debug)]
struct LogBirthProbabilities {
    /// Untouched, or after an end.
    one: f64,
    /// Simultaneous.
    two: f64,
    /// Beside one contact.
    second_contact: f64,
}

impl Tracker {
    /// Creates a tracker.
    pub fn new(likelihood: Arc<dyn Likelihood>, config: TrackerConfig) -> Self {
        Self {
            force_prior: likelihood.force_range().map(ForcePrior::from),
            likelihood,
            config,
            hypotheses: Vec::new(),
            time_s: None,
            next_id: 0,
            whitened: Vec::new(),
            slow: None,
        }
    }

    /// Updates by a reading at `time_s` seconds.
    ///
    /// # Errors
    /// [`TrackError`] unless time increases, without effect.
    pub fn update(&mut self, time_s: f64, reading: &[f64]) -> Result<Track, TrackError> {
        let duration_s = match self.time_s {
            Some(before_s) if time_s > before_s => Some(time_s - before_s),
            Some(before_s) => return Err(TrackError::Time { time_s, before_s }),
            None => None,
        };
        let likelihood = Arc::clone(&self.likelihood);
        let mut whitened = std::mem::take(&mut self.whitened);
        likelihood.whiten(reading, &mut whitened);
        let mut reading = reading.to_vec();
        if let Some(slow) = self.slow(reading.len()) {
            slow.subtract(time_s, duration_s, &mut whitened, &mut reading);
        }
        let is_residue = likelihood.is_residue(&reading);
        let mut single = likelihood.single_estimate(&reading);
        let log_births = self.predict(duration_s);
        if is_residue {
            // The likelihood models only noise: it would explain the residue by a persistent light contact.
            single = Estimate::of_contact(single.contact, Status::NoContact);
            self.end_contacts();
        }
        let observation = Observation {
            likelihood: &*likelihood,
            whitened: &whitened,
            swings: self.config.swing.is_some(),
        };
        let born = self.births(log_births, observation, &single);
        self.apply_observation(observation);
        born.into_iter().for_each(|(weight, belief)| self.add(weight, belief));
        let moments = self.prune();
        let mut track = self.track(time_s, single, moments);
        if let Some(slow) = &mut self.slow {
            let probability = track.numbers[track.contacts.len()];
            // A vibrating surface does not drift.
            if self.config.swing.is_none() || track.contacts.is_empty() {
                slow.learn(&*likelihood, &whitened, &track.contacts, probability);
            }
            if let Some(covariance) = slow.drift_covariance() {
                widen(covariance, &*likelihood, &mut track.contacts);
            }
        }
        self.whitened = whitened;
        self.time_s = Some(time_s);
        TrackedContact::widen_by_check(&mut track.contacts, &*likelihood);
        Ok(track)
    }

    /// Subtracts a baseline shift per channel. After a shift above the noise, drift and creep restart.
    pub fn move_baseline(&mut self, by: &[f64]) {
        if let Some(slow) = self.slow(by.len()) {
            slow.move_baseline(by);
        }
    }

    fn slow(&mut self, channels: usize) -> Option<&mut SlowState> {
        let TrackerConfig { drift, creep, .. } = self.config;
        let drifts = drift.is_some() || self.likelihood.untouched_drift().is_some();
        if self.slow.is_none() && (drifts || creep.is_some()) {
            self.slow = Some(SlowState::new(&*self.likelihood, channels, drift, creep));
        }
        self.slow.as_mut()
    }

    fn step(&self, duration_s: f64) -> Step {
        Step::new(&self.config, duration_s, self.likelihood.known_force_n().is_some())
    }

    fn most_contacts(&self) -> usize {
        self.likelihood.most_contacts().min(MOST_CONTACTS)
    }

    /// With births and ends.
    fn predict(&mut self, duration_s: Option<f64>) -> LogBirthProbabilities {
        // At the first reading, all numbers of contacts are equally probable.
        let Some(duration_s) = duration_s else {
            let each = -((1 + self.most_contacts()) as f64).ln();
            let belief = Belief::no_contact();
            self.add(each, belief);
            return LogBirthProbabilities { one: each, two: each, second_contact: f64::NEG_INFINITY };
        };
        let changes = 0.5 * (1.0 - (-2.0 * self.config.changes_per_s * duration_s).exp());
        let jumps = 1.0 - (-self.config.jumps_per_s * duration_s).exp();
        let step = self.step(duration_s);
        let most = self.most_contacts();
        let mut with = [0.0; 1 + MOST_CONTACTS];
        let mut left = Vec::new();
        for hypothesis in &mut self.hypotheses {
            let contacts = hypothesis.belief.contacts();
            with[contacts] += hypothesis.weight.exp();
            hypothesis.belief = hypothesis.belief.predicted(&step, self.likelihood.geometry());
            let ends = hypothesis.unseen.map(|unseen| if unseen { 0.5f64 } else { changes });
            for (k, ends) in ends.into_iter().enumerate().take(contacts) {
                let rest = hypothesis.belief.without_contact(k);
                left.extend(rest.map(|belief| (hypothesis.weight + ends.ln(), belief)));
            }
            let comes = if contacts < most { changes } else { 0.0 };
            let stays: f64 = ends.iter().take(contacts).map(|ends| (-ends).ln_1p()).sum();
            hypothesis.weight += stays + (-comes).ln_1p() + (-jumps).ln_1p();
        }
        self.add_remaining(left);
        LogBirthProbabilities {
            one: (with[0] * changes + with[1] * jumps + with[2] * changes * jumps).ln(),
            two: (with[0] * changes * changes + with[1] * changes * jumps + with[2] * jumps).ln(),
            second_contact: changes.ln(),
        }
    }

    fn end_contacts(&mut self) {
        self.hypotheses.retain(|hypothesis| hypothesis.belief.contacts() == 0);
        if self.hypotheses.is_empty() {
            self.add(0.0, Belief::no_contact());
        }
    }

    /// Merges all without contact.
    fn add_remaining(&mut self, left: Vec<(f64, Belief)>) {
        for (weight, belief) in left {
            let same = self.hypotheses.iter_mut().find(|hypothesis| hypothesis.belief.contacts() == 0);
            match (same, belief.contacts()) {
                (Some(nothing), 0) => {
                    let sum = weight.max(nothing.weight) + (-(weight - nothing.weight).abs()).exp().ln_1p();
                    nothing.belief.absorb(&belief, (weight - sum).exp());
                    nothing.weight = sum;
                }
                _ => self.add(weight, belief),
            }
        }
    }

    fn add(&mut self, weight: f64, belief: Belief) {
        self.hypotheses.push(Hypothesis { id: self.next_id, weight, belief, unseen: [false; MOST_CONTACTS] });
        self.next_id += 1;
    }

    fn apply_observation(&mut self, observation: Observation) {
        for hypothesis in &mut self.hypotheses {
            match hypothesis.belief.updated(observation) {
                Some((belief, evidence)) => {
                    hypothesis.belief = belief;
                    hypothesis.weight += evidence;
                }
                None => hypothesis.weight = f64::NEG_INFINITY,
            }
        }
    }

    fn births(
        &self,
        log_births: LogBirthProbabilities,
        observation: Observation,
        single: &Estimate,
    ) -> Vec<(f64, Belief)> {
        let (config, force_prior) = (&self.config, self.force_prior.as_ref());
        let weighted = |(evidence, belief): (f64, Belief)| {
            (if belief.contacts() == 1 { log_births.one } else { log_births.two } + evidence, belief)
        };
        match self.likelihood.geometry() {
            Geometry::Line(likelihood) => {
                let births = BirthModel { likelihood, observation, config, force_prior, single };
                let mut born: Vec<_> = births.first_contacts().into_iter().map(weighted).collect();
                for hypothesis in &self.hypotheses {
                    if let Belief::One(bank) = &hypothesis.belief {
                        let weight = hypothesis.weight + log_births.second_contact;
                        born.extend(
                            births.second_contact(bank).map(|(evidence, belief)| (weight + evidence, belief)),
                        );
                    }
                }
                born
            }
            Geometry::Plane(likelihood) => {
                let births = BirthModel { likelihood, observation, config, force_prior, single };
                births.first_contacts().into_iter().map(weighted).collect()
            }
        }
    }

    /// Normalises, drops, merges; returns the other moments.
    fn prune(&mut self) -> Vec<Vec<Moments>> {
        self.hypotheses.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let best = self.hypotheses.first().map_or(f64::NEG_INFINITY, |first| first.weight);
        if best == f64::NEG_INFINITY {
            // A reading that no hypothesis explains has no information: restart.
            self.hypotheses.clear();
            self.add(0.0, Belief::no_contact());
            return vec![Vec::new()];
        }
        let mut kept: Vec<Hypothesis> = Vec::with_capacity(MOST_HYPOTHESES);
        let mut moments: Vec<Vec<Moments>> = Vec::with_capacity(MOST_HYPOTHESES);
        for mut hypothesis in self.hypotheses.drain(..) {
            // The hypothesis without contact stays, as a start for later contacts.
            let nothing = hypothesis.belief.contacts() == 0;
            let probable = hypothesis.weight > best - MOST_LOG_RATIO;
            if !nothing && (!probable || kept.len() >= MOST_HYPOTHESES) {
                continue;
            }
            let contacts = hypothesis.belief.moments();
            match moments.iter().position(|other| are_same_contacts(other, &contacts)) {
                Some(same) => {
                    let other: &mut Hypothesis = &mut kept[same];
                    other.weight += (hypothesis.weight - other.weight).exp().ln_1p();
                }
                None => {
                    for (unseen, contact) in hypothesis.unseen.iter_mut().zip(&contacts) {
                        *unseen = self.likelihood.signal(contact.contact()) < UNSEEN;
                    }
                    kept.push(hypothesis);
                    moments.push(contacts);
                }
            }
        }
        self.hypotheses = kept;
        let sum: f64 = self.hypotheses.iter().map(|hypothesis| (hypothesis.weight - best).exp()).sum();
        let all = best + sum.ln();
        self.hypotheses
            .iter_mut()
            .for_each(|hypothesis| hypothesis.weight = (hypothesis.weight - all).max(f64::MIN));
        moments
    }

    fn track(&self, time_s: f64, single: Estimate, moments: Vec<Vec<Moments>>) -> Track {
        let mut numbers = [0.0; 1 + MOST_CONTACTS];
        for hypothesis in &self.hypotheses {
            numbers[hypothesis.belief.contacts()] += hypothesis.weight.exp();
        }
        let number = (1..numbers.len()).fold(0, |best, i| if numbers[i] > numbers[best] { i } else { best });
        let of_number =
            self.hypotheses.iter().zip(moments).filter(|(one, _)| one.belief.contacts() == number);
        let beliefs: Vec<(f64, Vec<Moments>)> =
            of_number.map(|(hypothesis, contacts)| (hypothesis.weight.exp(), contacts)).collect();
        let contacts = TrackedContact::from_mixture(&beliefs, &*self.likelihood);
        Track { time_s, numbers, contacts, single }
    }
}

/// In either order.
fn are_same_contacts(a: &[Moments], b: &[Moments]) -> bool {
    let same = |b: &mut dyn Iterator<Item = &Moments>| a.iter().zip(b).all(|(a, b)| a.is_same_contact(b));
    a.len() == b.len() && (same(&mut b.iter()) || same(&mut b.iter().rev()))
}

/// Smoother with a [`Tracker`].
pub struct SmoothTracker {
    tracker: Tracker,
    tracks: Vec<Track>,
    /// Hypotheses at each reading, by id.
    history: Vec<Vec<(u64, Belief)>>,
    /// After each reading; empty without drift.
    drift_covariances: Vec<Array2<f64>>,
}

impl SmoothTracker {
    /// Creates a smoother.
    pub fn new(likelihood: Arc<dyn Likelihood>, config: TrackerConfig) -> Self {
        Self {
            tracker: Tracker::new(likelihood, config),
            tracks: Vec::new(),
            history: Vec::new(),
            drift_covariances: Vec::new(),
        }
    }

    /// Updates as [`Tracker::update`].
    ///
    /// # Errors
    /// [`TrackError`].
    pub fn update(&mut self, time_s: f64, reading: &[f64]) -> Result<(), TrackError> {
        let track = self.tracker.update(time_s, reading)?;
        let lasts = |id: u64| self.tracker.hypotheses.iter().any(|hypothesis| hypothesis.id == id);
        if let Some(before) = self.history.last_mut() {
            // Smoothing needs only hypotheses that lasted or were reported.
            let shown = before.first().map(|(id, _)| *id);
            before.retain(|(id, _)| shown == Some(*id) || lasts(*id));
        }
        let with_contacts =
            self.tracker.hypotheses.iter().filter(|hypothesis| hypothesis.belief.contacts() > 0);
        let mut remembered: Vec<_> =
            with_contacts.map(|hypothesis| (hypothesis.id, hypothesis.belief.clone())).collect();
        // The reported hypothesis comes first.
        remembered.sort_by_key(|(_, belief)| belief.contacts() != track.contacts.len());
        self.history.push(remembered);
        self.drift_covariances
            .extend(self.tracker.slow.as_ref().and_then(SlowState::drift_covariance).cloned());
        self.tracks.push(track);
        Ok(())
    }

    /// Filtered tracks.
    pub fn filtered(&self) -> &[Track] {
        &self.tracks
    }

    /// Smoothed tracks, with the filter's numbers of contacts.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn smoothed(&self, watch: Watch) -> Result<Vec<Track>, Cancelled> {
        /// Readings per check of the watch.
        const EACH: usize = 16;
        let mut smoothed = self.tracks.clone();
        // The contacts at the next reading, given all readings.
        let mut later: Option<(u64, Belief)> = None;
        for k in (0..smoothed.len()).rev() {
            if k % EACH == 0 {
                watch.counted("smoothing", "readings", smoothed.len() - k, smoothed.len())?;
            }
            let number = self.tracks[k].contacts.len();
            let lasting = later.and_then(|(id, belief)| self.smoothed_belief(k, id, &belief));
            let lasting = lasting.filter(|(_, belief)| belief.contacts() == number);
            let last = || self.history[k].first().cloned();
            later = if number > 0 { lasting.or_else(last) } else { None };
            let moments = later.as_ref().map(|(_, belief)| belief.moments());
            let likelihood = &*self.tracker.likelihood;
            let contacts = &mut smoothed[k].contacts;
            *contacts =
                moments.map_or_else(Vec::new, |moments| TrackedContact::from_belief(&moments, likelihood));
            if let Some(covariance) = self.drift_covariances.get(k) {
                widen(covariance, likelihood, contacts);
            }
            TrackedContact::widen_by_check(contacts, likelihood);
        }
        Ok(smoothed)
    }

    fn smoothed_belief(&self, k: usize, id: u64, later: &Belief) -> Option<(u64, Belief)> {
        let (_, belief) = self.history[k].iter().find(|(remembered, _)| *remembered == id)?;
        let step = self.tracker.step(self.tracks[k + 1].time_s - self.tracks[k].time_s);
        belief.smoothed(&step, self.tracker.likelihood.geometry(), later).map(|belief| (id, belief))
    }
}
