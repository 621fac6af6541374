//! The baseline of a session, and estimates relative to it.

use super::{Estimation, TareMode};
use palpate_core::Estimate;
use palpate_core::Tare;
use palpate_estimators::estimator::Locator;

/// Least time, and least number of readings, for a baseline that the user requests.
const BASELINE_S: f64 = Tare::<[f64; 0]>::MOMENT_S;
const BASELINE_READINGS: u32 = Tare::<[f64; 0]>::SETTLED;

/// The baseline of a session.
#[derive(Debug)]
pub struct Taring {
    /// The tare; `None` if the locator does not contain the untouched reading of its channels.
    tare: Option<Tare<Vec<f64>>>,
    follows: bool,
    /// Time of the next reading, in seconds.
    now_s: f64,
    pending: Option<PendingBaseline>,
}

/// A baseline in progress.
#[derive(Debug)]
struct PendingBaseline {
    tare: Tare<Vec<f64>>,
    /// Time of the first reading, in seconds.
    since_s: Option<f64>,
    readings: u32,
}

impl Taring {
    /// The tare of a new session.
    pub fn new(locator: &Locator, mode: TareMode, estimation: &Estimation) -> Self {
        let follows = mode == TareMode::Auto && locator.false_alarm_rate().is_some();
        let tare = locator.tare().ok().map(|tare| match estimation {
            // The tracker compensates creep.
            Estimation::Track { creep: Some(_), .. } => tare.without_rests(),
            _ => tare,
        });
        Self { tare, follows, now_s: 0.0, pending: None }
    }

    /// Notes the time of the next reading, in seconds.
    pub fn note_time(&mut self, time_s: f64) {
        self.now_s = time_s;
        if let Some(tare) = &mut self.tare {
            tare.note_time(time_s);
        }
    }

    /// Begins a new baseline.
    pub fn begin(&mut self) {
        let begun =
            |tare: &Tare<Vec<f64>>| PendingBaseline { tare: tare.restarted(), since_s: None, readings: 0 };
        self.pending = self.tare.as_ref().map(begun);
    }

    /// The estimate of a reading, and whether the reading completes a baseline; `tared` contains the tared reading afterwards. `None` for a reading
    /// that is not finite.
    pub fn locate(
        &mut self,
        locator: &Locator,
        reading: &[f64],
        tared: &mut [f64],
    ) -> Option<(Estimate, bool)> {
        let tares = self.complete_baseline(reading);
        let Some(tare) = &mut self.tare else { return Some((locator.locate(reading).ok()?, tares)) };
        if self.follows {
            return Some((locator.locate_following(tare, reading, tared).ok()?, tares));
        }
        tare.apply(reading, tared).ok()?;
        Some((locator.locate(tared).ok()?, tares))
    }

    /// The estimate of a reading that repeats the previous one; the baseline stays unchanged.
    pub fn locate_repeat(&self, locator: &Locator, reading: &[f64], tared: &mut [f64]) -> Option<Estimate> {
        match &self.tare {
            Some(tare) => {
                tare.apply(reading, tared).ok()?;
                locator.locate(tared).ok()
            }
            None => locator.locate(reading).ok(),
        }
    }

    /// Adds a reading to the baseline in progress. True if this completes it; it then replaces the present baseline.
    fn complete_baseline(&mut self, reading: &[f64]) -> bool {
        let Some(PendingBaseline { tare, since_s, readings }) = &mut self.pending else { return false };
        if tare.add_untouched(reading).is_err() {
            return false;
        }
        *readings += 1;
        let since_s = *since_s.get_or_insert(self.now_s);
        if *readings < BASELINE_READINGS || self.now_s - since_s < BASELINE_S {
            return false;
        }
        self.tare = self.pending.take().map(|pending| pending.tare);
        true
    }
}
