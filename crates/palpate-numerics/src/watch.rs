//! Watching long work: progress out, cancellation in.

/// Progress that long work reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// One more round of an iteration: an epoch, a step, a fold.
    Round,
    /// A stage of the work, and the share of it that is done, 0 to 1.
    Stage {
        /// The stage, in words.
        name: &'static str,
        /// The share that is done; NaN where nobody can tell.
        share: f64,
    },
    /// A stage that goes through many of something, so that its rate can be told.
    Counted {
        /// The stage, in words.
        name: &'static str,
        /// What it goes through, in words and in the plural: "positions".
        unit: &'static str,
        /// How many of them are done.
        done: usize,
        /// How many there are.
        of: usize,
    },
}

/// Work that was stopped by the one who watched it; what was finished before is kept where the caller keeps it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before it was finished")]
pub struct Cancelled;

impl Cancelled {
    /// Whether an error says that work was stopped, whatever it is wrapped in.
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
    /// Nobody watches: the work goes on to its end.
    pub const NONE: Watch<'static> = Watch { observe: None };

    /// Calls `observe` often with the progress; on `false` the work stops.
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

    /// Reports the share of a stage that is done.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
    pub fn stage(&self, name: &'static str, share: f64) -> Result<(), Cancelled> {
        self.report(Progress::Stage { name, share })
    }

    /// Reports how many of something a stage has gone through: `watch.counted("all over the surface", "positions", done, of)`.
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
