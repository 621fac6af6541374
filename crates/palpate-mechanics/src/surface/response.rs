//! What a sensor reads under a given force, also where readings are not proportional to it.

use std::sync::Arc;

use super::InfluenceFunction;
use crate::contact::Contact;

/// What one sensor reads, as a function of where and how hard the surface is touched.
pub trait ResponseFunction: Send + Sync {
    /// The reading at `contact`, in the sensor's SI unit; 0 for a raw channel. Off the surface the value has no meaning.
    fn at(&self, contact: Contact) -> f64;

    /// How the reading changes with the contact. Where it has a kink, some value between those of its two sides.
    fn gradient(&self, contact: Contact) -> ResponseGradient;
}

/// The derivatives of a reading by its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponseGradient {
    /// By the contact's position along x and along y, in the reading's unit per metre.
    pub position: [f64; 2],
    /// By its force, in the reading's unit per newton.
    pub force: f64,
}

/// Readings that are proportional to the force: force × influence.
#[derive(Clone)]
pub struct Proportional<'a>(pub Arc<dyn InfluenceFunction + 'a>);

impl ResponseFunction for Proportional<'_> {
    fn at(&self, contact: Contact) -> f64 {
        contact.force_n * self.0.at(contact.position)
    }

    fn gradient(&self, contact: Contact) -> ResponseGradient {
        let position = self.0.gradient(contact.position).map(|slope| contact.force_n * slope);
        ResponseGradient { position, force: self.0.at(contact.position) }
    }
}
