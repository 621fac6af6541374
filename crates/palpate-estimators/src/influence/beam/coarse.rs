//! Coarse search: χ² at every STRIDE-th node, its local minima, and the starts of their refinement.
//!
//! Symbols as in [`super::search`]. At a known force, the distance of d from chords between neighbouring
//! nodes and the curve's deviation from them bound χ² from below. Otherwise the least-squares mixture
//! α·f + β·g of two nodes gives the place t = β/(α + β), and the force.

use super::table::InfluenceTable;
use crate::influence::config::ForceBelief;
use crate::status::LINE_PLACES;
use palpate_numerics::simd::{EightLanes, Number, RowLanes};

/// χ² is smooth between these nodes.
pub(super) const STRIDE: usize = 4;

pub(super) const COARSE: usize = (InfluenceTable::NODES - 1) / STRIDE + 1;
const _: () = assert!(COARSE == LINE_PLACES, "estimators count the places along a line alike");

const BLOCKS: usize = COARSE.div_ceil(8);

pub(super) const MOST_MINIMA: usize = 4;

#[derive(Clone, Debug)]
pub(super) struct Profile {
    /// χ² by node after one infinite value, with infinite padding.
    misfits: [f64; 8 * BLOCKS + 2],
    /// d·f.
    products: [[f64; 8]; BLOCKS],
}

impl Default for Profile {
    fn default() -> Self {
        Self { misfits: [f64::INFINITY; 8 * BLOCKS + 2], products: [[0.0; 8]; BLOCKS] }
    }
}

impl Profile {
    pub fn misfits(&self) -> &[f64; COARSE] {
        self.misfits[1..].first_chunk().expect("there are at least so many")
    }

    #[inline(always)]
    pub fn valleys<V: EightLanes>(&self) -> ([usize; MOST_MINIMA], usize) {
        let (left, here, right) =
            (self.misfits.as_chunks().0, self.misfits[1..].as_chunks().0, self.misfits[2..].as_chunks().0);
        let mut bits = 0u64;
        for b in 0..BLOCKS {
            let (left, here, right) = (V::load(&left[b]), V::load(&here[b]), V::load(&right[b]));
            let block = here.at_most(left) & here.below(right);
            bits |= u64::from(block) << (8 * b);
        }
        let (mut lowest, mut count) = ([0; MOST_MINIMA], 0);
        while bits != 0 {
            let node = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let value = self.misfits[node + 1];
            let mut rank = count;
            while rank > 0 && value < self.misfits[lowest[rank - 1] + 1] {
                if rank < MOST_MINIMA {
                    lowest[rank] = lowest[rank - 1];
                }
                rank -= 1;
            }
            if rank < MOST_MINIMA {
                lowest[rank] = node;
                count = (count + 1).min(MOST_MINIMA);
            }
        }
        (lowest, count)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coarse {
    force: ForceBelief,
    /// f by channel, zero-padded to groups of eight.
    influences: Vec<[[f64; 8]; BLOCKS]>,
    /// |W·f|² at a known W, else 0; infinite padding.
    own: [[f64; 8]; BLOCKS],
    /// 1/(|f|² + the force's precision).
    inverse_norms: [[f64; 8]; BLOCKS],
    /// |f|².
    norms: Vec<f64>,
    /// Chord k precedes node k.
    chords: Vec<Chord>,
    pub h_m: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Chord {
    /// Product of f at both ends.
    cross: f64,
    /// Squared length, and 1/(2·square).
    square: f64,
    half_inverse: f64,
    /// Largest deviation of the curve.
    sag: f64,
    least_weight: f64,
}

const BEYOND: Chord = Chord { cross: 0.0, square: 0.0, half_inverse: 1.0, sag: 0.0, least_weight: 1.0 };

#[derive(Clone, Copy, Debug)]
pub(super) struct Start<N = f64> {
    pub x_m: N,
    pub force_n: N,
    /// Lower bound of χ².
    pub floor: N,
}

impl Coarse {
    pub fn new(table: &InfluenceTable, weights: &[[f64; 8]], force: ForceBelief) -> Self {
        let at = |node: usize| table.at_node(STRIDE * node);
        let groups = table.sensors.div_ceil(8);
        let mut influences = vec![[[0.0; 8]; BLOCKS]; 8 * groups];
        let (mut own, mut inverse_norms) = ([[f64::INFINITY; 8]; BLOCKS], [[0.0; 8]; BLOCKS]);
        let norms: Vec<f64> = (0..COARSE).map(|node| at(node).iter().map(|f| f * f).sum()).collect();
        let (scale, precision) = match force {
            ForceBelief::Known(force_n) => (force_n, 0.0),
            belief => (0.0, belief.mean_and_precision().1),
        };
        for (node, norm) in norms.iter().enumerate() {
            let (block, lane) = (node / 8, node % 8);
            own[block][lane] = scale * scale * norm;
            inverse_norms[block][lane] = 1.0 / (norm + precision).max(f64::MIN_POSITIVE);
            influences.iter_mut().zip(at(node)).for_each(|(channel, f)| channel[block][lane] = *f);
        }
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let inner = (1..COARSE).map(|node| {
            let cells = STRIDE * groups;
            Chord::new(table, node, scale, &weights[(node - 1) * cells..node * cells])
        });
        let chords = std::iter::once(BEYOND).chain(inner).chain([BEYOND]).collect();
        let h_m = STRIDE as f64 * table.spacing_m();
        Self { force, influences, own, inverse_norms, norms, chords, h_m }
    }

    /// Computes χ² at the best force; `square` is |d|².
    #[inline(always)]
    pub fn scan<V: EightLanes>(&self, square: f64, whitened: &[[f64; 8]], profile: &mut Profile) {
        let mut products = [V::splat(0.0); BLOCKS];
        for (channels, d) in self.influences.as_chunks::<8>().0.iter().zip(whitened) {
            for i in 0..8 {
                let d = V::splat(d[i]);
                for b in 0..BLOCKS {
                    products[b] = products[b] + d * V::load(&channels[i][b]);
                }
            }
        }
        let misfits = profile.misfits[1..].as_chunks_mut().0;
        if let ForceBelief::Known(force_n) = self.force {
            let (square, twice) = (V::splat(square), V::splat(2.0 * force_n));
            for b in 0..BLOCKS {
                misfits[b] = (square + (V::load(&self.own[b]) - twice * products[b])).to_array();
            }
            return;
        }
        let (mean, precision) = self.force.mean_and_precision();
        let constant = V::splat(square + mean * mean * precision);
        for b in 0..BLOCKS {
            let score = (products[b] + V::splat(mean * precision)).max(V::splat(0.0));
            let explained = score * score * V::load(&self.inverse_norms[b]);
            misfits[b] = (constant - explained + V::load(&self.own[b])).to_array();
            profile.products[b] = products[b].to_array();
        }
    }

    #[inline(always)]
    pub fn start<V: EightLanes, N: RowLanes<V>>(
        &self,
        profiles: &N::Each<&Profile>,
        nodes: &N::Each<usize>,
    ) -> Start<N> {
        let valleys = profiles.as_ref().iter().zip(nodes.as_ref());
        let (mut places, mut floors) = (N::each(0.0), N::each(f64::NEG_INFINITY));
        if let ForceBelief::Known(force_n) = self.force {
            let lanes = places.as_mut().iter_mut().zip(floors.as_mut());
            for ((place, floor), (profile, node)) in lanes.zip(valleys) {
                let (t, least) = self.along_chords(profile, *node);
                (*place, *floor) = ((*node as f64 + t) * self.h_m, least);
            }
            return Start {
                x_m: N::from_lanes(&places),
                force_n: N::splat(force_n),
                floor: N::from_lanes(&floors),
            };
        }
        let mut mixtures = N::each(Mixture::default());
        for ((mixtures, place), (profile, node)) in
            mixtures.as_mut().iter_mut().zip(places.as_mut()).zip(valleys)
        {
            (*mixtures, *place) = (self.mixture(profile, *node), *node as f64);
        }
        let (t, force_n) = Mixture::abreast::<V, N>(&mixtures).mix(self.force);
        let x_m = (N::from_lanes(&places) + t) * N::splat(self.h_m);
        Start { x_m, force_n, floor: N::from_lanes(&floors) }
    }

    /// Distance from `node` to the closest chord point, in coarse nodes, and the lower bound of χ².
    #[inline(always)]
    fn along_chords(&self, profile: &Profile, node: usize) -> (f64, f64) {
        let here = profile.misfits[node + 1];
        let (left, right) = (&self.chords[node], &self.chords[node + 1]);
        let (t_left, left_square) = left.closest(here, profile.misfits[node]);
        let (t_right, right_square) = right.closest(here, profile.misfits[node + 2]);
        let t = if left_square < right_square { -t_left } else { t_right };
        (t, left.floor(left_square).min(right.floor(right_square)))
    }

    #[inline(always)]
    fn mixture(&self, profile: &Profile, node: usize) -> Mixture<f64> {
        let product = |node: usize| profile.products.as_flattened()[node];
        let to_right = profile.misfits[node + 2] < profile.misfits[node];
        let (other, towards) = if to_right { (node + 1, 1.0) } else { (node.wrapping_sub(1), -1.0) };
        let (product, norm) = (product(node), self.norms[node]);
        match self.norms.get(other) {
            Some(other_norm) => Mixture {
                product,
                norm,
                other_product: profile.products.as_flattened()[other],
                other_norm: *other_norm,
                cross: self.chords[other.max(node)].cross,
                towards,
            },
            None => Mixture { product, norm, ..Mixture::default() },
        }
    }
}

impl Chord {
    /// Chord between coarse nodes `node` − 1 and `node`, times `scale`.
    fn new(table: &InfluenceTable, node: usize, scale: f64, weights: &[[f64; 8]]) -> Self {
        const PARTS: usize = 32;
        // Allowance for the curve between the evaluated parts.
        const MARGIN: f64 = 1.1;
        let (from, to) = (table.at_node(STRIDE * (node - 1)), table.at_node(STRIDE * node));
        let ends = || from.iter().zip(to);
        let square = scale * scale * ends().map(|(a, b)| (b - a) * (b - a)).sum::<f64>();
        let strays = (1..PARTS).map(|part| {
            let t = part as f64 / PARTS as f64;
            let x_m = ((node - 1) as f64 + t) * STRIDE as f64 * table.spacing_m();
            let mut sum = 0.0;
            table.for_each(table.cell(x_m), |s, f, _| sum += (f - from[s] - t * (to[s] - from[s])).powi(2));
            scale * sum.sqrt()
        });
        Self {
            cross: ends().map(|(a, b)| a * b).sum(),
            square,
            half_inverse: if square > 0.0 { 0.5 / square } else { 0.0 },
            sag: MARGIN * strays.fold(0.0, f64::max),
            least_weight: weights.as_flattened().iter().copied().fold(1.0, f64::min),
        }
    }

    /// Distance of the closest point from the end with `here` ≤ `other`, and its χ².
    #[inline(always)]
    fn closest(&self, here: f64, other: f64) -> (f64, f64) {
        let t = (0.5 + (here - other) * self.half_inverse).max(0.0);
        (t, (here - t * t * self.square).max(0.0))
    }

    #[inline(always)]
    fn floor(&self, square: f64) -> f64 {
        let least = (square.sqrt() - self.sag).max(0.0);
        self.least_weight * least * least
    }
}

/// Ratio of |f|² next to a support, below which f has the direction of the next node.
const END: f64 = 1e-2;

/// Products with f at the lowest node and g at a neighbour.
#[derive(Clone, Copy, Debug, Default)]
struct Mixture<N> {
    pub product: N,
    pub norm: N,
    pub other_product: N,
    pub other_norm: N,
    /// f·g.
    pub cross: N,
    /// 1 for a neighbour to the right, −1 to the left.
    pub towards: N,
}

impl Mixture<f64> {
    #[inline(always)]
    pub fn abreast<V: Copy, N: RowLanes<V>>(each: &N::Each<Self>) -> Mixture<N> {
        let of = |part: fn(&Self) -> f64| {
            let mut lanes = N::each(0.0);
            lanes.as_mut().iter_mut().zip(each.as_ref()).for_each(|(lane, mixtures)| *lane = part(mixtures));
            N::from_lanes(&lanes)
        };
        Mixture {
            product: of(|mixtures| mixtures.product),
            norm: of(|mixtures| mixtures.norm),
            other_product: of(|mixtures| mixtures.other_product),
            other_norm: of(|mixtures| mixtures.other_norm),
            cross: of(|mixtures| mixtures.cross),
            towards: of(|mixtures| mixtures.towards),
        }
    }
}

impl<N: Number> Mixture<N> {
    /// Distance of the best mixture from the lowest node, in coarse nodes, and the force.
    #[inline(always)]
    pub fn mix(&self, force: ForceBelief) -> (N, N) {
        let n = N::splat;
        let Self { product: p, norm, other_product: q, other_norm, cross, towards } = *self;
        let (mean, precision) = force.mean_and_precision();
        let (here, there) = (p * other_norm - q * cross, q * norm - p * cross);
        let beyond = here.at_most(n(0.0)) | there.at_most(n(0.0));
        let (here, there) = (n(1.0).or(beyond, here), n(0.0).or(beyond, there));
        let at_end = if precision == 0.0 { norm.at_most(n(END) * other_norm) } else { 0 };
        let (here, there) = (n(0.75).or(at_end, here), n(0.25).or(at_end, there));
        let whole = here + there;
        let score = (here * p + there * q) + n(mean * precision) * whole;
        let norm = here * here * norm + n(2.0) * here * there * cross + there * there * other_norm;
        let square = (norm + n(precision) * whole * whole).max(n(f64::MIN_POSITIVE));
        (towards * there / whole, (score * whole).max(n(0.0)) / square)
    }
}
