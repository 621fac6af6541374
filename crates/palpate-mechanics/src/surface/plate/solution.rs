//! Factored equations of a plate; symbols as in `supports.rs`.

use ndarray::{Array1, Array2};

use super::dissection::nested_dissection;
use super::mesh::{Derivative, ElementStiffness, Mesh, NODE_DEGREES, element_stiffness};
use super::rigid::{self, Motions, RigidMotions};
use super::spec::{Edge, Edges, MOST_IMBALANCE, PlateSpec, PointSupportKind, Unsolvable, compliance_m_per_n};
use super::supports::SupportForces;
use crate::contact::Position;
use palpate_numerics::small::add_multiple;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{SparseCholesky, SparseSymmetric};

/// Factored equations: K₀ₕ, and the supports by the force method, also off the nodes.
pub(super) struct PlateSolution {
    pub mesh: Mesh,
    unknowns: Unknowns,
    factor: SparseCholesky,
    element: ElementStiffness,
    supports: Supports,
    balance: Balance,
}

/// More loads per sweep would cost memory and save little time.
pub(super) const TOGETHER: usize = 24;

struct Supports {
    /// Columns of B.
    deflections: Vec<Functional>,
    /// Columns of K₀ₕ⁻¹·B.
    solutions: Vec<Vec<f64>>,
    forces: SupportForces,
    motions: RigidMotions,
}

struct Balance {
    by_edges: Vec<(usize, Motions)>,
}

impl PlateSolution {
    /// Factors the equations and checks them by a grid of forces.
    ///
    /// # Errors
    /// [`Unsolvable`] when singular, too large, unbalanced or cancelled.
    pub fn new(spec: &PlateSpec, watch: Watch) -> Result<Self, Unsolvable> {
        let mesh = Mesh::new(spec.extent(), spec.elements);
        let motions = RigidMotions::new(&mesh, spec.edges);
        let unknowns = Unknowns::new(&mesh, spec.edges, motions.nodes());
        let element = element_stiffness(&mesh, spec.flexural_rigidity(), spec.poissons_ratio);
        let stiffness = stiffness_matrix(&mesh, &unknowns, &element, watch)?;
        let factor = SparseCholesky::new_watched(&stiffness, watch)?;
        let supports = Supports::new(spec, &mesh, motions, &unknowns, &factor, watch)?;
        let balance = Balance::new(&mesh, spec.edges, &unknowns, &element);
        let solved = Self { mesh, unknowns, factor, element, supports, balance };
        solved.check(spec, watch)?;
        Ok(solved)
    }

    pub fn stored_numbers(&self) -> usize {
        self.factor.stored_numbers()
    }

    /// Solves for all degrees of freedom under loads, pairs of functional and factor; NaN if unbalanced.
    pub fn solutions(&self, loads: &[(Functional, f64)], watch: Watch) -> Result<Vec<Vec<f64>>, Cancelled> {
        let mut all = Vec::with_capacity(loads.len());
        for loads in loads.chunks(TOGETHER) {
            watch.round()?;
            let functionals: Vec<&Functional> = loads.iter().map(|(functional, _)| functional).collect();
            let solved = self.solve(&functionals, watch)?;
            let times = |(shape, (_, factor)): (Shape, &(Functional, f64))| {
                let factor = if shape.is_balanced() { *factor } else { f64::NAN };
                let mut degrees = self.unknowns.expand(&shape.bent, factor);
                self.supports.motions.add(&mut degrees, factor, &shape.moved);
                degrees
            };
            all.extend(solved.into_iter().zip(loads).map(times));
        }
        Ok(all)
    }

    /// r = P·y + Q·R'·f of a support, as degrees of freedom of an influence function.
    pub fn reaction(&self, support: usize) -> Option<Vec<f64>> {
        let Supports { solutions, forces, motions, .. } = &self.supports;
        (support < solutions.len()).then(|| {
            let mut sum = vec![0.0; self.unknowns.count()];
            for (weight, solution) in forces.by_deflection.row(support).iter().zip(solutions) {
                add_multiple(&mut sum, *weight, solution);
            }
            let mut degrees = self.unknowns.expand(&sum, 1.0);
            motions.add(&mut degrees, 1.0, &forces.by_load.row(support).to_vec());
            degrees
        })
    }

    /// Solves with iterative refinement of unbalanced shapes (Golub and Van Loan, *Matrix Computations*,
    /// 3.5.3).
    fn solve(&self, loads: &[&Functional], watch: Watch) -> Result<Vec<Shape>, Cancelled> {
        let each = |load: &&Functional| self.unknowns.gathered(load.iter().copied());
        let solved = self.swept(&loads.iter().map(each).collect::<Vec<_>>(), watch)?;
        let mut shapes: Vec<Shape> = solved.into_iter().map(Shape::supported_shape).collect();
        for (shape, load) in shapes.iter_mut().zip(loads) {
            self.hold(shape, load, &load.iter().copied());
        }
        for _ in 0..MOST_REFINEMENTS {
            let is_off = |shape: &Shape| shape.imbalance.is_nan() || shape.imbalance > REFINED_IMBALANCE;
            let (mut off, loads): (Vec<&mut Shape>, Vec<&Functional>) =
                shapes.iter_mut().zip(loads.iter().copied()).filter(|(shape, _)| is_off(shape)).unzip();
            if off.is_empty() {
                break;
            }
            let residuals: Vec<Vec<f64>> =
                off.iter().zip(&loads).map(|(shape, load)| self.residual(shape, load)).collect();
            let each = |residual: &Vec<f64>| self.unknowns.gathered(residual.iter().copied().enumerate());
            let changes = self.swept(&residuals.iter().map(each).collect::<Vec<_>>(), watch)?;
            for (((shape, load), residual), change) in off.iter_mut().zip(loads).zip(&residuals).zip(changes)
            {
                let mut better = Shape::supported_shape(change);
                self.hold(&mut better, load, &residual.iter().copied().enumerate());
                better.add(shape);
                better.imbalance = self.imbalance(&better, load);
                if better.imbalance < shape.imbalance {
                    **shape = better;
                }
            }
        }
        Ok(shapes)
    }

    fn swept(&self, loads: &[Vec<f64>], watch: Watch) -> Result<Vec<Vec<f64>>, Cancelled> {
        let mut together = loads.concat();
        self.factor.solve_in_place_watched(&mut together, watch)?;
        Ok(together.chunks_exact(self.unknowns.count().max(1)).map(<[f64]>::to_vec).collect())
    }

    /// Residual f + B·r − K₀·u; 0 where an edge constrains it.
    ///
    /// K₀ multiplies the difference from the rigid motion of an element's first node, as the rounding of a
    /// large motion would bend the element.
    fn residual(&self, shape: &Shape, load: &Functional) -> Vec<f64> {
        let (mesh, u) = (&self.mesh, self.unknowns.expand(&shape.bent, 1.0));
        let mut residual = vec![0.0; mesh.degrees()];
        let mut add = |functional: &Functional, times: f64| {
            functional.iter().for_each(|(degree, weight)| residual[*degree] += times * weight);
        };
        add(load, 1.0);
        self.supports.deflections.iter().zip(&shape.forces).for_each(|(of, force)| add(of, *force));
        for (column, row) in (0..mesh.rows).flat_map(|row| (0..mesh.columns).map(move |column| (column, row)))
        {
            let degrees: [usize; 16] = std::array::from_fn(|i| {
                let (x, y) = (i % 4, i / 4);
                mesh.first_degree(column + x / 2, row + y / 2) + x % 2 + 2 * (y % 2)
            });
            let (level, along_x, along_y) = (u[degrees[0]], u[degrees[1]], u[degrees[4]]);
            let bent: [f64; 16] = std::array::from_fn(|i| {
                let rigid = match (i % 2, (i / 4) % 2) {
                    (0, 0) => level + ((i % 4) / 2) as f64 * along_x + (i / 8) as f64 * along_y,
                    (1, 0) => along_x,
                    (0, 1) => along_y,
                    _ => 0.0,
                };
                u[degrees[i]] - rigid
            });
            for (degree, couplings) in degrees.iter().zip(&self.element) {
                residual[*degree] -= couplings.iter().zip(&bent).map(|(k, u)| k * u).sum::<f64>();
            }
        }
        for (degree, residual) in residual.iter_mut().enumerate() {
            if self.unknowns.is_on_held_edge(degree) {
                *residual = 0.0;
            }
        }
        residual
    }

    fn hold(
        &self,
        shape: &mut Shape,
        load: &Functional,
        acting: &(impl Iterator<Item = (usize, f64)> + Clone),
    ) {
        self.supports.hold(&self.unknowns, shape, acting);
        shape.imbalance = self.imbalance(shape, load);
    }

    fn imbalance(&self, shape: &Shape, load: &Functional) -> f64 {
        self.balance.off(&self.mesh, &self.unknowns, &self.supports, load, shape)
    }

    fn check(&self, spec: &PlateSpec, watch: Watch) -> Result<(), Unsolvable> {
        const ALONG: usize = 3;
        let at = |i: usize, size_m: f64| i as f64 / ALONG as f64 * size_m;
        let row =
            |j| (0..=ALONG).map(move |i| Position { x_m: at(i, spec.length_m), y_m: at(j, spec.width_m) });
        let places: Vec<Position> = (0..=ALONG).flat_map(row).collect();
        let loads: Vec<Functional> = places.iter().map(|place| deflection_at(&self.mesh, *place)).collect();
        let shapes = self.solve(&loads.iter().collect::<Vec<_>>(), watch)?;
        match shapes.iter().zip(places).find(|(shape, _)| !shape.is_balanced()) {
            Some((shape, at)) => Err(Unsolvable::OutOfBalance { share: shape.imbalance, at }),
            None => Ok(()),
        }
    }
}

/// Largest imbalance without refinement.
const REFINED_IMBALANCE: f64 = 0.3 * MOST_IMBALANCE;
const MOST_REFINEMENTS: usize = 3;

struct Shape {
    bent: Vec<f64>,
    forces: Vec<f64>,
    moved: Vec<f64>,
    imbalance: f64,
}

impl Shape {
    fn supported_shape(bent: Vec<f64>) -> Self {
        Self { bent, forces: Vec::new(), moved: Vec::new(), imbalance: f64::NAN }
    }

    /// False for NaN.
    fn is_balanced(&self) -> bool {
        self.imbalance <= MOST_IMBALANCE
    }

    fn add(&mut self, other: &Self) {
        add_multiple(&mut self.bent, 1.0, &other.bent);
        add_multiple(&mut self.forces, 1.0, &other.forces);
        add_multiple(&mut self.moved, 1.0, &other.moved);
    }
}

impl Supports {
    fn new(
        spec: &PlateSpec,
        mesh: &Mesh,
        motions: RigidMotions,
        unknowns: &Unknowns,
        factor: &SparseCholesky,
        watch: Watch,
    ) -> Result<Self, Unsolvable> {
        let deflections: Vec<Functional> =
            spec.supports.iter().map(|support| deflection_at(mesh, support.position)).collect();
        let solution = |load: &Functional| {
            let mut u = unknowns.gathered(load.iter().copied());
            factor.solve_in_place_watched(&mut u, watch)?;
            Ok(u)
        };
        let solutions = deflections.iter().map(solution).collect::<Result<Vec<_>, Cancelled>>()?;
        let own = |i: usize| match spec.supports[i].kind {
            PointSupportKind::Simple => 0.0,
            PointSupportKind::Elastic { stiffness_n_per_m } => 1.0 / stiffness_n_per_m,
        };
        let count = deflections.len();
        let compliance = Array2::from_shape_fn((count, count), |(i, j)| {
            let given = 0.5
                * (reading(unknowns, &deflections[i], &solutions[j])
                    + reading(unknowns, &deflections[j], &solutions[i]));
            if i == j { given + own(i) } else { given }
        });
        let moved: Vec<Vec<f64>> =
            deflections.iter().map(|deflection| motions.resultants(&deflection.iter().copied())).collect();
        let moved = Array2::from_shape_fn((count, motions.count()), |(i, k)| moved[i][k]);
        let forces = SupportForces::new(&compliance, &moved, compliance_m_per_n(spec))?;
        Ok(Self { deflections, solutions, forces, motions })
    }

    fn hold(
        &self,
        unknowns: &Unknowns,
        shape: &mut Shape,
        load: &(impl Iterator<Item = (usize, f64)> + Clone),
    ) {
        let SupportForces { by_deflection, by_load, motion_by_load } = &self.forces;
        let moved = self.deflections.iter().map(|deflection| reading(unknowns, deflection, &shape.bent));
        let moved: Array1<f64> = moved.collect();
        let resultant = Array1::from(self.motions.resultants(load));
        let forces = -(by_deflection.dot(&moved) + by_load.dot(&resultant));
        for (force, solution) in forces.iter().zip(&self.solutions) {
            add_multiple(&mut shape.bent, *force, solution);
        }
        shape.forces = forces.to_vec();
        shape.moved = (motion_by_load.dot(&resultant) - by_load.t().dot(&moved)).to_vec();
    }
}

impl Balance {
    fn new(mesh: &Mesh, edges: Edges, unknowns: &Unknowns, element: &ElementStiffness) -> Self {
        let mut sums: Vec<Motions> = vec![[0.0; 3]; mesh.degrees()];
        let (columns, rows) = mesh.nodes();
        for (column, row) in (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))) {
            let held = constrained_degrees(mesh, edges, column, row);
            for degree in (0..NODE_DEGREES).filter(|degree| held[*degree]) {
                let degree = mesh.first_degree(column, row) + degree;
                let arms = rigid::motions_at(mesh, degree);
                for (other, coupling) in element_column(mesh, element, degree).entries(mesh) {
                    sums[other].iter_mut().zip(arms).for_each(|(sum, arm)| *sum += arm * coupling);
                }
            }
        }
        let by_edges = sums.into_iter().enumerate().filter_map(|(degree, sum)| {
            Some((unknowns.place(degree)?, sum)).filter(|_| sum.iter().any(|sum| *sum != 0.0))
        });
        Self { by_edges: by_edges.collect() }
    }

    /// Imbalance of force or moments, relative to the load.
    fn off(
        &self,
        mesh: &Mesh,
        unknowns: &Unknowns,
        supports: &Supports,
        load: &Functional,
        Shape { bent, forces, .. }: &Shape,
    ) -> f64 {
        let mut sums = [0.0; 3];
        let mut add = |functional: &Functional, times: f64| {
            // A load on a degree of freedom that an edge constrains goes into that edge.
            for (degree, weight) in functional.iter().filter(|(degree, _)| !unknowns.is_on_held_edge(*degree))
            {
                let arms = rigid::motions_at(mesh, *degree);
                sums.iter_mut().zip(arms).for_each(|(sum, arm)| *sum += times * weight * arm);
            }
        };
        add(load, 1.0);
        supports.deflections.iter().zip(forces).for_each(|(deflection, force)| add(deflection, *force));
        for (place, by_edge) in &self.by_edges {
            sums.iter_mut().zip(by_edge).for_each(|(sum, by_edge)| *sum += by_edge * bent[*place]);
        }
        let loaded: f64 = load.iter().map(|(_, weight)| weight.abs()).sum();
        sums.iter()
            .fold(0.0, |most: f64, sum| if most.is_nan() { most } else { (sum / loaded).abs().max(most) })
    }
}

fn deflection_at(mesh: &Mesh, position: Position) -> Functional {
    mesh.weights(mesh.locate(position), Derivative::None).to_vec()
}

fn reading(unknowns: &Unknowns, functional: &Functional, u: &[f64]) -> f64 {
    let terms = functional.iter().filter_map(|(degree, value)| Some(value * u[unknowns.place(*degree)?]));
    terms.sum()
}

/// Unconstrained degrees of freedom in the order of elimination.
struct Unknowns {
    places: Vec<Option<u32>>,
    degrees: Vec<u32>,
    nodes: Vec<usize>,
}

impl Unknowns {
    pub fn new(mesh: &Mesh, edges: Edges, nodes: &[(usize, usize)]) -> Self {
        let (columns, rows) = mesh.nodes();
        let nodes: Vec<usize> = nodes.iter().map(|(column, row)| mesh.first_degree(*column, *row)).collect();
        let mut places = vec![None; mesh.degrees()];
        let mut degrees = Vec::with_capacity(mesh.degrees());
        for (column, row) in nested_dissection(columns, rows) {
            let first = mesh.first_degree(column, row);
            let held = constrained_degrees(mesh, edges, column, row);
            for degree in (0..NODE_DEGREES).filter(|degree| !held[*degree]).map(|degree| first + degree) {
                if nodes.contains(&degree) {
                    continue;
                }
                places[degree] = Some(degrees.len() as u32);
                degrees.push(degree as u32);
            }
        }
        Self { places, degrees, nodes }
    }

    pub fn gathered(&self, values: impl Iterator<Item = (usize, f64)>) -> Vec<f64> {
        let mut gathered = vec![0.0; self.count()];
        for (degree, value) in values {
            if let Some(place) = self.place(degree) {
                gathered[place] += value;
            }
        }
        gathered
    }

    pub fn count(&self) -> usize {
        self.degrees.len()
    }

    /// Equation; `None` if constrained.
    pub fn place(&self, degree: usize) -> Option<usize> {
        self.places[degree].map(|place| place as usize)
    }

    pub fn is_on_held_edge(&self, degree: usize) -> bool {
        self.places[degree].is_none() && !self.nodes.contains(&degree)
    }

    pub fn degree(&self, unknown: usize) -> usize {
        self.degrees[unknown] as usize
    }

    pub fn expand(&self, unknowns: &[f64], factor: f64) -> Vec<f64> {
        self.places.iter().map(|place| place.map_or(0.0, |place| factor * unknowns[place as usize])).collect()
    }
}

/// Constrained degrees of freedom: w and its derivative along a supported edge, all four on a clamped edge.
fn constrained_degrees(mesh: &Mesh, edges: Edges, column: usize, row: usize) -> [bool; NODE_DEGREES] {
    let on = [
        (column == 0, edges.left, [true, false, true, false]),
        (column == mesh.columns, edges.right, [true, false, true, false]),
        (row == 0, edges.bottom, [true, true, false, false]),
        (row == mesh.rows, edges.top, [true, true, false, false]),
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

/// Weighted sum of degrees of freedom: index and weight.
pub(super) type Functional = Vec<(usize, f64)>;

fn stiffness_matrix(
    mesh: &Mesh,
    unknowns: &Unknowns,
    element: &ElementStiffness,
    watch: Watch,
) -> Result<SparseSymmetric, Cancelled> {
    const EACH: usize = 1 << 12;
    let mut matrix = SparseSymmetric::with_capacity(unknowns.count() * NEIGHBOURS * NODE_DEGREES / 2);
    for unknown in 0..unknowns.count() {
        if unknown % EACH == 0 {
            watch.round()?;
        }
        let column = element_column(mesh, element, unknowns.degree(unknown));
        let elements = column.entries(mesh);
        matrix.push_column(elements.filter_map(|(degree, value)| Some((unknowns.place(degree)?, value))));
    }
    Ok(matrix)
}

const NEIGHBOURS: usize = 9;

struct Column {
    node: (usize, usize),
    couplings: [[f64; NODE_DEGREES]; NEIGHBOURS],
}

impl Column {
    fn entries(&self, mesh: &Mesh) -> impl Iterator<Item = (usize, f64)> {
        let (columns, rows) = mesh.nodes();
        self.couplings.iter().enumerate().flat_map(move |(i, couplings)| {
            // One more than the neighbour's own column and row, which may be left of or below the grid.
            let (column, row) = (self.node.0 + i % 3, self.node.1 + i / 3);
            let exists = (1..=columns).contains(&column) && (1..=rows).contains(&row);
            let first = if exists { mesh.first_degree(column - 1, row - 1) } else { 0 };
            let degrees = if exists { NODE_DEGREES } else { 0 };
            couplings[..degrees].iter().enumerate().map(move |(degree, value)| (first + degree, *value))
        })
    }
}

fn element_column(mesh: &Mesh, element: &ElementStiffness, degree: usize) -> Column {
    let (node, own) = (degree / NODE_DEGREES, degree % NODE_DEGREES);
    let node = (node % (mesh.columns + 1), node / (mesh.columns + 1));
    let mut column = Column { node, couplings: [[0.0; NODE_DEGREES]; NEIGHBOURS] };
    for (end_y, end_x) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        // The element with this node as its end: its first node is (node.0 − end_x, node.1 − end_y).
        let fits = |at: usize, end: usize, count: usize| at >= end && at - end < count;
        if !(fits(node.0, end_x, mesh.columns) && fits(node.1, end_y, mesh.rows)) {
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

fn local(end_x: usize, end_y: usize, degree: usize) -> usize {
    4 * (2 * end_y + degree / 2) + 2 * end_x + degree % 2
}
