//! Prior of influence functions over position, force and time.
//!
//! Channel c reads o_c + φ(F)·f_c(a) + drift + noise for the force F at the position a, with
//!
//! f_c(a) = Σ_j β_cj·h_j(a) + α_c·g(a − p_c) + s_c/F̄·η·z(a),
//!
//! - h: polynomials with flat priors: a constant; for point sensors all up to cubics, which are biharmonic;
//! - g: singular part of the Green's function of a point sensor at p_c ([`Source`]), with log-uniform α;
//! - z: Gaussian process of unit variance and correlation k.
//!
//! φ(F) = F̄·(F/F̄)^γ, with F̄ the root mean square force. A gain with covariance δ²·k·exp(−(F − F′)²/2F̄²)
//! measures departures. Drift is a Gaussian process of time ([`DriftCourse`]), of variance κ times the
//! noise's over the recording. Noise has the variance σ²·m(a)·(1 + μ·φ²/F̄²), and σ² without a force: μ for
//! errors of forces and positions, m by position ([`PlaceNoise`]).

use super::drift::DriftCourse;
use super::place_noise::PlaceNoise;
use crate::fit::LocatorFault;
use crate::influence::calibration::CalibrationRows;
use ndarray::{Array1, Array2};
use palpate_mechanics::surface::Extent;
use palpate_numerics::regression::Kernel;
use palpate_numerics::root_mean_square;
use serde::{Deserialize, Serialize};

/// Singular part of a point sensor's influence function, with d from sensor to load.
///
/// A beam's deflection has |d|³, slope d·|d| and curvature (strain) |d|; a plate's deflection d²·ln|d| and
/// curvature ln|d| (Timoshenko and Woinowsky-Krieger, *Theory of Plates and Shells*, 1959, article 37).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// Strain sensor.
    Strain,
    /// Slope sensor, along a line only.
    Slope,
    /// Deflection sensor.
    Deflection,
}

impl Source {
    pub(super) fn all(extent: Extent) -> &'static [Self] {
        match extent {
            Extent::Line { .. } => &[Self::Strain, Self::Slope, Self::Deflection],
            Extent::Plane { .. } => &[Self::Strain, Self::Deflection],
        }
    }

    /// g at `way` from sensor to load, averaged along a line over a normal distribution of the standard
    /// deviation `radius`; all in lengths of the surface.
    fn singular_part(self, way: &[f64], radius: f64) -> f64 {
        /// Sensor size, which bounds a plate's curvature.
        const SIZE: f64 = 0.01;
        match (self, way) {
            (_, [d]) if radius > 0.0 => self.spread_along(*d, radius),
            (Self::Strain, [d]) => d.abs(),
            (Self::Slope, [d]) => d * d.abs(),
            (Self::Deflection, [d]) => d.abs().powi(3),
            _ => {
                let square = way.iter().map(|d| d * d).sum::<f64>().max(SIZE * SIZE);
                let logarithm = 0.5 * square.ln();
                if self == Self::Strain { logarithm } else { square * logarithm }
            }
        }
    }

    /// Mean of g(d + z) over normal z of the standard deviation `radius`: moments of a folded normal
    /// distribution.
    fn spread_along(self, d: f64, radius: f64) -> f64 {
        let (sign, density) = {
            let relative = d / radius;
            let density = (2.0 / std::f64::consts::PI).sqrt() * (-0.5 * relative * relative).exp();
            (libm::erf(relative * std::f64::consts::FRAC_1_SQRT_2), density)
        };
        let square = radius * radius;
        match self {
            Self::Strain => d * sign + radius * density,
            Self::Slope => (d * d + square) * sign + d * radius * density,
            Self::Deflection => d * (d * d + 3.0 * square) * sign + radius * (d * d + 2.0 * square) * density,
        }
    }
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Prior {
    pub extent: Extent,
    /// F̄.
    pub force_scale_n: f64,
    pub kernel: Kernel,
    pub lengths_m: Vec<f64>,
    /// η².
    pub smooth_part: f64,
    /// `None` for smooth influences.
    pub source: Option<Source>,
    /// Standard deviation of the load's distribution along a line, as under a soft layer, in lengths of the
    /// surface.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub load_radius: f64,
    /// δ: relative change of an influence with force.
    pub nonlinearity: f64,
    /// γ.
    pub response: f64,
    /// κ.
    pub drift: f64,
    #[serde(default)]
    pub drift_course: DriftCourse,
    /// μ.
    #[serde(default)]
    pub scatter: f64,
    /// m; `None` if uniform.
    #[serde(default)]
    pub noise_by_place: Option<PlaceNoise>,
}

impl Prior {
    /// Smooth over a quarter of the surface, linear in force, without drift.
    pub fn smooth(extent: Extent, presses: &CalibrationRows) -> Self {
        let spans_m = [Some(extent.length_m()), extent.width_m()].into_iter().flatten();
        Self {
            extent,
            force_scale_n: root_mean_square(&presses.force_n),
            kernel: Kernel::Matern32,
            lengths_m: spans_m.map(|span_m| 0.25 * span_m).collect(),
            smooth_part: 1.0,
            source: None,
            load_radius: 0.0,
            nonlinearity: 0.0,
            response: 1.0,
            drift: 0.0,
            drift_course: DriftCourse::default(),
            scatter: 0.0,
            noise_by_place: None,
        }
    }

    pub fn is_separable(&self) -> bool {
        self.nonlinearity == 0.0
    }

    /// Returns false for exponents where all forces are alike, or one dominates.
    pub fn has_response(&self) -> bool {
        (0.2..=5.0).contains(&self.response)
    }

    /// k between two positions.
    fn correlation(&self, a_m: &[f64], b_m: &[f64]) -> f64 {
        let coordinates = a_m.iter().zip(b_m).zip(&self.lengths_m);
        self.kernel.correlation(coordinates.map(|((a, b), length)| ((a - b) / length).powi(2)).sum())
    }

    /// φ/F̄.
    pub fn response_to(&self, force_n: f64) -> f64 {
        let relative = force_n / self.force_scale_n;
        if self.response == 1.0 { relative } else { relative.signum() * relative.abs().powf(self.response) }
    }

    /// Force with φ/F̄ = `response`.
    pub fn force_of_relative_response(&self, response: f64) -> f64 {
        self.force_scale_n * response.signum() * response.abs().powf(1.0 / self.response)
    }

    /// φ, in newtons.
    pub fn response_n(&self, force_n: f64) -> f64 {
        self.response_to(force_n) * self.force_scale_n
    }

    /// Force and variance, from those of φ.
    pub fn force_of_response(&self, response_n: f64, variance_n2: f64) -> (f64, f64) {
        if self.response == 1.0 || response_n <= 0.0 {
            return (response_n, variance_n2);
        }
        let force_n = self.force_scale_n * (response_n / self.force_scale_n).powf(1.0 / self.response);
        let slope = force_n / (self.response * response_n);
        (force_n, variance_n2 * slope * slope)
    }

    pub fn check(&self) -> Result<(), LocatorFault> {
        let numbers = |what, list: &[f64], good: fn(f64) -> bool, bound| {
            LocatorFault::check_numbers(what, list.iter().copied(), good, bound)
        };
        LocatorFault::check_count("length scales", self.extent.dimensions(), self.lengths_m.len())?;
        numbers("length scale", &self.lengths_m, |length| length > 0.0, "finite and greater than 0")?;
        let shares = [self.smooth_part, self.load_radius, self.nonlinearity, self.drift, self.scatter];
        numbers(
            "smooth part, load radius, nonlinearity, drift or scatter",
            &shares,
            |share| share >= 0.0,
            "at least 0",
        )?;
        numbers("exponent of the response", &[self.response], |exponent| exponent > 0.0, "greater than 0")?;
        numbers("force", &[self.force_scale_n], |force| force > 0.0, "greater than 0")?;
        self.noise_by_place.as_ref().map_or(Ok(()), |noise| noise.check(self.extent.dimensions()))
    }

    /// φ/F̄ of every press.
    pub fn responses(&self, presses: &CalibrationRows) -> Vec<f64> {
        presses.force_n.iter().map(|force_n| self.response_to(*force_n)).collect()
    }

    /// Lower triangle over s², without noise and drift.
    pub fn covariance(&self, presses: &CalibrationRows) -> Array2<f64> {
        let n = presses.len();
        let responses = self.responses(presses);
        let mut covariance = Array2::zeros((n, n));
        for i in 0..n {
            for j in 0..=i {
                let between = self.correlation(&presses.positions_m[i], &presses.positions_m[j]);
                let changed = if self.nonlinearity > 0.0 {
                    let way = (presses.force_n[i] - presses.force_n[j]) / self.force_scale_n;
                    self.nonlinearity.powi(2) * (-0.5 * way * way).exp()
                } else {
                    0.0
                };
                covariance[[i, j]] =
                    responses[i] * responses[j] * self.smooth_part * between * (1.0 + changed);
            }
        }
        covariance
    }

    /// Noise variance over an untouched row's.
    pub fn relative_noise(&self, force_n: f64, place_m: &[f64]) -> f64 {
        if force_n == 0.0 { 1.0 } else { self.scatter_of(force_n) * self.noise_at(place_m) }
    }

    pub fn relative_noise_of(&self, presses: &CalibrationRows, i: usize) -> f64 {
        self.relative_noise(presses.force_n[i], &presses.positions_m[i])
    }

    /// 1 + μ·φ²/F̄².
    pub fn scatter_of(&self, force_n: f64) -> f64 {
        1.0 + self.scatter * self.response_to(force_n).powi(2)
    }

    /// m at a position.
    pub fn noise_at(&self, place_m: &[f64]) -> f64 {
        self.noise_by_place.as_ref().map_or(1.0, |noise| noise.multiplier(place_m))
    }

    /// Covariance over the noise variance.
    pub fn drift_between(&self, a: f64, b: f64) -> f64 {
        self.drift * self.drift_course.covariance(a, b)
    }

    /// Covariance of f in units of s²/F̄.
    pub fn influence_covariance(
        &self,
        presses: &CalibrationRows,
        responses: &[f64],
        place_m: &[f64],
    ) -> Array1<f64> {
        let positions = presses.positions_m.iter().zip(responses);
        positions.map(|(at_m, phi)| phi * self.smooth_part * self.correlation(place_m, at_m)).collect()
    }

    /// Variance of f in units of s²/F̄², without polynomials and source.
    pub fn influence_variance(&self) -> f64 {
        self.smooth_part
    }

    pub fn polynomials(&self) -> usize {
        match (self.source, self.extent) {
            (None, _) => 1,
            (Some(_), Extent::Line { .. }) => 4,
            (Some(_), Extent::Plane { .. }) => 10,
        }
    }

    /// h at a position.
    pub fn polynomials_at(&self, place_m: &[f64]) -> Vec<f64> {
        let unit = |k: usize, size_m: f64| 2.0 * place_m[k] / size_m - 1.0;
        let x = unit(0, self.extent.length_m());
        // Legendre polynomials, which are nearly orthogonal.
        let second = |x: f64| 0.5 * (3.0 * x * x - 1.0);
        let third = |x: f64| 0.5 * x * (5.0 * x * x - 3.0);
        let all = match self.extent.width_m() {
            None => vec![1.0, x, second(x), third(x)],
            Some(width_m) => {
                let y = unit(1, width_m);
                let to_second = [1.0, x, y, second(x), x * y, second(y)];
                [&to_second[..], &[third(x), second(x) * y, x * second(y), third(y)]].concat()
            }
        };
        all[..self.polynomials()].to_vec()
    }

    /// H: n × (1 + polynomials).
    pub fn effects(&self, presses: &CalibrationRows) -> Array2<f64> {
        let mut effects = Array2::ones((presses.len(), 1 + self.polynomials()));
        for ((mut row, place_m), phi) in
            effects.outer_iter_mut().zip(&presses.positions_m).zip(self.responses(presses))
        {
            row.iter_mut().skip(1).zip(self.polynomials_at(place_m)).for_each(|(out, h)| *out = phi * h);
        }
        effects
    }

    /// g for each sensor; empty without a source.
    pub fn sources_at(&self, place_m: &[f64], sensors_m: &[Vec<f64>]) -> Array1<f64> {
        let Some(source) = self.source else { return Array1::zeros(0) };
        let scale = 1.0 / self.extent.length_m();
        let mut way = vec![0.0; place_m.len()];
        let at = |sensor_m: &Vec<f64>| {
            let ways = place_m.iter().zip(sensor_m).map(|(a, p)| (a - p) * scale);
            way.iter_mut().zip(ways).for_each(|(out, d)| *out = d);
            source.singular_part(&way, self.load_radius)
        };
        sensors_m.iter().map(at).collect()
    }

    /// Readings by sources, one column per sensor.
    pub fn sources(&self, presses: &CalibrationRows, sensors_m: &[Vec<f64>]) -> Array2<f64> {
        let mut sources =
            Array2::zeros((presses.len(), if self.source.is_some() { sensors_m.len() } else { 0 }));
        for ((mut row, place_m), phi) in
            sources.outer_iter_mut().zip(&presses.positions_m).zip(self.responses(presses))
        {
            if phi != 0.0 {
                row.assign(&(phi * self.sources_at(place_m, sensors_m)));
            }
        }
        sources
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean of g over a normal distribution by the midpoint rule.
    fn mean_over_load(source: Source, d: f64, radius: f64) -> f64 {
        const COUNT: usize = 20_000;
        const RANGE: f64 = 8.0;
        let nodes = (0..COUNT).map(|i| RANGE * (2.0 * (i as f64 + 0.5) / COUNT as f64 - 1.0));
        let (sum, all) = nodes.fold((0.0, 0.0), |(sum, all), z| {
            let weight = (-0.5 * z * z).exp();
            (sum + weight * source.singular_part(&[d + radius * z], 0.0), all + weight)
        });
        sum / all
    }

    #[test]
    fn singular_parts_under_a_layer_are_means_over_the_load() {
        for source in [Source::Strain, Source::Slope, Source::Deflection] {
            for (d, radius) in [(0.0, 0.02), (0.013, 0.02), (-0.4, 0.05), (0.3, 1e-3)] {
                let (found, mean) = (source.singular_part(&[d], radius), mean_over_load(source, d, radius));
                assert!((found - mean).abs() < 1e-7, "{source:?} {d} {radius}: {found} {mean}");
            }
            let [thin, none] = [1e-9, 0.0].map(|radius| source.singular_part(&[0.1], radius));
            assert!((thin - none).abs() < 1e-12, "{source:?}: {thin} {none}");
        }
    }
}
