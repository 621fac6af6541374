//! Errors of a track and of its single readings, and their growth with the contact's speed.

use crate::estimator::{
    ContactEstimate, Estimate, Locator, NotTrackable, SmoothTracker, Status, Track, TrackError, Tracked,
    TrackerConfig,
};
use crate::evaluation::covered;
use crate::recording::TimedRecording;
use crate::setup::Setup;
use crate::simulate::{MovingContacts, SimulateError, simulate_moving};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};

/// Mean errors over the contacts while they touched, in metres, and coverage of the 95 % intervals. Several detected contacts are paired
/// with the true ones such that the sum of the distances is least.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct TrackErrors {
    /// Number of readings with at least one contact.
    pub readings: usize,
    /// Number of touching contacts that the tracker had, over all readings. The errors of the track are those of these contacts.
    pub tracked: usize,
    /// Mean error of single readings.
    pub single_m: f64,
    /// Mean error of the track.
    pub track_m: f64,
    /// Share of the contacts of single readings with an interval that contains the true one.
    pub single_covered: f64,
    /// Share of the track's intervals that contain the true one.
    pub track_covered: f64,
    /// Share of all readings at which the single reading gives the true number of contacts.
    pub single_number_right: f64,
    /// Share of all readings at which the tracker has the true number of contacts.
    pub track_number_right: f64,
}

/// Sums over contacts.
#[derive(Default)]
struct Sums {
    contacts: usize,
    error_m: f64,
    covered: usize,
    numbers_right: usize,
}

impl Sums {
    /// Adds the true and the detected contacts of a reading.
    fn add(&mut self, truths: &[Position], found: &[ContactEstimate], extent: Extent) {
        self.numbers_right += usize::from(truths.len() == found.len());
        let places: Vec<Position> = found.iter().map(|contact| contact.position).collect();
        for (truth, mate) in pairs(truths, &places) {
            let (truth, contact) = (truths[truth], found[mate]);
            self.contacts += 1;
            self.error_m += contact.position.distance_m(truth);
            self.covered += usize::from(covered(&contact, truth, extent) == Some(true));
        }
    }

    fn mean(&self, sum: f64) -> f64 {
        sum / self.contacts.max(1) as f64
    }
}

impl TrackErrors {
    /// Compares tracks with the true contacts of each, which have force 0 where they do not touch; `None` where no contact touched, or none
    /// was tracked.
    pub fn new(tracks: &[Track], truths: &[Vec<Contact>], extent: Extent) -> Option<Self> {
        let (mut readings, mut single, mut track) = (0, Sums::default(), Sums::default());
        for (one, truths) in tracks.iter().zip(truths) {
            let touching = truths.iter().filter(|truth| truth.force_n > 0.0);
            let truths: Vec<Position> = touching.map(|truth| truth.position).collect();
            readings += usize::from(!truths.is_empty());
            let tracked: Vec<ContactEstimate> = one.contacts.iter().map(Tracked::estimate).collect();
            track.add(&truths, &tracked, extent);
            single.add(&truths, &contacts_of_single(&one.single, !truths.is_empty()), extent);
        }
        let all = tracks.len().min(truths.len()) as f64;
        (track.contacts > 0).then(|| Self {
            readings,
            tracked: track.contacts,
            single_m: single.mean(single.error_m),
            track_m: track.mean(track.error_m),
            single_covered: single.mean(single.covered as f64),
            track_covered: track.mean(track.covered as f64),
            single_number_right: single.numbers_right as f64 / all,
            track_number_right: track.numbers_right as f64 / all,
        })
    }

    /// Mean error of the single readings over that of the track.
    pub fn ratio(&self) -> f64 {
        self.single_m / self.track_m
    }
}

/// The contacts of a single reading; while a contact touches, at least the best guess.
fn contacts_of_single(estimate: &Estimate, touched: bool) -> Vec<ContactEstimate> {
    if !touched && estimate.status == Status::NoContact {
        return Vec::new();
    }
    std::iter::once(&estimate.contact).chain(estimate.further.as_slice()).copied().collect()
}

/// For each true contact, the tracked one that is paired with it; `None` for contacts that do not touch or were not detected.
pub fn tracked_of(track: &Track, truths: &[Contact]) -> Vec<Option<Tracked>> {
    let touching: Vec<usize> = (0..truths.len()).filter(|i| truths[*i].force_n > 0.0).collect();
    let places: Vec<Position> = touching.iter().map(|i| truths[*i].position).collect();
    let found: Vec<Position> = track.contacts.iter().map(|tracked| tracked.estimate().position).collect();
    let mut tracked = vec![None; truths.len()];
    for (truth, mate) in pairs(&places, &found) {
        tracked[touching[truth]] = Some(track.contacts[mate]);
    }
    tracked
}

/// As many pairs of indices as the shorter list has, with the least sum of distances.
fn pairs(a: &[Position], b: &[Position]) -> Vec<(usize, usize)> {
    if b.len() < a.len() {
        return pairs(b, a).into_iter().map(|(i, j)| (j, i)).collect();
    }
    let mut best = (f64::INFINITY, Vec::new());
    choose(a, b, &mut Vec::new(), 0.0, &mut best);
    best.1.into_iter().enumerate().collect()
}

/// Enumerates every assignment of distinct elements of `b` to those of `a`; `chosen` is the assignment so far.
fn choose(a: &[Position], b: &[Position], chosen: &mut Vec<usize>, sum: f64, best: &mut (f64, Vec<usize>)) {
    if chosen.len() == a.len() {
        if sum < best.0 {
            *best = (sum, chosen.clone());
        }
        return;
    }
    for j in 0..b.len() {
        if !chosen.contains(&j) {
            let distance = a[chosen.len()].distance_m(b[j]);
            chosen.push(j);
            choose(a, b, chosen, sum + distance, best);
            chosen.pop();
        }
    }
}

/// Tracks of a recording, by the filter and by the smoother.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// Tracks by the filter, each from the readings up to its time.
    pub filtered: Vec<Track>,
    /// Tracks by the smoother, each from all readings.
    pub smoothed: Vec<Track>,
}

/// A recording that cannot be tracked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FollowError {
    /// The locator cannot track.
    #[error(transparent)]
    NotTrackable(#[from] NotTrackable),
    /// A row is out of order.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// The watch stopped the work.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Tracks the contacts of a recording with rising times.
///
/// # Errors
/// [`FollowError`] for a locator that has no likelihood, or a time that is not later than the one before.
pub fn follow(
    locator: &Locator,
    config: TrackerConfig,
    recording: &TimedRecording,
) -> Result<Followed, FollowError> {
    let tracking = locator.tracking(&config)?;
    let mut tracker = SmoothTracker::new(tracking.likelihood(), config);
    for (row, time_s) in recording.recording.rows.iter().zip(&recording.times_s) {
        tracker.follow(*time_s, &row.reading)?;
    }
    Ok(Followed { smoothed: tracker.smoothed(Watch::NONE)?, filtered: tracker.filtered().to_vec() })
}

/// The errors at one speed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SpeedErrors {
    /// Ratio of the speed between the turns to the critical speed.
    pub ratio: f64,
    /// Speed between the turns, in m/s.
    pub speed_m_per_s: f64,
    /// Errors of the filter.
    pub filtered: TrackErrors,
    /// Errors of the smoother.
    pub smoothed: TrackErrors,
}

/// Error of a sweep over speeds.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SweepError {
    /// The locator cannot track.
    #[error(transparent)]
    Follow(#[from] FollowError),
    /// The bench cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The surface does not vibrate.
    #[error("a sweep over speeds needs a beam that swings; this surface is in balance at any speed")]
    NoCriticalSpeed,
}

/// Speeds of a sweep, over the critical one.
pub const SPEED_RATIOS: [f64; 8] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.95];

/// The errors at each of [`SPEED_RATIOS`]: the contacts are simulated with that speed, and tracked. A speed at which no contact is tracked
/// is omitted.
///
/// # Errors
/// [`SweepError`] when the surface has no critical speed, or the locator cannot track.
pub fn sweep_speeds(
    locator: &Locator,
    config: TrackerConfig,
    setup: &Setup,
    moving: &MovingContacts,
    seed: u64,
) -> Result<Vec<SpeedErrors>, SweepError> {
    let beam = moving.beam.ok_or(SweepError::NoCriticalSpeed)?;
    let extent = setup.surface().extent();
    let mut sweep = Vec::new();
    for ratio in SPEED_RATIOS {
        let speed_m_per_s = ratio * beam.critical_speed_m_per_s();
        let recording =
            simulate_moving(setup, &moving.at_speed(speed_m_per_s).map_err(SimulateError::from)?, seed)?;
        let truths = recording.truths();
        let Followed { filtered, smoothed } = follow(locator, config, &recording)?;
        let errors =
            TrackErrors::new(&filtered, &truths, extent).zip(TrackErrors::new(&smoothed, &truths, extent));
        sweep.extend(errors.map(|(filtered, smoothed)| SpeedErrors {
            ratio,
            speed_m_per_s,
            filtered,
            smoothed,
        }));
    }
    Ok(sweep)
}

#[cfg(test)]
mod tests {
    use palpate_mechanics::contact::Position;

    #[test]
    fn contacts_are_paired_so_that_the_distances_are_least() {
        let pairs = |a: &[f64], b: &[f64]| {
            let places = |list: &[f64]| list.iter().copied().map(Position::along).collect::<Vec<_>>();
            super::pairs(&places(a), &places(b))
        };
        assert_eq!(pairs(&[0.1, 0.3], &[0.31, 0.12]), [(0, 1), (1, 0)]);
        assert_eq!(pairs(&[0.1, 0.3], &[0.25]), [(1, 0)]);
        assert_eq!(pairs(&[0.1], &[0.5, 0.2, 0.0]), [(0, 1)]);
        assert_eq!(pairs(&[], &[0.5]), []);
    }
}
