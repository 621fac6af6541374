//! Distribution functions of statistics.

/// Half the width of a normal distribution's 95 % interval, in standard deviations.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// 95 % quantile of χ² with two degrees of freedom, −2·ln 0.05: the squared size, in standard
/// deviations, of a normal distribution's 95 % ellipse.
pub const ELLIPSE_95: f64 = 5.991_464_547_107_979;

/// The ends of the 95 % interval of a normal distribution.
#[inline]
pub fn normal_interval_95(mean: f64, sd: f64) -> (f64, f64) {
    (mean - NORMAL_95 * sd, mean + NORMAL_95 * sd)
}

/// An interval without what of it is below 0 or above `size`.
#[inline]
pub fn clamped_interval((low, high): (f64, f64), size: f64) -> (f64, f64) {
    (low.max(0.0), high.min(size))
}

/// Root by bisection, where a rising function reaches a value: the end of what `is_below` holds for, from a range that is halved so many times.
#[inline]
pub fn bisect((mut low, mut high): (f64, f64), halvings: usize, is_below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_below(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The standard normal distribution Φ(z).
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// Part of a standard normal distribution between two ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalPart {
    /// Its probability.
    pub share: f64,
    /// Mean of the distribution that is cut off at both ends.
    pub mean: f64,
    /// Its variance.
    pub variance: f64,
}

/// The part of a standard normal distribution from `from` to `to`, exact in the tails; one of less than 10⁻¹² is the point next to 0.
pub fn normal_between(from: f64, to: f64) -> NormalPart {
    const POINT: f64 = 1e-12;
    let density = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let share =
        if from > 0.0 { normal_cdf(-from) - normal_cdf(-to) } else { normal_cdf(to) - normal_cdf(from) };
    if share < POINT {
        return NormalPart { share, mean: if from > 0.0 { from } else { to.min(0.0) }, variance: 0.0 };
    }
    let (low, high) = (density(from) / share, density(to) / share);
    let mean = low - high;
    NormalPart { share, mean, variance: (1.0 + from * low - to * high - mean * mean).max(0.0) }
}

/// The z with Φ(z) = `share`, for a share between 0 and 1, by bisection to the last bits.
pub fn normal_quantile(share: f64) -> f64 {
    bisect((-39.0, 39.0), 80, |z| normal_cdf(z) < share)
}

/// The probability that a χ² variable of `freedom` degrees of freedom exceeds `value`, for `value` ≥ 0; one of no freedom is 0.
///
/// With x = value/2 it is Σ e⁻ˣ·xʲ/Γ(j + 1) over j = 0, 1, … < freedom/2 for an even number of degrees, and erfc(√x) plus the
/// same over j = ½, 3/2, … < freedom/2 for an odd one (Abramowitz and Stegun, 26.4.4 and 26.4.5).
pub fn chi_squared_survival(value: f64, freedom: usize) -> f64 {
    let x = 0.5 * value;
    let odd = freedom % 2 == 1;
    let start = if odd { libm::erfc(x.sqrt()) } else { 0.0 };
    if x <= 0.0 {
        return if freedom == 0 { 0.0 } else { 1.0 };
    }
    let terms = (0..freedom / 2).map(|j| if odd { j as f64 + 0.5 } else { j as f64 });
    start + terms.map(|j| (j * x.ln() - x - libm::lgamma(j + 1.0)).exp()).sum::<f64>()
}

/// The value that a χ² variable of `freedom` ≥ 1 degrees of freedom exceeds with probability `tail`, between 0 and 1, by
/// bisection.
pub fn chi_squared_critical_value(tail: f64, freedom: usize) -> f64 {
    let (mut low, mut high) = (0.0, freedom as f64);
    while chi_squared_survival(high, freedom) > tail {
        (low, high) = (high, 2.0 * high);
    }
    bisect((low, high), 60, |value| chi_squared_survival(value, freedom) > tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_met() {
        assert!((normal_cdf(NORMAL_95) - 0.975).abs() < 1e-15);
        assert!((normal_quantile(0.975) - NORMAL_95).abs() < 1e-12);
        assert!((chi_squared_critical_value(0.05, 2) - ELLIPSE_95).abs() < 1e-12);
        // Tables of χ²: 95 %, 99.99 % and one in a million.
        for (tail, freedom, value) in [
            (0.05, 1, 3.841_459),
            (0.05, 8, 15.507_313),
            (1e-4, 7, 29.877_504),
            (1e-4, 1, 15.136_705),
            (1e-6, 2, 27.631_021),
            (0.05, 1000, 1_074.679_449),
        ] {
            let found = chi_squared_critical_value(tail, freedom);
            assert!((found / value - 1.0).abs() < 1e-6, "{tail} {freedom}: {found}");
        }
    }
}
