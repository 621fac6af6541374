//! What fitting gives: all that a reading needs to become an estimate.

use crate::centroid::CentroidLocator;
use crate::closed_form::ClosedFormLocator;
use crate::digit::{DigitLocator, DigitShape};
use crate::fit::{Fitted, Locate, LocatorFault};
use crate::gaussian_process::GaussianProcessLocator;
use crate::influence::InfluenceLocator;
use crate::neighbours::NeighboursLocator;
use crate::network::{LevenbergMarquardtLocator, NetworkLocator, TrainingOutcome};
use crate::setup::Setup;
use palpate_core::Estimate;

/// A locator of any estimator: what files hold.
pub type Locator = Fitted<Method>;

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

macro_rules! methods {
    ($($variant:ident($method:ty)),* $(,)?) => {
        $(impl From<$method> for Method {
            fn from(method: $method) -> Self {
                Self::$variant(method)
            }
        })*
    };
}

methods! {
    Network(NetworkLocator),
    NetworkLm(LevenbergMarquardtLocator),
    Influence(InfluenceLocator),
    GaussianProcess(GaussianProcessLocator),
    ClosedForm(ClosedFormLocator),
    Digit(DigitLocator),
    Neighbours(NeighboursLocator),
    Centroid(CentroidLocator),
}

impl Locate for Method {
    fn locate(&self, reading: &[f64]) -> Estimate {
        self.as_locate().locate(reading)
    }

    fn check(&self, setup: &Setup) -> Result<(), LocatorFault> {
        self.as_locate().check(setup)
    }
}

impl Method {
    fn as_locate(&self) -> &dyn Locate {
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

impl<M> Fitted<M>
where
    Method: From<M>,
{
    /// The same locator as one of any estimator.
    pub fn into_locator(self) -> Locator {
        self.map(Method::from)
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
    /// The shape that the surface has by an estimate, at `steps` + 1 points; `None` for a method that does not tell it.
    pub fn shape(&self, estimate: &Estimate, steps: usize) -> Option<DigitShape> {
        match &self.method {
            Method::Digit(digit) => Some(digit.shape(&estimate.contact, steps)),
            _ => None,
        }
    }

    /// Leaves a dead channel out of all sums from now on, without fitting again.
    ///
    /// # Errors
    /// [`LeaveOutError`] when there is no such channel, or the method needs it.
    pub fn leave_out(&mut self, channel: usize) -> Result<(), LeaveOutError> {
        let channels = self.setup.layout.len();
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
        self.setup.layout.sensors[channel].channel.dead = true;
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
