//! Readings of many sensors, contact by contact.

use std::ops::ControlFlow;

use crate::contact::Position;
use palpate_numerics::watch::{Cancelled, Watch};

/// Readings of all sensors per newton at a contact, in their order, and their derivatives along and across, per metre.
pub type Influences = [Vec<f64>; 3];

/// Method of solving a surface for the readings of many sensors under many contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solving {
    /// One solution for each sensor, its influence function.
    BySensor,
    /// By reciprocity, three for each contact.
    ByContact,
}

/// Estimated work and memory of solving a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolutionCost {
    /// Memory of the equations and of the data of the sensors, in bytes.
    pub memory_bytes: f64,
    /// Time to set up and factor the equations once, in seconds of a core of some 3 GHz.
    pub seconds_once: f64,
    /// Time of one of many solutions.
    pub seconds_each: f64,
}

impl Solving {
    /// The method with fewer solutions.
    pub const fn sooner(sensors: usize, contacts: usize) -> Self {
        if sensors > ContactLoad::EACH * contacts { Self::ByContact } else { Self::BySensor }
    }
}

/// Readings of many sensors, by contact, on a surface with deflections proportional to the force. By reciprocity one solution for a
/// contact gives the readings of all sensors, whereas influence functions take one solution for each sensor.
pub trait ReadingsByContact: Send + Sync {
    /// Readings of the sensors, in their order, under each of `loads`.
    fn under(&self, loads: &[ContactLoad]) -> Vec<Vec<f64>>;

    /// A unit force at a contact as a sum of loads on degrees of freedom, each with its factor. Contacts near each other share these loads.
    fn degrees(&self, contact: Position) -> Vec<(usize, f64)>;

    /// Number of loads that are solved together faster than one by one; more loads cost memory and save no time.
    fn together(&self) -> usize;
    /// Influences at each of `contacts`.
    fn influences(&self, contacts: &[Position]) -> Vec<Influences> {
        let loads: Vec<ContactLoad> = contacts.iter().copied().flat_map(ContactLoad::all).collect();
        let mut under = self.under(&loads).into_iter();
        contacts.iter().map(|_| [(); ContactLoad::EACH].map(|()| under.next().unwrap_or_default())).collect()
    }
}

impl dyn ReadingsByContact + '_ {
    /// Solves for contacts, a few at a time, and passes each index with its influences to `take`, until `take` stops. `stage` is
    /// the name of the stage for the watch.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
    pub fn for_each_contact(
        &self,
        contacts: &[Position],
        stage: &'static str,
        watch: Watch,
        mut take: impl FnMut(usize, Influences) -> ControlFlow<()>,
    ) -> Result<(), Cancelled> {
        let together = (self.together() / ContactLoad::EACH).max(1);
        for (i, batch) in contacts.chunks(together).enumerate() {
            watch.counted(stage, "positions", i * together, contacts.len())?;
            for (k, influences) in self.influences(batch).into_iter().enumerate() {
                if take(i * together + k, influences).is_break() {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

/// A unit load on a surface at a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactLoad {
    /// A downward unit force: sensors read their influence.
    Force(Position),
    /// Derivative with respect to x: sensors read the derivative of their influence along the length, per metre.
    ByX(Position),
    /// Derivative with respect to y, across the width.
    ByY(Position),
    /// A unit load on a degree of freedom of [`ReadingsByContact::degrees`].
    Degree(usize),
}

impl ContactLoad {
    /// Number of loads that determine the influences at one contact.
    pub const EACH: usize = 3;

    /// The force at a contact and its derivatives.
    pub const fn all(contact: Position) -> [Self; Self::EACH] {
        [Self::Force(contact), Self::ByX(contact), Self::ByY(contact)]
    }
}
