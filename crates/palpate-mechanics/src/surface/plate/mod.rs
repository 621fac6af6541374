//! Rectangular Kirchhoff plates by the elements of Bogner, Fox and Schmit.

mod cache;
mod dissection;
mod influence;
mod mesh;
mod rigid;
mod solution;
mod spec;
mod supports;

pub use spec::{Edge, Edges, PlateError, PlateSpec, PointSupport, PointSupportKind, Unsolvable};

use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use serde::{Deserialize, Serialize};

use super::{
    Extent, InfluenceFunction, InsensitiveSensor, Proportional, ReadingsByContact, ResponseFunction,
    SolutionCost, Solving, Surface,
};
use crate::contact::Position;
use crate::sensing::SensorKind;
use cache::InfluenceCache;
use influence::{NotANumber, PlateInfluence, PlateReadings, full_scales};
use palpate_numerics::watch::{Cancelled, Watch};
use solution::PlateSolution;

/// A checked plate, factored at the first request, once for all clones.
///
/// Computed values are neither compared nor serialised. They take 85 MB for the default mesh, and up to 128
/// MB of influence functions.
///
/// ```
/// use palpate_mechanics::contact::Position;
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::plate::{Edge, Edges, PlateSpec};
/// use palpate_mechanics::surface::{Plate, Surface};
///
/// let spec = PlateSpec {
///     length_m: 0.3,
///     width_m: 0.3,
///     thickness_m: 0.8e-3,
///     youngs_modulus_pa: 200e9,
///     poissons_ratio: 0.3,
///     edges: Edges::all(Edge::Simple),
///     supports: Vec::new(),
///     elements: 8,
/// };
/// let per_newton = 0.011_60 * 0.3f64.powi(2) / spec.flexural_rigidity(); // Timoshenko and Woinowsky-Krieger, table 23
/// let middle = Position { x_m: 0.15, y_m: 0.15 };
/// assert!((Plate::new(spec)?.influence(Deflection, middle, middle) / -per_newton - 1.0).abs() < 5e-3);
/// # Ok::<(), palpate_mechanics::surface::PlateError>(())
/// ```
#[derive(Clone, Serialize, Deserialize)]
#[serde(try_from = "PlateSpec", into = "PlateSpec")]
pub struct Plate {
    spec: PlateSpec,
    computed: Arc<PlateResults>,
}

#[derive(Default)]
struct PlateResults {
    solved: OnceLock<Result<PlateSolution, Unsolvable>>,
    /// One thread solves, others wait.
    solving: Mutex<()>,
    influences: InfluenceCache,
    full_scales: OnceLock<[f64; SensorKind::ALL.len()]>,
}

impl Plate {
    /// Creates a plate.
    ///
    /// # Errors
    /// [`PlateError`] for the first fault.
    pub fn new(spec: PlateSpec) -> Result<Self, PlateError> {
        spec::check(&spec)?;
        Ok(Self { spec, computed: Arc::default() })
    }

    /// Creates a plate with simply supported edges.
    ///
    /// # Errors
    /// As [`Plate::new`].
    pub fn simply_supported(
        (length_m, width_m): (f64, f64),
        thickness_m: f64,
        youngs_modulus_pa: f64,
        poissons_ratio: f64,
    ) -> Result<Self, PlateError> {
        Self::new(PlateSpec {
            length_m,
            width_m,
            thickness_m,
            youngs_modulus_pa,
            poissons_ratio,
            edges: Edges::all(Edge::Simple),
            supports: Vec::new(),
            elements: PlateSpec::DEFAULT_ELEMENTS,
        })
    }

    /// Sets the number of elements along the longer side.
    ///
    /// # Errors
    /// As [`Plate::new`].
    pub fn with_elements(self, elements: usize) -> Result<Self, PlateError> {
        Self::new(PlateSpec { elements, ..self.spec })
    }

    /// The description.
    pub fn spec(&self) -> &PlateSpec {
        &self.spec
    }

    /// Upper bound of the memory.
    pub fn estimated_bytes(&self) -> f64 {
        spec::estimated_bytes(&self.spec)
    }

    /// Factors the equations, unless cached.
    ///
    /// # Errors
    /// [`PlateError::Unsolvable`] when singular to working precision, or too large.
    pub fn solve(&self) -> Result<(), PlateError> {
        self.solved(Watch::NONE).map(|_| ()).map_err(|reason| PlateError::Unsolvable { reason })
    }

    /// Stored entries of the factor.
    ///
    /// # Errors
    /// As [`Plate::solve`].
    pub fn factor_size(&self) -> Result<usize, PlateError> {
        let solved = self.solved(Watch::NONE);
        solved.map(PlateSolution::stored_numbers).map_err(|reason| PlateError::Unsolvable { reason })
    }

    /// Cancelled work is restarted by the next call.
    fn solved(&self, watch: Watch) -> Result<&PlateSolution, Unsolvable> {
        let PlateResults { solved, solving, .. } = &*self.computed;
        if solved.get().is_none() {
            let _alone = solving.lock().unwrap_or_else(PoisonError::into_inner);
            if solved.get().is_none() {
                let result = PlateSolution::new(&self.spec, watch);
                match result {
                    Err(stopped) if Cancelled::caused(&stopped) => return Err(Cancelled.into()),
                    result => drop(solved.set(result)),
                }
            }
        }
        match solved.get() {
            Some(result) => result.as_ref().map_err(|reason| *reason),
            None => Err(Cancelled.into()),
        }
    }
}

impl Surface for Plate {
    /// NaN when [`Plate::solve`] fails.
    fn influence_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_> {
        self.influence_functions(kind, &[sensor]).pop().unwrap_or_else(|| Arc::new(NotANumber))
    }

    fn influence_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn InfluenceFunction + '_>> {
        let functions = self.influence_functions_watched(kind, sensors, Watch::NONE);
        functions.unwrap_or_else(|Cancelled| not_a_number(sensors))
    }

    fn influence_functions_watched(
        &self,
        kind: SensorKind,
        sensors: &[Position],
        watch: Watch,
    ) -> Result<Vec<Arc<dyn InfluenceFunction + '_>>, Cancelled> {
        watch.round()?;
        let solved = match self.solved(watch) {
            Ok(solved) => solved,
            Err(Unsolvable::Cancelled(cancelled)) => return Err(cancelled),
            Err(_) => return Ok(not_a_number(sensors)),
        };
        let solve = |sensors: &[Position]| PlateInfluence::of_all(&self.spec, solved, kind, sensors, watch);
        let all = self.computed.influences.of_all(kind, sensors, solve)?.into_iter();
        Ok(all.map(|function| function as Arc<dyn InfluenceFunction>).collect())
    }

    fn response_functions(
        &self,
        kind: SensorKind,
        sensors: &[Position],
    ) -> Vec<Arc<dyn ResponseFunction + '_>> {
        proportional(self.influence_functions(kind, sensors))
    }

    fn response_functions_watched(
        &self,
        kind: SensorKind,
        sensors: &[Position],
        watch: Watch,
    ) -> Result<Vec<Arc<dyn ResponseFunction + '_>>, Cancelled> {
        Ok(proportional(self.influence_functions_watched(kind, sensors, watch)?))
    }

    /// `None` when [`Plate::solve`] fails.
    fn readings_by_contact(
        &self,
        sensors: &[(SensorKind, Position)],
    ) -> Option<Arc<dyn ReadingsByContact + '_>> {
        Some(Arc::new(PlateReadings::new(&self.spec, self.solved(Watch::NONE).ok()?, sensors)))
    }

    fn solution_cost(&self, sensors: usize, solving: Solving) -> Option<SolutionCost> {
        const PRODUCTS: f64 = 7e9;
        const FACTORED: f64 = 3e8;
        let sensors = sensors as f64;
        // Two sweeps through the factor; by contact also readings at 16 degrees of freedom per sensor.
        let sweeps = 2.0 * spec::estimated_factor_size(&self.spec);
        let (kept, multiply_adds) = match solving {
            Solving::BySensor => (PlateInfluence::bytes_of(&self.spec), sweeps),
            Solving::ByContact => (PlateReadings::BYTES_EACH, sweeps + 16.0 * sensors),
        };
        let memory_bytes = self.estimated_bytes() + sensors * kept;
        let seconds_once = self.estimated_bytes() / FACTORED;
        Some(SolutionCost { memory_bytes, seconds_once, seconds_each: multiply_adds / PRODUCTS })
    }

    fn check_solution_watched(&self, watch: Watch) -> Result<(), Unsolvable> {
        watch.round()?;
        self.solved(watch).map(|_| ())
    }

    fn is_supported_at(&self, position: Position) -> bool {
        spec::support_at(&self.spec, position).is_some()
    }

    fn force_supports(&self) -> Vec<Position> {
        let mut places: Vec<Position> = self.spec.supports.iter().map(|support| support.position).collect();
        places.sort_by(Position::cmp_by_x_then_y);
        places
    }

    fn insensitive_sensor(&self, kind: SensorKind, sensor: Position) -> Option<InsensitiveSensor> {
        spec::insensitive_sensor(&self.spec, kind, sensor)
    }

    /// On a coarse mesh, as the strain under a force at the sensor is singular.
    fn full_scale(&self, kind: SensorKind) -> f64 {
        self.computed.full_scales.get_or_init(|| full_scales(&self.spec))[kind as usize]
    }

    fn extent(&self) -> Extent {
        self.spec.extent()
    }
}

fn not_a_number<'a>(sensors: &[Position]) -> Vec<Arc<dyn InfluenceFunction + 'a>> {
    sensors.iter().map(|_| Arc::new(NotANumber) as Arc<dyn InfluenceFunction>).collect()
}

fn proportional<'a>(influences: Vec<Arc<dyn InfluenceFunction + 'a>>) -> Vec<Arc<dyn ResponseFunction + 'a>> {
    let influences = influences.into_iter();
    influences.map(|influence| Arc::new(Proportional(influence)) as Arc<dyn ResponseFunction>).collect()
}

impl PartialEq for Plate {
    fn eq(&self, other: &Self) -> bool {
        self.spec == other.spec
    }
}

impl fmt::Debug for Plate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Plate").field(&self.spec).finish()
    }
}

impl TryFrom<PlateSpec> for Plate {
    type Error = PlateError;

    fn try_from(spec: PlateSpec) -> Result<Self, PlateError> {
        Self::new(spec)
    }
}

impl From<Plate> for PlateSpec {
    fn from(plate: Plate) -> Self {
        plate.spec
    }
}

#[cfg(test)]
mod tests;
