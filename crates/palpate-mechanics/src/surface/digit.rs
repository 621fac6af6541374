//! The flexible digit, a cantilever finger with strain gauges, after Ma et al.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{
    Elastica, Extent, ForceDirection, InfluenceFunction, ResponseFunction, ResponseGradient, Strip, Surface,
};
use crate::contact::{Contact, Position};
use crate::sensing::SensorKind;
use palpate_numerics::OutOfRange;

/// A rectangular finger, clamped at x = 0.
///
/// Influence functions are for small forces, response functions those of the [`Elastica`]. Positions are
/// along the bent finger.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Finger", into = "Finger")]
pub struct Digit(Finger);

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Finger {
    #[serde(flatten)]
    strip: Strip,
    direction: ForceDirection,
}

/// Error of an invalid digit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DigitError {
    /// A dimension is not positive and finite.
    #[error(transparent)]
    NotPositive(#[from] OutOfRange),
    /// E·I/l² is not positive and finite.
    #[error("a digit's characteristic force E·I/l² is {force_n} N; it must be greater than 0 and finite")]
    Stiffness {
        /// The value.
        force_n: f64,
    },
}

impl Digit {
    /// Largest load F·s²/(E·I) in searches, as in the tables of Bisshopp and Drucker.
    pub const MOST_LOAD: f64 = 10.0;

    /// Creates a digit with normal forces.
    ///
    /// # Errors
    /// [`DigitError`].
    ///
    /// ```
    /// use palpate_mechanics::surface::Digit;
    /// use palpate_mechanics::units::{gpa, mm};
    ///
    /// let digit = Digit::new(mm(120.0), mm(10.0), mm(0.5), gpa(200.0))?;
    /// assert!((digit.bending_stiffness() - 0.0208).abs() < 1e-4); // N·m²
    /// # Ok::<(), palpate_mechanics::surface::DigitError>(())
    /// ```
    pub fn new(
        length_m: f64,
        width_m: f64,
        thickness_m: f64,
        youngs_modulus_pa: f64,
    ) -> Result<Self, DigitError> {
        let strip = Strip { length_m, width_m, thickness_m, youngs_modulus_pa };
        Self::try_from(Finger { strip, direction: ForceDirection::Normal })
    }

    /// Sets the direction of forces.
    #[must_use]
    pub fn with_direction(self, direction: ForceDirection) -> Self {
        Self(Finger { direction, ..self.0 })
    }

    /// Direction of forces.
    pub fn direction(&self) -> ForceDirection {
        self.0.direction
    }

    /// Length l.
    pub fn length_m(&self) -> f64 {
        self.0.strip.length_m
    }

    /// Width.
    pub fn width_m(&self) -> f64 {
        self.0.strip.width_m
    }

    /// Thickness t.
    pub fn thickness_m(&self) -> f64 {
        self.0.strip.thickness_m
    }

    /// Young's modulus E.
    pub fn youngs_modulus_pa(&self) -> f64 {
        self.0.strip.youngs_modulus_pa
    }

    /// E·I in N·m², I = width·t³/12.
    pub fn bending_stiffness(&self) -> f64 {
        self.0.strip.bending_stiffness()
    }

    /// E·I/l²; up to a tenth of it the finger is linear within 1 %.
    pub fn characteristic_force_n(&self) -> f64 {
        self.bending_stiffness() / (self.length_m() * self.length_m())
    }

    /// Returns the shape under `contact`.
    pub fn shape(&self, contact: Contact) -> Elastica {
        Elastica::new(self.direction(), self.bending_stiffness(), contact.position.x_m, contact.force_n)
    }

    /// −t/2, for the lower face.
    pub fn strain_per_curvature_m(&self) -> f64 {
        -0.5 * self.thickness_m()
    }
}

impl TryFrom<Finger> for Digit {
    type Error = DigitError;

    fn try_from(finger: Finger) -> Result<Self, DigitError> {
        finger.strip.check([
            "a digit's length",
            "a digit's width",
            "a digit's thickness",
            "a digit's youngs_modulus",
        ])?;
        let digit = Self(finger);
        let force_n = digit.characteristic_force_n();
        if force_n > 0.0 && force_n.is_finite() && (1.0 / force_n).is_finite() {
            Ok(digit)
        } else {
            Err(DigitError::Stiffness { force_n })
        }
    }
}

impl From<Digit> for Finger {
    fn from(digit: Digit) -> Self {
        digit.0
    }
}

/// A gauge; 0 for another kind.
#[derive(Clone, Copy, Debug)]
struct Gauge<'a> {
    digit: &'a Digit,
    strain_per_curvature_m: f64,
    at_m: f64,
}

/// Small forces.
impl InfluenceFunction for Gauge<'_> {
    fn at(&self, contact: Position) -> f64 {
        let lever_m = (contact.x_m - self.at_m).max(0.0);
        self.strain_per_curvature_m * lever_m / self.digit.bending_stiffness()
    }

    fn gradient(&self, contact: Position) -> [f64; 2] {
        let seen = if contact.x_m >= self.at_m { 1.0 } else { 0.0 };
        [self.strain_per_curvature_m * seen / self.digit.bending_stiffness(), 0.0]
    }
}

impl ResponseFunction for Gauge<'_> {
    fn at(&self, contact: Contact) -> f64 {
        self.strain_per_curvature_m * self.digit.shape(contact).curvature(self.at_m)
    }

    fn gradient(&self, contact: Contact) -> ResponseGradient {
        let [along, force] = self.digit.shape(contact).curvature_gradient(self.at_m);
        let scale = self.strain_per_curvature_m;
        ResponseGradient { position: [scale * along, 0.0], force: scale * force }
    }
}

impl Digit {
    fn gauge(&self, kind: SensorKind, sensor: Position) -> Gauge<'_> {
        let is_gauge = kind == SensorKind::Strain;
        let strain_per_curvature_m = if is_gauge { self.strain_per_curvature_m() } else { 0.0 };
        Gauge { digit: self, strain_per_curvature_m, at_m: sensor.x_m }
    }
}

impl Surface for Digit {
    fn influence_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_> {
        Arc::new(self.gauge(kind, sensor))
    }

    fn response_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn ResponseFunction + '_> {
        Arc::new(self.gauge(kind, sensor))
    }

    fn is_supported_at(&self, _: Position) -> bool {
        false
    }

    /// Strain at the clamp for a force at the tip.
    fn full_scale(&self, kind: SensorKind) -> f64 {
        match kind {
            SensorKind::Strain => 0.5 * self.thickness_m() * self.length_m() / self.bending_stiffness(),
            _ => 0.0,
        }
    }

    fn extent(&self) -> Extent {
        Extent::checked_line(self.length_m())
    }
}

#[cfg(test)]
mod tests;
