//! The smoother: each reading with those that came after it.

use super::belief::Belief;
use super::config::TrackerConfig;
use super::track::{Track, TrackError, Tracked};
use super::tracker::Tracker;
use crate::likelihood::Likelihood;

/// A [`Tracker`] that remembers, so that it can go back.
pub struct SmoothTracker<'a> {
    tracker: Tracker<'a>,
    likelihood: &'a dyn Likelihood,
    tracks: Vec<Track>,
    /// What was held possible at each reading, of contacts.
    past: Vec<Vec<Remembered>>,
}

/// A hypothesis as it was.
#[derive(Clone, Debug)]
struct Remembered {
    id: u64,
    belief: Belief,
}

impl<'a> SmoothTracker<'a> {
    /// A tracker that has seen nothing.
    pub fn new(likelihood: &'a dyn Likelihood, config: TrackerConfig) -> Self {
        let tracker = Tracker::new(likelihood, config);
        Self { tracker, likelihood, tracks: Vec::new(), past: Vec::new() }
    }

    /// Takes the next reading; see [`Tracker::follow`].
    ///
    /// # Errors
    /// [`TrackError`] when the time is not later than before.
    pub fn follow(&mut self, time_s: f64, reading: &[f64]) -> Result<(), TrackError> {
        let track = self.tracker.follow(time_s, reading)?;
        let lasts = |id: u64| self.tracker.hypotheses().iter().any(|hypothesis| hypothesis.id == id);
        if let Some(before) = self.past.last_mut() {
            // Nobody goes back to what neither lasted nor was shown.
            let mut number = 0;
            before.retain(|remembered| {
                number += 1;
                number == 1 || lasts(remembered.id)
            });
        }
        // The one that is shown comes first.
        let shown = track.contacts.len();
        let (shown, others): (Vec<_>, Vec<_>) = self
            .tracker
            .hypotheses()
            .iter()
            .filter(|hypothesis| hypothesis.belief.contacts() > 0)
            .partition(|hypothesis| hypothesis.belief.contacts() == shown);
        let remembered = shown
            .into_iter()
            .chain(others)
            .map(|hypothesis| Remembered { id: hypothesis.id, belief: hypothesis.belief.clone() });
        self.past.push(remembered.collect());
        self.tracks.push(track);
        Ok(())
    }

    /// What the filter knew at each reading.
    pub fn filtered(&self) -> &[Track] {
        &self.tracks
    }

    /// What is known at each reading when all have been seen. How many contacts there are stays what the filter found; of
    /// the hypotheses it held, the one that lasted is gone back over.
    pub fn smoothed(&self) -> Vec<Track> {
        let mut smoothed = self.tracks.clone();
        // The contacts at the reading after, as all readings show them.
        let mut later: Option<(u64, Belief)> = None;
        for k in (0..smoothed.len()).rev() {
            let number = self.tracks[k].contacts.len();
            let lasting = later.and_then(|(id, belief)| self.gone_back(k, id, &belief));
            let lasting = lasting.filter(|(_, belief)| belief.contacts() == number);
            let last = || self.past[k].first().map(|one| (one.id, one.belief.clone()));
            later = if number > 0 { lasting.or_else(last) } else { None };
            let moments = later.as_ref().map(|(_, belief)| belief.mixed().contacts());
            smoothed[k].contacts =
                moments.map_or_else(Vec::new, |moments| Tracked::of(&moments, self.likelihood));
        }
        smoothed
    }

    /// What hypothesis `id` was at reading `k`, given what it was at the next.
    fn gone_back(&self, k: usize, id: u64, later: &Belief) -> Option<(u64, Belief)> {
        let remembered = self.past[k].iter().find(|remembered| remembered.id == id)?;
        let step = self.tracker.step(self.tracks[k + 1].time_s - self.tracks[k].time_s);
        remembered.belief.smoothed(&step, self.likelihood.geometry(), later).map(|belief| (id, belief))
    }
}
