//! Where one contact is: whitened search over the table, then Gauss–Newton.
//!
//! Symbols: d whitened reading (less offsets, over the noise), f whitened influence, W force, a position,
//! χ²(a, W) = |d − W·f(a)|² (+ the force's own misfit where it is believed to be near a value), S channels in use.
//!
//! What it costs: the scan takes S·40 multiply-adds, eight side by side, and reads S·40 influences; a step reads two nodes
//! of the table and one of the weights. Neither bounds a single reading, whose steps wait for each other: sums, valleys, a
//! place, sums, a division, the next place, a root. So the search saves links of that chain: the force starts from the
//! scan's products and is solved for with the place's own sums, nearly always one or two steps are enough ([`super::gauss_newton`]
//! knows when), and valleys that cannot compete are not refined where the force is known. Batches run eight chains side
//! by side ([`super::locator`]).

use super::coarse::{Coarse, MOST_MINIMA, Profile};
use super::gauss_newton::{GaussNewton, Minimum, grouped, paired};
use super::spread::SpreadTable;
use super::table::InfluenceTable;
use crate::influence::channels::Channels;
use crate::influence::config::ForceBelief;
use crate::status::{LINE_PLACES, StatusRule, unknowns};
use palpate_numerics::simd::Eight;

/// A table that is ready to be searched: whitened, and without the channels that are left out.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Search {
    /// The channels in use.
    pub live: Vec<usize>,
    /// Whether those are the first channels of a reading.
    from_first: bool,
    /// Offset and one over the noise of the channels in use, in groups of eight, padded with zeros.
    scaling: Vec<[[f64; 8]; 2]>,
    /// f, f′ and the variance of f, of the channels in use.
    pub table: InfluenceTable,
    pub coarse: Coarse,
    pub gauss_newton: GaussNewton,
    pub force: ForceBelief,
    /// Greatest force of a contact of unknown force, in newtons.
    pub greatest_force_n: f64,
    /// The rule for one contact.
    pub rule: StatusRule,
    /// Directions of a spread.
    spread: SpreadTable,
}

/// A minimum this much above the best has a share of e⁻¹² of the probability.
pub(super) const NEGLIGIBLE: f64 = 24.0;
/// Steps to a minimum, of which one or two are the rule.
const MOST_STEPS: usize = 32;

impl Search {
    /// Whitens a table by the noise of each channel, and leaves out the channels that are `dead`.
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

    /// Groups of eight channels.
    #[inline(always)]
    pub fn groups(&self) -> usize {
        self.scaling.len()
    }

    /// Writes d, in groups of eight channels, and returns |d|².
    #[inline(always)]
    pub fn whiten<V: Eight>(&self, reading: &[f64], whitened: &mut [[f64; 8]]) -> f64 {
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

    /// The lowest valley of a reading that was whitened to length `square`, and below which misfit no other valley goes;
    /// `None` where there is no valley.
    #[inline(always)]
    pub fn lowest_valley<V: Eight>(
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

    /// True where a point explains a reading by its minimum: neither its misfit nor its spread is more than noise makes it.
    #[inline(always)]
    pub fn is_explained(&self, whitened: &[[f64; 8]], minimum: &Minimum) -> bool {
        self.rule.is_explained(minimum.misfit) && !self.is_spread(whitened, minimum)
    }

    /// True for a reading that is, by its minimum, one of a contact that is spread.
    #[inline(always)]
    pub fn is_spread(&self, whitened: &[[f64; 8]], minimum: &Minimum) -> bool {
        // The square of the residual is at least that of its part.
        minimum.misfit > self.spread.bound && self.spread.is_told(&self.gauss_newton, whitened, minimum)
    }

    /// The minima that matter, best first, of a reading that was whitened to length `square`.
    #[inline(always)]
    pub fn minima<V: Eight>(&self, square: f64, scratch: &mut Scratch) -> ([Minimum; MOST_MINIMA], usize) {
        let whitened = scratch.whitened.groups(self.groups());
        self.coarse.scan::<V>(square, whitened, &mut scratch.profile);
        let (valleys, valleys_count) = scratch.profile.valleys::<V>();
        let mut found = [Minimum::<f64>::nowhere(); MOST_MINIMA];
        let (mut count, mut best) = (0, f64::INFINITY);
        for node in &valleys[..valleys_count] {
            let start = self.coarse.start::<V, f64>(&[&scratch.profile], &[*node]);
            if start.floor > best + NEGLIGIBLE {
                continue;
            }
            let (minimum, _) =
                self.gauss_newton.minimum::<V, f64>(whitened, (start.x_m, start.force_n), MOST_STEPS);
            let near = 0.5 * self.gauss_newton.spacing.h_m;
            if found[..count].iter().all(|other| (other.x_m - minimum.x_m).abs() > near) {
                found[count] = minimum;
                count += 1;
                best = best.min(minimum.misfit);
            }
        }
        if count > 1 {
            found[..count].sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
            count = found[..count].iter().take_while(|m| m.misfit <= best + NEGLIGIBLE).count();
        }
        (found, count.max(1))
    }
}

/// The readings of some channels.
#[inline(always)]
fn gather(reading: &[f64], channels: &[usize]) -> [f64; 8] {
    let mut raw = [0.0; 8];
    raw.iter_mut().zip(channels).for_each(|(raw, s)| *raw = reading[*s]);
    raw
}

/// Memory for locating readings, to be used again; up to sixteen channels it lies in place, without allocation.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) whitened: Whitened,
    pub(super) profile: Profile,
    pub(super) eight: ForEight,
}

/// The same for eight readings, one after the other; empty until there is a batch.
#[derive(Clone, Debug, Default)]
pub(super) struct ForEight {
    pub whitened: Vec<[f64; 8]>,
    pub profiles: Vec<Profile>,
}

impl ForEight {
    /// Room for so many groups of channels in each reading.
    #[inline(always)]
    pub fn resize(&mut self, groups: usize) {
        self.whitened.resize(8 * groups, [0.0; 8]);
        self.profiles.resize_with(8, Profile::default);
    }
}

/// d, in groups of eight channels, padded with zeros.
#[derive(Clone, Debug, Default)]
pub(super) struct Whitened {
    near: [[f64; 8]; 2],
    far: Vec<[f64; 8]>,
}

impl Whitened {
    /// Room for so many groups.
    #[inline(always)]
    pub fn room(&mut self, groups: usize) -> &mut [[f64; 8]] {
        if groups <= 2 {
            return &mut self.near[..groups];
        }
        self.far.resize(groups, [0.0; 8]);
        &mut self.far
    }

    /// So many groups.
    #[inline(always)]
    pub fn groups(&self, groups: usize) -> &[[f64; 8]] {
        if groups <= 2 { &self.near[..groups] } else { &self.far[..groups] }
    }

    /// d of so many channels.
    pub fn channels(&self, channels: usize) -> &[f64] {
        &self.groups(channels.div_ceil(8)).as_flattened()[..channels]
    }
}
