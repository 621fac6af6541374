//! Readings of many sensors by contact.

use std::ops::ControlFlow;

use crate::contact::Position;
use palpate_numerics::watch::{Cancelled, Watch};

/// Readings of all sensors per newton, and their derivatives by x and y.
pub type Influences = [Vec<f64>; 3];

/// Method of solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solving {
    /// One solution per sensor.
    BySensor,
    /// Three reciprocal solutions per contact.
    ByContact,
}

/// Estimated cost of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolutionCost {
    /// Memory.
    pub memory_bytes: f64,
    /// Time of the factorisation on a 3 GHz core.
    pub seconds_once: f64,
    /// Time per solution.
    pub seconds_each: f64,
}

impl Solving {
    /// Returns the method with fewer solutions.
    pub const fn cheaper(sensors: usize, contacts: usize) -> Self {
        if sensors > ContactLoad::EACH * contacts { Self::ByContact } else { Self::BySensor }
    }
}

/// Readings of many sensors by contact, by reciprocity.
pub trait ReadingsByContact: Send + Sync {
    /// Returns the readings of all sensors under each load.
    fn readings_of_loads(&self, loads: &[ContactLoad]) -> Vec<Vec<f64>>;

    /// Returns a unit force at a contact as loads on degrees of freedom, with factors.
    fn degrees(&self, contact: Position) -> Vec<(usize, f64)>;

    /// Number of loads that are fastest together.
    fn batch_size(&self) -> usize;
    /// Returns the influences at each contact.
    fn influences(&self, contacts: &[Position]) -> Vec<Influences> {
        let loads: Vec<ContactLoad> = contacts.iter().copied().flat_map(ContactLoad::all).collect();
        let mut under = self.readings_of_loads(&loads).into_iter();
        contacts.iter().map(|_| [(); ContactLoad::EACH].map(|()| under.next().unwrap_or_default())).collect()
    }
}

impl dyn ReadingsByContact + '_ {
    /// Passes each index and its influences to `take`, until it breaks.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn for_each_contact(
        &self,
        contacts: &[Position],
        stage: &'static str,
        watch: Watch,
        mut take: impl FnMut(usize, Influences) -> ControlFlow<()>,
    ) -> Result<(), Cancelled> {
        let together = (self.batch_size() / ContactLoad::EACH).max(1);
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

/// A unit load at a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactLoad {
    /// A downward unit force.
    Force(Position),
    /// Derivative of the force by x.
    ByX(Position),
    /// Derivative of the force by y.
    ByY(Position),
    /// A unit load on a degree of freedom.
    Degree(usize),
}

impl ContactLoad {
    /// Loads per contact.
    pub const EACH: usize = 3;

    /// Returns the loads at a contact.
    pub const fn all(contact: Position) -> [Self; Self::EACH] {
        [Self::Force(contact), Self::ByX(contact), Self::ByY(contact)]
    }
}
