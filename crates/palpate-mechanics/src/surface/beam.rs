//! The simply supported Euler–Bernoulli beam in closed form (deflection: founding paper, eq. 1).

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Extent, InfluenceFunction, InsensitiveSensor, Strip, Surface};
use crate::contact::Position;
use crate::sensing::SensorKind;
use palpate_numerics::OutOfRange;

/// A rectangular beam on supports at x = 0 and x = l.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Strip", into = "Strip")]
pub struct Beam(Strip);

/// Error of an invalid beam.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BeamError {
    /// A dimension is not positive and finite.
    #[error(transparent)]
    NotPositive(#[from] OutOfRange),
    /// l³/(48·E·I) is not positive and finite.
    #[error(
        "a beam's compliance at mid-span is {compliance_m_per_n} m/N; it must be greater than 0 and finite"
    )]
    Compliance {
        /// Compliance at mid-span.
        compliance_m_per_n: f64,
    },
}

impl Beam {
    /// Creates a beam.
    ///
    /// # Errors
    /// [`BeamError`].
    ///
    /// ```
    /// use palpate_mechanics::surface::Beam;
    /// use palpate_mechanics::units::{gpa, mm};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// assert!((beam.bending_stiffness() - 1.152).abs() < 1e-12); // N·m²
    /// # Ok::<(), palpate_mechanics::surface::BeamError>(())
    /// ```
    pub fn new(
        length_m: f64,
        width_m: f64,
        thickness_m: f64,
        youngs_modulus_pa: f64,
    ) -> Result<Self, BeamError> {
        Self::try_from(Strip { length_m, width_m, thickness_m, youngs_modulus_pa })
    }

    /// Length l.
    pub fn length_m(&self) -> f64 {
        self.0.length_m
    }

    /// Width.
    pub fn width_m(&self) -> f64 {
        self.0.width_m
    }

    /// Thickness t.
    pub fn thickness_m(&self) -> f64 {
        self.0.thickness_m
    }

    /// Young's modulus E.
    pub fn youngs_modulus_pa(&self) -> f64 {
        self.0.youngs_modulus_pa
    }

    /// E·I in N·m², I = width·t³/12.
    pub fn bending_stiffness(&self) -> f64 {
        self.0.bending_stiffness()
    }

    fn deflection(&self, span: Span) -> f64 {
        let Span { l, b, x, .. } = span;
        -b * x * (l * l - b * b - x * x) / (6.0 * self.bending_stiffness() * l)
    }

    fn slope(&self, span: Span) -> f64 {
        let Span { l, b, x, direction } = span;
        -direction * b * (l * l - b * b - 3.0 * x * x) / (6.0 * self.bending_stiffness() * l)
    }

    fn strain(&self, span: Span) -> f64 {
        let Span { l, b, x, .. } = span;
        0.5 * self.0.thickness_m * b * x / (self.bending_stiffness() * l)
    }

    fn reaction(&self, sensor_m: f64, contact_m: f64) -> f64 {
        let l = self.0.length_m;
        let near = |support_m: f64| (sensor_m - support_m).abs() <= 1e-9 * l;
        if near(0.0) {
            (l - contact_m) / l
        } else if near(l) {
            contact_m / l
        } else {
            0.0
        }
    }
}

impl TryFrom<Strip> for Beam {
    type Error = BeamError;

    fn try_from(strip: Strip) -> Result<Self, BeamError> {
        strip.check([
            "a beam's length",
            "a beam's width",
            "a beam's thickness",
            "a beam's youngs_modulus",
        ])?;
        let beam = Self(strip);
        let compliance_m_per_n = beam.full_scale(SensorKind::Deflection);
        if compliance_m_per_n > 0.0 && compliance_m_per_n.is_finite() {
            Ok(beam)
        } else {
            Err(BeamError::Compliance { compliance_m_per_n })
        }
    }
}

impl From<Beam> for Strip {
    fn from(beam: Beam) -> Self {
        beam.0
    }
}

/// Length l; distance x of the sensor from the support on its side of the force; distance b of the force from
/// the other support; direction 1 from the left, −1 from the right.
#[derive(Clone, Copy)]
struct Span {
    l: f64,
    b: f64,
    x: f64,
    direction: f64,
}

impl Span {
    fn new(l: f64, sensor_m: f64, contact_m: f64) -> Self {
        if sensor_m <= contact_m {
            Self { l, b: l - contact_m, x: sensor_m, direction: 1.0 }
        } else {
            Self { l, b: contact_m, x: l - sensor_m, direction: -1.0 }
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct BeamInfluence<'a> {
    beam: &'a Beam,
    kind: SensorKind,
    sensor_m: f64,
}

impl InfluenceFunction for BeamInfluence<'_> {
    fn at(&self, contact: Position) -> f64 {
        let Self { beam, kind, sensor_m } = *self;
        let span = Span::new(beam.0.length_m, sensor_m, contact.x_m);
        match kind {
            SensorKind::Deflection => beam.deflection(span),
            SensorKind::Slope => beam.slope(span),
            SensorKind::Strain => beam.strain(span),
            SensorKind::Reaction => beam.reaction(sensor_m, contact.x_m),
            SensorKind::Raw => 0.0,
        }
    }

    /// Deflection: slope with sensor and force exchanged (Maxwell's reciprocity).
    fn gradient(&self, contact: Position) -> [f64; 2] {
        let Self { beam, kind, sensor_m } = *self;
        let (l, stiffness) = (beam.0.length_m, beam.bending_stiffness());
        let Span { b, x, direction, .. } = Span::new(l, sensor_m, contact.x_m);
        let along = match kind {
            SensorKind::Deflection => beam.slope(Span::new(l, contact.x_m, sensor_m)),
            SensorKind::Slope => (l * l - 3.0 * b * b - 3.0 * x * x) / (6.0 * stiffness * l),
            SensorKind::Strain => -direction * 0.5 * beam.0.thickness_m * x / (stiffness * l),
            // A reaction is linear in the contact position.
            SensorKind::Reaction => (beam.reaction(sensor_m, l) - beam.reaction(sensor_m, 0.0)) / l,
            SensorKind::Raw => 0.0,
        };
        [along, 0.0]
    }
}

impl Surface for Beam {
    fn influence_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_> {
        Arc::new(BeamInfluence { beam: self, kind, sensor_m: sensor.x_m })
    }

    fn influence(&self, kind: SensorKind, sensor: Position, contact: Position) -> f64 {
        BeamInfluence { beam: self, kind, sensor_m: sensor.x_m }.at(contact)
    }

    fn is_supported_at(&self, position: Position) -> bool {
        let l = self.0.length_m;
        [0.0, l].iter().any(|support_m| (position.x_m - support_m).abs() <= 1e-9 * l)
    }

    fn force_supports(&self) -> Vec<Position> {
        [0.0, self.0.length_m].map(Position::along).to_vec()
    }

    fn insensitive_sensor(&self, kind: SensorKind, sensor: Position) -> Option<InsensitiveSensor> {
        let held =
            matches!(kind, SensorKind::Deflection | SensorKind::Strain) && self.is_supported_at(sensor);
        held.then_some(InsensitiveSensor::Held { kind })
    }

    /// Deflection and strain at mid-span; slope over a support, for a force at l/√3 from the other.
    fn full_scale(&self, kind: SensorKind) -> f64 {
        let (l, stiffness) = (self.0.length_m, self.bending_stiffness());
        match kind {
            SensorKind::Deflection => l.powi(3) / (48.0 * stiffness),
            SensorKind::Slope => l * l / (9.0 * 3f64.sqrt() * stiffness),
            SensorKind::Strain => self.0.thickness_m * l / (8.0 * stiffness),
            SensorKind::Reaction => 1.0,
            SensorKind::Raw => 0.0,
        }
    }

    fn extent(&self) -> Extent {
        Extent::checked_line(self.length_m())
    }
}
