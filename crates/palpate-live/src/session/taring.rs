use super::{Estimation, TareMode};
use palpate_core::Estimate;
use palpate_core::Tare;
use palpate_estimators::estimator::Locator;

const BASELINE_S: f64 = Tare::<[f64; 0]>::MOMENT_S;
const BASELINE_READINGS: u32 = Tare::<[f64; 0]>::SETTLED;

#[derive(Debug)]
pub struct Taring {
    /// `None` without the offsets of the calibration.
    tare: Option<Tare<Vec<f64>>>,
    follows: bool,
    now_s: f64,
    pending: Option<PendingBaseline>,
}

#[derive(Debug)]
struct PendingBaseline {
    tare: Tare<Vec<f64>>,
    since_s: Option<f64>,
    readings: u32,
}

impl Taring {
    pub fn new(locator: &Locator, mode: TareMode, estimation: &Estimation) -> Self {
        let follows = mode == TareMode::Auto && locator.false_alarm_rate().is_some();
        let tare = locator.tare().ok().map(|tare| match estimation {
            // The tracker compensates creep.
            Estimation::Track { creep: Some(_), .. } => tare.without_rests(),
            _ => tare,
        });
        Self { tare, follows, now_s: 0.0, pending: None }
    }

    pub fn note_time(&mut self, time_s: f64) {
        self.now_s = time_s;
        if let Some(tare) = &mut self.tare {
            tare.note_time(time_s);
        }
    }

    pub fn begin(&mut self) {
        let begun =
            |tare: &Tare<Vec<f64>>| PendingBaseline { tare: tare.restarted(), since_s: None, readings: 0 };
        self.pending = self.tare.as_ref().map(begun);
    }

    /// Estimate, and whether a baseline was completed.
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

    pub fn locate_repeat(&self, locator: &Locator, reading: &[f64], tared: &mut [f64]) -> Option<Estimate> {
        match &self.tare {
            Some(tare) => {
                tare.apply(reading, tared).ok()?;
                locator.locate(tared).ok()
            }
            None => locator.locate(reading).ok(),
        }
    }

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
