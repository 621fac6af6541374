//! The limit: the Cramér–Rao bound of contact position and force for a surface, its layout and its noise.
//!
//! Sensor i reads y_i(a, W) plus independent Gaussian noise of variance σ_i² + q_i²/12. Here a is the contact
//! position, W the force, y_i the sensor's response function, σ_i its noise and q_i its resolution (quantisation as noise
//! of variance q²/12: Widrow and Kollár, *Quantization Noise*, 2008). On a surface that bends little y_i = W·f_i(a), with the
//! influence function f_i. For a known force on a line the bound is
//! 1/√(Σ_i (∂y_i/∂a/σ_i)²). An unknown force is estimated with the position, at the cost of part of that information.
//!
//! The bound ignores dead channels, and those that are saturated at the contact. It does not include gain and offset errors, which
//! calibration removes. It is valid for unbiased estimators and small errors. Where it nears the size of the surface, its value means
//! "blind" and no more. [`LimitWarning`] reports distant contacts with nearly equal readings.

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

/// Knowledge of the contact force: given, or estimated with the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Force {
    /// The force is given.
    Known,
    /// The force is estimated together with the position.
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

/// A surface with its active sensors and their noise.
#[derive(Clone)]
pub struct CramerRaoBound<'a> {
    extent: Extent,
    /// The mechanics; `None` for a surface without a model.
    model: Option<&'a dyn Surface>,
    channels: Vec<Channel>,
    responses: Responses<'a>,
    /// Norm of the whitened readings per newton, with every sensor at its full scale.
    full_scale: f64,
}

/// Share of the full scale below which readings, or their change over the length of the surface, are rounding errors.
const SILENT: f64 = 1e-9;

/// An active sensor.
#[derive(Clone)]
struct Channel {
    /// Number of the sensor in the layout, from 0.
    index: usize,
    kind: SensorKind,
    /// √(σ² + q²/12).
    sd: f64,
    range: Option<(f64, f64)>,
}

impl<'a> CramerRaoBound<'a> {
    /// The limit of a surface with the sensors of `layout`, except dead ones.
    ///
    /// For more than 1,500 sensors on a plate no influence functions are stored. Each contact is then solved for, as
    /// [`CramerRaoBound::prepare`] does for contacts all over the surface.
    ///
    /// # Errors
    /// [`LimitError::Noise`] for an active sensor with neither noise nor resolution, or when no sensor is active; [`LimitError::Surface`] when
    /// the equations of the surface have no balanced solution.
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Result<Self, LimitError> {
        Self::new_watched(surface, layout, Watch::NONE)
    }

    /// The limit as in [`CramerRaoBound::new`], watched during the solutions for the sensors.
    ///
    /// # Errors
    /// The errors of [`CramerRaoBound::new`], and [`LimitError::Cancelled`].
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

    /// The limit of a surface without a model. Each response is that of one channel over the standard deviation of its noise, both from a
    /// recording.
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

    /// Work and memory of the limit of a surface with the sensors of `layout`, all over it and at `others` further contacts.
    pub fn cost(surface: &dyn Surface, layout: &Layout, others: usize) -> LimitCost {
        let alive = layout.sensors().iter().filter(|sensor| !sensor.channel.dead).count();
        Responses::cost(surface, alive, Grid::over_surface(surface.extent()).positions.len() + others)
    }

    /// Solves in advance for contacts all over the surface, which curves and warnings use, and for `others`. Only for many sensors does this
    /// do any work.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
    pub fn prepare(&self, others: &[Position], watch: Watch) -> Result<(), Cancelled> {
        let positions = [&Grid::over_surface(self.extent).positions[..], others].concat();
        self.responses.prepare(&positions, watch)
    }

    /// The extent of the surface.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Number of active sensors.
    pub fn alive(&self) -> usize {
        self.channels.len()
    }

    /// The bound at a contact; `None` where the readings do not determine the position: the Fisher information is singular to rounding.
    /// Reasons are a zero force, the lack of a sensitive sensor, or a change of position that a change of force cancels. Over a
    /// support the readings respond to no force, so an unknown force is undetermined there, and the position with it.
    pub fn bound_at(&self, contact: Contact, force: Force) -> Option<Bound> {
        let Columns { force: by_force, along, across } = self.derivatives(contact);
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

    /// Noise-free reading of each active sensor at a contact, over the standard deviation of its noise.
    pub fn whitened_reading(&self, contact: Contact) -> Vec<f64> {
        self.whitened_readings(&[contact.position], contact.force_n).pop().unwrap_or_default()
    }

    /// Whitened readings at several contacts of one force, which are solved for together.
    fn whitened_readings(&self, positions: &[Position], force_n: f64) -> Vec<Vec<f64>> {
        let mut each = self.responses.readings(positions, force_n);
        for readings in &mut each {
            for (reading, channel) in readings.iter_mut().zip(&self.channels) {
                *reading = channel.held(*reading) / channel.sd;
            }
        }
        each
    }

    /// Index of each active sensor in the layout, from 0, and the standard deviation of its noise, which whitens its readings.
    pub fn noise_sds(&self) -> Vec<(usize, f64)> {
        self.channels.iter().map(|channel| (channel.index, channel.sd)).collect()
    }

    /// Norm of the whitened readings: the signal of a touch in standard deviations of the noise.
    pub fn signal_to_noise(&self, contact: Contact) -> f64 {
        norm(&self.whitened_reading(contact))
    }

    /// Derivatives of the whitened readings; 0 for saturated channels.
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
        columns.across = self.extent.if_plane(across);
        columns
    }
}

impl Channel {
    /// A reading, clamped to the range.
    fn held(&self, reading: f64) -> f64 {
        self.range.map_or(reading, |(low, high)| reading.max(low).min(high))
    }
}

/// Derivatives of the whitened readings with respect to force, x and, on a plane, y.
#[derive(Default)]
struct Columns {
    force: Vec<f64>,
    along: Vec<f64>,
    across: Option<Vec<f64>>,
}

/// Error of a bench without a bound.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// The surface has no model.
    #[error("a measured surface has no model, and the limit needs influence functions")]
    NoModel,
    /// The noise is singular, and the limit would be 0; or no sensor is active.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// The contact force is not a positive, finite number.
    #[error("the contact force is {force_n} N; it must be greater than 0 and finite")]
    Force {
        /// The force, in newtons.
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
    /// The equations of the surface have no balanced solution.
    #[error("the equations of the surface could not be solved: {0}")]
    Surface(#[from] Unsolvable),
    /// The watch stopped the work.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Refuses a force that is not positive and finite.
fn check_force(force_n: f64) -> Result<(), LimitError> {
    if force_n > 0.0 && force_n.is_finite() { Ok(()) } else { Err(LimitError::Force { force_n }) }
}

#[cfg(test)]
mod tests;
