//! Comparison of a press with earlier presses, before it is recorded.

use super::baseline::Baseline;
use super::press::Press;
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use std::fmt;

/// Share of the smallest press so far; a lighter touch is doubtful.
const LIGHT_SHARE: f64 = 0.15;
/// Deviation from the repeats of a press, as a share of its size; a larger one is doubtful.
const REPEAT_SHARE: f64 = 0.2;
/// Largest share of a press that is attributed to hysteresis.
const MOST_RESIDUE_SHARE: f64 = 0.3;
/// Growth of a reading without a lift above which the recorded touch was only a light one before the press.
pub const GROWTH: f64 = 1.2;
/// Largest number of repeated requests of one press; after these it is recorded unchanged.
const MOST_REQUESTS: u32 = 2;

/// Reason to request a press again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// The reading changed too slowly for a press.
    Drift,
    /// The press grew after its reading was recorded, and was lifted before it came to rest.
    Grew,
    /// The touch is much lighter than earlier presses.
    Light {
        /// Size in % of an earlier press.
        percent: f64,
    },
    /// The touch differs from the other presses of its place.
    OffRepeats {
        /// The difference in % of their size.
        percent: f64,
    },
}

impl fmt::Display for Doubt {
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
    /// The reading.
    pub reading: Vec<f64>,
    /// Deviation from the previous untouched reading.
    pub deviation: Vec<f64>,
}

/// A recorded press.
#[derive(Clone, Debug, PartialEq)]
struct PastPress {
    position: Position,
    force_n: Option<f64>,
    depth_m: Option<f64>,
    touch: TouchReading,
}

impl PastPress {
    fn is_repeat(&self, press: &Press) -> bool {
        self.position == press.position && self.force_n == press.force_n && self.depth_m == press.depth_m
    }
}

/// Presses so far, for comparison with the next one.
#[derive(Clone, Debug, Default)]
pub struct RepeatCheck {
    past: Vec<PastPress>,
    /// The last press that was requested again, and the number of requests.
    refused: Option<TouchReading>,
    requests: u32,
    /// Deviation up to which the last press grew after its reading was recorded: a lighter touch does not count as the press.
    outgrown: Option<Vec<f64>>,
    /// Largest change between consecutive recorded untouched readings.
    residue: Vec<f64>,
}

impl RepeatCheck {
    /// A check against the presses of a file; `rows` are in the order of the file.
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

    /// The reason to request a press again, given its touch; `None` if it may be recorded.
    ///
    /// A second press that confirms the first is recorded, to avoid endless requests.
    pub fn doubt(&self, press: &Press, touch: &TouchReading, baseline: &Baseline) -> Option<Doubt> {
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
            return Some(Doubt::Light { percent: 100.0 * share });
        }
        let repeats = self.past.iter().filter(|past| past.is_repeat(press));
        // Agreement with one repeat is sufficient, because another may be the wrong one.
        let share = repeats.map(|past| self.excess_share(press, touch, &past.touch, baseline));
        if let Some(share) = share.min_by(f64::total_cmp) {
            return (share > REPEAT_SHARE).then_some(Doubt::OffRepeats { percent: 100.0 * share });
        }
        let share = size / self.smallest_size(baseline)?;
        (share < LIGHT_SHARE).then_some(Doubt::Light { percent: 100.0 * share })
    }

    /// Difference from an earlier press as a share of its size, less the share that hysteresis of earlier touches may have left.
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

    /// Size of the smallest press so far, in standard deviations of the noise.
    pub fn smallest_size(&self, baseline: &Baseline) -> Option<f64> {
        self.past.iter().map(|past| baseline.size_of(&past.touch.deviation)).min_by(f64::total_cmp)
    }

    /// Size of the largest press so far, in standard deviations of the noise; 0 before the first.
    pub fn largest_size(&self, baseline: &Baseline) -> f64 {
        self.past.iter().map(|past| baseline.size_of(&past.touch.deviation)).fold(0.0, f64::max)
    }

    /// Notes the change of the untouched reading since the last recorded one.
    pub fn add_residue(&mut self, change: Vec<f64>, baseline: &Baseline) {
        if baseline.length_of(&change) > baseline.length_of(&self.residue) {
            self.residue = change;
        }
    }

    /// Notes that a press was requested again.
    pub fn refuse(&mut self, touch: TouchReading) {
        self.refused = Some(touch);
        self.requests += 1;
    }

    /// Records a press.
    pub fn record(&mut self, press: &Press, touch: TouchReading) {
        let Press { position, force_n, depth_m } = *press;
        self.past.push(PastPress { position, force_n, depth_m, touch });
        self.forget_request();
    }

    /// Removes the last press.
    pub fn forget_last(&mut self) {
        self.past.pop();
        self.forget_request();
    }

    /// Removes the last press, which grew up to this deviation after its reading was recorded.
    pub fn outgrow_last(&mut self, deviation: Vec<f64>) {
        self.forget_last();
        self.outgrown = Some(deviation);
    }

    /// Resets the count of repeated requests.
    pub fn forget_request(&mut self) {
        self.refused = None;
        self.requests = 0;
        self.outgrown = None;
    }
}

/// Length of the difference between two touches as a share of the second.
///
/// If the force is known, the smaller of two differences counts, that of the deviations and that of the readings: with hysteresis, the readings of
/// a load agree after any earlier touch. If the force is unknown, only the directions of the deviations are compared.
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
