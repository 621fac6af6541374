//! What the closed form asks of a bench.

use super::ClosedFormLocator;
use crate::fit::{ChannelMismatch, Fit, FitTask};
use crate::setup::Setup;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::SurfaceSpec;
use palpate_numerics::watch::Cancelled;

/// The closed form: it needs a beam and its sensors, and learns nothing from a recording.
///
/// - Scales under both supports and nothing else: the moment balance a = l·R_right/(R_left + R_right), W = R_left + R_right.
/// - Otherwise every deflection, slope, strain and reaction that the layout has: position, and force where it is unknown, by
///   least squares weighted by the channels' noise; with two readings and an unknown force this is the root of their ratio.
///
/// Uncertainty is propagated from the channels' noise (and quantisation) to first order; where the layout gives a channel no noise
/// there is none, and a reading that is off by more than a tenth of itself is outside the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClosedForm;

/// Why the closed form does not suit a bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClosedFormFitError {
    /// A surface without a model.
    #[error("the closed form needs a beam's dimensions and stiffness; a measured surface has no model")]
    NoModel,
    /// Another kind of surface.
    #[error("the closed form needs a beam on two simple supports; the surface is another one")]
    NotABeam,
    /// A channel in units of its own.
    #[error(
        "the closed form needs deflection, slope, strain or reaction sensors; the layout has a {kind} channel"
    )]
    NotModelled {
        /// What the channel measures.
        kind: SensorKind,
    },
    /// Too few sensors that see a contact.
    #[error(
        "the closed form needs at least {needed} sensors that see a contact ({}); the layout has {found}",
        if *needed == 1 { "the force is known" } else { "the force is unknown" }
    )]
    TooFewSensors {
        /// Unknowns: 1 for the position, and 1 for a force that is unknown.
        needed: usize,
        /// Sensors that are not dead and whose influence is not 0 everywhere.
        found: usize,
    },
    /// The recording's channels are not the setup's.
    #[error(transparent)]
    Channels(#[from] ChannelMismatch),
    /// The fit was stopped.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl Fit for ClosedForm {
    type Method = ClosedFormLocator;
    type Error = ClosedFormFitError;

    fn fit_method(&self, task: FitTask) -> Result<ClosedFormLocator, ClosedFormFitError> {
        locator(task.setup)
    }
}

fn locator(setup: &Setup) -> Result<ClosedFormLocator, ClosedFormFitError> {
    if setup.surface.model().is_none() {
        return Err(ClosedFormFitError::NoModel);
    }
    let SurfaceSpec::Beam(beam) = setup.surface else { return Err(ClosedFormFitError::NotABeam) };
    let kinds = setup.layout.kinds();
    if let Some(kind) = kinds.into_iter().find(|kind| *kind == SensorKind::Raw) {
        return Err(ClosedFormFitError::NotModelled { kind });
    }
    let locator = ClosedFormLocator { beam, layout: setup.layout.clone(), force_n: setup.force_n };
    let (needed, found) = (1 + usize::from(setup.force_n.is_none()), locator.seeing().len());
    if found < needed {
        return Err(ClosedFormFitError::TooFewSensors { needed, found });
    }
    Ok(locator)
}
