//! The simply supported beam in closed form, after Euler and Bernoulli.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Extent, InfluenceFunction, InsensitiveSensor, Strip, Surface};
use crate::contact::Position;
use crate::sensing::SensorKind;
use palpate_numerics::OutOfRange;

/// A straight beam of rectangular section on two simple supports, at x = 0 and x = l.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Strip", into = "Strip")]
pub struct Beam(Strip);

/// Error of a beam that cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BeamError {
    /// A dimension is not a positive, finite number.
    #[error(transparent)]
    NotPositive(#[from] OutOfRange),
    /// The compliance l³/(48·E·I) is not a positive, finite number.
    #[error(
        "a beam's compliance at mid-span is {compliance_m_per_n} m/N; it must be greater than 0 and finite"
    )]
    Compliance {
        /// Mid-span deflection per newton at mid-span, in m/N.
        compliance_m_per_n: f64,
    },
}

impl Beam {
    /// A beam of this length, width and thickness, in metres, and Young's modulus, in pascals.
    ///
    /// # Errors
    /// [`BeamError`] for a number that is not positive and finite, or a compliance that is not.
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

    /// Length l between the supports, in metres.
    pub fn length_m(&self) -> f64 {
        self.0.length_m
    }

    /// Width of the section, in metres.
    pub fn width_m(&self) -> f64 {
        self.0.width_m
    }

    /// Thickness t of the section, in metres.
    pub fn thickness_m(&self) -> f64 {
        self.0.thickness_m
    }

    /// Young's modulus E, in pascals.
    pub fn youngs_modulus_pa(&self) -> f64 {
        self.0.youngs_modulus_pa
    }

    /// Bending stiffness E·I in N·m², with I = width·t³/12.
    pub fn bending_stiffness(&self) -> f64 {
        self.0.bending_stiffness()
    }

    /// Deflection y(x) per newton at a, in m/N, positive upward: −b·x·(l² − b² − x²)/(6·E·I·l) for x ≤ a, and the mirror image
    /// for x > a (the founding paper's eq. 1).
    fn deflection(&self, span: Span) -> f64 {
        let Span { l, b, x, .. } = span;
        -b * x * (l * l - b * b - x * x) / (6.0 * self.bending_stiffness() * l)
    }

    /// Slope y'(x) per newton at a, in rad/N: −b·(l² − b² − 3·x²)/(6·E·I·l) for x ≤ a, and the mirror image with opposite sign
    /// for x > a.
    fn slope(&self, span: Span) -> f64 {
        let Span { l, b, x, direction } = span;
        -direction * b * (l * l - b * b - 3.0 * x * x) / (6.0 * self.bending_stiffness() * l)
    }

    /// Strain on the lower face per newton at a, positive in tension: (t/2)·y''(x) = (t/2)·b·x/(E·I·l) for x ≤ a,
    /// and the mirror image for x > a. A downward force stretches the lower face, so the strain is never negative.
    fn strain(&self, span: Span) -> f64 {
        let Span { l, b, x, .. } = span;
        0.5 * self.0.thickness_m * b * x / (self.bending_stiffness() * l)
    }

    /// Force of the support at `sensor` on the beam per newton at a, positive upward: b/l on the left, a/l on the
    /// right; 0 without a support.
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

/// Place of the sensor, relative to the support on its side of the force.
///
/// l: length; x: distance of the sensor from that support; b: distance of the force from the other one, all in metres;
/// direction: 1 from the left support, −1 from the right one.
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

/// The influence function of one sensor on a [`Beam`].
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

    /// Closed forms. Deflection: the slope with sensor and force exchanged (Maxwell's reciprocity,
    /// y(x; a) = y(a; x)). Slope: (l² − 3·b² − 3·x²)/(6·E·I·l) on either side. Strain: −(t/2)·x/(E·I·l)
    /// and the mirror image with opposite sign, with the kink over the sensor. Reactions: −1/l and 1/l.
    fn gradient(&self, contact: Position) -> [f64; 2] {
        let Self { beam, kind, sensor_m } = *self;
        let (l, stiffness) = (beam.0.length_m, beam.bending_stiffness());
        let Span { b, x, direction, .. } = Span::new(l, sensor_m, contact.x_m);
        let along = match kind {
            SensorKind::Deflection => beam.slope(Span::new(l, contact.x_m, sensor_m)),
            SensorKind::Slope => (l * l - 3.0 * b * b - 3.0 * x * x) / (6.0 * stiffness * l),
            SensorKind::Strain => -direction * 0.5 * beam.0.thickness_m * x / (stiffness * l),
            // A reaction is linear in the contact's position.
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

    /// At the supports deflection and bending moment are 0.
    fn insensitive_sensor(&self, kind: SensorKind, sensor: Position) -> Option<InsensitiveSensor> {
        let held =
            matches!(kind, SensorKind::Deflection | SensorKind::Strain) && self.is_supported_at(sensor);
        held.then_some(InsensitiveSensor::Held { kind })
    }

    /// Deflection l³/(48·E·I) at mid-span; slope l²/(9·√3·E·I) over a support, for a force l/√3 from the other one;
    /// strain t·l/(8·E·I) at mid-span; reaction 1 under the force.
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
