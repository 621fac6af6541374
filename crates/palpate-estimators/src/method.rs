//! What every method can do: be fitted to a recording, and locate.

mod held_out;
mod likelihood;

pub use held_out::HeldOutSpread;
pub use likelihood::{ContactFit, Geometry, Likelihood, LineLikelihood, PlaneLikelihood};

use crate::recording::Recording;
use crate::setup::Bench;
use palpate_core::Estimate;

/// What a method is fitted to.
#[derive(Clone, Copy, Debug)]
pub struct FitTask<'a> {
    /// Surface, sensors, known force.
    pub bench: &'a Bench,
    /// Readings with their contacts; as many channels as the bench has sensors, and at least one row.
    pub recording: &'a Recording,
    /// Fixes whatever the method draws at random.
    pub seed: u64,
}

/// A configured method, which can be fitted.
pub trait Fit {
    /// What fitting gives.
    type Locator: Locate;
    /// Why it cannot be fitted.
    type Error;

    /// Fits to a recording; `None` when `keep_going`, asked often, says no.
    ///
    /// # Errors
    /// When the recording does not suit the method.
    fn fit(
        &self,
        task: FitTask,
        keep_going: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Self::Locator>, Self::Error>;
}

/// A fitted method.
pub trait Locate {
    /// Where the surface is touched when the sensors read `reading`: one finite value a channel, in SI units or raw.
    fn locate(&self, reading: &[f64]) -> Estimate;

    /// Checks what a file may have got wrong.
    ///
    /// # Errors
    /// [`LocatorFault`], naming what does not fit together.
    fn check(&self, bench: &Bench) -> Result<(), LocatorFault>;
}

/// A reading that nothing can be told from.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ReadingError {
    /// Another number of channels.
    #[error("the reading has {found} channels; the locator has {needed}")]
    Channels {
        /// Channels of the locator.
        needed: usize,
        /// Channels of the reading.
        found: usize,
    },
    /// A value that is no number.
    #[error("channel {channel} reads {value}; it must be a finite number")]
    NotFinite {
        /// Which channel, from 1.
        channel: usize,
        /// Its value.
        value: f64,
    },
}

impl ReadingError {
    /// Checks that a reading has `needed` values, all finite.
    ///
    /// # Errors
    /// [`ReadingError`], naming the first that is not.
    pub fn check(reading: &[f64], needed: usize) -> Result<(), Self> {
        let found = reading.len();
        if needed != found {
            return Err(Self::Channels { needed, found });
        }
        match reading.iter().position(|value| !value.is_finite()) {
            Some(i) => Err(Self::NotFinite { channel: i + 1, value: reading[i] }),
            None => Ok(()),
        }
    }
}

/// A locator whose numbers do not fit together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LocatorFault {
    /// A list has the wrong length.
    #[error("the locator has {found} {what}; it must have {needed}")]
    Count {
        /// What the list holds.
        what: &'static str,
        /// Length that the rest asks for.
        needed: usize,
        /// Length of the list.
        found: usize,
    },
    /// A number that is infinite, not a number, or beyond its bound.
    #[error("the locator's {what} number {number} is not {bound}")]
    BadNumber {
        /// What the list holds.
        what: &'static str,
        /// Which one, from 1.
        number: usize,
        /// What it must be.
        bound: &'static str,
    },
}

impl LocatorFault {
    /// Checks the length of a list.
    ///
    /// # Errors
    /// [`LocatorFault::Count`] when `found` is not `needed`.
    pub fn check_count(what: &'static str, needed: usize, found: usize) -> Result<(), Self> {
        if needed == found { Ok(()) } else { Err(Self::Count { what, needed, found }) }
    }

    /// Checks the numbers of a list.
    ///
    /// # Errors
    /// [`LocatorFault::BadNumber`] for the first that is not finite or not `good`.
    pub fn check_numbers(
        what: &'static str,
        numbers: impl IntoIterator<Item = f64>,
        good: impl Fn(f64) -> bool,
        bound: &'static str,
    ) -> Result<(), Self> {
        match numbers.into_iter().position(|number| !(number.is_finite() && good(number))) {
            Some(i) => Err(Self::BadNumber { what, number: i + 1, bound }),
            None => Ok(()),
        }
    }
}
