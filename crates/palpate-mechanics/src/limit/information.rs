//! Fisher information of a few parameters, and the Cramér–Rao bound that follows from it.
//!
//! Readings with independent Gaussian noise, each divided by the standard deviation of its noise, have the Fisher
//! information F = JᵀJ, where J holds the derivative of every reading (rows) with respect to every parameter (columns).
//! No unbiased estimator has a covariance below F⁻¹ (Kay, *Fundamentals of Statistical Signal Processing: Estimation
//! Theory*, 1993, section 3.9). F itself is never formed: with J = Q·R it is Rᵀ·R, and R keeps the digits that
//! squaring loses where two columns are nearly parallel, as those of force and position are near a support.

use palpate_numerics::small::{Ldl, Matrix, dot};

/// A column that the columns before it explain to within this share of its length says nothing of its own: derivatives
/// taken by differences are precise to 10⁻¹⁰, so what is left is rounding.
const EXPLAINED: f64 = 1e-9;

/// F⁻¹ for the columns of J, P by P, in their order; `None` where F is singular to rounding.
pub(super) fn inverse_information<const P: usize>(mut columns: [Vec<f64>; P]) -> Option<Matrix<P>> {
    let covariance = Ldl::of_root(&orthogonalise(&mut columns)?).inverse();
    covariance.iter().flatten().all(|entry| entry.is_finite()).then_some(covariance)
}

/// Modified Gram–Schmidt: the columns of J become those of Q, and Rᵀ is returned.
fn orthogonalise<const P: usize>(columns: &mut [Vec<f64>; P]) -> Option<Matrix<P>> {
    let mut triangle = [[0.0; P]; P];
    for (j, shares) in triangle.iter_mut().enumerate() {
        let (before, rest) = columns.split_at_mut(j);
        let column = &mut rest[0];
        let length = norm(column);
        for (unit, share) in before.iter().zip(shares.iter_mut()) {
            *share = dot(unit, column);
            column.iter_mut().zip(unit).for_each(|(value, unit)| *value -= *share * unit);
        }
        let left = norm(column);
        if !left.is_normal() || left <= EXPLAINED * length {
            return None;
        }
        column.iter_mut().for_each(|value| *value /= left);
        shares[j] = left;
    }
    Some(triangle)
}

pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_the_information() {
        let columns = [vec![1.0, 2.0, 0.5, -1.0], vec![0.3, -1.0, 2.0, 0.0], vec![4.0, 0.1, 0.2, 0.7]];
        let covariance = inverse_information(columns.clone()).unwrap();
        for (i, row) in covariance.iter().enumerate() {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| row[k] * dot(&columns[k], &columns[j])).sum();
                assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn columns_that_say_the_same_are_singular() {
        let column = vec![1.0, 2.0, 3.0];
        let twice: Vec<f64> = column.iter().map(|value| 2.0 * value).collect();
        assert_eq!(inverse_information([column.clone(), twice]), None);
        assert_eq!(inverse_information([vec![0.0; 3]]), None);
        assert_eq!(inverse_information([vec![f64::NAN; 3]]), None);
        assert_eq!(inverse_information([column, vec![f64::INFINITY; 3]]), None);
    }
}
