//! Which locators can follow moving contacts.

use super::{Locator, Method};
use crate::influence::{BeamLikelihood, InfluenceLocator, PlateLikelihood};
use crate::likelihood::Likelihood;
use crate::tracking::TrackerConfig;
use palpate_mechanics::surface::SurfaceSpec;

/// What a tracker needs of a locator.
pub struct Tracking {
    likelihood: Box<dyn Likelihood>,
}

/// A locator by which moving contacts cannot be followed, or not in that way.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotTrackable {
    /// It cannot say how probable a reading is at a contact.
    #[error("a moving contact is followed by an influence locator of a surface with a model; this one is of kind `{kind}`{}", if *measured { ", on a measured surface" } else { "" })]
    Kind {
        /// The locator's kind.
        kind: &'static str,
        /// Whether its surface has no model.
        measured: bool,
    },
    /// The shape in which its surface swings is not known.
    #[error(
        "inertia is reckoned with on a beam on two simple supports, whose first mode is half a sine; this surface is held otherwise: follow it in balance, without a natural frequency"
    )]
    Mode,
}

impl Tracking {
    /// The likelihood to follow contacts by.
    pub fn likelihood(&self) -> &dyn Likelihood {
        &*self.likelihood
    }
}

impl Locator {
    /// What a tracker of this configuration needs.
    ///
    /// # Errors
    /// [`NotTrackable`] for a locator whose method has no likelihood, or for a swing of a surface whose modes are not known.
    pub fn tracking(&self, config: &TrackerConfig) -> Result<Tracking, NotTrackable> {
        if config.swing.is_some() && !matches!(self.setup.surface, SurfaceSpec::Beam(_)) {
            return Err(NotTrackable::Mode);
        }
        match &self.method {
            Method::Influence(InfluenceLocator::Beam(beam)) => {
                Ok(Tracking { likelihood: Box::new(BeamLikelihood::new(beam)) })
            }
            Method::Influence(InfluenceLocator::Plane(plane)) => {
                Ok(Tracking { likelihood: Box::new(PlateLikelihood::new(plane)) })
            }
            method => Err(NotTrackable::Kind {
                kind: self.kind(),
                measured: matches!(method, Method::Influence(_)),
            }),
        }
    }
}
