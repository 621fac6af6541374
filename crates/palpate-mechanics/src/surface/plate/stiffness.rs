//! The stiffness of one element after Bogner, Fox and Schmit, *The generation of inter-element-compatible stiffness and
//! mass matrices by the use of interpolation formulas* (1965).

use super::hermite::{curvatures, integrals, slopes, values};
use super::mesh::Mesh;

/// The second derivative of the bending energy of an element with respect to its 16 degrees of freedom.
///
/// Degree 4·y + x belongs to the product of the Hermite functions x along the length and y along the width, so x = 2·a + p
/// is the end a and the order of derivative p.
pub(super) type ElementStiffness = [[f64; 16]; 16];

/// D·∬ (w_xx² + w_yy² + 2·ν·w_xx·w_yy + 2·(1 − ν)·w_xy²)/2 as a quadratic form (Timoshenko and Woinowsky-Krieger, *Theory
/// of Plates and Shells*, 2nd ed., eq. 117).
///
/// `rigidity_nm`: flexural rigidity D in N·m; `poissons_ratio`: ν. In units of newtons per metre.
pub(super) fn element_stiffness(mesh: &Mesh, rigidity_nm: f64, poissons_ratio: f64) -> ElementStiffness {
    let (h_x, h_y, nu) = (mesh.side_x_m, mesh.side_y_m, poissons_ratio);
    let bent = integrals(curvatures, curvatures);
    let level = integrals(values, values);
    let twisted = integrals(slopes, slopes);
    let mixed = integrals(curvatures, values);
    let element = |row: usize, column: usize| {
        let (i, k) = (row % 4, row / 4);
        let (j, l) = (column % 4, column / 4);
        let along_x = bent[i][j] * level[k][l] * h_y / h_x.powi(3);
        let along_y = level[i][j] * bent[k][l] * h_x / h_y.powi(3);
        let both = nu * (mixed[i][j] * mixed[l][k] + mixed[j][i] * mixed[k][l]) / (h_x * h_y);
        let twist = 2.0 * (1.0 - nu) * twisted[i][j] * twisted[k][l] / (h_x * h_y);
        rigidity_nm * (along_x + along_y + both + twist)
    };
    std::array::from_fn(|row| std::array::from_fn(|column| element(row, column)))
}
