//! Detection of sample and hold: a logger faster than its sensors repeats all channels together.
//!
//! Three tests distinguish it from chance repeats of coarse converters, each with false-alarm rate
//! [`FALSE_ALARM`]:
//!
//! 1. *Size of changes.* Fine Gaussian noise, with mostly large changes, rarely repeats a value. A
//!    likelihood-ratio test compares counts of repeats, changes below 2.5 steps and larger changes with
//!    rounded Gaussian noise.
//! 2. *Coincidence of changes.* Of n pairs, channel c changes in d_c, and at least one channel in u. For
//!    independent channels P(U ≤ u) ≤ C(n, u) · Π_c C(u, d_c) / C(n, d_c) (union bound), combined over
//!    stretches by Fisher's method. Chance repeats are estimated by capture–recapture.
//! 3. *No change.* Noise of at least half a step repeats a value with probability at most 0.52.

use palpate_numerics::{bisect, chi_squared_critical_value, chi_squared_survival, normal_cdf};

/// False-alarm rate for independent channels, by policy.
pub const FALSE_ALARM: f64 = 1e-6;

/// Stored change sizes per channel.
const SIZES: usize = 256;
/// Relative rounding of equal values.
const ROUNDING: f64 = 1e-12;
/// Bound of large changes, between 2 and 3 steps.
const LARGE_STEPS: f64 = 2.5;
/// Greatest share of chance repeats, by policy.
const CHANCE_SHARE: f64 = 0.5;

/// Cause of repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RepeatCause {
    /// The logger is faster than its sensors.
    SampleAndHold,
    /// No repeat differs: low noise, or a fast logger.
    NoChange,
}

/// Counts of repeats over pairs of consecutive readings in stretches of one contact.
///
/// ```
/// use palpate_estimators::recording::{RepeatCause, RepeatCounts};
///
/// let mut counts = RepeatCounts::new(2);
/// let values = [[1.03, 7.31], [1.41, 7.02], [0.87, 7.66], [1.22, 7.19], [0.65, 7.48], [1.07, 6.91], [1.36, 7.27], [0.93, 7.09]];
/// let logged: Vec<[f64; 2]> = values.iter().flat_map(|value| [*value; 5]).collect();
/// logged.windows(2).for_each(|pair| counts.add(&pair[0], &pair[1]));
/// assert_eq!((counts.repeats(), counts.cause()), (32, Some(RepeatCause::SampleAndHold)));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RepeatCounts {
    channels: Vec<Changes>,
    stretch: Stretch,
    finished: Coincidence,
    pairs: u64,
    repeats: u64,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Changes {
    count: u64,
    /// Pairs at an end of the range, possibly clipped.
    clipped: u64,
    range: Option<[f64; 2]>,
    sizes: Vec<f64>,
    /// Smallest difference of unequal values.
    step: f64,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct Stretch {
    pairs: u64,
    /// Pairs with any change.
    changed: u64,
    changes: Vec<u64>,
}

/// Evidence of coincident changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Coincidence {
    stretches: usize,
    /// ln of the bound of P(U ≤ u), summed.
    ln_probability: f64,
    repeats: f64,
    /// Chance repeats.
    chance: f64,
}

impl RepeatCounts {
    /// Creates empty counts.
    pub fn new(channels: usize) -> Self {
        Self {
            channels: vec![Changes::default(); channels],
            stretch: Stretch::new(channels),
            finished: Coincidence::default(),
            pairs: 0,
            repeats: 0,
        }
    }

    /// Adds consecutive readings of one stretch.
    pub fn add(&mut self, before: &[f64], after: &[f64]) {
        let mut repeats = true;
        let mut is_clipped = true;
        for (c, (a, b)) in before.iter().zip(after).enumerate().take(self.channels.len()) {
            if is_equal(*a, *b) {
                let at_end = self.channels[c].is_at_end(*b);
                self.channels[c].clipped += u64::from(at_end);
                is_clipped &= at_end;
            } else {
                (repeats, is_clipped) = (false, false);
                self.stretch.changes[c] += 1;
                self.channels[c].add((a - b).abs());
            }
        }
        self.pairs += 1;
        if is_clipped {
            return;
        }
        self.repeats += u64::from(repeats);
        self.stretch.pairs += 1;
        self.stretch.changed += u64::from(!repeats);
    }

    /// Ends a stretch.
    pub fn end_stretch(&mut self) {
        let channels = self.channels.len();
        let stretch = std::mem::replace(&mut self.stretch, Stretch::new(channels));
        self.finished = self.finished.plus(&stretch);
    }

    /// Sets a channel's range and step before the first pair. Repeats at the ends of the range then do not
    /// count, because the channel may be clipped.
    pub fn set_range(&mut self, channel: usize, values: impl IntoIterator<Item = f64>) {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let steps =
            values.windows(2).filter(|pair| !is_equal(pair[0], pair[1])).map(|pair| pair[1] - pair[0]);
        if let Some(changes) = self.channels.get_mut(channel) {
            changes.step = steps.reduce(f64::min).unwrap_or_default();
            changes.range = values.first().zip(values.last()).map(|(low, high)| [*low, *high]);
        }
    }

    /// Number of pairs.
    pub fn pairs(&self) -> u64 {
        self.pairs
    }

    /// Pairs in which every channel repeats, at least one within its range.
    pub fn repeats(&self) -> u64 {
        self.repeats
    }

    fn channel_repeats(&self, channel: usize) -> u64 {
        self.pairs - self.channels.get(channel).map_or(0, |changes| changes.count + changes.clipped)
    }

    /// Cause of the repeats; `None` for chance.
    pub fn cause(&self) -> Option<RepeatCause> {
        if self.repeats == 0 {
            return None;
        }
        let varying = || (0..self.channels.len()).filter(|c| self.channels[*c].count > 0);
        if varying().next().is_none() {
            // 0.52^(pairs · channels) < false-alarm rate; a channel with a single value gives no evidence.
            let live = self.channels.iter().filter(|changes| changes.step > 0.0).count();
            let most = noisy_repeat_probability().ln() * self.repeats as f64 * live as f64;
            return (most < FALSE_ALARM.ln()).then_some(RepeatCause::NoChange);
        }
        let held = varying().all(|c| self.is_slow(c)) || self.finished.plus(&self.stretch).is_certain();
        held.then_some(RepeatCause::SampleAndHold)
    }

    /// True if rounded Gaussian noise does not explain the repeats.
    pub fn is_slow(&self, channel: usize) -> bool {
        let Some(changes) = self.channels.get(channel) else { return false };
        changes.exceed_rounding(self.channel_repeats(channel))
    }
}

/// Noise of half a step; differences have standard deviation √2/2.
fn noisy_repeat_probability() -> f64 {
    probability_within(0.5, std::f64::consts::FRAC_1_SQRT_2)
}

fn probability_within(steps: f64, sd: f64) -> f64 {
    1.0 - 2.0 * normal_cdf(-steps / sd)
}

/// True for equal values in every channel.
pub fn is_same_reading(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_equal(*a, *b))
}

fn is_equal(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

impl Changes {
    fn is_at_end(&self, value: f64) -> bool {
        self.range.is_some_and(|ends| ends.iter().any(|end| is_equal(*end, value)))
    }

    fn add(&mut self, size: f64) {
        self.count += 1;
        self.step = if self.step > 0.0 { self.step.min(size) } else { size };
        if self.sizes.len() < SIZES {
            self.sizes.push(size);
        }
    }

    /// Test 1.
    fn exceed_rounding(&self, repeats: u64) -> bool {
        if self.sizes.is_empty() || repeats == 0 {
            return false;
        }
        let large = self.sizes.iter().filter(|size| **size > LARGE_STEPS * self.step).count();
        let large_share = large as f64 / self.sizes.len() as f64;
        // The test needs fine noise, with mostly large changes.
        if large_share <= 0.5 {
            return false;
        }
        let changes = self.count as f64;
        let counts = [repeats as f64, changes * (1.0 - large_share), changes * large_share];
        let total: f64 = counts.iter().sum();
        let ln_likelihood = |shares: [f64; 3]| -> f64 {
            let terms = counts.iter().zip(shares).filter(|(count, _)| **count > 0.0);
            terms.map(|(count, share)| count * share.max(f64::MIN_POSITIVE).ln()).sum()
        };
        let rounded = |sd: f64| {
            let (same, small) = (probability_within(0.5, sd), probability_within(LARGE_STEPS, sd));
            [same, small - same, 2.0 * normal_cdf(-LARGE_STEPS / sd)]
        };
        // Standard deviations of differences from 0.05 to 20,000 steps, 5 % apart.
        let best = (0..265).map(|i| ln_likelihood(rounded(0.05 * 1.05_f64.powi(i)))).fold(f64::MIN, f64::max);
        let ratio = 2.0 * (ln_likelihood(counts.map(|count| count / total)) - best);
        // Repeats by chance, from the sizes of the changes alone.
        let share_of = |sd: f64| rounded(sd)[2] / (1.0 - rounded(sd)[0]);
        let sd = bisect((0.05, 2e4), 60, |sd| share_of(sd) < large_share);
        let same = rounded(sd)[0];
        let chance = changes * same / (1.0 - same);
        ratio > chi_squared_critical_value(FALSE_ALARM, 1) && chance < CHANCE_SHARE * repeats as f64
    }
}

impl Stretch {
    fn new(channels: usize) -> Self {
        Self { pairs: 0, changed: 0, changes: vec![0; channels] }
    }

    /// ln of the bound of P(U ≤ u).
    fn ln_probability(&self) -> f64 {
        let (n, u) = (self.pairs as f64, self.changed as f64);
        let channels = self.changes.iter().map(|d| ln_choose(u, *d as f64) - ln_choose(n, *d as f64));
        (ln_choose(n, u) + channels.sum::<f64>()).min(0.0)
    }

    /// u (1 − Z) / Z, with Π_c (1 − Z d_c / u) = 1 − Z the probability of no change; infinite without common
    /// changes.
    fn chance_repeats(&self) -> f64 {
        let u = self.changed as f64;
        let shares: Vec<f64> = self.changes.iter().map(|d| *d as f64 / u).collect();
        let unchanged = |z: f64| shares.iter().map(|share| 1.0 - share * z).product::<f64>();
        if shares.iter().sum::<f64>() <= 1.0 {
            return f64::INFINITY;
        }
        let z = bisect((0.0, 1.0), 60, |z| z == 0.0 || unchanged(z) < 1.0 - z);
        u * (1.0 - z) / z
    }
}

impl Coincidence {
    fn plus(self, stretch: &Stretch) -> Self {
        if stretch.changed == 0 {
            return self;
        }
        let repeats = (stretch.pairs - stretch.changed) as f64;
        Self {
            stretches: self.stretches + 1,
            ln_probability: self.ln_probability + stretch.ln_probability(),
            repeats: self.repeats + repeats,
            chance: self.chance + stretch.chance_repeats().min(repeats),
        }
    }

    /// Fisher's method rejects independent channels, and few repeats are by chance.
    fn is_certain(&self) -> bool {
        self.stretches > 0
            && self.chance < CHANCE_SHARE * self.repeats
            && chi_squared_survival(-2.0 * self.ln_probability, 2 * self.stretches) < FALSE_ALARM
    }
}

fn ln_choose(n: f64, k: f64) -> f64 {
    libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0)
}
