//! Comparison of a press with earlier presses.

use super::baseline::Baseline;
use super::press::Press;
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use std::fmt;

/// Share of the smallest press below which a touch is doubtful.
const LIGHT_SHARE: f64 = 0.15;
/// Relative deviation from repeats that is doubtful.
const REPEAT_SHARE: f64 = 0.2;
/// Largest share of hysteresis.
const MOST_RESIDUE_SHARE: f64 = 0.3;
/// Growth without a lift after a preliminary touch.
pub const GROWTH: f64 = 1.2;
/// Limit on repeated requests; the press is then recorded.
const MOST_REQUESTS: u32 = 2;

/// Reason for a repeated request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RetakeReason {
    /// Slow change.
    Drift,
    /// Growth after the recording, without rest.
    Grew,
    /// Touch much lighter than earlier ones.
    Light {
        /// Size in % of an earlier press.
        percent: f64,
    },
    /// Difference from the repeats.
    OffRepeats {
        /// Difference in %.
        percent: f64,
    },
}

impl fmt::Display for RetakeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Drift => write!(f, "the reading drifted; no press was seen"),
            Self::Grew => write!(f, "the press grew after its reading was recorded"),
            Self::Light { percent } => {
                write!(f, "the touch has only {percent:.1} % of an earlier press")
            }
            Self::OffRepeats { percent } => {
                write!(f, "the touch differs by {percent:.0} % from the other presses of this place")
            }
        }
    }
}

/// Mean reading of a touch.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchReading {
    pub reading: Vec<f64>,
    pub deviation: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq)]
struct PreviousPress {
    position: Position,
    force_n: Option<f64>,
    depth_m: Option<f64>,
    touch: TouchReading,
}

impl PreviousPress {
    fn is_repeat(&self, press: &Press) -> bool {
        self.position == press.position && self.force_n == press.force_n && self.depth_m == press.depth_m
    }
}

#[derive(Clone, Debug, Default)]
pub struct RepeatCheck {
    previous: Vec<PreviousPress>,
    refused: Option<TouchReading>,
    requests: u32,
    /// Largest deviation of the removed last press; a lighter touch is doubtful.
    outgrown: Option<Vec<f64>>,
    /// Largest change between untouched rows.
    residue: Vec<f64>,
}

impl RepeatCheck {
    pub fn new(rows: &[Row]) -> Self {
        let mut own = Self::default();
        let mut untouched: Option<&[f64]> = None;
        for row in rows {
            if !row.touches() {
                untouched = Some(&row.reading);
            } else if let Some(untouched) = untouched {
                let deviation = row.reading.iter().zip(untouched).map(|(value, mean)| value - mean).collect();
                let press = Press {
                    position: row.position,
                    force_n: row.force_n,
                    depth_m: row.nuisances.first().copied(),
                };
                own.record(&press, TouchReading { reading: row.reading.clone(), deviation });
            }
        }
        own
    }

    /// A second press that confirms the first is recorded.
    pub fn retake_reason(
        &self,
        press: &Press,
        touch: &TouchReading,
        baseline: &Baseline,
    ) -> Option<RetakeReason> {
        let is_confirmed = self
            .refused
            .as_ref()
            .is_some_and(|refused| difference_share(press, touch, refused, baseline) <= REPEAT_SHARE);
        if is_confirmed || self.requests >= MOST_REQUESTS {
            return None;
        }
        let size = baseline.size_of(&touch.deviation);
        if let Some(share) = self.outgrown.as_ref().map(|outgrown| size / baseline.size_of(outgrown))
            && share * GROWTH < 1.0
        {
            return Some(RetakeReason::Light { percent: 100.0 * share });
        }
        let repeats = self.previous.iter().filter(|past| past.is_repeat(press));
        // The other repeats may be wrong.
        let share = repeats.map(|past| self.excess_share(press, touch, &past.touch, baseline));
        if let Some(share) = share.min_by(f64::total_cmp) {
            return (share > REPEAT_SHARE).then_some(RetakeReason::OffRepeats { percent: 100.0 * share });
        }
        let share = size / self.smallest_size(baseline)?;
        (share < LIGHT_SHARE).then_some(RetakeReason::Light { percent: 100.0 * share })
    }

    /// Relative difference from an earlier press, less hysteresis.
    fn excess_share(
        &self,
        press: &Press,
        touch: &TouchReading,
        past: &TouchReading,
        baseline: &Baseline,
    ) -> f64 {
        let residue_share =
            baseline.length_of(&self.residue) / baseline.length_of(&past.deviation).max(f64::MIN_POSITIVE);
        difference_share(press, touch, past, baseline) - residue_share.min(MOST_RESIDUE_SHARE)
    }

    /// Smallest press, in standard deviations.
    pub fn smallest_size(&self, baseline: &Baseline) -> Option<f64> {
        self.previous.iter().map(|past| baseline.size_of(&past.touch.deviation)).min_by(f64::total_cmp)
    }

    /// Largest press, in standard deviations; 0 without presses.
    pub fn largest_size(&self, baseline: &Baseline) -> f64 {
        self.previous.iter().map(|past| baseline.size_of(&past.touch.deviation)).fold(0.0, f64::max)
    }

    pub fn add_residue(&mut self, change: Vec<f64>, baseline: &Baseline) {
        if baseline.length_of(&change) > baseline.length_of(&self.residue) {
            self.residue = change;
        }
    }

    /// Counts a repeated request.
    pub fn refuse(&mut self, touch: TouchReading) {
        self.refused = Some(touch);
        self.requests += 1;
    }

    pub fn record(&mut self, press: &Press, touch: TouchReading) {
        let Press { position, force_n, depth_m } = *press;
        self.previous.push(PreviousPress { position, force_n, depth_m, touch });
        self.forget_request();
    }

    pub fn forget_last(&mut self) {
        self.previous.pop();
        self.forget_request();
    }

    /// Removes the last press, which grew later.
    pub fn outgrow_last(&mut self, deviation: Vec<f64>) {
        self.forget_last();
        self.outgrown = Some(deviation);
    }

    pub fn forget_request(&mut self) {
        self.refused = None;
        self.requests = 0;
        self.outgrown = None;
    }
}

/// Known force: minimum over deviations and readings, because readings under load agree despite hysteresis.
/// Unknown force: difference in direction.
fn difference_share(
    press: &Press,
    touch: &TouchReading,
    reference: &TouchReading,
    baseline: &Baseline,
) -> f64 {
    let length = baseline.length_of(&reference.deviation);
    let own = baseline.length_of(&touch.deviation);
    if length <= 0.0 || own <= 0.0 {
        return f64::INFINITY;
    }
    let distance = |scale: f64, a: &[f64], b: &[f64]| {
        let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| scale * a - b).collect();
        baseline.length_of(&difference) / length
    };
    if press.force_n.is_none() {
        let scale = baseline.product_of(&touch.deviation, &reference.deviation) / (own * own);
        return distance(scale, &touch.deviation, &reference.deviation);
    }
    distance(1.0, &touch.deviation, &reference.deviation).min(distance(
        1.0,
        &touch.reading,
        &reference.reading,
    ))
}
