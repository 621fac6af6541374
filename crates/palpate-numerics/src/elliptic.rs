//! Carlson's elliptic integrals and Jacobi's elliptic functions.

/// Series remainder of sixth order: (2⁻⁵¹)^(1/6) = 0.0028.
const SPREAD: f64 = 0.0028;
/// Eight suffice for k′ = 10⁻³⁰⁰.
const MOST_MEANS: usize = 16;

/// R_F(x, y, z) = ½·∫₀^∞ dt/√((t + x)(t + y)(t + z)), at most one argument 0 (Carlson, *Numerical computation
/// of real or complex elliptic integrals*, 1995, algorithm 1).
pub fn carlson_rf(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    loop {
        let mean = (x + y + z) / 3.0;
        let [dx, dy, dz] = [x, y, z].map(|argument| 1.0 - argument / mean);
        if dx.abs().max(dy.abs()).max(dz.abs()) < SPREAD || !mean.is_normal() {
            let (second, third) = (dx * dy - dz * dz, dx * dy * dz);
            let series =
                1.0 - second / 10.0 + third / 14.0 + second * second / 24.0 - 3.0 * second * third / 44.0;
            return series / mean.sqrt();
        }
        let step = (x * y).sqrt() + (y * z).sqrt() + (z * x).sqrt();
        [x, y, z] = [x, y, z].map(|argument| 0.25 * (argument + step));
    }
}

/// R_D(x, y, z) = (3/2)·∫₀^∞ dt/((t + z)·√((t + x)(t + y)(t + z))), z > 0, at most one of x and y 0 (Carlson
/// 1995, algorithm 4).
pub fn carlson_rd(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    let (mut sum, mut share) = (0.0, 1.0);
    loop {
        let mean = (x + y + 3.0 * z) / 5.0;
        let [dx, dy, dz] = [x, y, z].map(|argument| 1.0 - argument / mean);
        if dx.abs().max(dy.abs()).max(dz.abs()) < SPREAD || !mean.is_normal() {
            let (xy, zz) = (dx * dy, dz * dz);
            let (second, third) = (xy - 6.0 * zz, (3.0 * xy - 8.0 * zz) * dz);
            let (fourth, fifth) = (3.0 * (xy - zz) * zz, xy * zz * dz);
            let series = 1.0 - 3.0 * second / 14.0 + third / 6.0 + 9.0 * second * second / 88.0
                - 3.0 * fourth / 22.0
                - 9.0 * second * third / 52.0
                + 3.0 * fifth / 26.0;
            return share * series / (mean * mean.sqrt()) + 3.0 * sum;
        }
        let step = (x * y).sqrt() + (y * z).sqrt() + (z * x).sqrt();
        sum += share / (z.sqrt() * (z + step));
        share *= 0.25;
        [x, y, z] = [x, y, z].map(|argument| 0.25 * (argument + step));
    }
}

/// Jacobi's elliptic functions at one argument.
///
/// ```
/// use palpate_numerics::Jacobi;
///
/// let Jacobi { sn, cn, dn, .. } = Jacobi::new(0.5, 0.3); // u = 0.5, m = 0.7
/// assert!((sn * sn + cn * cn - 1.0).abs() < 1e-15 && (dn * dn + 0.7 * sn * sn - 1.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobi {
    /// sn(u | m)
    pub sn: f64,
    /// cn(u | m)
    pub cn: f64,
    /// dn(u | m)
    pub dn: f64,
    /// Jacobi's epsilon ℰ(u | m) = ∫₀ᵘ dn²(t | m) dt.
    pub epsilon: f64,
}

impl Jacobi {
    /// Computes the functions at m = 1 − `complement` < 1 (Abramowitz and Stegun, 16.4, 17.4.37 and 17.6).
    pub fn new(u: f64, complement: f64) -> Self {
        let m = 1.0 - complement;
        let (mut a, mut b, mut c) = (1.0, complement.sqrt(), m.max(0.0).sqrt());
        let mut steps = [(1.0, 0.0); MOST_MEANS];
        let (mut count, mut power, mut deficit) = (0, 1.0, 0.5 * c * c);
        while c > f64::EPSILON * a && count < MOST_MEANS {
            (a, b, c) = (0.5 * (a + b), (a * b).sqrt(), 0.5 * (a - b));
            power *= 2.0;
            deficit += 0.5 * power * c * c;
            steps[count] = (a, c);
            count += 1;
        }
        let mut amplitude = power * a * u;
        let mut zeta = 0.0;
        for (a, c) in steps[..count].iter().rev() {
            zeta += c * amplitude.sin();
            amplitude = 0.5 * (amplitude + (c / a * amplitude.sin()).asin());
        }
        let (sn, cn) = amplitude.sin_cos();
        let dn = (complement + m * cn * cn).sqrt();
        Self { sn, cn, dn, epsilon: u * (1.0 - deficit) + zeta }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn carlsons_own_values_are_met() {
        // Carlson 1995, section 3.
        let rf = [(1.0, 2.0, 0.0, 1.311_028_777_146_059_9), (2.0, 3.0, 4.0, 0.584_082_841_677_151_7)];
        for (x, y, z, value) in rf {
            assert!((carlson_rf(x, y, z) / value - 1.0).abs() < 2e-15, "{x} {y} {z}");
        }
        let rd = [(0.0, 2.0, 1.0, 1.797_210_352_103_388_3), (2.0, 3.0, 4.0, 0.165_105_272_942_610_53)];
        for (x, y, z, value) in rd {
            assert!((carlson_rd(x, y, z) / value - 1.0).abs() < 3e-15, "{x} {y} {z}");
        }
    }

    proptest! {
        #[test]
        fn the_functions_undo_the_integrals(angle in 0.01..1.57f64, m in 0.0..0.9999f64) {
            let (sine, cosine) = angle.sin_cos();
            let delta = 1.0 - m * sine * sine;
            let first = sine * carlson_rf(cosine * cosine, delta, 1.0);
            let second = first - m * sine.powi(3) / 3.0 * carlson_rd(cosine * cosine, delta, 1.0);
            let Jacobi { sn, cn, dn, epsilon } = Jacobi::new(first, 1.0 - m);
            prop_assert!((sn - sine).abs() < 1e-13 && (cn - cosine).abs() < 1e-12);
            prop_assert!((dn * dn - delta).abs() < 1e-12);
            prop_assert!((epsilon - second).abs() < 1e-12 * (1.0 + second));
        }
    }

    #[test]
    fn they_are_circular_and_hyperbolic_at_the_ends() {
        for u in [-2.0, 0.3, FRAC_PI_2, 5.0f64] {
            let circular = Jacobi::new(u, 1.0);
            assert!((circular.sn - u.sin()).abs() < 1e-15 && (circular.epsilon - u).abs() < 1e-15);
            let hyperbolic = Jacobi::new(u, 1e-30);
            assert!(
                (hyperbolic.sn - u.tanh()).abs() < 1e-12 && (hyperbolic.epsilon - u.tanh()).abs() < 1e-12
            );
        }
    }
}
