//! The limit over a surface.

use super::zone::Grid;
use super::{Bound, CramerRaoBound, Force, LimitError, check_force};
use crate::contact::{Contact, Position};
use crate::surface::Extent;
use palpate_numerics::{mean, percentile};

/// The limit at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitPoint {
    /// Contact position.
    pub position: Position,
    /// Bound; `None` if undetermined.
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
    /// Contact force.
    pub force_n: f64,
    /// Knowledge of the force.
    pub force: Force,
    /// Positions and bounds.
    pub points: Vec<LimitPoint>,
}

/// Summary over the positions with a bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitSummary {
    /// Mean limit.
    pub mean_m: f64,
    /// Median limit.
    pub median_m: f64,
    /// Mean of [`Bound::mean_error_m`].
    pub mean_error_m: f64,
    /// Smallest limit.
    pub best: (Position, f64),
    /// Largest limit.
    pub worst: (Position, f64),
    /// Number of positions without a bound.
    pub unidentifiable: usize,
}

/// Returns positions with a spacing, also from the edge.
///
/// # Errors
/// [`LimitError::Positions`] for none or more than 100,000.
pub fn positions_with_spacing(extent: Extent, every_m: f64) -> Result<Vec<Position>, LimitError> {
    Ok(Grid::with_spacing(extent, every_m)?.positions)
}

impl LimitCurve {
    /// Computes the limit over the surface, on a line at 1/400 of the length apart.
    ///
    /// # Errors
    /// [`LimitError::Force`].
    pub fn over_surface(limit: &CramerRaoBound, force_n: f64, force: Force) -> Result<Self, LimitError> {
        Self::at_positions(limit, force_n, force, &Grid::over_surface(limit.extent).positions)
    }

    /// Computes the limit at given positions.
    ///
    /// # Errors
    /// [`LimitError::Force`].
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

    /// x in metres and `figure` of the bound, ascending; on a plane the mean across. NaN without a bound.
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

    /// Formats positions without a bound: "1 of 399 positions, 0.3 %, at 12000 mm".
    pub fn unidentifiable_text(&self) -> Option<String> {
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

    /// Summarises; `None` without a bound.
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
            unidentifiable: self.points.len() - bounds.len(),
        })
    }
}
