//! Batches of readings.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use palpate_core::Estimate;
use palpate_numerics::watch::{Cancelled, Watch};

use crate::fit::{CheckEstimate, Locate, MethodLocator, ReadingError};
use crate::status::NO_CONTACT;

/// Readings of a block, with estimates of 0.9 kB each in a core's second-level cache.
pub const BLOCK: usize = 256;

/// Options of a batch.
#[derive(Clone, Copy, Debug)]
pub struct BatchOptions<'a> {
    /// Threads, without effect on estimates.
    pub threads: NonZeroUsize,
    /// Watch, which is notified of each block.
    pub watch: Watch<'a>,
}

impl Default for BatchOptions<'_> {
    fn default() -> Self {
        Self { threads: NonZeroUsize::MIN, watch: Watch::NONE }
    }
}

/// Callback `take(first, estimates)` for a block, from any thread, in any order, with the first row from 0.
pub type TakeBlock<'a> = dyn Fn(usize, &[Estimate]) + Sync + 'a;

/// Error of a batch.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BatchError {
    /// Incomplete reading.
    #[error("expected a multiple of {channels} values, found {values}")]
    Uneven {
        /// Number of values.
        values: usize,
        /// Channels of the locator.
        channels: usize,
    },
    /// Invalid reading.
    #[error("reading {row}: {error}")]
    Reading {
        /// Number of the first invalid reading, from 1.
        row: usize,
        /// Error of the reading.
        error: ReadingError,
    },
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

impl<M: Locate> MethodLocator<M> {
    /// Estimates the contacts of consecutive readings, equal to [`MethodLocator::locate`] to the last bit.
    ///
    /// ```
    /// use palpate_estimators::{arrangement::Training, fit::Fit, influence::Influence, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let presses = setup.simulate(&Training::even(10), 0)?;
    /// let locator = Influence::default().fit(&setup, &presses)?;
    /// let readings: Vec<f64> = presses.rows.iter().flat_map(|row| row.reading.clone()).collect();
    /// let estimates = locator.locate_batch(&readings)?;
    /// assert_eq!(estimates[4], locator.locate(&readings[4 * 8..5 * 8])?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`BatchError`] for an incomplete or infinite reading.
    pub fn locate_batch(&self, readings: &[f64]) -> Result<Vec<Estimate>, BatchError> {
        let channels = self.channels_of(readings)?;
        let mut estimates = vec![NO_CONTACT; readings.len() / channels];
        let blocks = readings.chunks(BLOCK * channels).zip(estimates.chunks_mut(BLOCK));
        for (block, (readings, estimates)) in blocks.enumerate() {
            self.locate_block(readings, channels, block * BLOCK, estimates)?;
        }
        Ok(estimates)
    }

    /// Estimates contacts by blocks of [`BLOCK`] for `take`.
    ///
    /// # Errors
    /// [`BatchError`], after the completed blocks.
    pub fn locate_blocks(
        &self,
        readings: &[f64],
        options: BatchOptions,
        take: &TakeBlock,
    ) -> Result<(), BatchError>
    where
        M: Sync,
        M::Check: Sync,
    {
        let channels = self.channels_of(readings)?;
        let rows = readings.len() / channels;
        let (taken, located) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let failed: Mutex<Option<BatchError>> = Mutex::new(None);
        let lock = || failed.lock().unwrap_or_else(PoisonError::into_inner);
        let work = || {
            let mut estimates = vec![NO_CONTACT; BLOCK.min(rows)];
            // A thread always completes its block, and so are all blocks ahead of one that fails. The first
            // invalid reading is thus reported for any number of threads.
            while lock().is_none() {
                let first = taken.fetch_add(BLOCK, Ordering::Relaxed);
                if first >= rows {
                    return;
                }
                let count = BLOCK.min(rows - first);
                let readings = &readings[first * channels..][..count * channels];
                let done =
                    self.locate_block(readings, channels, first, &mut estimates[..count]).and_then(|()| {
                        take(first, &estimates[..count]);
                        let located = located.fetch_add(count, Ordering::Relaxed) + count;
                        Ok(options.watch.counted("locating", "readings", located, rows)?)
                    });
                if let Err(error) = done {
                    let mut failed = lock();
                    *failed = failed.into_iter().chain([error]).min_by_key(BatchError::row);
                }
            }
        };
        let threads = options.threads.get().min(rows.div_ceil(BLOCK));
        std::thread::scope(|scope| {
            (1..threads).for_each(|_| {
                scope.spawn(work);
            });
            work();
        });
        failed.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
    }

    fn channels_of(&self, readings: &[f64]) -> Result<usize, BatchError> {
        let (values, channels) = (readings.len(), self.layout().len().max(1));
        if values.is_multiple_of(channels) {
            Ok(channels)
        } else {
            Err(BatchError::Uneven { values, channels })
        }
    }

    fn locate_block(
        &self,
        readings: &[f64],
        channels: usize,
        first: usize,
        estimates: &mut [Estimate],
    ) -> Result<(), BatchError> {
        for (i, reading) in readings.chunks_exact(channels).enumerate() {
            ReadingError::check(reading, self.layout().len())
                .map_err(|error| BatchError::Reading { row: first + i + 1, error })?;
        }
        let extent = self.setup.surface().extent();
        self.method.locate_batch(readings, channels, estimates);
        if let Some(check) = &self.check {
            check.check_batch(readings, channels, estimates, extent);
        }
        for (reading, estimate) in readings.chunks_exact(channels).zip(estimates) {
            *estimate = self.finished(*estimate, reading);
        }
        Ok(())
    }
}

impl BatchError {
    fn row(&self) -> usize {
        match self {
            Self::Reading { row, .. } => *row,
            Self::Uneven { .. } | Self::Cancelled(_) => usize::MAX,
        }
    }
}

#[cfg(test)]
mod tests;
