//! Search for one contact on a line: whitening, coarse search, Gauss–Newton.
//!
//! Symbols: d whitened reading (minus offsets, over the noise), f whitened influence, W force, a position,
//! χ²(a, W) = |d − W·f(a)|² (+ the term of a normal prior of the force).

use super::coarse::{COARSE, Coarse, MOST_MINIMA, Profile};
use super::gauss_newton::{GaussNewton, Minimum, grouped, paired};
use super::spread::SpreadTable;
use super::table::InfluenceTable;
use crate::influence::channels::Channels;
use crate::influence::config::ForceBelief;
use crate::status::{LINE_PLACES, StatusRule, unknowns};
use palpate_numerics::simd::{Array, EightLanes};

/// Whitened table of the channels in use.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Search {
    pub live: Vec<usize>,
    from_first: bool,
    /// Offset and 1/noise, in zero-padded groups of eight channels.
    scaling: Vec<[[f64; 8]; 2]>,
    pub table: InfluenceTable,
    pub coarse: Coarse,
    pub gauss_newton: GaussNewton,
    pub force: ForceBelief,
    pub greatest_force_n: f64,
    pub rule: StatusRule,
    spread: SpreadTable,
}

/// A minimum this far above the best has e⁻¹² of its probability.
pub(super) const NEGLIGIBLE: f64 = 24.0;
const MOST_STEPS: usize = 32;

impl Search {
    pub fn new(table: &InfluenceTable, channels: &Channels, force: ForceBelief) -> Self {
        let Channels { offsets, noise_sd, reference_force_n, false_alarm_rate, .. } = channels;
        let live = channels.live();
        let inverse_sd: Vec<f64> = live.iter().map(|s| 1.0 / noise_sd[*s]).collect();
        let table = table.whitened(&live, &inverse_sd);
        let offsets: Vec<f64> = live.iter().map(|s| offsets[*s]).collect();
        let gauss_newton = GaussNewton::new(&table, force, *reference_force_n);
        Self {
            from_first: live.iter().enumerate().all(|(i, s)| i == *s),
            scaling: paired(grouped(&offsets, live.len(), 0.0), grouped(&inverse_sd, live.len(), 0.0)),
            coarse: Coarse::new(&table, &gauss_newton.weights, force),
            spread: SpreadTable::new(&table, &gauss_newton, force),
            gauss_newton,
            rule: StatusRule::new(live.len(), unknowns(1, force.known_n()), LINE_PLACES, *false_alarm_rate),
            greatest_force_n: channels.greatest_force_n(),
            live,
            table,
            force,
        }
    }

    #[inline(always)]
    pub fn groups(&self) -> usize {
        self.scaling.len()
    }

    /// Writes d and returns |d|².
    #[inline(always)]
    pub fn whiten<V: EightLanes>(&self, reading: &[f64], whitened: &mut [[f64; 8]]) -> f64 {
        let mut square = V::splat(0.0);
        for (g, (group, [offsets, inverse])) in whitened.iter_mut().zip(&self.scaling).enumerate() {
            let channels = &self.live[8 * g..self.live.len().min(8 * g + 8)];
            let direct = match reading.get(8 * g..).and_then(|rest| rest.first_chunk()) {
                Some(chunk) if self.from_first && channels.len() == 8 => Some(chunk),
                _ => None,
            };
            let raw = match direct {
                Some(chunk) => V::load(chunk),
                None => V::load(&gather(reading, channels)),
            };
            let d = (raw - V::load(offsets)) * V::load(inverse);
            *group = d.to_array();
            square = square + d * d;
        }
        square.sum()
    }

    /// Lowest local minimum, and a lower bound of χ² of the others.
    #[inline(always)]
    pub fn lowest_valley<V: EightLanes>(
        &self,
        square: f64,
        whitened: &[[f64; 8]],
        profile: &mut Profile,
    ) -> Option<(usize, f64)> {
        self.coarse.scan::<V>(square, whitened, profile);
        let (valleys, count) = profile.valleys::<V>();
        let (lowest, others) = valleys[..count].split_first()?;
        let floor = others.iter().map(|node| self.coarse.start::<V, f64>(&[&*profile], &[*node]).floor);
        Some((*lowest, floor.fold(f64::INFINITY, f64::min)))
    }

    /// Log determinant of the channels' covariance, over the noise's.
    pub fn log_determinant(&self, x_m: f64, force_n: f64) -> f64 {
        let cell = self.table.cell(x_m);
        let weight = self.gauss_newton.weights_at(&cell, force_n);
        -(0..self.table.sensors).map(|channel| weight(channel).ln()).sum::<f64>()
    }

    #[inline(always)]
    pub fn is_explained(&self, whitened: &[[f64; 8]], minimum: &Minimum) -> bool {
        self.rule.is_explained(minimum.misfit) && !self.is_spread(whitened, minimum)
    }

    /// Distributed-contact test.
    #[inline(always)]
    pub fn is_spread(&self, whitened: &[[f64; 8]], minimum: &Minimum) -> bool {
        // χ² is at least as large as the score.
        minimum.misfit > self.spread.bound && self.spread.is_told(&self.gauss_newton, whitened, minimum)
    }

    /// Relevant minima, best first; `square` is |d|².
    #[inline(always)]
    pub fn minima<V: EightLanes>(
        &self,
        square: f64,
        scratch: &mut Scratch,
    ) -> ([Minimum; MOST_MINIMA], usize) {
        let whitened = scratch.whitened.groups(self.groups());
        self.coarse.scan::<V>(square, whitened, &mut scratch.profile);
        let (valleys, count) = scratch.profile.valleys::<V>();
        self.minima_from::<V>(whitened, &scratch.profile, &valleys[..count])
    }

    /// Minima from every coarse node: Gauss–Newton steps cannot leave a stretch where place and force are
    /// confounded.
    #[cold]
    pub fn minima_from_everywhere(
        &self,
        whitened: &[[f64; 8]],
        profile: &Profile,
    ) -> ([Minimum; MOST_MINIMA], usize) {
        let nodes: [usize; COARSE] = std::array::from_fn(|node| node);
        self.minima_from::<Array<f64, 8, false>>(whitened, profile, &nodes)
    }

    #[inline(always)]
    fn minima_from<V: EightLanes>(
        &self,
        whitened: &[[f64; 8]],
        profile: &Profile,
        nodes: &[usize],
    ) -> ([Minimum; MOST_MINIMA], usize) {
        let mut found = [Minimum::<f64>::nowhere(); MOST_MINIMA];
        let (mut count, mut best) = (0, f64::INFINITY);
        for node in nodes {
            let start = self.coarse.start::<V, f64>(&[profile], &[*node]);
            if start.floor > best + NEGLIGIBLE {
                continue;
            }
            let (minimum, _) =
                self.gauss_newton.minimum::<V, f64>(whitened, (start.x_m, start.force_n), MOST_STEPS);
            let near = 0.5 * self.gauss_newton.spacing.h_m;
            let is_near = |other: &Minimum| (other.x_m - minimum.x_m).abs() <= near;
            match found[..count].iter().position(is_near) {
                Some(same) if minimum.misfit < found[same].misfit => found[same] = minimum,
                Some(_) => {}
                None if count < MOST_MINIMA => {
                    found[count] = minimum;
                    count += 1;
                }
                None => replace_worst(&mut found, minimum),
            }
            best = best.min(minimum.misfit);
        }
        if count > 1 {
            found[..count].sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
            count = found[..count].iter().take_while(|m| m.misfit <= best + NEGLIGIBLE).count();
        }
        (found, count.max(1))
    }
}

fn replace_worst(found: &mut [Minimum; MOST_MINIMA], minimum: Minimum) {
    let worst = found.iter_mut().max_by(|a, b| a.misfit.total_cmp(&b.misfit));
    if let Some(worst) = worst.filter(|worst| minimum.misfit < worst.misfit) {
        *worst = minimum;
    }
}

#[inline(always)]
fn gather(reading: &[f64], channels: &[usize]) -> [f64; 8] {
    let mut raw = [0.0; 8];
    raw.iter_mut().zip(channels).for_each(|(raw, s)| *raw = reading[*s]);
    raw
}

/// Reusable memory for locating readings; up to sixteen channels need no allocation.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) whitened: ChannelGroups,
    pub(super) profile: Profile,
    pub(super) eight: ForEight,
}

#[derive(Clone, Debug, Default)]
pub(super) struct ForEight {
    pub whitened: Vec<[f64; 8]>,
    pub profiles: Vec<Profile>,
}

impl ForEight {
    #[inline(always)]
    pub fn resize(&mut self, groups: usize) {
        self.whitened.resize(8 * groups, [0.0; 8]);
        self.profiles.resize_with(8, Profile::default);
    }
}

/// d, in zero-padded groups of eight channels.
#[derive(Clone, Debug, Default)]
pub(super) struct ChannelGroups {
    near: [[f64; 8]; 2],
    far: Vec<[f64; 8]>,
}

impl ChannelGroups {
    #[inline(always)]
    pub fn room(&mut self, groups: usize) -> &mut [[f64; 8]] {
        if groups <= 2 {
            return &mut self.near[..groups];
        }
        self.far.resize(groups, [0.0; 8]);
        &mut self.far
    }

    #[inline(always)]
    pub fn groups(&self, groups: usize) -> &[[f64; 8]] {
        if groups <= 2 { &self.near[..groups] } else { &self.far[..groups] }
    }

    pub fn channels(&self, channels: usize) -> &[f64] {
        &self.groups(channels.div_ceil(8)).as_flattened()[..channels]
    }
}
