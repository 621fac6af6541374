//! Activation functions of a network's nodes.

/// What a node does with its weighted sum z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Activation {
    /// σ(z) = 1 / (1 + exp(−z)), between 0 and 1.
    Logistic,
    /// tanh(z), between −1 and 1.
    Tanh,
    /// z itself.
    Linear,
}

impl Activation {
    /// The node's output for the weighted sum `z`.
    pub fn apply(self, z: f64) -> f64 {
        match self {
            Self::Logistic => 1.0 / (1.0 + libm::exp(-z)),
            Self::Tanh => libm::tanh(z),
            Self::Linear => z,
        }
    }

    /// Replaces a layer's weighted sums by its outputs: [`Activation::apply`] to within 4·10⁻¹⁶ of 1, several nodes at a time.
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

/// 1/k! for k = 0…13: the exponential on |t| ≤ ½·ln 2 to the last bit of a double.
const INVERSE_FACTORIALS: [f64; 14] = {
    let mut terms = [1.0; 14];
    let mut k = 1;
    while k < terms.len() {
        terms[k] = terms[k - 1] / k as f64;
        k += 1;
    }
    terms
};

/// Adding then subtracting it rounds to a whole number, whose low bits then lie lowest in the sum.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// exp(−z) beyond this |z| would leave the normal numbers; σ is 0 or 1 there to 10⁻³⁰⁰.
const END: f64 = 700.0;

/// ln 2 in two parts, the first with so few digits that whole multiples of it are exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// σ of B sums in step, without branches or calls, so that the compiler can use vectors: exp(−z) = 2^n·e^t with n whole.
#[inline(always)]
fn logistic<const B: usize>(values: &mut [f64; B]) {
    for value in values.iter_mut() {
        let z = if *value > END { END } else { *value };
        let z = if z < -END { -END } else { z };
        let shifted = ROUNDER - z * core::f64::consts::LOG2_E;
        let n = shifted - ROUNDER;
        let t = (-z - n * LN_2_HIGH) - n * LN_2_LOW;
        let power = f64::from_bits(exponential(t).to_bits().wrapping_add(shifted.to_bits() << 52));
        *value = 1.0 / (1.0 + power);
    }
}

/// e^t by Estrin's scheme: powers of t side by side, since a chain of thirteen multiply-adds would be waited for.
#[inline(always)]
fn exponential(t: f64) -> f64 {
    let c = &INVERSE_FACTORIALS;
    let (t2, pair) = (t * t, |k: usize| c[k] + c[k + 1] * t);
    let t4 = t2 * t2;
    let four = |k: usize| pair(k) + pair(k + 2) * t2;
    (four(0) + four(4) * t4) + (four(8) + pair(12) * t4) * (t4 * t4)
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
    fn what_is_not_a_number_does_not_become_one() {
        let mut values = [f64::NAN; 7];
        Activation::Logistic.apply_all(&mut values);
        assert!(values.iter().all(|a| a.is_nan()), "{values:?}");
    }
}
