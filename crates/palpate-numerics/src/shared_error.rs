//! Covariances with a common-mode error, V = D + g·gᵀ with D diagonal.

/// aᵀ·V⁻¹·b from `ab` = aᵀ·D⁻¹·b, `ga` = gᵀ·D⁻¹·a etc. (Sherman and Morrison, Annals of Mathematical
/// Statistics 21, 1950).
///
/// ```
/// use palpate_numerics::with_shared_error;
///
/// // V = [[2, 1], [1, 2]] is D = 1 with g = (1, 1), and V⁻¹ = [[2, −1], [−1, 2]]/3.
/// assert!((with_shared_error(1.0, 1.0, 1.0, 2.0) - 2.0 / 3.0).abs() < 1e-15); // a = b = (1, 0)
/// assert!((with_shared_error(0.0, 1.0, 1.0, 2.0) + 1.0 / 3.0).abs() < 1e-15); // a = (1, 0), b = (0, 1)
/// ```
#[inline(always)]
pub fn with_shared_error(ab: f64, ga: f64, gb: f64, gg: f64) -> f64 {
    ab - ga * gb / (1.0 + gg)
}

/// Whitening for V = I + γ·γᵀ.
///
/// ```
/// use palpate_numerics::SharedError;
///
/// let shared = SharedError::new(vec![0.0, 3f64.sqrt()]);
/// let mut values = [[1.0], [1.0]];
/// shared.whiten(&mut values);
/// assert!((values[0][0] - 1.0).abs() < 1e-15 && (values[1][0] - 0.5).abs() < 1e-15); // the variance of the second is 1 + 3
/// assert!((shared.log_determinant() - 4f64.ln()).abs() < 1e-15);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SharedError {
    gamma: Vec<f64>,
    square: f64,
}

impl SharedError {
    /// Creates the whitening from relative loadings γ.
    pub fn new(gamma: Vec<f64>) -> Self {
        Self { square: gamma.iter().map(|error| error * error).sum(), gamma }
    }

    /// Multiplies N columns by V^(−½) = I − (1 − 1/√(1 + γ·γ))·γ·γᵀ/(γ·γ).
    pub fn whiten<const N: usize>(&self, values: &mut [[f64; N]]) {
        if self.square > 0.0 {
            let share = (1.0 - (1.0 + self.square).sqrt().recip()) / self.square;
            let along: [f64; N] = std::array::from_fn(|k| {
                share * self.gamma.iter().zip(&*values).map(|(error, row)| error * row[k]).sum::<f64>()
            });
            for (row, error) in values.iter_mut().zip(&self.gamma) {
                row.iter_mut().zip(along).for_each(|(value, along)| *value -= error * along);
            }
        }
    }

    /// ln|V|.
    pub fn log_determinant(&self) -> f64 {
        self.square.ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::dot;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whitened_products_are_those_of_the_inverse(
            gamma in prop::collection::vec(-5.0..5.0f64, 4),
            a in prop::collection::vec(-1.0..1.0f64, 4),
            b in prop::collection::vec(-1.0..1.0f64, 4),
        ) {
            let [ab, ga, gb, gg] =
                [dot(&a, &b), dot(&gamma, &a), dot(&gamma, &b), dot(&gamma, &gamma)];
            let told = with_shared_error(ab, ga, gb, gg);
            // V times V⁻¹·b, computed row by row, is b.
            let inverse_b: Vec<f64> = (0..4).map(|i| with_shared_error(b[i], gamma[i], gb, gg)).collect();
            let along = dot(&gamma, &inverse_b);
            for i in 0..4 {
                prop_assert!((inverse_b[i] + gamma[i] * along - b[i]).abs() < 1e-12);
            }
            let shared = SharedError::new(gamma);
            let mut both: Vec<[f64; 2]> = a.iter().zip(&b).map(|(a, b)| [*a, *b]).collect();
            shared.whiten(&mut both);
            let product: f64 = both.iter().map(|[a, b]| a * b).sum();
            prop_assert!((product - told).abs() < 1e-12);
            prop_assert!((shared.log_determinant() - (1.0 + gg).ln()).abs() < 1e-12);
        }
    }
}
