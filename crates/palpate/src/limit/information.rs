//! Fisher information of a few parameters, and the Cramér–Rao bound that follows from it.
//!
//! Readings with independent Gaussian noise, each divided by the standard deviation of its noise, have the Fisher
//! information F = JᵀJ, where J holds the derivative of every reading (rows) with respect to every parameter (columns).
//! No unbiased estimator has a covariance below F⁻¹ (Kay, *Fundamentals of Statistical Signal Processing: Estimation
//! Theory*, 1993, section 3.9). F itself is never formed: with J = Q·R its inverse is R⁻¹·R⁻ᵀ, and R keeps the digits that
//! squaring loses where two columns are nearly parallel, as those of force and position are near a support.

/// A column that the columns before it explain to within this share of its length says nothing of its own: derivatives
/// taken by differences are precise to 10⁻¹⁰, so what is left is rounding.
const EXPLAINED: f64 = 1e-9;

/// F⁻¹ for the columns of J, P by P, in their order; `None` where F is singular to rounding.
pub(super) fn inverse_information<const P: usize>(mut columns: [Vec<f64>; P]) -> Option<[[f64; P]; P]> {
    let upper = orthogonalise(&mut columns)?;
    let inverse = inverse_upper(&upper);
    let mut covariance = [[0.0; P]; P];
    for (i, row) in covariance.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry = (i.max(j)..P).map(|k| inverse[i][k] * inverse[j][k]).sum();
        }
    }
    covariance.iter().flatten().all(|entry| entry.is_finite()).then_some(covariance)
}

/// Modified Gram–Schmidt: the columns become those of Q, and R is returned.
fn orthogonalise<const P: usize>(columns: &mut [Vec<f64>; P]) -> Option<[[f64; P]; P]> {
    let mut upper = [[0.0; P]; P];
    for j in 0..P {
        let (before, rest) = columns.split_at_mut(j);
        let column = &mut rest[0];
        let length = norm(column);
        for (i, unit) in before.iter().enumerate() {
            let share = dot(unit, column);
            column.iter_mut().zip(unit).for_each(|(value, unit)| *value -= share * unit);
            upper[i][j] = share;
        }
        let left = norm(column);
        // Written so that NaN counts as nothing left.
        if !(left > EXPLAINED * length) || !left.is_normal() {
            return None;
        }
        column.iter_mut().for_each(|value| *value /= left);
        upper[j][j] = left;
    }
    Some(upper)
}

/// R⁻¹ of an upper triangle, by back-substitution.
fn inverse_upper<const P: usize>(upper: &[[f64; P]; P]) -> [[f64; P]; P] {
    let mut inverse = [[0.0; P]; P];
    for column in 0..P {
        for row in (0..=column).rev() {
            let unit = if row == column { 1.0 } else { 0.0 };
            let known: f64 = (row + 1..=column).map(|k| upper[row][k] * inverse[k][column]).sum();
            inverse[row][column] = (unit - known) / upper[row][row];
        }
    }
    inverse
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
