//! Principal axes of a small covariance matrix.

use ndarray::{Array1, Array2};

/// Sweeps after which Jacobi's method has long converged.
const MOST_SWEEPS: usize = 60;

/// Eigenvalues, largest first, and eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations (Golub and Van Loan, *Matrix
/// Computations*, 8.5).
pub(super) fn principal_axes(mut a: Array2<f64>) -> (Array1<f64>, Array2<f64>) {
    let size = a.nrows();
    let mut vectors = Array2::eye(size);
    for _ in 0..MOST_SWEEPS {
        let mut rotated = false;
        for p in 0..size {
            for q in p + 1..size {
                if a[[p, q]].abs() > f64::EPSILON * (a[[p, p]] * a[[q, q]]).abs().sqrt() {
                    rotate(&mut a, &mut vectors, p, q);
                    rotated = true;
                }
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|i, j| a[[*j, *j]].total_cmp(&a[[*i, *i]]));
    let values = order.iter().map(|i| a[[*i, *i]]).collect();
    (values, vectors.select(ndarray::Axis(1), &order))
}

/// The rotation in the plane of p and q that makes a_pq zero.
fn rotate(a: &mut Array2<f64>, vectors: &mut Array2<f64>, p: usize, q: usize) {
    let tau = (a[[q, q]] - a[[p, p]]) / (2.0 * a[[p, q]]);
    let t = tau.signum() / (tau.abs() + tau.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    let turn = |x: f64, y: f64| (c * x - s * y, s * x + c * y);
    for k in 0..a.nrows() {
        (a[[k, p]], a[[k, q]]) = turn(a[[k, p]], a[[k, q]]);
    }
    for k in 0..a.nrows() {
        (a[[p, k]], a[[q, k]]) = turn(a[[p, k]], a[[q, k]]);
        (vectors[[k, p]], vectors[[k, q]]) = turn(vectors[[k, p]], vectors[[k, q]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_give_the_matrix_back() {
        let root =
            Array2::from_shape_fn((7, 7), |(i, j)| ((i * 7 + j) as f64).sin() * 10f64.powi(j as i32 / 2));
        let matrix = root.dot(&root.t());
        let (values, vectors) = principal_axes(matrix.clone());
        assert!(values.windows(2).into_iter().all(|pair| pair[0] >= pair[1]));
        let again = vectors.dot(&Array2::from_diag(&values)).dot(&vectors.t());
        let worst = (&again - &matrix).iter().fold(0.0, |m: f64, e| m.max(e.abs()));
        assert!(worst < 1e-13 * values[0], "{worst}");
        let unit = vectors.t().dot(&vectors) - Array2::<f64>::eye(7);
        assert!(unit.iter().all(|e| e.abs() < 1e-13));
    }
}
