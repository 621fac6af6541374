//! The limit: the Cramér–Rao bound of contact position and force for a surface, its layout and its noise.
//!
//! Sensor i reads y_i(a, W) plus independent Gaussian noise of variance σ_i² + q_i²/12, where a is the contact
//! position, W its force, y_i the sensor's response function (W·f_i(a), with f_i its influence function, on a surface that
//! bends little), σ_i its noise and q_i its resolution (quantisation as noise
//! of variance q²/12: Widrow and Kollár, *Quantization Noise*, 2008). For a known force on a line the bound is
//! 1/√(Σ_i (∂y_i/∂a/σ_i)²); an unknown force is estimated along and costs part of that information.
//!
//! Left out: dead channels, and those that are saturated at the contact. Not counted: gain and offset errors, which
//! calibration removes. The bound is one of unbiased estimators and small errors; where it nears the size of the surface it
//! says "blind" and no more, and that two contacts far apart may read alike is for [`LimitWarning`] to say.

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

/// Knowledge of the contact force: given, or estimated along.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Force {
    /// Value.
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

/// A surface with the sensors that are alive and the noise of each.
#[derive(Clone)]
pub struct CramerRaoBound<'a> {
    extent: Extent,
    /// The mechanics, where there are some.
    model: Option<&'a dyn Surface>,
    channels: Vec<Channel>,
    responses: Responses<'a>,
    /// Length of the whitened reading of a newton where all sensors read their most.
    full_scale: f64,
}

/// Share of the full scale below which a contact, or a step of it by the length of the surface, changes readings by no more than rounding.
const SILENT: f64 = 1e-9;

/// A live sensor.
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
    /// The limit of a surface read by `layout`; dead channels are left out.
    ///
    /// Of more than 1,500 sensors on a plate no influence functions are kept: each contact is solved for, as [`CramerRaoBound::prepare`]
    /// does for those all over the surface.
    ///
    /// # Errors
    /// [`LimitError::Noise`] for a live sensor with neither noise nor resolution, or when none is alive; [`LimitError::Surface`] for a
    /// surface whose equations have no solution in balance.
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Result<Self, LimitError> {
        Self::new_watched(surface, layout, Watch::NONE)
    }

    /// The same, watched while sensors are solved for.
    ///
    /// # Errors
    /// Those of [`CramerRaoBound::new`], and [`LimitError::Cancelled`].
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

    /// The limit of a surface without a model, from what each of its channels reads over the standard deviation of its noise, as a
    /// recording told it.
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

    /// Work and memory of the limit of a surface read by `layout`, all over it and at so many other contacts.
    pub fn cost(surface: &dyn Surface, layout: &Layout, others: usize) -> LimitCost {
        let alive = layout.sensors().iter().filter(|sensor| !sensor.channel.dead).count();
        Responses::cost(surface, alive, Grid::over_surface(surface.extent()).positions.len() + others)
    }

    /// Solves for contacts all over the surface, which curves and warnings ask of, and for others, so that they need not be solved for
    /// one by one. Only of many sensors there is anything to do.
    ///
    /// # Errors
    /// [`Cancelled`] when the work is to stop.
    pub fn prepare(&self, others: &[Position], watch: Watch) -> Result<(), Cancelled> {
        let positions = [&Grid::over_surface(self.extent).positions[..], others].concat();
        self.responses.prepare(&positions, watch)
    }

    /// The surface that is touched.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Number of sensors that are alive.
    pub fn alive(&self) -> usize {
        self.channels.len()
    }

    /// The bound at a contact; `None` where the readings do not tell the position at all, which is where the Fisher
    /// information is singular to rounding: no force, no sensor that notices, or a change of position that a change of force undoes. Over a
    /// support nothing is read, however hard the touch: a force that is not known, and a position with it, is not told.
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

    /// Each live sensor's reading at a contact, without noise, over the standard deviation of its noise.
    pub fn whitened_reading(&self, contact: Contact) -> Vec<f64> {
        self.whitened_readings(&[contact.position], contact.force_n).pop().unwrap_or_default()
    }

    /// The same at several contacts of one force, which are solved for together.
    fn whitened_readings(&self, positions: &[Position], force_n: f64) -> Vec<Vec<f64>> {
        let mut each = self.responses.readings(positions, force_n);
        for readings in &mut each {
            for (reading, channel) in readings.iter_mut().zip(&self.channels) {
                *reading = channel.held(*reading) / channel.sd;
            }
        }
        each
    }

    /// Number of each live sensor in the layout, from 0, with the standard deviation of its noise by which readings are whitened.
    pub fn noise_sds(&self) -> Vec<(usize, f64)> {
        self.channels.iter().map(|channel| (channel.index, channel.sd)).collect()
    }

    /// Length of the whitened reading: how many standard deviations a touch stands out of the noise.
    pub fn signal_to_noise(&self, contact: Contact) -> f64 {
        norm(&self.whitened_reading(contact))
    }

    /// Derivatives of the whitened readings; those of saturated channels are 0.
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
    /// A reading, held at the ends of the range.
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

/// Error of a bench for which there is no bound.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// The surface has no model.
    #[error("a measured surface has no model, and without influence functions there is no limit to compute")]
    NoModel,
    /// The noise is singular, and the limit would be 0; or no sensor is alive.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// The contact force is not a positive, finite number.
    #[error("the contact force is {force_n} N; it must be greater than 0 and finite")]
    Force {
        /// The force, in newtons.
        force_n: f64,
    },
    /// The force is nowhere given.
    #[error("the limit depends on the contact force, and none is given")]
    NoForce,
    /// Too few or too many positions.
    #[error("the limit is asked for at {count} positions; there must be at least 1 and at most {most}")]
    Positions {
        /// Number that was asked for.
        count: f64,
        /// The most.
        most: usize,
    },
    /// The equations of the surface have no solution that is in balance.
    #[error("the equations of the surface could not be solved: {0}")]
    Surface(#[from] Unsolvable),
    /// Whoever watched the work stopped it.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
}

/// Refuses a force for which there is no limit.
fn check_force(force_n: f64) -> Result<(), LimitError> {
    if force_n > 0.0 && force_n.is_finite() { Ok(()) } else { Err(LimitError::Force { force_n }) }
}

#[cfg(test)]
mod tests;
