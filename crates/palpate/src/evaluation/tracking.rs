//! How far a track is off, beside what the readings say one by one; and how that goes with the contact's speed.

use crate::contact::Contact;
use crate::estimator::{Locator, NotTrackable, SmoothTracker, Track, TrackError, TrackerConfig};
use crate::recording::TimedRecording;
use crate::rig::{MotionRig, Rig};
use crate::simulate::{SimulateError, simulate_moving};

/// Mean errors over the readings while something touched, in metres, and how often the 95 % intervals held the contact.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct TrackErrors {
    /// Readings while something touched.
    pub readings: usize,
    /// Of those, readings at which the tracker had a contact; the track's errors are of these.
    pub tracked: usize,
    /// Mean error of a reading by itself.
    pub single_m: f64,
    /// Mean error of the track.
    pub track_m: f64,
    /// Share of the readings by themselves whose interval held the contact.
    pub single_covered: f64,
    /// Share of the track's intervals that held it.
    pub track_covered: f64,
}

impl TrackErrors {
    /// Compares tracks with the true contacts, one each, whose force is 0 where nothing touched; `None` where nothing ever
    /// did, or nothing was tracked.
    pub fn of(tracks: &[Track], truths: &[Contact]) -> Option<Self> {
        let within = |(low, high): (f64, f64), x_m: f64| f64::from(u8::from((low..=high).contains(&x_m)));
        let mut errors = Self {
            readings: 0,
            tracked: 0,
            single_m: 0.0,
            track_m: 0.0,
            single_covered: 0.0,
            track_covered: 0.0,
        };
        for (track, truth) in tracks.iter().zip(truths).filter(|(_, truth)| truth.force_n > 0.0) {
            let x_m = truth.position.x_m;
            let alone = &track.alone.contact;
            errors.readings += 1;
            errors.single_m += (alone.position.x_m - x_m).abs();
            errors.single_covered +=
                alone.uncertainty.map_or(0.0, |uncertainty| within(uncertainty.x_95_m, x_m));
            if let Some(tracked) = track.tracked {
                errors.tracked += 1;
                errors.track_m += (tracked.x_m - x_m).abs();
                errors.track_covered += within(tracked.x_95_m, x_m);
            }
        }
        if errors.tracked == 0 {
            return None;
        }
        let (all, tracked) = (errors.readings as f64, errors.tracked as f64);
        errors.single_m /= all;
        errors.single_covered /= all;
        errors.track_m /= tracked;
        errors.track_covered /= tracked;
        Some(errors)
    }

    /// How many times smaller the track's mean error is than that of the readings by themselves.
    pub fn ratio(&self) -> f64 {
        self.single_m / self.track_m
    }
}

/// A recording followed, by the filter and by the smoother.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// As the readings came.
    pub filtered: Vec<Track>,
    /// With all of them.
    pub smoothed: Vec<Track>,
}

/// Why a recording cannot be followed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FollowError {
    /// The locator cannot follow.
    #[error(transparent)]
    NotTrackable(#[from] NotTrackable),
    /// A row is out of order.
    #[error(transparent)]
    Track(#[from] TrackError),
}

/// Follows a recording whose times rise.
///
/// # Errors
/// [`FollowError`] for a locator that has no likelihood, or a time that is not later than the one before.
pub fn follow(
    locator: &Locator,
    config: TrackerConfig,
    recording: &TimedRecording,
) -> Result<Followed, FollowError> {
    let tracking = locator.tracking()?;
    let mut tracker = SmoothTracker::new(tracking.likelihood(), config);
    for (row, time_s) in recording.recording.rows.iter().zip(&recording.times_s) {
        tracker.follow(*time_s, &row.reading)?;
    }
    Ok(Followed { smoothed: tracker.smoothed(), filtered: tracker.filtered().to_vec() })
}

/// The errors at one speed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SpeedErrors {
    /// The speed between the turns over the critical one.
    pub ratio: f64,
    /// That speed, in m/s.
    pub speed_m_per_s: f64,
    /// Of the filter.
    pub filtered: TrackErrors,
    /// Of the smoother.
    pub smoothed: TrackErrors,
}

/// Why a sweep over speeds cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SweepError {
    /// The locator cannot follow.
    #[error(transparent)]
    Follow(#[from] FollowError),
    /// The rig cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

/// Speeds of a sweep, over the critical one.
pub const SPEED_RATIOS: [f64; 8] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 0.95];

/// The errors at each of [`SPEED_RATIOS`]: the rig's motion at that speed, simulated and followed. A speed at which
/// nothing is tracked is left out.
///
/// # Errors
/// [`SweepError`] when the rig has no motion or the locator cannot follow.
pub fn sweep_speeds(
    locator: &Locator,
    config: TrackerConfig,
    rig: &Rig,
    seed: u64,
) -> Result<Vec<SpeedErrors>, SweepError> {
    let moving = rig.motion.ok_or(SimulateError::NoMotion)?;
    let mut sweep = Vec::new();
    for ratio in SPEED_RATIOS {
        let speed_m_per_s = ratio * moving.beam.critical_speed_m_per_s();
        let motion = crate::mechanics::Motion { speed_m_per_s, ..moving.motion };
        let rig = Rig { motion: Some(MotionRig { motion, ..moving }), ..rig.clone() };
        let recording = simulate_moving(&rig, seed)?;
        let truths: Vec<Contact> = recording.recording.rows.iter().filter_map(|row| row.contact()).collect();
        let Followed { filtered, smoothed } = follow(locator, config, &recording)?;
        let errors = TrackErrors::of(&filtered, &truths).zip(TrackErrors::of(&smoothed, &truths));
        sweep.extend(errors.map(|(filtered, smoothed)| SpeedErrors {
            ratio,
            speed_m_per_s,
            filtered,
            smoothed,
        }));
    }
    Ok(sweep)
}
