//! The Cramér–Rao bound of contact position and force, valid for unbiased estimators and small errors.
//!
//! A reading is y_i(a, W) at position a and force W, with noise of variance σ_i² + q_i²/12 (resolution q_i:
//! Widrow and Kollár, *Quantization Noise*, 2008). For small deflections y_i = W·f_i(a). On a line, for a
//! known force, the bound is 1/√(Σ_i (∂y_i/∂a/σ_i)²).
//!
//! Disabled and saturated channels are ignored.

mod bound;
mod curve;
mod responses;
mod twins;
mod warning;
mod zone;

pub use bound::Bound;
pub use curve::{LimitCurve, LimitPoint, LimitSummary, positions_with_spacing};
pub use responses::LimitCost;
pub use warning::{LimitWarning, limit_warnings};
pub use zone::Zone;

use std::sync::Arc;

use crate::contact::{Contact, Position};
use crate::sensing::{Layout, NoiseError, Sensor, SensorKind};
use crate::surface::{Extent, ResponseFunction, ResponseGradient, Surface, Unsolvable};
use bound::{inverse_information, norm};
use palpate_numerics::watch::{Cancelled, Watch};
use responses::Responses;
use zone::Grid;

/// Knowledge of the contact force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Force {
    /// Given.
    Known,
    /// Estimated with the position.
    Unknown,
}

impl Force {
    /// "known" or "unknown".
    pub const fn name(self) -> &'static str {
        match self {
            Self::Known => "known",
            Self::Unknown => "unknown",
        }
    }
}

/// The Cramér–Rao bound of a surface with sensors.
#[derive(Clone)]
pub struct CramerRaoBound<'a> {
    extent: Extent,
    model: Option<&'a dyn Surface>,
    channels: Vec<Channel>,
    responses: Responses<'a>,
    /// Norm of the whitened readings per newton at full scale.
    full_scale: f64,
}

/// Relative size of rounding errors of readings.
const SILENT: f64 = 1e-9;

#[derive(Clone)]
struct Channel {
    index: usize,
    kind: SensorKind,
    /// √(σ² + q²/12).
    sd: f64,
    range: Option<(f64, f64)>,
}

impl<'a> CramerRaoBound<'a> {
    /// Creates the bound for the active sensors of `layout`.
    ///
    /// On a plate with more than 1,500 sensors, contacts are solved one by one; see
    /// [`CramerRaoBound::prepare`].
    ///
    /// # Errors
    /// [`LimitError::Noise`] for singular noise or no active sensor; [`LimitError::Surface`] without a
    /// solution.
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Result<Self, LimitError> {
        Self::new_watched(surface, layout, Watch::NONE)
    }

    /// Creates the bound, watched.
    ///
    /// # Errors
    /// As [`CramerRaoBound::new`], and [`LimitError::Cancelled`].
    pub fn new_watched(surface: &'a dyn Surface, layout: &Layout, watch: Watch) -> Result<Self, LimitError> {
        let channel = |(index, (sensor, sd)): (usize, (&Sensor, Option<f64>))| {
            Some(Channel { index, kind: sensor.kind, sd: sd?, range: sensor.channel.range })
        };
        let sensors = layout.sensors().iter().zip(layout.reading_sds()?);
        let channels: Vec<Channel> = sensors.enumerate().filter_map(channel).collect();
        surface.check_solution_watched(watch)?;
        let scales: Vec<f64> =
            channels.iter().map(|channel| surface.full_scale(channel.kind) / channel.sd).collect();
        let responses = Responses::new(surface, layout, watch)?;
        Ok(Self {
            extent: surface.extent(),
            model: Some(surface),
            channels,
            responses,
            full_scale: norm(&scales),
        })
    }

    /// Creates the bound of whitened response functions.
    ///
    /// ```
    /// use palpate_mechanics::contact::{Contact, Position};
    /// use palpate_mechanics::limit::{CramerRaoBound, Force};
    /// use palpate_mechanics::surface::{Extent, InfluenceFunction, Proportional, ResponseFunction};
    /// use std::sync::Arc;
    ///
    /// /// A scale under the right end of a board 1 m long, and its noise of 0.01 N.
    /// struct Scale;
    ///
    /// impl InfluenceFunction for Scale {
    ///     fn at(&self, contact: Position) -> f64 {
    ///         contact.x_m / 0.01
    ///     }
    ///
    ///     fn gradient(&self, _contact: Position) -> [f64; 2] {
    ///         [1.0 / 0.01, 0.0]
    ///     }
    /// }
    ///
    /// let response: Arc<dyn ResponseFunction> = Arc::new(Proportional(Arc::new(Scale)));
    /// let bound = CramerRaoBound::of_responses(Extent::line(1.0)?, [response]);
    /// let contact = Contact { position: Position::along(0.3), force_n: 2.0 };
    /// let sd_m = bound.bound_at(contact, Force::Known).unwrap().sd_position_m;
    /// assert!((sd_m - 0.005).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of_responses(
        extent: Extent,
        whitened: impl IntoIterator<Item = Arc<dyn ResponseFunction + 'a>>,
    ) -> Self {
        let responses: Vec<_> = whitened.into_iter().collect();
        let channel = |index| Channel { index, kind: SensorKind::Raw, sd: 1.0, range: None };
        let channels = (0..responses.len()).map(channel).collect();
        let responses = Responses::BySensor(responses);
        let largest = responses.readings(&Grid::over_surface(extent).positions, 1.0);
        let full_scale = largest.iter().map(|readings| norm(readings)).fold(0.0, f64::max);
        Self { extent, model: None, channels, responses, full_scale }
    }

    /// Estimates the cost over a surface and at `others` further contacts.
    pub fn cost(surface: &dyn Surface, layout: &Layout, others: usize) -> LimitCost {
        let alive = layout.sensors().iter().filter(|sensor| !sensor.channel.disabled).count();
        Responses::cost(surface, alive, Grid::over_surface(surface.extent()).positions.len() + others)
    }

    /// Solves in advance for contacts over the surface and `others`.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn prepare(&self, others: &[Position], watch: Watch) -> Result<(), Cancelled> {
        let positions = [&Grid::over_surface(self.extent).positions[..], others].concat();
        self.responses.prepare(&positions, watch)
    }

    /// Extent of the surface.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Number of active sensors.
    pub fn enabled_count(&self) -> usize {
        self.channels.len()
    }

    /// Returns the bound at a contact; `None` for singular Fisher information, as over a support with an
    /// unknown force.
    pub fn bound_at(&self, contact: Contact, force: Force) -> Option<Bound> {
        let Columns { force: by_force, along, y: across } = self.derivatives(contact);
        let least = SILENT * self.full_scale;
        let is_silent =
            |by_place: &Vec<f64>| norm(by_place) * self.extent.length_m() <= least * contact.force_n;
        if force == Force::Unknown && norm(&by_force) <= least
            || is_silent(&along)
            || across.as_ref().is_some_and(is_silent)
        {
            return None;
        }
        match (force, across) {
            (Force::Known, None) => {
                let [[xx]] = inverse_information([along])?;
                Some(Bound::new([[xx, 0.0], [0.0, 0.0]], None))
            }
            (Force::Known, Some(across)) => Bound::of_columns([along, across]),
            (Force::Unknown, None) => {
                let [[ff, _], [_, xx]] = inverse_information([by_force, along])?;
                Some(Bound::new([[xx, 0.0], [0.0, 0.0]], Some(ff)))
            }
            (Force::Unknown, Some(across)) => {
                let covariance = inverse_information([by_force, along, across])?;
                let [[ff, ..], [_, xx, xy], [_, _, yy]] = covariance;
                Some(Bound::new([[xx, xy], [xy, yy]], Some(ff)))
            }
        }
    }

    /// Whitened, noise-free reading of the active sensors.
    pub fn whitened_reading(&self, contact: Contact) -> Vec<f64> {
        self.whitened_readings(&[contact.position], contact.force_n).pop().unwrap_or_default()
    }

    fn whitened_readings(&self, positions: &[Position], force_n: f64) -> Vec<Vec<f64>> {
        let mut each = self.responses.readings(positions, force_n);
        for readings in &mut each {
            for (reading, channel) in readings.iter_mut().zip(&self.channels) {
                *reading = channel.saturate(*reading) / channel.sd;
            }
        }
        each
    }

    /// Index and noise of each active sensor.
    pub fn noise_sds(&self) -> Vec<(usize, f64)> {
        self.channels.iter().map(|channel| (channel.index, channel.sd)).collect()
    }

    /// Norm of the whitened readings.
    pub fn signal_to_noise(&self, contact: Contact) -> f64 {
        norm(&self.whitened_reading(contact))
    }

    fn derivatives(&self, contact: Contact) -> Columns {
        let mut columns = Columns::default();
        let mut across = Vec::new();
        for (Channel { sd, range, .. }, (reading, gradient)) in
            self.channels.iter().zip(self.responses.gradients(contact))
        {
            let ResponseGradient { position: [along_x, along_y], force } = gradient;
            let free = range.is_none_or(|(low, high)| low < reading && reading < high);
            let weight = if free { 1.0 / sd } else { 0.0 };
            columns.force.push(weight * force);
            columns.along.push(weight * along_x);
            across.push(weight * along_y);
        }
        columns.y = self.extent.if_plane(across);
        columns
    }
}

impl Channel {
    fn saturate(&self, reading: f64) -> f64 {
        self.range.map_or(reading, |(low, high)| reading.max(low).min(high))
    }
}

/// Derivatives of the whitened readings.
#[derive(Default)]
struct Columns {
    force: Vec<f64>,
    along: Vec<f64>,
    y: Option<Vec<f64>>,
}

/// Error of a bench without a bound.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// The surface has no model.
    #[error("a measured surface has no model, and the limit needs influence functions")]
    NoModel,
    /// The noise is singular, or no sensor is active.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// The force is not positive and finite.
    #[error("the contact force is {force_n} N; it must be greater than 0 and finite")]
    Force {
        /// The force.
        force_n: f64,
    },
    /// No force is given.
    #[error("the limit depends on the contact force, and none is given")]
    NoForce,
    /// Too few or too many positions.
    #[error("the limit is requested at {count} positions; expected 1 to {most}")]
    Positions {
        /// Requested number.
        count: f64,
        /// Largest number.
        most: usize,
    },
    /// The surface has no solution.
    #[error("the equations of the surface could not be solved: {0}")]
    Surface(#[from] Unsolvable),
    /// The watch cancelled the work.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

fn check_force(force_n: f64) -> Result<(), LimitError> {
    if force_n > 0.0 && force_n.is_finite() { Ok(()) } else { Err(LimitError::Force { force_n }) }
}

#[cfg(test)]
mod tests;
