//! Where to press, how often and how hard.

use super::{Arrangement, ArrangementError};
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
    /// `count` positions by a rule, each pressed once with the contact's force.
    ///
    /// ```
    /// use palpate_estimators::arrangement::{Arrangement, Training};
    /// use palpate_mechanics::units::newtons;
    ///
    /// let training = Training::new(Arrangement::Even, 10).repeated(5).with_force(newtons(3.0));
    /// ```
    pub const fn new(arrangement: Arrangement, count: usize) -> Self {
        Self { arrangement, count, repeats: 1, force_n: None }
    }

    /// `count` equally spaced positions along the length.
    pub const fn even(count: usize) -> Self {
        Self::new(Arrangement::Even, count)
    }

    /// The middles of columns × rows equal cells of a plane.
    pub const fn grid(columns: usize, rows: usize) -> Self {
        Self::new(Arrangement::Grid { columns, rows }, columns * rows)
    }

    /// The same, each position pressed `repeats` times; at least 1.
    #[must_use]
    pub fn repeated(self, repeats: usize) -> Self {
        Self { repeats: repeats.max(1), ..self }
    }

    /// The same, pressed with this force in newtons, whatever the force of contacts in use.
    #[must_use]
    pub fn with_force(self, force_n: f64) -> Self {
        Self { force_n: Some(force_n), ..self }
    }

    /// The positions on a surface of this `extent`, each once.
    ///
    /// # Errors
    /// [`ArrangementError`] when the rule cannot place so many.
    pub fn positions(&self, extent: Extent) -> Result<Vec<Position>, ArrangementError> {
        self.arrangement.positions(self.count, extent)
    }
}
