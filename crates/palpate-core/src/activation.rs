//! Activation functions of neural networks.

/// Activation function of a weighted sum z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Activation {
    /// σ(z) = 1 / (1 + exp(−z)).
    Logistic,
    /// tanh(z).
    Tanh,
    /// z.
    Linear,
}

impl Activation {
    /// Returns the output for the weighted sum `z`.
    pub fn apply(self, z: f64) -> f64 {
        match self {
            Self::Logistic => 1.0 / (1.0 + libm::exp(-z)),
            Self::Tanh => libm::tanh(z),
            Self::Linear => z,
        }
    }

    /// Applies [`Activation::apply`] in place, to 4·10⁻¹⁶.
    pub fn apply_all(self, values: &mut [f64]) {
        match self {
            Self::Logistic => {
                let (blocks, rest) = values.as_chunks_mut::<4>();
                blocks.iter_mut().for_each(logistic);
                let (pairs, rest) = rest.as_chunks_mut::<2>();
                pairs.iter_mut().for_each(logistic);
                rest.as_chunks_mut::<1>().0.iter_mut().for_each(logistic);
            }
            Self::Tanh => values.iter_mut().for_each(|z| *z = libm::tanh(*z)),
            Self::Linear => {}
        }
    }
}

/// Constants of σ(z) = 1 / (1 + 2^n·2^r), with −z·log₂ e = n + r and |r| ≤ ½.
///
/// 2^r = (E + r·O) / (E − r·O), with polynomials E and O in r². The rounding error of z·log₂ e grows with
/// |z|, but σ′ falls faster. Therefore r needs no second part.
#[derive(Clone, Copy, Debug)]
pub struct Logistic;

impl Logistic {
    /// Bound of |z|; σ is then 0 or 1 to 10⁻³⁰⁰, with 2^n·E normal.
    pub const END: f64 = 691.0;
    /// Coefficients of E, lowest first: minimax, relative error 1.3·10⁻¹⁷ after rounding.
    pub const EVEN: [f64; 3] = [189_140.054_010_213_3, 10_096.716_587_306_339, 43.300_524_562_927_92];
    /// Coefficients of O, lowest first; the third is 1.
    pub const ODD: [f64; 2] = [65_550.947_584_067_56, 874.742_790_038_898_7];
    /// 1.5·2⁵², which rounds to an integer in the low bits.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
}

/// σ without branches and calls, for vectorization.
#[inline(always)]
fn logistic<const B: usize>(values: &mut [f64; B]) {
    let ([e0, e1, e2], [o0, o1]) = (Logistic::EVEN, Logistic::ODD);
    for value in values.iter_mut() {
        let z = if *value > Logistic::END { Logistic::END } else { *value };
        let z = if z < -Logistic::END { -Logistic::END } else { z };
        let y = z * -core::f64::consts::LOG2_E;
        let shifted = y + Logistic::ROUNDER;
        let r = y - (shifted - Logistic::ROUNDER);
        let u = r * r;
        let (even, odd) = (e0 + u * (e1 + u * e2), r * (o0 + u * (o1 + u)));
        let (below, above) = (even - odd, even + odd);
        let scaled = f64::from_bits(above.to_bits().wrapping_add(shifted.to_bits() << 52));
        *value = below / (below + scaled);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_at_a_time_is_each_node_by_itself() {
        for activation in [Activation::Logistic, Activation::Tanh, Activation::Linear] {
            let sums: [f64; 1607] = core::array::from_fn(|i| (i as f64 - 803.0) * 0.0507);
            let mut outputs = sums;
            activation.apply_all(&mut outputs);
            for (z, a) in sums.into_iter().zip(outputs) {
                assert!(
                    (a - activation.apply(z)).abs() <= 4e-16 * a.abs().max(1.0),
                    "{activation:?}({z}) = {a}"
                );
            }
        }
    }

    #[test]
    fn far_out_it_stays_between_nought_and_one() {
        for z in [1e3, 1e30, f64::MAX, f64::INFINITY] {
            let mut values = [-z, z];
            Activation::Logistic.apply_all(&mut values);
            assert!((0.0..1e-300).contains(&values[0]) && values[1] == 1.0, "{values:?}");
        }
    }

    #[test]
    fn nan_stays_nan() {
        let mut values = [f64::NAN; 7];
        Activation::Logistic.apply_all(&mut values);
        assert!(values.iter().all(|a| a.is_nan()), "{values:?}");
    }
}
