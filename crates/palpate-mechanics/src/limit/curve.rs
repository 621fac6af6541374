//! The limit over a whole surface.

use super::zone::Grid;
use super::{Bound, CramerRaoBound, Force, LimitError, check_force};
use crate::contact::{Contact, Position};
use crate::surface::Extent;
use palpate_numerics::{mean, percentile};

/// The limit at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitPoint {
    /// Position of the contact.
    pub position: Position,
    /// The bound there; `None` where the readings do not determine the position.
    pub bound: Option<Bound>,
}

/// The limit at many positions, for one force.
///
/// ```
/// use palpate_mechanics::limit::{CramerRaoBound, Force, LimitCurve, limit_warnings};
/// use palpate_mechanics::sensing::{Layout, SensorKind};
/// use palpate_mechanics::surface::Beam;
/// use palpate_numerics::watch::Watch;
///
/// let beam = Beam::new(0.4, 0.04, 1.2e-3, 200e9)?;
/// let mut layout = Layout::even(SensorKind::Deflection, 8, 0.4);
/// layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 5e-6))?;
/// let bound = CramerRaoBound::new(&beam, &layout)?;
/// let curve = LimitCurve::over_surface(&bound, 3.0, Force::Known)?;
/// assert_eq!(curve.points.len(), 399);
/// let summary = curve.summary().unwrap();
/// assert!(summary.best.1 < summary.median_m && summary.median_m < summary.worst.1);
/// let warnings = limit_warnings(&bound, 3.0, Force::Known, Watch::NONE)?;
/// assert!(warnings[0].to_string().starts_with("ambiguous at 0–1.6 mm with known force"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LimitCurve {
    /// Extent of the surface.
    pub extent: Extent,
    /// The contact force, in newtons.
    pub force_n: f64,
    /// Knowledge of the force.
    pub force: Force,
    /// Positions and bounds; on a line from left to right.
    pub points: Vec<LimitPoint>,
}

/// Summary of a curve, over the positions with a bound. Limits are standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitSummary {
    /// Mean limit, in metres.
    pub mean_m: f64,
    /// Median limit, in metres.
    pub median_m: f64,
    /// Mean over the positions of the mean error of an estimator at the limit (σ·√(2/π) on a line), in metres.
    pub mean_error_m: f64,
    /// Position and value of the smallest limit, in metres.
    pub best: (Position, f64),
    /// Position and value of the largest limit, in metres.
    pub worst: (Position, f64),
    /// Number of positions without a bound.
    pub without: usize,
}

/// Positions on a surface `every_m` (metres) apart, the first of them `every_m` from the edge.
///
/// # Errors
/// [`LimitError::Positions`] for no position or more than 100,000.
pub fn positions_with_spacing(extent: Extent, every_m: f64) -> Result<Vec<Position>, LimitError> {
    Ok(Grid::with_spacing(extent, every_m)?.positions)
}

impl LimitCurve {
    /// The limit all over the surface: on a line at 399 positions, 1/400 of the length apart.
    ///
    /// # Errors
    /// [`LimitError::Force`] for a force that is not positive and finite.
    pub fn over_surface(limit: &CramerRaoBound, force_n: f64, force: Force) -> Result<Self, LimitError> {
        Self::at_positions(limit, force_n, force, &Grid::over_surface(limit.extent).positions)
    }

    /// The limit at the given positions, which must be on the surface.
    ///
    /// # Errors
    /// [`LimitError::Force`] for a force that is not positive and finite.
    pub fn at_positions(
        limit: &CramerRaoBound,
        force_n: f64,
        force: Force,
        positions: &[Position],
    ) -> Result<Self, LimitError> {
        check_force(force_n)?;
        let point =
            |&position| LimitPoint { position, bound: limit.bound_at(Contact { position, force_n }, force) };
        Ok(Self { extent: limit.extent, force_n, force, points: positions.iter().map(point).collect() })
    }

    /// `figure` of the bound by x in metres, from left to right; on a plane the mean across the width. NaN where no bound exists.
    pub fn by_x(&self, figure: impl Fn(&Bound) -> f64) -> Vec<(f64, f64)> {
        let mut points: Vec<&LimitPoint> = self.points.iter().collect();
        points.sort_by(|a, b| a.position.x_m.total_cmp(&b.position.x_m));
        let columns = points.chunk_by(|a, b| a.position.x_m == b.position.x_m);
        let mean = |column: &[&LimitPoint]| {
            let figures = column.iter().map(|point| point.bound.as_ref().map_or(f64::NAN, &figure));
            figures.sum::<f64>() / column.len() as f64
        };
        columns.map(|column| (column[0].position.x_m, mean(column))).collect()
    }

    /// The positions without a bound as text: "1 of 399 positions, 0.3 %, at 12000 mm"; `None` where all have one.
    pub fn not_told_in_words(&self) -> Option<String> {
        const MOST_NAMED: usize = 3;
        let places: Vec<String> = self
            .points
            .iter()
            .filter(|point| point.bound.is_none())
            .map(|point| self.extent.place_in_words(point.position))
            .collect();
        let (count, of) = (places.len(), self.points.len());
        let share = format!("{count} of {of} positions, {:.1} %", 100.0 * count as f64 / of as f64);
        match count {
            0 => None,
            1..=MOST_NAMED => Some(format!("{share}, at {}", places.join(", "))),
            _ => Some(share),
        }
    }

    /// Summary of the curve; `None` where no position has a bound.
    pub fn summary(&self) -> Option<LimitSummary> {
        let mut bounds: Vec<(Position, Bound)> =
            self.points.iter().filter_map(|point| Some((point.position, point.bound?))).collect();
        bounds.sort_by(|(_, a), (_, b)| a.sd_position_m.total_cmp(&b.sd_position_m));
        let limit = |&(position, bound): &(Position, Bound)| (position, bound.sd_position_m);
        let mean = |of: fn(&Bound) -> f64| mean(bounds.iter().map(|(_, bound)| of(bound)));
        let sds_m: Vec<f64> = bounds.iter().map(|(_, bound)| bound.sd_position_m).collect();
        Some(LimitSummary {
            mean_m: mean(|bound| bound.sd_position_m),
            median_m: percentile(&sds_m, 50.0)?,
            mean_error_m: mean(Bound::mean_error_m),
            best: bounds.first().map(limit)?,
            worst: bounds.last().map(limit)?,
            without: self.points.len() - bounds.len(),
        })
    }
}
