//! Where to start at unknown force: which mixture of two neighbouring influences a reading is closest to.
//!
//! Symbols as in [`super::search`]. With the force free, a place is told by the direction of d alone: between the rays of
//! f at two neighbouring coarse nodes, the least-squares mixture α·f + β·g of both lies at t = β/(α + β) of the way from
//! one to the other, and the best force is that of the mixture.

use super::belief::ForceBelief;
use super::lanes::{Abreast, Number};

/// Where |f|² is less than this of the next node's, next to a support, its direction is that of the next node's.
const END: f64 = 1e-2;

/// A reading between the influences f at its lowest coarse node and g at the node beside it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rays<N> {
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

impl Rays<f64> {
    /// Those of readings side by side.
    #[inline(always)]
    pub fn abreast<V: Copy, N: Abreast<V>>(each: &N::Each<Self>) -> Rays<N> {
        let of = |part: fn(&Self) -> f64| {
            let mut lanes = N::each(0.0);
            lanes.as_mut().iter_mut().zip(each.as_ref()).for_each(|(lane, rays)| *lane = part(rays));
            N::of(&lanes)
        };
        Rays {
            product: of(|rays| rays.product),
            norm: of(|rays| rays.norm),
            other_product: of(|rays| rays.other_product),
            other_norm: of(|rays| rays.other_norm),
            cross: of(|rays| rays.cross),
            towards: of(|rays| rays.towards),
        }
    }
}

impl<N: Number> Rays<N> {
    /// How far from the lowest node, in coarse nodes, the mixture that is closest to d lies, and its best force.
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
