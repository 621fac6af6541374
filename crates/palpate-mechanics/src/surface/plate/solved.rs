//! A plate's equations, factored: a solution then costs two sweeps through the factor.
//!
//! Symbols: K stiffness matrix, with the elastic supports in it; b the deflection of a simple support as a functional, B all
//! of them as columns; r the forces of the simple supports on the plate; f a load.

use std::collections::HashMap;

use ndarray::{Array1, Array2};

use super::dissection::nested_dissection;
use super::mesh::{Derivative, ElementStiffness, Mesh, NODE_DEGREES, element_stiffness};
use super::spec::{Edge, Edges, PlateSpec, PointSupport, PointSupportKind, Unsolvable};
use palpate_numerics::small::add_multiple;
use palpate_numerics::{Cholesky, SparseCholesky, SparseSymmetric};

/// The factored equations of a plate.
///
/// A simple support need not be at a node: B'·u = 0 is held exactly. K alone can be singular, when points hold the plate, so
/// that K + γ·B·B' is factored, with springs γ under the simple supports, which carry nothing once their points do not move.
/// Then u = (K + γ·B·B')⁻¹·(f + B·r), with r such that B'·u = 0 (Benzi, Golub and Liesen, *Numerical solution of saddle point
/// problems*, 2005, section 5 and eq. 5.3).
pub(super) struct Solved {
    pub mesh: Mesh,
    unknowns: Unknowns,
    factor: SparseCholesky,
    simple_supports: SimpleSupports,
}

/// Loads that are solved for in one sweep through the factor: more would cost memory and save little.
pub(super) const TOGETHER: usize = 24;

/// Constraint equations of the simple supports.
struct SimpleSupports {
    /// Of each support of the plate, which of the simple ones it is.
    numbers: Vec<Option<usize>>,
    /// The column of B of each.
    deflections: Vec<Functional>,
    /// (K + γ·B·B')⁻¹·B, a column each.
    solutions: Vec<Vec<f64>>,
    /// The factor of S = B'·(K + γ·B·B')⁻¹·B.
    compliance: Cholesky,
}

impl Solved {
    /// Sets up and factors the equations of a plate that was checked.
    ///
    /// # Errors
    /// [`Unsolvable`] when they are singular to working precision, or too large for the memory that there is.
    pub fn new(spec: &PlateSpec) -> Result<Self, Unsolvable> {
        let mesh = Mesh::new(spec.extent(), spec.elements);
        let unknowns = Unknowns::new(&mesh, spec.edges);
        let springs = springs(spec, &mesh);
        let element = element_stiffness(&mesh, spec.flexural_rigidity(), spec.poissons_ratio);
        let factor = SparseCholesky::new(&stiffness_matrix(&mesh, &unknowns, &element, &springs))?;
        let simple_supports = SimpleSupports::new(spec, springs, &unknowns, &factor)?;
        Ok(Self { mesh, unknowns, factor, simple_supports })
    }

    /// Number of stored entries of the factor.
    pub fn stored_numbers(&self) -> usize {
        self.factor.stored_numbers()
    }

    /// All degrees of freedom under each of `loads`, a functional and what the solution is multiplied by.
    pub fn solutions(&self, loads: &[(Functional, f64)]) -> Vec<Vec<f64>> {
        let each = loads.chunks(TOGETHER).flat_map(|loads| {
            let functionals: Vec<&Functional> = loads.iter().map(|(functional, _)| functional).collect();
            let mut solved = solve(&self.unknowns, &self.factor, &functionals);
            let expanded = |(u, (_, factor)): (&mut [f64], &(Functional, f64))| {
                self.simple_supports.hold(&self.unknowns, u);
                self.unknowns.expand(u, *factor)
            };
            solved.chunks_exact_mut(self.unknowns.count().max(1)).zip(loads).map(expanded).collect::<Vec<_>>()
        });
        each.collect()
    }

    /// The force of a simple support on the plate, positive upward, under a downward unit force, as degrees of freedom of a
    /// function of where that force acts: the row of S⁻¹·B'·(K + γ·B·B')⁻¹ that is the support's. `None` for another support.
    pub fn reaction(&self, support: usize) -> Option<Vec<f64>> {
        let number = self.simple_supports.numbers.get(support).copied().flatten()?;
        let held = &self.simple_supports;
        let mut unit = Array1::zeros(held.solutions.len());
        unit[number] = 1.0;
        let mut sum = vec![0.0; self.unknowns.count()];
        for (weight, solution) in held.compliance.solve(&unit).iter().zip(&held.solutions) {
            add_multiple(&mut sum, *weight, solution);
        }
        Some(self.unknowns.expand(&sum, 1.0))
    }
}

impl SimpleSupports {
    fn new(
        spec: &PlateSpec,
        springs: Vec<Spring>,
        unknowns: &Unknowns,
        factor: &SparseCholesky,
    ) -> Result<Self, Unsolvable> {
        let mut count = 0;
        let numbers = spec.supports.iter().map(|support| {
            let number = support.is_rigid().then_some(count);
            count += usize::from(support.is_rigid());
            number
        });
        let numbers: Vec<_> = numbers.collect();
        let rigid = springs.into_iter().zip(&numbers).filter(|(_, number)| number.is_some());
        let deflections: Vec<Functional> = rigid.map(|(spring, _)| spring.deflection).collect();
        let solutions: Vec<_> = deflections.iter().map(|load| solve(unknowns, factor, &[load])).collect();
        let compliance =
            Array2::from_shape_fn((count, count), |(i, j)| reading(unknowns, &deflections[i], &solutions[j]));
        Ok(Self { numbers, deflections, compliance: Cholesky::factor(compliance)?, solutions })
    }

    /// Adds to u what the forces of the supports do, so that their points do not move: r = −S⁻¹·B'·u.
    fn hold(&self, unknowns: &Unknowns, u: &mut [f64]) {
        if self.solutions.is_empty() {
            return;
        }
        let moved = self.deflections.iter().map(|deflection| reading(unknowns, deflection, u));
        let forces = self.compliance.solve(&moved.collect());
        for (force, solution) in forces.iter().zip(&self.solutions) {
            add_multiple(u, -force, solution);
        }
    }
}

/// The springs under the plate, one for each support in its order: the elastic ones, and γ under the simple ones.
///
/// Whatever γ is, the solution is the same; one of the plate's own size, D over its area, keeps the precision.
fn springs(spec: &PlateSpec, mesh: &Mesh) -> Vec<Spring> {
    let own_n_per_m = spec.flexural_rigidity() / (spec.length_m * spec.width_m);
    let spring = |support: &PointSupport| Spring {
        deflection: mesh.weights(mesh.locate(support.position), Derivative::None).to_vec(),
        stiffness_n_per_m: match support.kind {
            PointSupportKind::Simple => own_n_per_m,
            PointSupportKind::Elastic { stiffness_n_per_m } => stiffness_n_per_m,
        },
    };
    spec.supports.iter().map(spring).collect()
}

/// The unknowns under each load, one after the other.
fn solve(unknowns: &Unknowns, factor: &SparseCholesky, loads: &[&Functional]) -> Vec<f64> {
    let mut u = vec![0.0; unknowns.count() * loads.len()];
    for (u, load) in u.chunks_exact_mut(unknowns.count().max(1)).zip(loads) {
        for (degree, value) in *load {
            if let Some(place) = unknowns.place(*degree) {
                u[place] += value;
            }
        }
    }
    factor.solve_in_place(&mut u);
    u
}

/// Value of `functional` for the unknowns `u`.
fn reading(unknowns: &Unknowns, functional: &Functional, u: &[f64]) -> f64 {
    let terms = functional.iter().filter_map(|(degree, value)| Some(value * u[unknowns.place(*degree)?]));
    terms.sum()
}

/// The numbers of the degrees of freedom that no edge holds at zero, in the order of elimination.
struct Unknowns {
    /// Of each degree of freedom, where it stands in the equations.
    places: Vec<Option<u32>>,
    /// Degree of freedom of each unknown.
    degrees: Vec<u32>,
}

impl Unknowns {
    /// The unknowns of a mesh whose edges are held so.
    pub fn new(mesh: &Mesh, edges: Edges) -> Self {
        let (columns, rows) = mesh.nodes();
        let mut places = vec![None; mesh.degrees()];
        let mut degrees = Vec::with_capacity(mesh.degrees());
        for (column, row) in nested_dissection(columns, rows) {
            let first = mesh.first_degree(column, row);
            let held = held_degrees(mesh, edges, column, row);
            for degree in (0..NODE_DEGREES).filter(|degree| !held[*degree]).map(|degree| first + degree) {
                places[degree] = Some(degrees.len() as u32);
                degrees.push(degree as u32);
            }
        }
        Self { places, degrees }
    }

    /// Number of unknowns.
    pub fn count(&self) -> usize {
        self.degrees.len()
    }

    /// Number of the equation of a degree of freedom; `None` when it is held at zero.
    pub fn place(&self, degree: usize) -> Option<usize> {
        self.places[degree].map(|place| place as usize)
    }

    /// The degree of freedom of an unknown.
    pub fn degree(&self, unknown: usize) -> usize {
        self.degrees[unknown] as usize
    }

    /// All degrees of freedom, the held ones 0, when the unknowns are `unknowns`, times `factor`.
    pub fn expand(&self, unknowns: &[f64], factor: f64) -> Vec<f64> {
        self.places.iter().map(|place| place.map_or(0.0, |place| factor * unknowns[place as usize])).collect()
    }
}

/// Which degrees of freedom of a node its edges hold at zero.
///
/// Along an edge that is held w = 0, so its derivative along the edge is zero too; on a clamped one the slope across it is
/// zero as well, and so is that slope's derivative along it.
fn held_degrees(mesh: &Mesh, edges: Edges, column: usize, row: usize) -> [bool; NODE_DEGREES] {
    let on = [
        (column == 0, edges.left, [true, false, true, false]),
        (column == mesh.across, edges.right, [true, false, true, false]),
        (row == 0, edges.bottom, [true, true, false, false]),
        (row == mesh.up, edges.top, [true, true, false, false]),
    ];
    let mut held = [false; NODE_DEGREES];
    for (_, edge, simple) in on.into_iter().filter(|(on, ..)| *on) {
        let holds = match edge {
            Edge::Free => [false; NODE_DEGREES],
            Edge::Simple => simple,
            Edge::Clamped => [true; NODE_DEGREES],
        };
        for (held, holds) in held.iter_mut().zip(holds) {
            *held |= holds;
        }
    }
    held
}

/// The sum over some degrees of freedom, each multiplied by its factor: what a point of the plate does, or a sensor reads.
pub(super) type Functional = Vec<(usize, f64)>;

/// A spring under a point of the plate.
struct Spring {
    /// The deflection of the point.
    pub deflection: Functional,
    /// Its stiffness, in N/m.
    pub stiffness_n_per_m: f64,
}

/// The stiffness matrix of equal elements and springs, of the unknowns only.
fn stiffness_matrix(
    mesh: &Mesh,
    unknowns: &Unknowns,
    element: &ElementStiffness,
    springs: &[Spring],
) -> SparseSymmetric {
    let under = springs_by_degree(springs);
    let mut matrix = SparseSymmetric::with_capacity(unknowns.count() * NEIGHBOURS * NODE_DEGREES / 2);
    for unknown in 0..unknowns.count() {
        let degree = unknowns.degree(unknown);
        let mut column = element_column(mesh, element, degree);
        for (spring, factor) in under.get(&degree).into_iter().flatten() {
            for (other, other_factor) in &spring.deflection {
                column.add(mesh, *other, spring.stiffness_n_per_m * factor * other_factor);
            }
        }
        let elements = column.entries(mesh);
        matrix.push_column(elements.filter_map(|(degree, value)| Some((unknowns.place(degree)?, value))));
    }
    matrix
}

/// The springs whose points move with a degree of freedom, and by how much.
fn springs_by_degree(springs: &[Spring]) -> HashMap<usize, Vec<(&Spring, f64)>> {
    let mut under: HashMap<usize, Vec<(&Spring, f64)>> = HashMap::new();
    for spring in springs {
        for (degree, factor) in &spring.deflection {
            under.entry(*degree).or_default().push((spring, *factor));
        }
    }
    under
}

/// A node couples with itself and the eight around it.
const NEIGHBOURS: usize = 9;

/// One column of the matrix: the couplings of a node's degree of freedom with those of its neighbours.
struct Column {
    /// The node, its column and row in the grid.
    node: (usize, usize),
    /// Neighbours row by row from the one below to the left.
    couplings: [[f64; NODE_DEGREES]; NEIGHBOURS],
}

impl Column {
    /// Adds to the coupling with `degree`, which is one of a neighbour.
    fn add(&mut self, mesh: &Mesh, degree: usize, value: f64) {
        let (node, degree) = (degree / NODE_DEGREES, degree % NODE_DEGREES);
        let (column, row) = (node % (mesh.across + 1), node / (mesh.across + 1));
        let neighbour = 3 * (row + 1 - self.node.1) + (column + 1 - self.node.0);
        self.couplings[neighbour][degree] += value;
    }

    /// Degree of freedom and coupling of all neighbours that exist.
    fn entries(&self, mesh: &Mesh) -> impl Iterator<Item = (usize, f64)> {
        let (columns, rows) = mesh.nodes();
        self.couplings.iter().enumerate().flat_map(move |(i, couplings)| {
            // One more than the neighbour's own, which may be left of or below the grid.
            let (column, row) = (self.node.0 + i % 3, self.node.1 + i / 3);
            let exists = (1..=columns).contains(&column) && (1..=rows).contains(&row);
            let first = if exists { mesh.first_degree(column - 1, row - 1) } else { 0 };
            let degrees = if exists { NODE_DEGREES } else { 0 };
            couplings[..degrees].iter().enumerate().map(move |(degree, value)| (first + degree, *value))
        })
    }
}

/// Contributions of the up to four elements around a node to the column of its `degree`.
fn element_column(mesh: &Mesh, element: &ElementStiffness, degree: usize) -> Column {
    let (node, own) = (degree / NODE_DEGREES, degree % NODE_DEGREES);
    let node = (node % (mesh.across + 1), node / (mesh.across + 1));
    let mut column = Column { node, couplings: [[0.0; NODE_DEGREES]; NEIGHBOURS] };
    for (end_y, end_x) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        // The element of which this node is the end: its first node is (node.0 − end_x, node.1 − end_y).
        let fits = |at: usize, end: usize, count: usize| at >= end && at - end < count;
        if !(fits(node.0, end_x, mesh.across) && fits(node.1, end_y, mesh.up)) {
            continue;
        }
        let row = &element[local(end_x, end_y, own)];
        for (other_y, other_x) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let neighbour = 3 * (1 + other_y - end_y) + (1 + other_x - end_x);
            for (degree, coupling) in column.couplings[neighbour].iter_mut().enumerate() {
                *coupling += row[local(other_x, other_y, degree)];
            }
        }
    }
    column
}

/// Index of a node's degree of freedom within an element.
fn local(end_x: usize, end_y: usize, degree: usize) -> usize {
    4 * (2 * end_y + degree / 2) + 2 * end_x + degree % 2
}
