//! Estimation methods of a session, from tared readings to estimates.

use super::follower::Follower;
use super::low_pass::LowPass;
use palpate_core::Estimate;
use palpate_estimators::estimator::{Creep, Drift, Locator, NotTrackable, Swing, TrackerConfig};
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_numerics::OutOfRange;
use serde::{Deserialize, Serialize};

/// Estimation method of a session, from tared readings to estimates.
///
/// Filtered readings are not tracked: a tracker assumes independent noise in each reading, and its intervals would be too narrow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Estimation {
    /// Each reading is located by itself.
    #[default]
    Single,
    /// Each reading is located by itself, after a first-order low-pass filter.
    LowPass {
        /// Cut-off frequency in hertz: 1e-6 to 1e9.
        cutoff_hz: f64,
    },
    /// A tracker follows the contacts.
    Track {
        /// First natural frequency of a beam on two simple supports, in hertz. With it, the inertia of the beam is modelled at the usual damping;
        /// without it, the surface is in balance at every reading.
        frequency_hz: Option<f64>,
        /// Creep of the surface that is compensated; none by default.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        creep: Option<CreepConfig>,
    },
}

/// Creep of a soft surface under a constant load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CreepConfig {
    /// Growth of a reading under a long constant load, as a share of the reading of a fresh press: 0 to 1.
    pub share: f64,
    /// Time constant of the growth, in seconds: 0.001 to 1,000,000. After it, a share of 1/e of the growth is still to come.
    pub time_s: f64,
}

/// Error of a session that cannot be created.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SessionError {
    /// The tracker cannot use this locator.
    #[error(transparent)]
    NotTrackable(#[from] NotTrackable),
    /// A frequency is out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
}

impl Estimation {
    /// A tracker as the session uses it, if the method tracks contacts.
    ///
    /// # Errors
    /// [`SessionError`] for a locator that the tracker cannot use, or a frequency out of range.
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

/// State of an estimation during a session.
pub(super) enum EstimationState {
    /// Each reading by itself.
    Single,
    /// Filtered readings.
    LowPass(LowPass),
    /// A tracker.
    Track(Box<Follower>),
}

impl EstimationState {
    /// The estimation in its initial state.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn new(estimation: &Estimation, locator: &Locator) -> Result<Self, SessionError> {
        if let Estimation::LowPass { cutoff_hz } = estimation {
            return Ok(Self::LowPass(LowPass::new(*cutoff_hz)?));
        }
        Ok(estimation.follower(locator)?.map_or(Self::Single, |follower| Self::Track(Box::new(follower))))
    }

    /// Discards the readings from before a silence, or from another connection. The state of a tracker is kept: it becomes uncertain with time
    /// anyway.
    pub fn interrupt(&mut self) {
        if let Self::LowPass(filter) = self {
            filter.reset();
        }
    }

    /// The estimate after a reading at time `unix_ns`. `single` is the estimate of the tared reading by itself. `tared` is replaced by the reading
    /// that was located. `None` for a filtered reading that is not finite.
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
                // Filtering before taring gives the same result as the other order, and a new baseline takes effect at once.
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
