//! Where to press, how often and how hard.

use super::{Arrangement, ArrangementError};
use crate::setup::Bench;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;

/// Training positions: the rule that places them, and how each is pressed.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// The rule that places them.
    pub arrangement: Arrangement,
    /// How many there are; at least 1.
    pub count: usize,
    /// How often each is pressed; at least 1.
    pub repeats: usize,
    /// The force of these presses in newtons, where it is not the contact's.
    pub force_n: Option<f64>,
}

impl Training {
    /// The positions on a surface of this `extent`, each once.
    ///
    /// # Errors
    /// [`ArrangementError`] when the rule cannot place so many.
    pub fn positions(&self, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
        self.arrangement.positions(self.count, extent)
    }

    /// The bench as it is when pressed to calibrate: with the force of these presses.
    pub fn pressed(&self, bench: &Bench) -> Bench {
        Bench { force_n: self.force_n.or(bench.force_n), ..bench.clone() }
    }
}

