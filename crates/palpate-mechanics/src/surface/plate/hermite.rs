//! Cubic Hermite functions on the unit interval.
//!
//! Symbols: ξ place within an element, 0 to 1; N₀, N₁ the functions of value and slope at ξ = 0, N₂, N₃ those at ξ = 1.

/// The four functions, or a derivative of them, at one ξ.
pub(super) type Four = [f64; 4];

/// Integrals over the element of products of two functions or of their derivatives.
pub(super) type Integrals = [[f64; 4]; 4];

/// N₀ … N₃ at `xi`.
pub(super) fn values(xi: f64) -> Four {
    let (square, cube) = (xi * xi, xi * xi * xi);
    [1.0 - 3.0 * square + 2.0 * cube, xi - 2.0 * square + cube, 3.0 * square - 2.0 * cube, cube - square]
}

/// Their first derivatives with respect to ξ.
pub(super) fn slopes(xi: f64) -> Four {
    let square = xi * xi;
    [6.0 * square - 6.0 * xi, 1.0 - 4.0 * xi + 3.0 * square, 6.0 * xi - 6.0 * square, 3.0 * square - 2.0 * xi]
}

/// Their second derivatives with respect to ξ.
pub(super) fn curvatures(xi: f64) -> Four {
    [12.0 * xi - 6.0, 6.0 * xi - 4.0, 6.0 - 12.0 * xi, 6.0 * xi - 2.0]
}

/// ∫ fᵢ·gⱼ dξ from 0 to 1, by the rule of Gauss and Legendre with four points, exact up to degree 7.
pub(super) fn integrals(f: fn(f64) -> Four, g: fn(f64) -> Four) -> Integrals {
    let mut sums = Integrals::default();
    for (xi, weight) in gauss_points() {
        let (f, g) = (f(xi), g(xi));
        for (row, f) in sums.iter_mut().zip(f) {
            for (sum, g) in row.iter_mut().zip(g) {
                *sum += weight * f * g;
            }
        }
    }
    sums
}

/// Places and weights of the rule with four points on the unit interval (Abramowitz and Stegun, 25.4.30):
/// x² = (3 ∓ 2·√(6/5))/7, weights (18 ± √30)/36 on −1 … 1.
fn gauss_points() -> [(f64, f64); 4] {
    let (root, spread) = (30f64.sqrt(), 2.0 * (6.0f64 / 5.0).sqrt());
    let near = (((3.0 - spread) / 7.0).sqrt(), (18.0 + root) / 36.0);
    let far = (((3.0 + spread) / 7.0).sqrt(), (18.0 - root) / 36.0);
    let at = |x: f64, weight: f64| (0.5 * (1.0 + x), 0.5 * weight);
    [at(-far.0, far.1), at(-near.0, near.1), at(near.0, near.1), at(far.0, far.1)]
}
