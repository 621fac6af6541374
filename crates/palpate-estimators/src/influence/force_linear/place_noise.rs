//! Position-dependent noise.

use crate::fit::LocatorFault;
use ndarray::Array2;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Factor of the noise variance, m(a) = exp(q(a) − q₀) ≥ 1.
///
/// q is a [`Shape`] in u and v, fractions of the calibrated span, and constant beyond. q₀ is the least q of
/// the calibrated positions, as of an untouched board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaceNoise {
    spans_m: Vec<[f64; 2]>,
    shape: Shape,
    /// θ by ascending degree, then descending j.
    coefficients: Vec<f64>,
    /// q₀.
    least: f64,
}

/// Form of ln m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Shape {
    /// q = Σ θ_jk·cos(jπu)·cos(kπv), 0 < j + k ≤ degree.
    Smooth { degree: usize },
    /// q = ½·θ·tanh((u − at)/width), or in v.
    Step { coordinate: usize, at: f64, width: f64 },
}

impl Shape {
    pub fn parameters(self, dimensions: usize) -> usize {
        match self {
            Self::Smooth { degree } => terms(dimensions, degree),
            Self::Step { .. } => 2,
        }
    }

    fn coefficients(self, dimensions: usize) -> usize {
        match self {
            Self::Smooth { degree } => terms(dimensions, degree),
            Self::Step { .. } => 1,
        }
    }
}

fn terms(dimensions: usize, degree: usize) -> usize {
    if dimensions == 1 { degree } else { (1..=degree).map(|degree| degree + 1).sum() }
}

fn spans_m(places_m: &[&[f64]]) -> Vec<[f64; 2]> {
    let dimensions = places_m.first().map_or(1, |place_m| place_m.len());
    let span_m = |k: usize| {
        places_m.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place_m| {
            [low.min(place_m[k]), high.max(place_m[k])]
        })
    };
    (0..dimensions).map(span_m).collect()
}

const MOST_DEGREES: [usize; 2] = [5, 3];

impl PlaceNoise {
    /// Uniform noise: θ = 0.
    pub fn even(places_m: &[&[f64]], shape: Shape) -> Self {
        let spans_m = spans_m(places_m);
        let coefficients = vec![0.0; shape.coefficients(spans_m.len())];
        Self { spans_m, shape, coefficients, least: 0.0 }
    }

    pub fn most_degrees(dimensions: usize) -> usize {
        MOST_DEGREES[dimensions - 1]
    }

    /// Candidate steps with two coordinates or more on either side, at most `most` per axis.
    pub fn steps(places_m: &[&[f64]], most: usize) -> Vec<Shape> {
        let mut steps = Vec::new();
        for (coordinate, [low, high]) in spans_m(places_m).into_iter().enumerate() {
            let mut shares: Vec<f64> =
                places_m.iter().map(|place_m| (place_m[coordinate] - low) / (high - low)).collect();
            shares.retain(|share| share.is_finite());
            shares.sort_by(f64::total_cmp);
            shares.dedup();
            let every = shares.len().div_ceil(most).max(1);
            let shares: Vec<f64> = shares.into_iter().step_by(every).collect();
            for pair in shares.windows(2).skip(1).take(shares.len().saturating_sub(3)) {
                let (at, width) = (0.5 * (pair[0] + pair[1]), 0.25 * (pair[1] - pair[0]));
                steps.push(Shape::Step { coordinate, at, width });
            }
        }
        steps
    }

    /// Moves a step to the quieter end of its gap, as overestimated noise does less harm.
    pub fn towards_quiet(mut self) -> Self {
        /// In widths; a gap has four.
        const MOVED: f64 = 1.2;
        if let Shape::Step { at, width, .. } = &mut self.shape {
            *at -= MOVED * *width * self.coefficients.first().map_or(0.0, |theta| theta.signum());
            *width *= 0.5;
        }
        self
    }

    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// θ.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Replaces the first θ.
    pub fn with_coefficients(&self, places_m: &[&[f64]], coefficients: &[f64]) -> Self {
        let mut changed = Self { least: 0.0, ..self.clone() };
        changed.coefficients.iter_mut().zip(coefficients).for_each(|(own, other)| *own = *other);
        changed.least =
            places_m.iter().map(|place_m| changed.exponent(place_m)).fold(f64::INFINITY, f64::min);
        changed
    }

    /// m at a position.
    pub fn multiplier(&self, place_m: &[f64]) -> f64 {
        (self.exponent(place_m) - self.least).max(0.0).exp()
    }

    /// Derivatives of ln m by θ, one row per position.
    pub fn slopes(&self, places_m: &[&[f64]], asked_m: &[Vec<f64>]) -> Array2<f64> {
        let terms_at = |place_m: &[f64]| {
            let mut terms = Vec::with_capacity(self.coefficients.len());
            self.for_terms(place_m, |_, term| terms.push(term));
            terms
        };
        let quietest = places_m
            .iter()
            .min_by(|a, b| self.exponent(a).total_cmp(&self.exponent(b)))
            .map(|at| terms_at(at));
        let quietest = quietest.unwrap_or_else(|| vec![0.0; self.coefficients.len()]);
        let rows: Vec<Vec<f64>> = asked_m.iter().map(|place_m| terms_at(place_m)).collect();
        Array2::from_shape_fn((asked_m.len(), quietest.len()), |(i, k)| rows[i][k] - quietest[k])
    }

    /// q at a position.
    fn exponent(&self, place_m: &[f64]) -> f64 {
        let mut sum = 0.0;
        self.for_terms(place_m, |k, term| sum += self.coefficients[k] * term);
        sum
    }

    /// Passes the basis functions to `take`, in the order of θ.
    fn for_terms(&self, place_m: &[f64], mut take: impl FnMut(usize, f64)) {
        let share = |k: usize| {
            let [low, high] = self.spans_m[k];
            if high > low { ((place_m[k] - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 }
        };
        let cosines = |k: usize| {
            let first = (PI * share(k)).cos();
            let mut cosines = [1.0; MOST_DEGREES[0] + 1];
            cosines[1] = first;
            for j in 2..cosines.len() {
                cosines[j] = 2.0 * first * cosines[j - 1] - cosines[j - 2];
            }
            cosines
        };
        let degree = match self.shape {
            Shape::Smooth { degree } => degree,
            Shape::Step { coordinate, at, width } => {
                return take(0, 0.5 * ((share(coordinate) - at) / width).tanh());
            }
        };
        let along = cosines(0);
        if self.spans_m.len() == 1 {
            (1..=degree).for_each(|j| take(j - 1, along[j]));
            return;
        }
        let across = cosines(1);
        let degrees = (1..=degree).flat_map(|degree| (0..=degree).map(move |k| (degree - k, k)));
        degrees.enumerate().for_each(|(term, (j, k))| take(term, along[j] * across[k]));
    }

    pub fn check(&self, dimensions: usize) -> Result<(), LocatorFault> {
        let numbers = |what, list: &[f64]| {
            LocatorFault::check_numbers(what, list.iter().copied(), |_| true, "a finite number")
        };
        LocatorFault::check_count("spans of the noise by place", dimensions, self.spans_m.len())?;
        let refuse = |what, value: f64, bound| {
            LocatorFault::check_numbers(what, std::iter::once(value), |_| false, bound)
        };
        match self.shape {
            Shape::Smooth { degree } if !(1..=Self::most_degrees(dimensions)).contains(&degree) => {
                let bound = if dimensions == 1 { "from 1 to 5" } else { "from 1 to 3" };
                refuse("degree of the noise by place", degree as f64, bound)?;
            }
            Shape::Step { coordinate, .. } if coordinate >= dimensions => {
                let bound = "below the number of the surface's dimensions";
                refuse("coordinate of the noise by place", coordinate as f64, bound)?;
            }
            Shape::Step { width, .. } if width.is_nan() || width <= 0.0 => {
                refuse("width of the noise by place", width, "greater than 0")?;
            }
            Shape::Step { at, width, .. } => numbers("step of the noise by place", &[at, width])?,
            Shape::Smooth { .. } => {}
        }
        let needed = self.shape.coefficients(dimensions);
        LocatorFault::check_count("coefficients of the noise by place", needed, self.coefficients.len())?;
        numbers("coefficient of the noise by place", &self.coefficients)?;
        numbers("least noise by place", &[self.least])?;
        self.spans_m.iter().try_for_each(|span_m| numbers("span of the noise by place", span_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_differences() {
        let places_m: Vec<Vec<f64>> =
            (0..7).map(|i| vec![0.1 * f64::from(i), 0.05 * f64::from(i * i % 5)]).collect();
        for dimensions in [1, 2] {
            let places_m: Vec<&[f64]> = places_m.iter().map(|place_m| &place_m[..dimensions]).collect();
            let smooth = Shape::Smooth { degree: PlaceNoise::most_degrees(dimensions) };
            let steps = PlaceNoise::steps(&places_m, 12);
            assert!(steps.len() >= 4);
            [smooth, steps[0], steps[steps.len() - 1]]
                .into_iter()
                .for_each(|shape| check_slopes(&places_m, shape));
        }
    }

    fn check_slopes(places_m: &[&[f64]], shape: Shape) {
        const STEP: f64 = 1e-6;
        let dimensions = places_m[0].len();
        let even = PlaceNoise::even(places_m, shape);
        assert!(places_m.iter().all(|place_m| even.multiplier(place_m) == 1.0));
        let theta: Vec<f64> = (0..even.coefficients.len()).map(|k| 0.3 * (1.0 + k as f64).sin()).collect();
        let noise = even.with_coefficients(places_m, &theta);
        let least = places_m.iter().map(|place_m| noise.multiplier(place_m)).fold(f64::INFINITY, f64::min);
        assert_eq!(least, 1.0);
        let asked_m: Vec<Vec<f64>> = places_m.iter().map(|place_m| place_m.to_vec()).collect();
        let slopes = noise.slopes(places_m, &asked_m);
        for k in 0..theta.len() {
            let mut moved = theta.clone();
            moved[k] += STEP;
            let moved = even.with_coefficients(places_m, &moved);
            for (i, place_m) in places_m.iter().enumerate() {
                let slope = (moved.multiplier(place_m) / noise.multiplier(place_m)).ln() / STEP;
                assert!((slope - slopes[[i, k]]).abs() < 1e-5, "{shape:?}: {slope} {}", slopes[[i, k]]);
            }
        }
        assert!(noise.check(dimensions).is_ok() && noise.check(3 - dimensions).is_err());
    }
}
