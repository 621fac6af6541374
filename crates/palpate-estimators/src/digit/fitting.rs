//! What the digit's estimator asks of a bench.

use palpate_numerics::watch::Cancelled;
use serde::{Deserialize, Serialize};

use super::DigitLocator;
use crate::fit::{ChannelMismatch, Fit, FitTask};
use crate::setup::Setup;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Digit, SurfaceSpec};

/// The flexible digit's estimator: maximum likelihood over position and force. It needs the digit, its gauges and their
/// noise, and learns nothing from a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitEstimator {
    /// What the gauges read.
    pub theory: DigitTheory,
}

/// How a finger bends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DigitTheory {
    /// As far as the force bends it: the elastica.
    #[default]
    Exact,
    /// Hardly at all: strain is force times lever. For comparison, and for small forces.
    Linear,
}

/// Why the digit's estimator does not suit a bench.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DigitFitError {
    /// Another kind of surface.
    #[error("the digit estimator needs `kind = \"digit\"` in [surface]; the surface is another one")]
    NotADigit,
    /// A sensor that is no strain gauge.
    #[error("the digit estimator needs strain gauges; the layout has a {kind} sensor")]
    NotAGauge {
        /// What the sensor measures.
        kind: SensorKind,
    },
    /// A gauge whose noise is not given.
    #[error(
        "gauge {gauge} has neither noise nor resolution; the digit estimator weighs gauges by their noise: give `noise` in [sensors]"
    )]
    NoNoise {
        /// Which, from 1.
        gauge: usize,
    },
    /// Too few gauges for what is to be found.
    #[error(
        "the digit estimator needs at least {needed} living gauges ({}); the layout has {found}",
        if *needed == 1 { "the force is known" } else { "the force is unknown" }
    )]
    TooFewGauges {
        /// Unknowns: 1 for the position, and 1 for a force that is unknown.
        needed: usize,
        /// Gauges that are not dead.
        found: usize,
    },
    /// A known force that bends the digit further than its model goes.
    #[error(
        "the force is {force_n} N; a contact at the tip bears at most {most_n} N, a load F·l²/(E·I) of {}",
        Digit::MOST_LOAD
    )]
    TooMuchForce {
        /// The force, in newtons.
        force_n: f64,
        /// The largest, in newtons.
        most_n: f64,
    },
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for DigitEstimator {
    type Method = DigitLocator;
    type Error = DigitFitError;

    fn fit_method(&self, task: FitTask) -> Result<DigitLocator, DigitFitError> {
        locator(task.setup, self.theory)
    }
}

fn locator(setup: &Setup, theory: DigitTheory) -> Result<DigitLocator, DigitFitError> {
    let SurfaceSpec::Digit(digit) = setup.surface else { return Err(DigitFitError::NotADigit) };
    if let Some(kind) = setup.layout.kinds().into_iter().find(|kind| *kind != SensorKind::Strain) {
        return Err(DigitFitError::NotAGauge { kind });
    }
    let locator = DigitLocator { digit, layout: setup.layout.clone(), force_n: setup.force_n, theory };
    if let Some(i) = locator.gauge_without_noise() {
        return Err(DigitFitError::NoNoise { gauge: i + 1 });
    }
    let (needed, found) = (1 + usize::from(setup.force_n.is_none()), locator.living());
    if found < needed {
        return Err(DigitFitError::TooFewGauges { needed, found });
    }
    let most_n = Digit::MOST_LOAD * digit.characteristic_force_n();
    match setup.force_n {
        Some(force_n) if force_n > most_n => Err(DigitFitError::TooMuchForce { force_n, most_n }),
        _ => Ok(locator),
    }
}
