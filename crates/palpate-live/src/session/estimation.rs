//! How a session comes from tared readings to estimates.

use super::follower::Follower;
use super::low_pass::LowPass;
use palpate_core::Estimate;
use palpate_estimators::estimator::{Creep, Drift, Locator, NotTrackable, Swing, TrackerConfig};
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_numerics::OutOfRange;
use serde::{Deserialize, Serialize};

/// How a session comes from tared readings to estimates.
///
/// Filtered readings are not followed: a tracker takes the noise of each reading for its own, and would be too sure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Estimation {
    /// Each reading is located by itself.
    #[default]
    Single,
    /// Each reading is located by itself after a low-pass filter of the first order.
    LowPass {
        /// Cut-off frequency in hertz: 1e-6 to 1e9.
        cutoff_hz: f64,
    },
    /// Contacts are followed by a tracker.
    Track {
        /// First natural frequency of a beam on two simple supports, in hertz, whose inertia is reckoned with at the usual damping; without it the surface
        /// is in balance at every reading.
        frequency_hz: Option<f64>,
        /// Creep of the surface that is taken off; none by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        creep: Option<CreepConfig>,
    },
}

/// Creep of a soft surface under a load that is held.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CreepConfig {
    /// Growth of a reading that is held for long, as a share of that of a fresh press: 0 to 1.
    pub share: f64,
    /// Time in which all but an e-th of it has come, in seconds: 0.001 to 1,000,000.
    pub time_s: f64,
}

/// A session that cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SessionError {
    /// Contacts cannot be followed by this locator.
    #[error(transparent)]
    NotTrackable(#[from] NotTrackable),
    /// A frequency that is out of its range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
}

impl Estimation {
    /// A follower where contacts are followed, as the session has one.
    ///
    /// # Errors
    /// [`SessionError`] for a locator by which contacts cannot be followed, or a frequency out of its range.
    pub fn follower(&self, locator: &Locator) -> Result<Option<Follower>, SessionError> {
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
        Ok(Some(Follower::new(locator, config)?))
    }
}

/// State of an estimation in the course of a session.
pub(super) enum EstimationState {
    /// Each reading by itself.
    Single,
    /// Filtered readings.
    LowPass(LowPass),
    /// A tracker.
    Track(Box<Follower>),
}

impl EstimationState {
    /// The estimation at its start.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn new(estimation: &Estimation, locator: &Locator) -> Result<Self, SessionError> {
        if let Estimation::LowPass { cutoff_hz } = estimation {
            return Ok(Self::LowPass(LowPass::new(*cutoff_hz)?));
        }
        Ok(estimation.follower(locator)?.map_or(Self::Single, |follower| Self::Track(Box::new(follower))))
    }

    /// Forgets the readings from before a silence, or from another connection. A tracker's state goes on: time alone makes it uncertain.
    pub fn interrupt(&mut self) {
        if let Self::LowPass(filter) = self {
            filter.reset();
        }
    }

    /// The estimate after a reading that was taken at `unix_ns`, of which `single` is that of the tared reading by itself. `tared` is the reading that was
    /// located afterwards. `None` for a filtered reading beyond numbers.
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
                // Readings are filtered as they come, and tared afterwards: the outcome is that of the other order, and a new baseline counts at once.
                let filtered = filter.filter(unix_ns, reading);
                for ((tared, value), filtered) in tared.iter_mut().zip(reading).zip(filtered) {
                    *tared = filtered + (*tared - value);
                }
                locator.locate(tared).ok()
            }
            Self::Track(follower) => Some(follower.follow(unix_ns, reading, tared, single)),
        }
    }
}
