//! Distribution functions.

/// Half-width of the normal 95 % interval.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;
/// Half-width of the normal 99 % interval.
pub const NORMAL_99: f64 = 2.575_829_303_548_900_4;

/// 95 % quantile of χ² with two degrees of freedom, −2·ln 0.05.
pub const ELLIPSE_95: f64 = 5.991_464_547_107_979;

/// 95 % interval of a normal distribution.
#[inline]
pub fn normal_interval_95(mean: f64, sd: f64) -> (f64, f64) {
    (mean - NORMAL_95 * sd, mean + NORMAL_95 * sd)
}

/// Smallest interval around two others.
#[inline]
pub fn hull(one: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    (one.0.min(other.0), one.1.max(other.1))
}

/// Smallest interval around an interval and a value.
#[inline]
pub fn extend_to(interval: (f64, f64), value: f64) -> (f64, f64) {
    hull(interval, (value, value))
}

/// Part of an interval within 0 and `size`.
#[inline]
pub fn clamped_interval((low, high): (f64, f64), size: f64) -> (f64, f64) {
    (low.max(0.0), high.min(size))
}

/// Bisects for the end of `is_below`.
#[inline]
pub fn bisect((mut low, mut high): (f64, f64), halvings: usize, is_below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_below(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Standard normal distribution function Φ(z).
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// A truncated standard normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalPart {
    /// Logarithm of its probability, also where that underflows.
    pub ln_share: f64,
    /// Mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
}

/// Truncates the standard normal distribution, `to` > `from`.
pub fn normal_between(from: f64, to: f64) -> NormalPart {
    /// Start of the continued fraction.
    const TAIL: f64 = 6.0;
    /// Start of the negligible tail.
    const ALL: f64 = 9.0;
    /// Largest width of a uniform density.
    const NARROW: f64 = 1e-4;
    if from > TAIL {
        return upper_tail(from, to);
    }
    if to < -TAIL {
        let part = upper_tail(-to, -from);
        return NormalPart { mean: -part.mean, ..part };
    }
    if from < -ALL && to > ALL {
        return NormalPart { ln_share: 0.0, mean: 0.0, variance: 1.0 };
    }
    if to - from < NARROW {
        let mean = 0.5 * (from + to);
        let ln_share = (to - from).ln() - 0.5 * mean * mean - ROOT_TWO_PI.ln();
        return NormalPart { ln_share, mean, variance: (to - from) * (to - from) / 12.0 };
    }
    let density = |z: f64| (-0.5 * z * z).exp() / ROOT_TWO_PI;
    let share =
        if from > 0.0 { normal_cdf(-from) - normal_cdf(-to) } else { normal_cdf(to) - normal_cdf(from) };
    let (low, high) = (density(from) / share, density(to) / share);
    // An end at infinity has no density.
    let term = |z: f64, density: f64| if density > 0.0 { z * density } else { 0.0 };
    let mean = low - high;
    let variance = (1.0 + term(from, low) - term(to, high) - mean * mean).max(0.0);
    NormalPart { ln_share: share.ln(), mean, variance }
}

const ROOT_TWO_PI: f64 = 2.506_628_274_631_000_5;

/// Share φ(from)·(m(from) − r·m(to)), with Mills' ratio m and r = φ(to)/φ(from).
fn upper_tail(from: f64, to: f64) -> NormalPart {
    // The density falls by the factor e over 1/from, so it is uniform over a much narrower part.
    let fall = (to - from) * from;
    if fall < 1e-3 {
        let (width, mean) = (to - from, 0.5 * (from + to));
        let ln_share = width.ln() - 0.5 * mean * mean - ROOT_TWO_PI.ln();
        return NormalPart { ln_share, mean, variance: width * width / 12.0 };
    }
    let ratio = (-0.5 * (to - from) * (to + from)).exp();
    let left = mills_ratio(from) - if ratio > 0.0 { ratio * mills_ratio(to) } else { 0.0 };
    let mean = (1.0 - ratio) / left;
    // Far out, the distribution is exponential, with equal mean and standard deviation above its start.
    let above = mean - from;
    let variance = if from > 1e3 && ratio == 0.0 {
        above * above
    } else {
        let end = if ratio > 0.0 { to * ratio } else { 0.0 };
        (1.0 + (from - end) / left - mean * mean).max(0.0)
    };
    NormalPart { ln_share: left.ln() - 0.5 * from * from - ROOT_TWO_PI.ln(), mean, variance }
}

/// Φ(−z)/φ(z) for z ≥ 6 (Abramowitz and Stegun, 26.2.14).
fn mills_ratio(z: f64) -> f64 {
    const LEVELS: usize = 16;
    1.0 / (1..=LEVELS).rev().fold(z, |below, level| z + level as f64 / below)
}

/// Inverts Φ for `share` between 0 and 1.
pub fn normal_quantile(share: f64) -> f64 {
    bisect((-39.0, 39.0), 80, |z| normal_cdf(z) < share)
}

/// P(χ² > `value`), `value` ≥ 0 (Abramowitz and Stegun, 26.4.4 and 26.4.5).
pub fn chi_squared_survival(value: f64, freedom: usize) -> f64 {
    let x = 0.5 * value;
    let odd = freedom % 2 == 1;
    let start = if odd { libm::erfc(x.sqrt()) } else { 0.0 };
    if x <= 0.0 {
        return if freedom == 0 { 0.0 } else { 1.0 };
    }
    let count = freedom / 2;
    if count == 0 {
        return start;
    }
    // From the largest term, at j near x, the other terms follow by the ratios j/x and x/(j + 1).
    let least = if odd { 0.5 } else { 0.0 };
    let largest = (x - least).clamp(0.0, (count - 1) as f64).floor();
    let at = least + largest;
    let term = (at * x.ln() - x - libm::lgamma(at + 1.0)).exp();
    let below = (0..largest as usize).map(|i| (at - i as f64) / x);
    let above = (largest as usize + 1..count).map(|j| x / (least + j as f64));
    start + term + sum_of_products(term, below) + sum_of_products(term, above)
}

fn sum_of_products(first: f64, ratios: impl Iterator<Item = f64>) -> f64 {
    let mut sum = 0.0;
    let mut term = first;
    for ratio in ratios {
        term *= ratio;
        sum += term;
        if term < 1e-18 * (first + sum) {
            break;
        }
    }
    sum
}

/// Critical value of χ² with `freedom` ≥ 1.
pub fn chi_squared_critical_value(tail: f64, freedom: usize) -> f64 {
    let (mut low, mut high) = (0.0, freedom as f64);
    while chi_squared_survival(high, freedom) > tail {
        (low, high) = (high, 2.0 * high);
    }
    bisect((low, high), 60, |value| chi_squared_survival(value, freedom) > tail)
}

/// Logarithm of Student's t density, ν > 0.
pub fn student_ln_density(t: f64, freedom: f64) -> f64 {
    let constant = libm::lgamma(0.5 * (freedom + 1.0))
        - libm::lgamma(0.5 * freedom)
        - 0.5 * (freedom * std::f64::consts::PI).ln();
    constant - 0.5 * (freedom + 1.0) * (t * t / freedom).ln_1p()
}

/// P(|t| > `t`) of Student's distribution, 1 ≤ ν ≤ 1,000, by integrals of sin^(ν−1).
pub fn student_survival(t: f64, freedom: f64) -> f64 {
    const HALVES: usize = 400;
    let integral = |to: f64| {
        let step = to / HALVES as f64;
        let value = |i: usize| (step * i as f64).sin().powf(freedom - 1.0);
        let weighted = (1..HALVES).map(|i| if i % 2 == 1 { 4.0 * value(i) } else { 2.0 * value(i) });
        step / 3.0 * (value(0) + weighted.sum::<f64>() + value(HALVES))
    };
    let to = freedom.sqrt().atan2(t);
    integral(to) / integral(std::f64::consts::FRAC_PI_2)
}

/// Critical value of |t|, 1 ≤ ν ≤ 1,000.
pub fn student_critical_value(tail: f64, freedom: f64) -> f64 {
    const MOST: f64 = 1e6;
    bisect((0.0, MOST), 80, |t| student_survival(t, freedom) > tail)
}

/// Probability of at least `least` of `trials` events of probability `share`.
pub fn binomial_tail(trials: usize, least: usize, share: f64) -> f64 {
    let mut term = (trials as f64 * (-share).ln_1p()).exp();
    let mut fewer = 0.0;
    for k in 0..least.min(trials + 1) {
        fewer += term;
        term *= (trials - k) as f64 / (k + 1) as f64 * share / (1.0 - share);
    }
    (1.0 - fewer).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms, and P(|t| > 8.610) = 0.001 for four degrees.
    #[test]
    fn student_tails_are_those_of_closed_forms_and_tables() {
        for t in [0.0, 0.3, 2.0, 40.0] {
            let cauchy = 1.0 - 2.0 / std::f64::consts::PI * f64::atan(t);
            let of_two = 1.0 - t / (2.0 + t * t).sqrt();
            assert!((student_survival(t, 1.0) / cauchy - 1.0).abs() < 1e-6, "{t}");
            assert!((student_survival(t, 2.0) / of_two - 1.0).abs() < 1e-6, "{t}");
        }
        assert!((student_critical_value(0.001, 4.0) - 8.610).abs() < 1e-3);
        assert!((student_critical_value(0.05, 1000.0) - 1.9623).abs() < 1e-4);
    }

    #[test]
    fn the_density_of_student_is_the_slope_of_its_distribution() {
        for (t, freedom) in [(0.5, 3.0), (2.0, 4.5), (6.0, 8.0)] {
            let step = 1e-3;
            let slope =
                (student_survival(t - step, freedom) - student_survival(t + step, freedom)) / (4.0 * step);
            assert!((student_ln_density(t, freedom).exp() / slope - 1.0).abs() < 1e-4, "{t} {freedom}");
        }
    }

    #[test]
    fn the_survival_of_many_degrees_of_freedom_is_the_whole_sum() {
        for (freedom, value) in
            [(1, 2.0_f64), (2, 0.1), (9, 30.0), (1000, 1100.0), (10_001, 9_800.0), (64, 2000.0)]
        {
            let (x, odd) = (0.5 * value, freedom % 2 == 1);
            let terms = (0..freedom / 2).map(|j| j as f64 + if odd { 0.5 } else { 0.0 });
            let sum: f64 = terms.map(|j| (j * x.ln() - x - libm::lgamma(j + 1.0)).exp()).sum();
            let whole = sum + if odd { libm::erfc(x.sqrt()) } else { 0.0 };
            let found = chi_squared_survival(value, freedom);
            assert!((found - whole).abs() <= 1e-10 * whole, "{freedom} {value}: {found} {whole}");
        }
    }

    fn summed(from: f64, to: f64) -> [f64; 3] {
        const STEPS: usize = 400_000;
        let to = to.min(from.max(0.0) + 40.0);
        let width = (to - from) / STEPS as f64;
        let peak = 0.0_f64.clamp(from, to);
        let mut sums = [0.0; 3];
        for i in 0..STEPS {
            let z = from + (i as f64 + 0.5) * width;
            let weight = (-0.5 * (z - peak) * (z + peak)).exp() * width;
            let off = z - peak;
            [weight, weight * off, weight * off * off]
                .iter()
                .zip(&mut sums)
                .for_each(|(term, sum)| *sum += term);
        }
        let mean = sums[1] / sums[0];
        [sums[0].ln() - 0.5 * peak * peak - ROOT_TWO_PI.ln(), peak + mean, sums[2] / sums[0] - mean * mean]
    }

    #[test]
    fn the_tail_of_a_binomial_distribution_is_that_of_its_terms() {
        // 1 − 0.9⁵, C(5, 4)·0.1⁴·0.9 + 0.1⁵, and the ends.
        assert!((binomial_tail(5, 1, 0.1) - 0.40951).abs() < 1e-12);
        assert!((binomial_tail(5, 4, 0.1) - 46e-5).abs() < 1e-12);
        assert_eq!((binomial_tail(5, 0, 0.1), binomial_tail(0, 0, 0.1)), (1.0, 1.0));
        assert!(binomial_tail(5, 6, 0.1) < 1e-12 && binomial_tail(5, 60, 0.1) < 1e-12);
    }

    #[test]
    fn parts_of_a_normal_distribution_are_those_of_a_plain_sum() {
        for (from, to) in [
            (-1.0, 2.0),
            (-20.0, 0.3),
            (0.5, 0.50005),
            (4.0, 9.0),
            (5.99, 40.0),
            (6.01, 40.0),
            (6.01, 6.4),
            (30.0, 30.00001),
            (55.0, 60.0),
            (300.0, 300.01),
        ] {
            let [ln_share, mean, variance] = summed(from, to);
            let mirrored = normal_between(-to, -from);
            for (part, sign) in [(normal_between(from, to), 1.0), (mirrored, -1.0)] {
                assert!((part.ln_share - ln_share).abs() < 1e-6, "{from} {to}: {part:?} {ln_share}");
                assert!((sign * part.mean - mean).abs() < 1e-6, "{from} {to}: {part:?} {mean}");
                assert!((part.variance / variance - 1.0).abs() < 1e-3, "{from} {to}: {part:?} {variance}");
            }
        }
        let far = normal_between(1e6, f64::INFINITY);
        assert!((far.mean - 1e6 - 1e-6).abs() < 1e-9 && far.ln_share.is_finite(), "{far:?}");
        let whole = normal_between(f64::NEG_INFINITY, f64::INFINITY);
        assert_eq!((whole.ln_share, whole.mean, whole.variance), (0.0, 0.0, 1.0));
        let half = normal_between(0.0, f64::INFINITY);
        assert!((half.mean - (2.0 / std::f64::consts::PI).sqrt()).abs() < 1e-12, "{half:?}");
    }

    #[test]
    fn tables_are_met() {
        assert!((normal_cdf(NORMAL_95) - 0.975).abs() < 1e-15);
        assert!((normal_quantile(0.975) - NORMAL_95).abs() < 1e-12);
        assert!((normal_quantile(0.995) - NORMAL_99).abs() < 1e-12);
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
