//! Eigenvalues of a small symmetric matrix.

use ndarray::{Array1, Array2, Axis};

/// Convergence is quadratic.
const MOST_SWEEPS: usize = 60;

/// A = U·diag(d)·Uᵀ, d descending, by cyclic Jacobi rotations (Golub and Van Loan, *Matrix Computations*,
/// 8.5).
///
/// 6·n³ multiply-adds per sweep. Both triangles are averaged.
///
/// # Panics
/// For a rectangular matrix.
pub fn symmetric_eigen(matrix: &Array2<f64>) -> (Array1<f64>, Array2<f64>) {
    let n = matrix.nrows();
    assert_eq!(n, matrix.ncols(), "a symmetric matrix is square");
    let mut a = (matrix + &matrix.t()) / 2.0;
    let mut u = Array2::<f64>::eye(n);
    for _ in 0..MOST_SWEEPS {
        let mut rotated = false;
        for (p, q) in (1..n).flat_map(|q| (0..q).map(move |p| (p, q))) {
            // Small relative to its own row and column, so that small eigenvalues are exact; never true for
            // NaN.
            if a[[p, q]].abs() > f64::EPSILON * (a[[p, p]] * a[[q, q]]).abs().sqrt() {
                rotate(&mut a, &mut u, p, q);
                rotated = true;
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|i, j| a[[*j, *j]].total_cmp(&a[[*i, *i]]));
    (order.iter().map(|i| a[[*i, *i]]).collect(), u.select(Axis(1), &order))
}

fn rotate(a: &mut Array2<f64>, u: &mut Array2<f64>, p: usize, q: usize) {
    let tau = (a[[q, q]] - a[[p, p]]) / (2.0 * a[[p, q]]);
    let t = tau.signum() / (tau.abs() + tau.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for k in 0..a.nrows() {
        let (x, y) = (a[[k, p]], a[[k, q]]);
        (a[[k, p]], a[[k, q]]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..a.nrows() {
        let (x, y) = (a[[p, k]], a[[q, k]]);
        (a[[p, k]], a[[q, k]]) = (c * x - s * y, s * x + c * y);
        let (x, y) = (u[[k, p]], u[[k, q]]);
        (u[[k, p]], u[[k, q]]) = (c * x - s * y, s * x + c * y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn the_parts_give_the_matrix_back() {
        for n in [1, 2, 3, 15] {
            let a = Array2::from_shape_fn((n, n), |(i, j)| ((i * j) as f64).sin() + ((i + j) as f64).cos());
            let (d, u) = symmetric_eigen(&a);
            let back = u.dot(&Array2::from_diag(&d)).dot(&u.t());
            assert!((&back - &a).iter().all(|e| e.abs() < 1e-12 * n as f64), "{n}");
            let unit = u.t().dot(&u) - Array2::<f64>::eye(n);
            assert!(unit.iter().all(|e| e.abs() < 1e-13 * n as f64), "{n}");
            assert!(d.windows(2).into_iter().all(|pair| pair[0] >= pair[1]), "{d}");
        }
    }

    #[test]
    fn known_values_are_found() {
        let (d, _) = symmetric_eigen(&array![[2.0, 1.0], [1.0, 2.0]]);
        assert!((d[0] - 3.0).abs() < 1e-15 && (d[1] - 1.0).abs() < 1e-15);
    }
}
