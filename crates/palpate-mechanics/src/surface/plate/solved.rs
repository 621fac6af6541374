//! A plate's equations, factored: a solution then costs two sweeps through the factor.
//!
//! Symbols: K stiffness matrix, with the elastic supports in it; b the deflection of a simple support as a functional, B all
//! of them as columns; r the forces of the simple supports on the plate; f a load.

use ndarray::{Array1, Array2};

use super::assembly::{Functional, Spring, stiffness_matrix};
use super::error::Unsolvable;
use super::mesh::{Derivative, Mesh};
use super::spec::{PlateSpec, PointSupport, PointSupportKind};
use super::stiffness::element_stiffness;
use super::unknowns::Unknowns;
use palpate_numerics::{Cholesky, SparseCholesky};

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
const TOGETHER: usize = 24;

/// What holds the points of the simple supports.
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

    /// How many numbers the factor is stored in.
    pub fn stored_numbers(&self) -> usize {
        self.factor.stored_numbers()
    }

    /// All degrees of freedom under each of `loads`, a functional and what the solution is multiplied by.
    pub fn solutions(&self, loads: &[(Functional, f64)]) -> Vec<Vec<f64>> {
        let each = loads.chunks(TOGETHER).flat_map(|loads| {
            let functionals: Vec<&Functional> = loads.iter().map(|(functional, _)| functional).collect();
            let mut solved = solve(&self.unknowns, &self.factor, &functionals);
            let spread = |(u, (_, factor)): (&mut [f64], &(Functional, f64))| {
                self.simple_supports.hold(&self.unknowns, u);
                self.unknowns.spread(u, *factor)
            };
            solved.chunks_exact_mut(self.unknowns.count().max(1)).zip(loads).map(spread).collect::<Vec<_>>()
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
            add(&mut sum, *weight, solution);
        }
        Some(self.unknowns.spread(&sum, 1.0))
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
            add(u, -force, solution);
        }
    }
}

/// The springs under the plate, one for each support in its order: the elastic ones, and γ under the simple ones.
///
/// Whatever γ is, the solution is the same; one of the plate's own size, D over its area, keeps the precision.
fn springs(spec: &PlateSpec, mesh: &Mesh) -> Vec<Spring> {
    let own_n_per_m = spec.flexural_rigidity() / (spec.length_m * spec.width_m);
    let spring = |support: &PointSupport| Spring {
        deflection: mesh.weights(mesh.place(support.position), Derivative::None).to_vec(),
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

/// What `functional` is of the unknowns `u`.
fn reading(unknowns: &Unknowns, functional: &Functional, u: &[f64]) -> f64 {
    let terms = functional.iter().filter_map(|(degree, value)| Some(value * u[unknowns.place(*degree)?]));
    terms.sum()
}

/// sum += factor·values.
fn add(sum: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}
