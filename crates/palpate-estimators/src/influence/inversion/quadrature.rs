//! Gauss–Hermite quadrature of a single, nearly normal mode: 5 points on a line, 3 × 3 on a plane.

use super::minima::Minimum;
use super::{ContactLikelihood, PlaceFit};
use crate::influence::grid::Axis;
use palpate_numerics::small::Ldl;

/// Distance from an edge without effect, in standard deviations.
const CLEAR: f64 = 3.0;
/// Greatest deviation of the cost from a paraboloid, relative to its rise.
const MOST_BENT: f64 = 1.0 / 3.0;
const MOST_FITS: usize = 4;

/// Points and weights for a standard normal density (Abramowitz and Stegun, 25.4.46).
pub(in crate::influence) const FIVE_POINTS: [(f64, f64); 5] = [
    (0.0, 8.0 / 15.0),
    (1.355_626_179_974_265_8, 0.222_075_922_005_612_64),
    (-1.355_626_179_974_265_8, 0.222_075_922_005_612_64),
    (2.856_970_013_872_805_7, 0.011_257_411_327_720_69),
    (-2.856_970_013_872_805_7, 0.011_257_411_327_720_69),
];
const THREE_POINTS: [(f64, f64); 3] =
    [(0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0), (-1.732_050_807_568_877_2, 1.0 / 6.0)];

#[derive(Clone, Copy, Debug)]
pub(super) struct WeightedPlace {
    pub place: [f64; 2],
    pub weight: f64,
    pub found: PlaceFit,
}

/// Returns weighted places that represent the posterior of a minimum; `None` where it is truncated or not
/// nearly normal.
///
/// The first normal density is Laplace's approximation; further ones are fitted to the previous points.
/// Without a sufficient fit, 25 points on a plane have to confirm the moments of 9.
pub(super) fn around<E: ContactLikelihood>(reading: &mut E, minimum: &Minimum) -> Option<Vec<WeightedPlace>> {
    let axes = reading.axes();
    let varies = axes.map(|axis| axis.count > 1);
    let [x, y, latent] = minimum.at;
    let free = [varies[0], varies[1], reading.range().is_some()];
    let [[xx, xy, _], [_, yy, _], _] = Ldl::of_free(&minimum.information, free)?.inverse();
    let mut normal = Normal::new([x, y], [xx, xy, yy]);
    let mut middle = minimum.found;
    let mut fits = 0;
    let points = loop {
        if !normal.is_clear(axes) {
            return None;
        }
        let points = normal.points(reading, latent, middle, rule(varies));
        if points.iter().all(|point| point.bend.abs() <= MOST_BENT * point.rise().max(1.0)) {
            return Some(points.iter().map(Point::weighed).collect());
        }
        fits += 1;
        if fits == MOST_FITS {
            break points;
        }
        normal = normal.fitted(&points, varies)?;
        middle = reading.fit_place(normal.mean, latent);
    };
    if varies != [true; 2] {
        return None;
    }
    let finer = normal.points(reading, latent, middle, product([&FIVE_POINTS; 2]));
    agree(&points, &finer).then(|| finer.iter().map(Point::weighed).collect())
}

#[derive(Clone, Copy, Debug)]
struct Normal {
    mean: [f64; 2],
    /// Cholesky factor: standard normal (u, v) map to the steps (along·u, both·u + across·v).
    along: f64,
    both: f64,
    across: f64,
}

/// Point with `at` in standard deviations.
#[derive(Clone, Copy, Debug)]
struct Point {
    at: [f64; 2],
    place: [f64; 2],
    weight: f64,
    found: PlaceFit,
    /// Rise of the cost minus that of the normal density.
    bend: f64,
}

impl Point {
    fn rise(&self) -> f64 {
        square(self.at)
    }

    fn weighed(&self) -> WeightedPlace {
        WeightedPlace { place: self.place, weight: self.weight * (-0.5 * self.bend).exp(), found: self.found }
    }
}

fn square([u, v]: [f64; 2]) -> f64 {
    u * u + v * v
}

/// True of equal means to a tenth of a standard deviation, and equal variances to a fifth.
fn agree(points: &[Point], finer: &[Point]) -> bool {
    let moments = |points: &[Point]| {
        let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
        for point in points {
            let weight = point.weighed().weight;
            sum += weight;
            for k in 0..2 {
                first[k] += weight * point.at[k];
                second[k] += weight * point.at[k] * point.at[k];
            }
        }
        [0, 1].map(|k| (first[k] / sum, second[k] / sum - (first[k] / sum).powi(2)))
    };
    moments(points).iter().zip(moments(finer)).all(|((mean, variance), (finer_mean, finer_variance))| {
        (mean - finer_mean).abs() <= 0.1 * finer_variance.sqrt()
            && (variance / finer_variance - 1.0).abs() <= 0.2
    })
}

fn rule(varies: [bool; 2]) -> impl Iterator<Item = ([f64; 2], f64)> {
    const NONE: &[(f64, f64)] = &[(0.0, 1.0)];
    product(match varies {
        [true, true] => [&THREE_POINTS, &THREE_POINTS],
        [true, false] => [&FIVE_POINTS, NONE],
        [false, true] => [NONE, &FIVE_POINTS],
        [false, false] => [NONE, NONE],
    })
}

fn product([of_u, of_v]: [&'static [(f64, f64)]; 2]) -> impl Iterator<Item = ([f64; 2], f64)> {
    of_u.iter().flat_map(move |(u, of_u)| of_v.iter().map(move |(v, of_v)| ([*u, *v], of_u * of_v)))
}

impl Normal {
    fn new(mean: [f64; 2], [xx, xy, yy]: [f64; 3]) -> Self {
        let along = xx.max(0.0).sqrt();
        let both = if along > 0.0 { xy / along } else { 0.0 };
        Self { mean, along, both, across: (yy - both * both).max(0.0).sqrt() }
    }

    fn place(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [self.mean[0] + self.along * u, self.mean[1] + self.both * u + self.across * v]
    }

    fn points<E: ContactLikelihood>(
        &self,
        reading: &mut E,
        latent: f64,
        middle: PlaceFit,
        rule: impl Iterator<Item = ([f64; 2], f64)>,
    ) -> Vec<Point> {
        let point = |(at, weight): ([f64; 2], f64)| {
            let place = self.place(at);
            let found = if at == [0.0; 2] { middle } else { reading.fit_place(place, latent) };
            Point { at, place, weight, found, bend: found.cost - middle.cost - square(at) }
        };
        rule.map(point).collect()
    }

    /// True where edges and margins have no effect.
    fn is_clear(&self, axes: [Axis; 2]) -> bool {
        let deviations = [self.along, self.both.hypot(self.across)];
        (0..2).all(|k| {
            let (at, end, margin) = (self.mean[k], (axes[k].count - 1) as f64, CLEAR * deviations[k]);
            let [before, behind] = axes[k].margins;
            axes[k].count == 1 || margin < at - before && margin < end - behind - at
        })
    }

    /// Fits a normal density to the points by least squares of the logarithm, weighted by this density.
    ///
    /// With c = −2·ln of the points' density, b = E[c·w] and A = E[c·(w·wᵀ − 1)]/2, the mean is −A⁻¹·b/2 and
    /// the covariance A⁻¹. `None` where a variance changes more than fourfold.
    fn fitted(&self, points: &[Point], varies: [bool; 2]) -> Option<Self> {
        const MOST_CHANGE: f64 = 4.0;
        let ([mut bu, mut bv], [mut uu, mut uv, mut vv]) = ([0.0; 2], [0.0; 3]);
        for Point { at: [u, v], weight, found, .. } in points {
            let c = weight * (found.cost - points[0].found.cost);
            bu += c * u;
            bv += c * v;
            uu += 0.5 * c * (u * u - 1.0);
            uv += 0.5 * c * u * v;
            vv += 0.5 * c * (v * v - 1.0);
        }
        // An axis that does not vary keeps its variance.
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
