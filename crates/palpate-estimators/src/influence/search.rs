//! Where one contact is: whitened search over the table, then Gauss–Newton.
//!
//! Symbols: d whitened reading (less offsets, over the noise), f whitened influence, W force, a position,
//! χ²(a, W) = |d − W·f(a)|² (+ the force's own misfit where it is believed to be near a value), S channels in use.
//!
//! What it costs: the scan takes S·40 multiply-adds, eight side by side, and reads S·40 influences; a step reads two nodes
//! of the table and one of the weights. Neither bounds a single reading, whose steps wait for each other: sums, valleys, a
//! place, sums, a division, the next place, a root. So the search saves links of that chain: the force starts from the
//! scan's products and is solved for with the place's own sums, nearly always one or two steps are enough ([`super::bend`]
//! knows when), and valleys that cannot compete are not refined where the force is known. Batches run eight chains side
//! by side ([`super::batch`]).

use super::belief::ForceBelief;
use super::bend::{Bend, bends};
use super::coarse::{Coarse, MOST_MINIMA, Profile};
use super::lanes::{Eight, Number};
use super::scratch::Scratch;
use super::several::charge;
use super::table::{InfluenceTable, Spacing};
use palpate_numerics::chi_squared_bound;

/// A table that is ready to be searched: whitened, and without the channels that are left out.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Search {
    /// The channels in use.
    pub live: Vec<usize>,
    /// Whether those are the first channels of a reading.
    from_first: bool,
    /// Of the channels in use, in groups of eight: offset and one over the noise, padded with zeros.
    scaling: Vec<[[f64; 8]; 2]>,
    /// f, f′ and the variance of f, of the channels in use.
    pub table: InfluenceTable,
    pub spacing: Spacing,
    /// f and f′ at every node, in groups of eight channels.
    pub rows: Vec<[[f64; 8]; 2]>,
    /// 1/(1 + v) in every cell, v the calibration's variance of a reading over the noise's at the known force or the
    /// calibration's, in groups of eight channels.
    pub weights: Vec<[f64; 8]>,
    /// How the influences bend in every cell.
    pub bends: Vec<Bend>,
    pub coarse: Coarse,
    /// Where places end: at the surface's ends, or a little before.
    pub ends_m: [f64; 2],
    pub force: ForceBelief,
    /// The calibration's mean force, in newtons: its offsets are as uncertain as its influences at this force.
    reference_force_n: f64,
    inverse_reference: f64,
    /// What a contact costs, by the criterion that counts contacts.
    pub charge: f64,
    /// A misfit of one contact is larger than this once in ten thousand readings; infinite where none can be.
    pub worst_misfit: f64,
    /// |d|² of noise alone is larger than this once in ten thousand readings.
    pub worst_noise: f64,
}

/// A minimum of the misfit, or one each of several readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Minimum<N = f64> {
    pub x_m: N,
    pub force_n: N,
    /// χ² there.
    pub misfit: N,
    /// Variance of the position, covariance of position and force, variance of the force.
    pub covariance: [N; 3],
}

/// A minimum this much above the best has a share of e⁻¹² of the probability.
pub(super) const NEGLIGIBLE: f64 = 24.0;
/// Forces beyond so many times the calibration's are taken for no less certain: an immense force next to a support, of
/// which the calibration says nothing, would else explain every reading.
const MOST_GROWTH: f64 = 10.0;
/// Steps to a minimum, of which one or two are the rule.
const MOST_STEPS: usize = 32;

impl Search {
    /// Whitens a table by the noise of each channel, and leaves out the channels that are `dead`.
    pub fn new(
        table: &InfluenceTable,
        offsets: &[f64],
        noise_sd: &[f64],
        dead: &[bool],
        force: ForceBelief,
        reference_force_n: f64,
    ) -> Self {
        let live: Vec<usize> = (0..table.sensors).filter(|s| !dead[*s]).collect();
        let inverse_sd: Vec<f64> = live.iter().map(|s| 1.0 / noise_sd[*s]).collect();
        let table = table.whitened(&live, &inverse_sd);
        let offsets: Vec<f64> = live.iter().map(|s| offsets[*s]).collect();
        let weights = weights(&table, force.weights_force_n(reference_force_n));
        Self {
            from_first: live.iter().enumerate().all(|(i, s)| i == *s),
            scaling: pair(grouped(&offsets, live.len(), 0.0), grouped(&inverse_sd, live.len(), 0.0)),
            spacing: table.spacing(),
            rows: pair(grouped(&table.values, live.len(), 0.0), grouped(&table.slopes, live.len(), 0.0)),
            ends_m: ends_m(&table, force),
            coarse: Coarse::new(&table, &weights, force),
            bends: bends(&table, &weights, force),
            weights,
            charge: charge(force.unknowns(), live.len()),
            worst_misfit: worst_misfit(live.len().saturating_sub(force.unknowns())),
            worst_noise: worst_misfit(live.len()),
            live,
            table,
            force,
            reference_force_n,
            inverse_reference: 1.0 / reference_force_n,
        }
    }

    /// Groups of eight channels.
    #[inline(always)]
    pub fn groups(&self) -> usize {
        self.scaling.len()
    }

    /// What the table's variances are multiplied by for a contact of a force.
    pub fn variance_scale(&self, force_n: f64) -> f64 {
        self.grown(force_n) * self.reference_force_n * self.reference_force_n
    }

    /// How much larger than in calibration the table's variances count for a contact of a force.
    #[inline(always)]
    pub fn grown<N: Number>(&self, force_n: N) -> N {
        let ratio =
            (force_n * N::splat(self.inverse_reference)).max(N::splat(1.0)).min(N::splat(MOST_GROWTH));
        ratio * ratio
    }

    /// Writes d, in groups of eight channels; |d|².
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
            d.store(group);
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
            let (minimum, _) = self.refine::<V, f64>(whitened, (start.x_m, start.force_n), MOST_STEPS);
            let near = 0.5 * self.spacing.h_m;
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

impl<N: Number> Minimum<N> {
    /// That of a reading without any.
    #[inline(always)]
    pub fn nowhere() -> Self {
        let (zero, infinity) = (N::splat(0.0), N::splat(f64::INFINITY));
        Self { x_m: zero, force_n: zero, misfit: infinity, covariance: [infinity, zero, infinity] }
    }

    /// `self` where the reading's bit is set, `other` where it is not.
    #[inline(always)]
    pub fn or(self, bits: u8, other: Self) -> Self {
        let [xx, xf, ff] = self.covariance;
        Self {
            x_m: self.x_m.or(bits, other.x_m),
            force_n: self.force_n.or(bits, other.force_n),
            misfit: self.misfit.or(bits, other.misfit),
            covariance: [
                xx.or(bits, other.covariance[0]),
                xf.or(bits, other.covariance[1]),
                ff.or(bits, other.covariance[2]),
            ],
        }
    }
}

/// The readings of some channels.
#[inline(always)]
fn gather(reading: &[f64], channels: &[usize]) -> [f64; 8] {
    let mut raw = [0.0; 8];
    raw.iter_mut().zip(channels).for_each(|(raw, s)| *raw = reading[*s]);
    raw
}

/// Where places end. Next to a support a contact of unknown force reads like a stronger one that is nearer, and at the
/// support like an infinite one, so a tenth of a spacing is kept.
fn ends_m(table: &InfluenceTable, force: ForceBelief) -> [f64; 2] {
    let last = table.nodes() - 1;
    let square = |node: usize| table.at_node(node).iter().map(|f| f * f).sum::<f64>();
    let kept = |end: usize, next: usize| match force {
        ForceBelief::Unknown if square(end) < 1e-2 * square(next) => 0.1 * table.spacing_m(),
        _ => 0.0,
    };
    [kept(0, 1), table.length_m - kept(last, last - 1)]
}

/// 1/(1 + v) in every cell of a whitened table, for a contact of a force.
fn weights(table: &InfluenceTable, force_n: f64) -> Vec<[f64; 8]> {
    let (left, right) = (&table.variances[..], &table.variances[table.sensors..]);
    let cells = left.iter().zip(right);
    let weights: Vec<f64> = cells.map(|(a, b)| 1.0 / (1.0 + 0.5 * force_n * force_n * (a + b))).collect();
    grouped(&weights, table.sensors, 1.0)
}

/// Rows of `width` numbers, each in groups of eight that are filled up.
fn grouped(numbers: &[f64], width: usize, filler: f64) -> Vec<[f64; 8]> {
    let rows = numbers.chunks_exact(width).flat_map(|row| row.chunks(8));
    let group = |part: &[f64]| std::array::from_fn(|i| part.get(i).copied().unwrap_or(filler));
    rows.map(group).collect()
}

/// Two lists of groups, group by group.
fn pair(first: Vec<[f64; 8]>, second: Vec<[f64; 8]>) -> Vec<[[f64; 8]; 2]> {
    first.into_iter().zip(second).map(|(a, b)| [a, b]).collect()
}

/// The misfit that a reading exceeds once in ten thousand times, when `freedom` channels more than unknowns are in use;
/// infinite where none are.
pub(super) fn worst_misfit(freedom: usize) -> f64 {
    match freedom {
        0 => f64::INFINITY,
        freedom => chi_squared_bound(1e-4, freedom),
    }
}
