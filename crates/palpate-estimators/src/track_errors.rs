//! Errors of tracks and of single readings.

use crate::estimator::{
    ContactEstimate, Estimate, Locator, NotTrackable, SmoothTracker, Status, Track, TrackError,
    TrackedContact, TrackerConfig,
};
use crate::evaluation::CoveredCoordinates;
use crate::recording::TimedRecording;
use crate::setup::Setup;
use crate::simulate::{MovingContacts, SimulateError, simulate_moving};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};

/// Mean errors in metres and coverage of 95 % intervals. Contacts are paired with the least sum of distances.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct TrackErrors {
    /// Readings with contact.
    pub readings: usize,
    /// Tracked touching contacts.
    pub tracked: usize,
    /// Error of single readings.
    pub single_m: f64,
    /// Error of tracks.
    pub track_m: f64,
    /// Coverage by single readings.
    pub single_covered: f64,
    /// Coverage by tracks.
    pub track_covered: f64,
    /// Share of single readings with the true number of contacts.
    pub single_number_right: f64,
    /// Share of tracks with the true number of contacts.
    pub track_number_right: f64,
}

#[derive(Default)]
struct Sums {
    contacts: usize,
    error_m: f64,
    /// Sum of the shares of covered coordinates.
    covered: f64,
    numbers_right: usize,
}

impl Sums {
    fn add(&mut self, truths: &[Position], found: &[ContactEstimate], extent: Extent) {
        self.numbers_right += usize::from(truths.len() == found.len());
        let places: Vec<Position> = found.iter().map(|contact| contact.position).collect();
        for (truth, mate) in pairs(truths, &places) {
            let (truth, contact) = (truths[truth], found[mate]);
            self.contacts += 1;
            self.error_m += contact.position.distance_m(truth);
            let covered = CoveredCoordinates::new(&contact, truth, extent);
            self.covered += covered.map_or(0.0, CoveredCoordinates::share);
        }
    }

    fn mean(&self, sum: f64) -> f64 {
        sum / self.contacts.max(1) as f64
    }
}

impl TrackErrors {
    /// Compares tracks with true contacts of force 0 if untouched; `None` without tracked contacts.
    pub fn new(tracks: &[Track], truths: &[Vec<Contact>], extent: Extent) -> Option<Self> {
        let (mut readings, mut single, mut track) = (0, Sums::default(), Sums::default());
        for (one, truths) in tracks.iter().zip(truths) {
            let touching = truths.iter().filter(|truth| truth.force_n > 0.0);
            let truths: Vec<Position> = touching.map(|truth| truth.position).collect();
            readings += usize::from(!truths.is_empty());
            let tracked: Vec<ContactEstimate> = one.contacts.iter().map(TrackedContact::estimate).collect();
            track.add(&truths, &tracked, extent);
            single.add(&truths, &contacts_of_single(&one.single, !truths.is_empty()), extent);
        }
        let all = tracks.len().min(truths.len()) as f64;
        (track.contacts > 0).then(|| Self {
            readings,
            tracked: track.contacts,
            single_m: single.mean(single.error_m),
            track_m: track.mean(track.error_m),
            single_covered: single.mean(single.covered),
            track_covered: track.mean(track.covered),
            single_number_right: single.numbers_right as f64 / all,
            track_number_right: track.numbers_right as f64 / all,
        })
    }

    /// Ratio of errors, single over track.
    pub fn ratio(&self) -> f64 {
        self.single_m / self.track_m
    }
}

/// Best estimate while touched.
fn contacts_of_single(estimate: &Estimate, touched: bool) -> Vec<ContactEstimate> {
    if !touched && estimate.status == Status::NoContact {
        return Vec::new();
    }
    std::iter::once(&estimate.contact).chain(estimate.further.as_slice()).copied().collect()
}

/// Tracked contact of each true one; `None` if untouched or undetected.
pub fn tracked_of(track: &Track, truths: &[Contact]) -> Vec<Option<TrackedContact>> {
    let touching: Vec<usize> = (0..truths.len()).filter(|i| truths[*i].force_n > 0.0).collect();
    let places: Vec<Position> = touching.iter().map(|i| truths[*i].position).collect();
    let found: Vec<Position> = track.contacts.iter().map(|tracked| tracked.estimate().position).collect();
    let mut tracked = vec![None; truths.len()];
    for (truth, mate) in pairs(&places, &found) {
        tracked[touching[truth]] = Some(track.contacts[mate]);
    }
    tracked
}

fn pairs(a: &[Position], b: &[Position]) -> Vec<(usize, usize)> {
    if b.len() < a.len() {
        return pairs(b, a).into_iter().map(|(i, j)| (j, i)).collect();
    }
    let mut best = (f64::INFINITY, Vec::new());
    choose(a, b, &mut Vec::new(), 0.0, &mut best);
    best.1.into_iter().enumerate().collect()
}

/// Searches all assignments; `chosen` is the current part.
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

/// Tracks of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordingTracks {
    /// Filtered tracks.
    pub filtered: Vec<Track>,
    /// Smoothed tracks.
    pub smoothed: Vec<Track>,
}

/// Tracking error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrackingError {
    /// No likelihood.
    #[error(transparent)]
    NotTrackable(#[from] NotTrackable),
    /// Times do not increase.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// Cancelled by the watch.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Tracks the contacts of a recording.
///
/// # Errors
/// [`TrackingError`].
pub fn track_recording(
    locator: &Locator,
    config: TrackerConfig,
    recording: &TimedRecording,
) -> Result<RecordingTracks, TrackingError> {
    let tracking = locator.tracking(&config)?;
    let mut tracker = SmoothTracker::new(tracking.likelihood(), config);
    for (row, time_s) in recording.recording.rows.iter().zip(&recording.times_s) {
        tracker.update(*time_s, &row.reading)?;
    }
    Ok(RecordingTracks { smoothed: tracker.smoothed(Watch::NONE)?, filtered: tracker.filtered().to_vec() })
}

/// Errors at one speed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SpeedErrors {
    /// Speed over the critical speed.
    pub ratio: f64,
    /// Speed between turns, in m/s.
    pub speed_m_per_s: f64,
    /// Filter errors.
    pub filtered: TrackErrors,
    /// Smoother errors.
    pub smoothed: TrackErrors,
}

/// Sweep error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SweepError {
    /// Tracking error.
    #[error(transparent)]
    Follow(#[from] TrackingError),
    /// Simulation error.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// No critical speed.
    #[error("a sweep over speeds needs a beam that swings; this surface is in balance at any speed")]
    NoCriticalSpeed,
}

/// Ratios to the critical speed.
pub const SPEED_RATIOS: [f64; 8] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.95];

/// Simulates and tracks at [`SPEED_RATIOS`], without speeds at which no contact is tracked.
///
/// # Errors
/// [`SweepError`].
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
        let RecordingTracks { filtered, smoothed } = track_recording(locator, config, &recording)?;
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
