//! Progress and cancellation of long work.

/// Progress that long work reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// One more round of an iteration: an epoch, a step, a fold.
    Round,
    /// A stage of the work, and its completed share, 0 to 1.
    Stage {
        /// Name of the stage.
        name: &'static str,
        /// The completed share; NaN where it is unknown.
        share: f64,
    },
    /// A stage that counts items, so that a rate can be shown.
    Counted {
        /// Name of the stage.
        name: &'static str,
        /// Name of the items, in the plural: "positions".
        unit: &'static str,
        /// Number of completed items.
        done: usize,
        /// Number of all items.
        of: usize,
    },
}

/// Error of work that the watch stopped; a caller may keep the results up to then.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before it was finished")]
pub struct Cancelled;

impl Cancelled {
    /// True when an error comes from stopped work, at any depth of its chain of sources.
    pub fn caused(error: &(dyn std::error::Error + 'static)) -> bool {
        let mut causes = std::iter::successors(Some(error), |error| error.source());
        causes.any(|error| error.is::<Self>())
    }
}

/// Observes long work from any of its threads, and may stop it.
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
    /// No observer: the work runs to its end.
    pub const NONE: Watch<'static> = Watch { observe: None };

    /// Calls `observe` often with the progress; the work stops when it returns `false`.
    pub fn new(observe: &'a (dyn Fn(Progress) -> bool + Sync)) -> Self {
        Self { observe: Some(observe) }
    }

    /// Reports one more round.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
    pub fn round(&self) -> Result<(), Cancelled> {
        self.report(Progress::Round)
    }

    /// Reports the completed share of a stage.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
    pub fn stage(&self, name: &'static str, share: f64) -> Result<(), Cancelled> {
        self.report(Progress::Stage { name, share })
    }

    /// Reports the number of completed items of a stage: `watch.counted("all over the surface", "positions", done, of)`.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
    pub fn counted(
        &self,
        name: &'static str,
        unit: &'static str,
        done: usize,
        of: usize,
    ) -> Result<(), Cancelled> {
        self.report(Progress::Counted { name, unit, done, of })
    }

    /// Reports any progress.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
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
