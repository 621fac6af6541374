//! Where to look: the misfit at every STRIDE-th node, its valleys, and where in a valley to start.
//!
//! Symbols as in [`super::search`]. At a known force a chord joins the influences of two neighbouring coarse nodes, times the force.
//! How close d comes to a chord is a quadratic in the misfits at its ends; how far the curve strays from its chord is known
//! beforehand, so a valley's lowest misfit is bounded from below without going there. With the force free, a place follows from the
//! direction of d alone: between the directions of f at two neighbouring coarse nodes, the least-squares mixture α·f + β·g of both lies at
//! t = β/(α + β) of the way from one to the other, and the best force is that of the mixture.

use super::table::InfluenceTable;
use crate::influence::config::ForceBelief;
use crate::status::LINE_PLACES;
use palpate_numerics::simd::{Abreast, Eight, Number};

/// The search looks at every so many nodes; misfits between them are smooth.
pub(super) const STRIDE: usize = 4;

/// Number of nodes that it looks at.
pub(super) const COARSE: usize = (InfluenceTable::NODES - 1) / STRIDE + 1;
const _: () = assert!(COARSE == LINE_PLACES, "estimators count the places along a line alike");

/// Nodes are searched eight side by side.
const BLOCKS: usize = COARSE.div_ceil(8);

/// Valleys that may matter; more never compete in practice.
pub(super) const MOST_MINIMA: usize = 4;

/// A reading's misfits along the surface.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    /// The misfit at every coarse node, after an infinite one and before others that fill up.
    misfits: [f64; 8 * BLOCKS + 2],
    /// d·f at every coarse node.
    products: [[f64; 8]; BLOCKS],
}

impl Default for Profile {
    fn default() -> Self {
        Self { misfits: [f64::INFINITY; 8 * BLOCKS + 2], products: [[0.0; 8]; BLOCKS] }
    }
}

impl Profile {
    /// The misfit at every coarse node.
    pub fn misfits(&self) -> &[f64; COARSE] {
        self.misfits[1..].first_chunk().expect("there are at least so many")
    }

    /// The lowest valleys and how many, lowest first: nodes no higher than both neighbours.
    #[inline(always)]
    pub fn valleys<V: Eight>(&self) -> ([usize; MOST_MINIMA], usize) {
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

/// The influences at the coarse nodes and between them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coarse {
    force: ForceBelief,
    /// f, channel by channel, padded with zeros to groups of eight channels.
    influences: Vec<[[f64; 8]; BLOCKS]>,
    /// Terms of the misfit beside |d|² and the product: |W·f|² where W is known; infinite where no node is.
    own: [[f64; 8]; BLOCKS],
    /// 1/(|f|² + the force's precision).
    inverse_norms: [[f64; 8]; BLOCKS],
    /// |f|².
    norms: Vec<f64>,
    /// Number k lies before node k; the first and the last lie beyond the ends.
    chords: Vec<Chord>,
    /// Distance between coarse nodes.
    h_m: f64,
}

/// Chord between two coarse nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Chord {
    /// The product of f at the ends.
    cross: f64,
    /// The chord's squared length, and one over twice that.
    square: f64,
    half_inverse: f64,
    /// Largest distance of the curve from the chord.
    sag: f64,
    /// The least weight of a channel.
    least_weight: f64,
}

/// Beyond an end: no way leads there.
const BEYOND: Chord = Chord { cross: 0.0, square: 0.0, half_inverse: 1.0, sag: 0.0, least_weight: 1.0 };

/// Start of the refinement in a valley, of one or eight readings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start<N = f64> {
    pub x_m: N,
    pub force_n: N,
    /// A misfit below which the valley does not go.
    pub floor: N,
}

impl Coarse {
    /// Coarse nodes of a whitened table; `weights` of every cell's channels, padded to groups of eight.
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

    /// The misfit at every coarse node, with the best force there, of a reading that was whitened to length `square`.
    #[inline(always)]
    pub fn scan<V: Eight>(&self, square: f64, whitened: &[[f64; 8]], profile: &mut Profile) {
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

    /// Start of the refinement in a valley of each reading, `nodes` being their lowest places.
    #[inline(always)]
    pub fn start<V: Eight, N: Abreast<V>>(
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

    /// Distance from `node`, in coarse nodes, at which a chord comes closest to d, and the least misfit that its curve may have.
    #[inline(always)]
    fn along_chords(&self, profile: &Profile, node: usize) -> (f64, f64) {
        let here = profile.misfits[node + 1];
        let (left, right) = (&self.chords[node], &self.chords[node + 1]);
        let (t_left, left_square) = left.closest(here, profile.misfits[node]);
        let (t_right, right_square) = right.closest(here, profile.misfits[node + 2]);
        let t = if left_square < right_square { -t_left } else { t_right };
        (t, left.floor(left_square).min(right.floor(right_square)))
    }

    /// The two mixtures between which a reading's direction lies, at the valley at `node`.
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
    /// Between coarse node `node` − 1 and `node`, of influences times `scale`; `weights` of its cells.
    fn new(table: &InfluenceTable, node: usize, scale: f64, weights: &[[f64; 8]]) -> Self {
        const PARTS: usize = 32;
        // The curve between the places that are looked at.
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

    /// Distance from the end with misfit `here`, no higher than the misfit at the other, at which the chord comes closest to d,
    /// and the square of how close.
    #[inline(always)]
    fn closest(&self, here: f64, other: f64) -> (f64, f64) {
        let t = (0.5 + (here - other) * self.half_inverse).max(0.0);
        (t, (here - t * t * self.square).max(0.0))
    }

    /// The least misfit on the curve, where the chord comes as close as the root of `square`.
    #[inline(always)]
    fn floor(&self, square: f64) -> f64 {
        let least = (square.sqrt() - self.sag).max(0.0);
        self.least_weight * least * least
    }
}

/// Share of the next node's |f|² below which, next to a support, the direction of f is that of the next node's.
const END: f64 = 1e-2;

/// A reading between the influences f at its lowest coarse node and g at the node beside it.
#[derive(Clone, Copy, Debug, Default)]
struct Mixture<N> {
    /// d·f.
    pub product: N,
    /// |f|².
    pub norm: N,
    /// d·g.
    pub other_product: N,
    /// |g|².
    pub other_norm: N,
    /// f·g.
    pub cross: N,
    /// 1 where the other node is to the right, −1 where it is to the left.
    pub towards: N,
}

impl Mixture<f64> {
    /// Those of readings side by side.
    #[inline(always)]
    pub fn abreast<V: Copy, N: Abreast<V>>(each: &N::Each<Self>) -> Mixture<N> {
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
    /// Distance from the lowest node, in coarse nodes, of the mixture that is closest to d, and its best force.
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
