//! Modified Gram–Schmidt (Golub and Van Loan, *Matrix Computations*, 5.2.8).

use crate::small::{add_multiple, dot};

/// Adds a normalised orthogonal component, if above the share `least`.
///
/// ```
/// use palpate_numerics::push_rest;
///
/// let mut basis = vec![vec![1.0, 0.0]];
/// push_rest(&mut basis, vec![3.0, 4.0], 1e-9);
/// push_rest(&mut basis, vec![5.0, 6.0], 1e-9); // the basis spans the plane already
/// assert_eq!(basis, [[1.0, 0.0], [0.0, 1.0]]);
/// ```
pub fn push_rest(basis: &mut Vec<Vec<f64>>, mut vector: Vec<f64>, least: f64) {
    let length = dot(&vector, &vector).sqrt();
    for unit in &*basis {
        let along = dot(unit, &vector);
        add_multiple(&mut vector, -along, unit);
    }
    let left = dot(&vector, &vector).sqrt();
    if left > least * length && left.is_finite() {
        vector.iter_mut().for_each(|value| *value /= left);
        basis.push(vector);
    }
}
