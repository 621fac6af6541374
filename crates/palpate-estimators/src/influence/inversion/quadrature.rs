//! Gauss and Hermite's rule around a minimum that is alone and nearly normal: 5 points on a line, 3 × 3 on a plane, on the ellipse of the
//! normal density that is the nearest.

use super::minima::Minimum;
use super::{Explain, Explained};
use crate::influence::grid::Axis;
use palpate_numerics::small::Ldl;

/// Standard deviations from an edge beyond which the edge does not matter.
const CLEAR: f64 = 3.0;
/// Greatest difference of the cost from a paraboloid, as a share of the paraboloid's rise.
const MOST_BENT: f64 = 1.0 / 3.0;
/// Normal densities that are fitted before the posterior counts as too bent.
const MOST_FITS: usize = 4;

/// Points and weights of Gauss and Hermite's rules for a standard normal density (Abramowitz and Stegun, 25.4.46).
pub(in crate::influence) const FIVE_POINTS: [(f64, f64); 5] = [
    (0.0, 8.0 / 15.0),
    (1.355_626_179_974_265_8, 0.222_075_922_005_612_64),
    (-1.355_626_179_974_265_8, 0.222_075_922_005_612_64),
    (2.856_970_013_872_805_7, 0.011_257_411_327_720_69),
    (-2.856_970_013_872_805_7, 0.011_257_411_327_720_69),
];
const THREE_POINTS: [(f64, f64); 3] =
    [(0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0), (-1.732_050_807_568_877_2, 1.0 / 6.0)];

/// A place with its weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed {
    pub place: [f64; 2],
    pub weight: f64,
    pub found: Explained,
}

/// Places around a minimum that stand for its posterior; `None` where that is cut off or not nearly normal.
///
/// The first normal density is Laplace's, at the minimum. Between presses, where the process knows less, variances change with the place and so
/// bend the cost: further densities are fitted to the points of the one before.
pub(super) fn around<E: Explain>(reading: &mut E, minimum: &Minimum) -> Option<Vec<Weighed>> {
    let axes = reading.axes();
    let varies = axes.map(|axis| axis.count > 1);
    let [x, y, latent] = minimum.at;
    let free = [varies[0], varies[1], reading.range().is_some()];
    let [[xx, xy, _], [_, yy, _], _] = Ldl::of_free(&minimum.information, free)?.inverse();
    let mut normal = Normal::new([x, y], [xx, xy, yy]);
    let (mut middle, mut points) = (minimum.found, Vec::with_capacity(9));
    for _ in 0..MOST_FITS {
        if !normal.is_clear(axes) {
            return None;
        }
        points.clear();
        points.extend(rule(varies).map(|(at, weight)| Point {
            at,
            weight,
            found: if at == [0.0; 2] { middle } else { reading.explain(normal.place(at), latent) },
        }));
        if points.iter().all(|point| point.bend(&middle).abs() <= MOST_BENT * point.rise().max(1.0)) {
            let weighed = |point: &Point| Weighed {
                place: normal.place(point.at),
                weight: point.weight * (-0.5 * point.bend(&middle)).exp(),
                found: point.found,
            };
            return Some(points.iter().map(weighed).collect());
        }
        normal = normal.fitted(&points, varies)?;
        middle = reading.explain(normal.mean, latent);
    }
    None
}

/// A normal density over the grid, in nodes.
#[derive(Clone, Copy, Debug)]
struct Normal {
    mean: [f64; 2],
    /// The root of the covariance, by which standard normal numbers (u, v) become steps over the grid: (along·u, both·u + across·v).
    along: f64,
    both: f64,
    across: f64,
}

/// A point of a rule, in standard deviations, with its weight.
#[derive(Clone, Copy, Debug)]
struct Point {
    at: [f64; 2],
    weight: f64,
    found: Explained,
}

impl Point {
    /// Rise of a normal density's cost from its middle.
    fn rise(&self) -> f64 {
        self.at[0] * self.at[0] + self.at[1] * self.at[1]
    }

    /// What the cost rises more from the middle than that of a normal density.
    fn bend(&self, middle: &Explained) -> f64 {
        self.found.cost - middle.cost - self.rise()
    }
}

/// Points and weights of the rule over those axes that vary, the middle first.
fn rule(varies: [bool; 2]) -> impl Iterator<Item = ([f64; 2], f64)> {
    const NONE: &[(f64, f64)] = &[(0.0, 1.0)];
    let [of_u, of_v]: [&[(f64, f64)]; 2] = match varies {
        [true, true] => [&THREE_POINTS, &THREE_POINTS],
        [true, false] => [&FIVE_POINTS, NONE],
        [false, true] => [NONE, &FIVE_POINTS],
        [false, false] => [NONE, NONE],
    };
    of_u.iter().flat_map(move |(u, of_u)| of_v.iter().map(move |(v, of_v)| ([*u, *v], of_u * of_v)))
}

impl Normal {
    /// Of this mean and covariance: xx, xy and yy.
    fn new(mean: [f64; 2], [xx, xy, yy]: [f64; 3]) -> Self {
        let along = xx.max(0.0).sqrt();
        let both = if along > 0.0 { xy / along } else { 0.0 };
        Self { mean, along, both, across: (yy - both * both).max(0.0).sqrt() }
    }

    fn place(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [self.mean[0] + self.along * u, self.mean[1] + self.both * u + self.across * v]
    }

    /// True where no edge of the grid, and none of its margins, matters.
    fn is_clear(&self, axes: [Axis; 2]) -> bool {
        let deviations = [self.along, self.both.hypot(self.across)];
        (0..2).all(|k| {
            let (at, end, margin) = (self.mean[k], (axes[k].count - 1) as f64, CLEAR * deviations[k]);
            let [before, behind] = axes[k].margins;
            axes[k].count == 1 || margin < at - before && margin < end - behind - at
        })
    }

    /// The density whose logarithm is, in the mean over this one, the nearest to the one that the points have: with c = −2·ln of
    /// that, the linear and quadratic Hermite polynomials of c are b = E[c·w] and A = E[c·(w·wᵀ − 1)]/2, and the density has the mean −A⁻¹·b/2 and the
    /// covariance A⁻¹. `None` where it would be far wider or narrower.
    fn fitted(&self, points: &[Point], varies: [bool; 2]) -> Option<Self> {
        /// Greatest change of a variance.
        const MOST_CHANGE: f64 = 4.0;
        let ([mut bu, mut bv], [mut uu, mut uv, mut vv]) = ([0.0; 2], [0.0; 3]);
        for Point { at: [u, v], weight, found } in points {
            let c = weight * (found.cost - points[0].found.cost);
            bu += c * u;
            bv += c * v;
            uu += 0.5 * c * (u * u - 1.0);
            uv += 0.5 * c * u * v;
            vv += 0.5 * c * (v * v - 1.0);
        }
        // What does not vary stays as it is.
        let uu = if varies[0] { uu } else { 1.0 };
        let vv = if varies[1] { vv } else { 1.0 };
        let determinant = uu * vv - uv * uv;
        let [cov_uu, cov_uv, cov_vv] = [vv, -uv, uu].map(|value| value / determinant);
        let is_like = |variance: f64| (1.0 / MOST_CHANGE..=MOST_CHANGE).contains(&variance);
        if !(determinant > 0.0 && is_like(cov_uu) && is_like(cov_vv)) {
            return None;
        }
        let mean = self.place([-0.5 * (cov_uu * bu + cov_uv * bv), -0.5 * (cov_uv * bu + cov_vv * bv)]);
        let Self { along, both, across, .. } = *self;
        let xx = along * along * cov_uu;
        let xy = along * (both * cov_uu + across * cov_uv);
        let yy = both * both * cov_uu + 2.0 * both * across * cov_uv + across * across * cov_vv;
        Some(Self::new(mean, [xx, xy, yy]))
    }
}
