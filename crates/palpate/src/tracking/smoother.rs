//! The smoother: each reading with those that came after it.

use super::bank::Bank;
use super::config::TrackerConfig;
use super::gaussian::{Gaussian, Motion, W};
use super::tracker::{Track, TrackError, Tracked, Tracker};
use crate::method::Likelihood;

/// A [`Tracker`] that remembers, so that it can go back.
pub struct SmoothTracker<'a> {
    tracker: Tracker<'a>,
    length_m: f64,
    tracks: Vec<Track>,
    /// What was held possible at each reading.
    past: Vec<Vec<Remembered>>,
}

/// A hypothesis as it was.
#[derive(Clone, Copy, Debug)]
struct Remembered {
    id: u64,
    bank: Bank,
    floor_m2: f64,
}

impl<'a> SmoothTracker<'a> {
    /// A tracker that has seen nothing.
    pub fn new(likelihood: &'a dyn Likelihood, config: TrackerConfig) -> Self {
        let tracker = Tracker::new(likelihood, config);
        Self { tracker, length_m: likelihood.length_m(), tracks: Vec::new(), past: Vec::new() }
    }

    /// Takes the next reading; see [`Tracker::follow`].
    ///
    /// # Errors
    /// [`TrackError`] when the time is not later than before.
    pub fn follow(&mut self, time_s: f64, reading: &[f64]) -> Result<(), TrackError> {
        self.tracks.push(self.tracker.follow(time_s, reading)?);
        let remembered = self.tracker.hypotheses().iter().map(|hypothesis| Remembered {
            id: hypothesis.id,
            bank: hypothesis.bank,
            floor_m2: hypothesis.fit.calibration_m2,
        });
        self.past.push(remembered.collect());
        Ok(())
    }

    /// What the filter knew at each reading.
    pub fn filtered(&self) -> &[Track] {
        &self.tracks
    }

    /// What is known at each reading when all have been seen. Whether anything touches stays what the filter found; of
    /// the hypotheses it held, the one that lasted is gone back over.
    pub fn smoothed(&self) -> Vec<Track> {
        let mut smoothed = self.tracks.clone();
        // The contact at the reading after, as all readings show it.
        let mut later: Option<(u64, Gaussian)> = None;
        for k in (0..smoothed.len()).rev() {
            let lasting = later.and_then(|(id, belief)| {
                let remembered = self.past[k].iter().find(|remembered| remembered.id == id);
                remembered.map(|remembered| (remembered, self.gone_back(k, remembered, &belief)))
            });
            let last = || self.past[k].first().map(|remembered| (remembered, remembered.bank.mixed()));
            let found = if self.tracks[k].tracked.is_some() { lasting.or_else(last) } else { None };
            later = found.map(|(remembered, belief)| (remembered.id, belief));
            smoothed[k].tracked =
                found.map(|(remembered, belief)| Tracked::of(&belief, remembered.floor_m2, self.length_m));
        }
        smoothed
    }

    /// What a hypothesis was at reading `k`, given what it was at the next: Rauch, Tung and Striebel's step with the bank as
    /// one Gaussian, and the motion as restless as the bank's shares say.
    fn gone_back(&self, k: usize, remembered: &Remembered, later: &Gaussian) -> Gaussian {
        let belief = remembered.bank.mixed();
        let step = self.tracker.step(self.tracks[k + 1].time_s - self.tracks[k].time_s, belief.mean[W]);
        let shares = remembered.bank.predicted(&step).shares;
        belief.smoothed(&Motion::mixed(shares, &step.motions), later)
    }
}
