//! What fitting gives: all that a reading needs to become an estimate.

use crate::centroid::CentroidLocator;
use crate::closed_form::ClosedFormLocator;
use crate::digit::{DigitLocator, DigitShape};
use crate::gaussian_process::GaussianProcessLocator;
use crate::influence::InfluenceLocator;
use crate::method::{Locate, LocatorFault, ReadingError};
use crate::neighbours::NeighboursLocator;
use crate::network::{LevenbergMarquardtLocator, NetworkLocator, TrainingOutcome};
use crate::recording::Provenance;
use crate::setup::Bench;
use palpate_core::Estimate;

/// A fitted estimator. It carries its surface, layout, scaling and provenance, so that nothing it needs is outside it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Locator {
    /// The surface that is touched, and its sensors.
    pub bench: Bench,
    /// Where it comes from.
    pub provenance: LocatorProvenance,
    /// The method and what it learned.
    pub method: Method,
}

/// Where a locator comes from.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LocatorProvenance {
    /// Version of palpate that fitted it.
    pub palpate: String,
    /// Seed of the fit.
    pub seed: u64,
    /// The recording that it was fitted to.
    pub recording: Provenance,
}

/// The methods that can locate.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(clippy::large_enum_variant, reason = "a program holds one locator, or a few")]
pub enum Method {
    /// The founding paper's network.
    Network(NetworkLocator),
    /// Networks trained by Levenberg–Marquardt.
    NetworkLm(LevenbergMarquardtLocator),
    /// Influence functions, inverted.
    Influence(InfluenceLocator),
    /// Gaussian-process regression.
    GaussianProcess(GaussianProcessLocator),
    /// The beam's own equations.
    ClosedForm(ClosedFormLocator),
    /// The bending finger's own equations.
    Digit(DigitLocator),
    /// Nearest neighbours.
    Neighbours(NeighboursLocator),
    /// The calibrated centroid.
    Centroid(CentroidLocator),
}

impl Method {
    /// What every method can do.
    fn locate(&self) -> &dyn Locate {
        match self {
            Self::Network(network) => network,
            Self::NetworkLm(networks) => networks,
            Self::Influence(influence) => influence,
            Self::GaussianProcess(process) => process,
            Self::ClosedForm(form) => form,
            Self::Digit(digit) => digit,
            Self::Neighbours(neighbours) => neighbours,
            Self::Centroid(centroid) => centroid,
        }
    }
}

/// A channel that cannot be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LeaveOutError {
    /// There is no such channel.
    #[error("there is no channel {channel}; the locator has channels 1 to {channels}")]
    NoChannel {
        /// Which was named, from 1.
        channel: usize,
        /// Channels of the locator.
        channels: usize,
    },
    /// The method cannot do without it.
    #[error("a locator of kind `{kind}` needs every channel: fit it again without the dead one")]
    Needed {
        /// The locator's kind.
        kind: &'static str,
    },
    /// It is the last one.
    #[error("it is the last living channel; at least 1 must be left")]
    NoneLeft,
}

impl Locator {
    /// Where the surface is touched when the sensors read `reading`: one value a channel, in SI units or raw.
    ///
    /// # Errors
    /// [`ReadingError`] for another number of channels or a value that is not finite.
    pub fn locate(&self, reading: &[f64]) -> Result<Estimate, ReadingError> {
        ReadingError::check(reading, self.bench.layout.len())?;
        Ok(self.method.locate().locate(reading))
    }

    /// The shape that the surface has by an estimate, at `steps` + 1 points; `None` for a method that does not tell it.
    pub fn shape(&self, estimate: &Estimate, steps: usize) -> Option<DigitShape> {
        match &self.method {
            Method::Digit(digit) => Some(digit.shape(&estimate.contact, steps)),
            _ => None,
        }
    }

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`LocatorFault`], naming what does not fit together.
    pub fn check(&self) -> Result<(), LocatorFault> {
        self.method.locate().check(&self.bench)
    }

    /// Leaves a dead channel out of all sums from now on, without fitting again.
    ///
    /// # Errors
    /// [`LeaveOutError`] when there is no such channel, or the method needs it.
    pub fn leave_out(&mut self, channel: usize) -> Result<(), LeaveOutError> {
        let channels = self.bench.layout.len();
        if channel >= channels {
            return Err(LeaveOutError::NoChannel { channel: channel + 1, channels });
        }
        let kind = self.kind();
        match &mut self.method {
            Method::Influence(influence) => {
                if matches!(influence, InfluenceLocator::Measured(_)) {
                    return Err(LeaveOutError::Needed { kind });
                }
                if !influence.leave_out(channel) {
                    return Err(LeaveOutError::NoneLeft);
                }
            }
            Method::Digit(digit) => {
                if !digit.leave_out(channel) {
                    return Err(LeaveOutError::NoneLeft);
                }
            }
            _ => return Err(LeaveOutError::Needed { kind }),
        }
        self.bench.layout.sensors[channel].channel.dead = true;
        Ok(())
    }

    /// The `kind` under which a rig names its estimator.
    pub fn kind(&self) -> &'static str {
        match self.method {
            Method::Network(_) => "network",
            Method::NetworkLm(_) => "network-lm",
            Method::Influence(_) => "influence",
            Method::GaussianProcess(_) => "gaussian-process",
            Method::ClosedForm(_) => "closed-form",
            Method::Digit(_) => "digit",
            Method::Neighbours(_) => "neighbours",
            Method::Centroid(_) => "centroid",
        }
    }

    /// The weights of a network; nothing for another method.
    pub fn weights(&self) -> &[f64] {
        match &self.method {
            Method::Network(network) => &network.parts().weights,
            _ => &[],
        }
    }

    /// How its training ended, where it was trained by epochs.
    pub fn training_outcome(&self) -> Option<TrainingOutcome> {
        match &self.method {
            Method::Network(network) => Some(network.parts().outcome),
            _ => None,
        }
    }
}
