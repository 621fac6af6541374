//! A press compared with earlier presses, before it is recorded.

use super::baseline::Baseline;
use super::press::Press;
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use std::fmt;

/// Share of the smallest press so far below which a touch is doubtful.
const LIGHT_SHARE: f64 = 0.15;
/// Deviation from the repeats of a press, as a share of its size, above which it is doubtful.
const REPEAT_SHARE: f64 = 0.2;
/// Largest share of a press that hysteresis is assumed to explain.
const MOST_RESIDUE_SHARE: f64 = 0.3;
/// Growth of a reading, without a lift, that shows the recorded touch to have been a light one before the press.
pub const GROWTH: f64 = 1.2;
/// Times that one press is asked for again before it is recorded as it is.
const MOST_REQUESTS: u32 = 2;

/// Reason to ask for a press again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// The reading moved without a press: too slowly.
    Drift,
    /// The press grew after its reading was taken, and was lifted before it rested.
    Grew,
    /// The touch is much lighter than earlier presses.
    Light {
        /// Size in % of an earlier press.
        percent: f64,
    },
    /// The touch differs from the presses of its place.
    OffRepeats {
        /// The difference in % of their size.
        percent: f64,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Drift => write!(f, "the reading drifted; no press was seen"),
            Self::Grew => write!(f, "the press grew after its reading was taken"),
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
    /// Deviation from the untouched reading before it.
    pub deviation: Vec<f64>,
}

/// A press that was recorded.
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

/// Presses so far, with which the next one is compared.
#[derive(Clone, Debug, Default)]
pub struct RepeatCheck {
    past: Vec<PastPress>,
    /// The press that was asked for again last, and how often.
    refused: Option<TouchReading>,
    requests: u32,
    /// Deviation up to which the last press grew after its reading was taken: a lighter touch is not the press.
    outgrown: Option<Vec<f64>>,
    /// Largest change between untouched readings that were recorded one after the other.
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

    /// The reason to ask for a press with this touch again; `None` where it may be recorded.
    ///
    /// A second press that confirms the first is recorded, so that nobody is asked in a circle.
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
        // Agreement with one of them is enough: another may be the wrong one.
        let share = repeats.map(|past| self.excess_share(press, touch, &past.touch, baseline));
        if let Some(share) = share.min_by(f64::total_cmp) {
            return (share > REPEAT_SHARE).then_some(Doubt::OffRepeats { percent: 100.0 * share });
        }
        let share = size / self.smallest_size(baseline)?;
        (share < LIGHT_SHARE).then_some(Doubt::Light { percent: 100.0 * share })
    }

    /// Difference to an earlier press as a share of its size, less what the touches before both may have left by hysteresis.
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

    /// Notes that a press was asked for again.
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

    /// Forgets the last press.
    pub fn forget_last(&mut self) {
        self.past.pop();
        self.forget_request();
    }

    /// Forgets the last press, which grew up to this deviation after its reading was taken.
    pub fn outgrow_last(&mut self, deviation: Vec<f64>) {
        self.forget_last();
        self.outgrown = Some(deviation);
    }

    /// Forgets that a press was asked for again.
    pub fn forget_request(&mut self) {
        self.refused = None;
        self.requests = 0;
        self.outgrown = None;
    }
}

/// Length of the difference of two touches as a share of the second.
///
/// Of a known force, the smaller difference counts of the deviations and of the readings: with hysteresis, the readings of a load agree, whatever the touch
/// before it left. Where the force is unknown, only the directions of the deviations are compared.
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
