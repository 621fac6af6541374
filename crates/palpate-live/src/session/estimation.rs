use super::estimate_tracker::EstimateTracker;
use super::low_pass::LowPass;
use palpate_core::Estimate;
use palpate_estimators::estimator::{Creep, Drift, Locator, NotTrackable, Swing, TrackerConfig};
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_numerics::OutOfRange;
use serde::{Deserialize, Serialize};

/// Estimation method.
///
/// Filtered readings are not tracked: a tracker assumes independent noise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Estimation {
    /// Single readings.
    #[default]
    Single,
    /// Readings after a first-order low-pass filter.
    LowPass {
        /// Cut-off frequency in hertz, 1e-6 to 1e9.
        cutoff_hz: f64,
    },
    /// Tracker.
    Track {
        /// First natural frequency of a simply supported beam in hertz; quasi-static without it.
        frequency_hz: Option<f64>,
        /// Compensated creep.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        creep: Option<CreepConfig>,
    },
}

/// Creep of a soft surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CreepConfig {
    /// Growth relative to the initial reading, 0 to 1.
    pub share: f64,
    /// Time constant in seconds, 0.001 to 1,000,000.
    pub time_s: f64,
}

/// Error of a session configuration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SessionError {
    /// The locator does not support tracking.
    #[error(transparent)]
    NotTrackable(#[from] NotTrackable),
    /// A number is out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
}

impl Estimation {
    /// Tracker of the method, if any.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn follower(&self, locator: &Locator) -> Result<Option<EstimateTracker>, SessionError> {
        let Self::Track { frequency_hz, creep } = self else { return Ok(None) };
        let range = "at least 0.000001 Hz and at most 1000000000 Hz";
        let numbers = frequency_hz.map(|frequency_hz| ("the natural frequency", frequency_hz));
        OutOfRange::check(range, numbers, |frequency_hz| (1e-6..=1e9).contains(&frequency_hz))?;
        let damping_ratio = ModalBeam::USUAL_DAMPING_RATIO;
        let swing = frequency_hz.map(|frequency_hz| Swing { frequency_hz, damping_ratio });
        if let Some(CreepConfig { share, time_s }) = creep {
            let shares = [("the share of the creep", *share)];
            OutOfRange::check("at least 0 and at most 1", shares, |share| (0.0..=1.0).contains(&share))?;
            let times = [("the time of the creep", *time_s)];
            let range = "at least 0.001 s and at most 1000000 s";
            OutOfRange::check(range, times, |time_s| (1e-3..=1e6).contains(&time_s))?;
        }
        let creep = creep.map(|CreepConfig { share, time_s }| Creep { share, time_s });
        let drift = Some(Drift::default());
        let config = TrackerConfig { swing, drift, creep, ..TrackerConfig::default() };
        Ok(Some(EstimateTracker::new(locator, config)?))
    }
}

pub(super) enum EstimationState {
    Single,
    LowPass(LowPass),
    Track(Box<EstimateTracker>),
}

impl EstimationState {
    pub fn new(estimation: &Estimation, locator: &Locator) -> Result<Self, SessionError> {
        if let Estimation::LowPass { cutoff_hz } = estimation {
            return Ok(Self::LowPass(LowPass::new(*cutoff_hz)?));
        }
        Ok(estimation.follower(locator)?.map_or(Self::Single, |follower| Self::Track(Box::new(follower))))
    }

    /// Resets the filter; a tracker is kept, because its uncertainty grows.
    pub fn interrupt(&mut self) {
        if let Self::LowPass(filter) = self {
            filter.reset();
        }
    }

    /// Estimates a reading; `tared` becomes the located reading. `None` if it is not finite.
    pub fn estimate(
        &mut self,
        locator: &Locator,
        unix_ns: u64,
        reading: &[f64],
        tared: &mut [f64],
        single: Estimate,
    ) -> Option<Estimate> {
        match self {
            Self::Single => Some(single),
            Self::LowPass(filter) => {
                // Filter and tare commute; in this order a new baseline takes effect at once.
                let filtered = filter.filter(unix_ns, reading);
                for ((tared, value), filtered) in tared.iter_mut().zip(reading).zip(filtered) {
                    *tared = filtered + (*tared - value);
                }
                locator.locate(tared).ok()
            }
            Self::Track(tracker) => Some(tracker.update(unix_ns, reading, tared, single)),
        }
    }
}
