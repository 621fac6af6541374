//! Progress and cancellation of long work.

/// Progress of long work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// An iteration.
    Round,
    /// A stage.
    Stage {
        /// Name of the stage.
        name: &'static str,
        /// Completed share, 0 to 1, or NaN.
        share: f64,
    },
    /// A stage that counts items.
    Counted {
        /// Name of the stage.
        name: &'static str,
        /// Plural name of the items.
        unit: &'static str,
        /// Completed items.
        done: usize,
        /// All items.
        of: usize,
    },
}

/// Error of cancelled work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before it was finished")]
pub struct Cancelled;

impl Cancelled {
    /// True for an error caused by [`Cancelled`].
    pub fn caused(error: &(dyn std::error::Error + 'static)) -> bool {
        let mut causes = std::iter::successors(Some(error), |error| error.source());
        causes.any(|error| error.is::<Self>())
    }
}

/// Observer of long work, which may cancel it.
///
/// ```
/// use palpate_numerics::watch::{Cancelled, Watch};
///
/// let unwatched = Watch::NONE;
/// assert_eq!(unwatched.round(), Ok(()));
/// let stop_at_once = |_| false;
/// assert_eq!(Watch::new(&stop_at_once).round(), Err(Cancelled));
/// ```
#[derive(Clone, Copy, Default)]
pub struct Watch<'a> {
    observe: Option<&'a (dyn Fn(Progress) -> bool + Sync)>,
}

impl<'a> Watch<'a> {
    /// No observer.
    pub const NONE: Watch<'static> = Watch { observe: None };

    /// Creates a watch; `observe` returns `false` to cancel.
    pub fn new(observe: &'a (dyn Fn(Progress) -> bool + Sync)) -> Self {
        Self { observe: Some(observe) }
    }

    /// Reports an iteration.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn round(&self) -> Result<(), Cancelled> {
        self.report(Progress::Round)
    }

    /// Reports the completed share of a stage.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn stage(&self, name: &'static str, share: f64) -> Result<(), Cancelled> {
        self.report(Progress::Stage { name, share })
    }

    /// Reports the completed items of a stage.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn counted(
        &self,
        name: &'static str,
        unit: &'static str,
        done: usize,
        of: usize,
    ) -> Result<(), Cancelled> {
        self.report(Progress::Counted { name, unit, done, of })
    }

    /// Reports progress.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn report(&self, progress: Progress) -> Result<(), Cancelled> {
        match self.observe {
            Some(observe) if !observe(progress) => Err(Cancelled),
            _ => Ok(()),
        }
    }
}

impl std::fmt::Debug for Watch<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if self.observe.is_some() { "Watch" } else { "Watch::NONE" })
    }
}
