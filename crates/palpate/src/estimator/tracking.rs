//! Which locators can follow a moving contact.

use super::{Locator, Method};
use crate::influence::{BeamLikelihood, InfluenceLocator};
use crate::method::Likelihood;

/// What a tracker needs of a locator.
pub struct Tracking {
    likelihood: BeamLikelihood,
}

/// A locator that cannot say how probable a reading is at a contact.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a moving contact is followed by an influence locator of a surface with a model; this one is of kind `{kind}`{}", if *measured { ", on a measured surface" } else { "" })]
pub struct NotTrackable {
    /// The locator's kind.
    pub kind: &'static str,
    /// Whether its surface has no model.
    pub measured: bool,
}

impl Tracking {
    /// The likelihood to follow contacts by.
    pub fn likelihood(&self) -> &dyn Likelihood {
        &self.likelihood
    }
}

impl Locator {
    /// What a tracker needs.
    ///
    /// # Errors
    /// [`NotTrackable`] for a locator whose method has no likelihood.
    pub fn tracking(&self) -> Result<Tracking, NotTrackable> {
        match &self.method {
            Method::Influence(InfluenceLocator::Beam(beam)) => {
                Ok(Tracking { likelihood: BeamLikelihood::new(beam) })
            }
            method => {
                Err(NotTrackable { kind: self.kind(), measured: matches!(method, Method::Influence(_)) })
            }
        }
    }
}
