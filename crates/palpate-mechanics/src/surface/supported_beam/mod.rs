//! The exact Euler–Bernoulli beam on any supports, with steps of its section.
//!
//! The influence function of a sensor at s is the deflection under a disturbance at s (Betti, Maxwell):
//!
//! | sensor | disturbance |
//! |---|---|
//! | deflection y(s) | unit force downward |
//! | slope y'(s) | unit couple |
//! | strain (t/2)·y''(s) | kink −t/(2·E·I) |
//! | reaction at s | unit settlement upward |

mod spec;
mod structure;

pub use spec::{
    BeamPart, BeamSection, BeamSupport, BeamSupportKind, RigidMotion, SupportedBeamError, SupportedBeamSpec,
};

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Extent, InfluenceFunction, InsensitiveSensor, Surface};
use crate::contact::Position;
use crate::sensing::SensorKind;
use spec::SAME_PLACE;
use structure::{Disturbance, Element, Shape, Site, State, Structure, SupportCompliance};

/// Rounding error, relative to full scale.
const ROUNDING: f64 = 1e-12;

/// A beam on any supports.
///
/// Signs are those of [`Beam`](super::Beam). At a jump of the curvature a strain sensor is on the right side,
/// at the right end on the left.
///
/// ```
/// use palpate_mechanics::contact::Position;
/// use palpate_mechanics::sensing::SensorKind::Deflection;
/// use palpate_mechanics::surface::{BeamSection, BeamSupport, BeamSupportKind, Surface};
/// use palpate_mechanics::surface::{SupportedBeam, SupportedBeamSpec};
///
/// let cantilever = SupportedBeam::new(SupportedBeamSpec {
///     length_m: 0.4,
///     youngs_modulus_pa: 200e9,
///     sections: vec![BeamSection { to_m: 0.4, width_m: 0.04, thickness_m: 1.2e-3 }],
///     supports: vec![BeamSupport { at_m: 0.0, kind: BeamSupportKind::Clamped }],
/// })?;
/// let tip = Position::along(0.4);
/// let closed_form = -0.4f64.powi(3) / (3.0 * 1.152); // −l³/(3·E·I)
/// assert!((cantilever.influence(Deflection, tip, tip) / closed_form - 1.0).abs() < 1e-9);
/// # Ok::<(), palpate_mechanics::surface::SupportedBeamError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SupportedBeamSpec", into = "SupportedBeamSpec")]
pub struct SupportedBeam {
    spec: SupportedBeamSpec,
    structure: Structure,
    /// Largest bending stiffness D.
    stiffness_nm2: f64,
    /// By [`SensorKind::ALL`].
    full_scales: [f64; SensorKind::ALL.len()],
}

impl SupportedBeam {
    /// Checks the description and solves it.
    ///
    /// # Errors
    /// [`SupportedBeamError`] for the first fault.
    pub fn new(spec: SupportedBeamSpec) -> Result<Self, SupportedBeamError> {
        spec.check()?;
        let stiffnesses = spec.sections.iter().map(|s| s.bending_stiffness(spec.youngs_modulus_pa));
        let stiffness_nm2 = stiffnesses.fold(0.0, f64::max);
        let structure = structure(&spec, stiffness_nm2);
        let mut beam = Self { spec, structure, stiffness_nm2, full_scales: [0.0; SensorKind::ALL.len()] };
        beam.full_scales = SensorKind::ALL.map(|kind| beam.largest_influence(kind));
        let good = |kind: SensorKind| {
            let largest = beam.full_scale(kind);
            kind == SensorKind::Raw || (largest > 0.0 && largest.is_finite())
        };
        if SensorKind::ALL.into_iter().all(good) {
            Ok(beam)
        } else {
            let compliance_m_per_n = beam.full_scale(SensorKind::Deflection);
            Err(SupportedBeamError::Compliance { compliance_m_per_n })
        }
    }

    /// The description.
    pub fn spec(&self) -> &SupportedBeamSpec {
        &self.spec
    }

    fn disturbance(&self, kind: SensorKind, site: Site) -> Option<Disturbance> {
        let (l, stiffness) = (self.spec.length_m, self.stiffness_nm2);
        match kind {
            SensorKind::Deflection => Some(Disturbance::Jump(State::SHEAR * -(l.powi(3) / stiffness))),
            SensorKind::Slope => Some(Disturbance::Jump(State::MOMENT * (l * l / stiffness))),
            SensorKind::Strain => {
                let Element { stiffness: share, thickness_m, .. } = self.structure.elements[site.element];
                Some(Disturbance::Jump(State::SLOPE * -(0.5 * thickness_m * l / (share * stiffness))))
            }
            SensorKind::Reaction => {
                let held = self.structure.hold_at(site)?.yielding.is_some();
                held.then_some(Disturbance::Settlement)
            }
            SensorKind::Raw => None,
        }
    }

    fn shape_at(&self, kind: SensorKind, site: Site) -> Shape {
        match self.disturbance(kind, site) {
            Some(disturbance) => self.structure.shape(site, disturbance),
            None => self.structure.rigid_shape(),
        }
    }

    fn shape(&self, kind: SensorKind, sensor: Position) -> Shape {
        self.shape_at(kind, self.structure.site(sensor.x_m / self.spec.length_m))
    }

    fn largest_influence(&self, kind: SensorKind) -> f64 {
        let elements = self.structure.elements.iter().enumerate();
        let peak = |element, offset| self.shape_at(kind, Site { element, offset }).peak();
        let of_element = |(i, element): (usize, &Element)| match kind {
            SensorKind::Raw => 0.0,
            // Reactions exist at the nodes only.
            SensorKind::Reaction => peak(i, 0.0).max(peak(i, element.length)),
            _ => largest_within(element.length, |offset| peak(i, offset)),
        };
        // The total order keeps a NaN, which `new` refuses.
        elements.map(of_element).max_by(f64::total_cmp).unwrap_or(f64::NAN)
    }
}

impl Surface for SupportedBeam {
    fn influence_function(&self, kind: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_> {
        Arc::new(self.shape(kind, sensor))
    }

    fn is_supported_at(&self, position: Position) -> bool {
        let slack_m = SAME_PLACE * self.spec.length_m;
        let here = |support: &BeamSupport| (support.at_m - position.x_m).abs() <= slack_m;
        self.spec.supports.iter().any(|support| support.kind.has_reaction_force() && here(support))
    }

    fn force_supports(&self) -> Vec<Position> {
        let takers = self.spec.supports.iter().filter(|support| support.kind.has_reaction_force());
        let mut places: Vec<Position> = takers.map(|support| Position::along(support.at_m)).collect();
        places.sort_by(|a, b| a.x_m.total_cmp(&b.x_m));
        places
    }

    fn insensitive_sensor(&self, kind: SensorKind, sensor: Position) -> Option<InsensitiveSensor> {
        let negligible = ROUNDING * self.full_scale(kind);
        let held = kind != SensorKind::Raw && self.shape(kind, sensor).peak() <= negligible;
        held.then_some(InsensitiveSensor::Held { kind })
    }

    /// Exact over contact positions, to rounding over sensor positions.
    fn full_scale(&self, kind: SensorKind) -> f64 {
        self.full_scales[kind as usize]
    }

    fn extent(&self) -> Extent {
        Extent::checked_line(self.spec.length_m)
    }
}

impl TryFrom<SupportedBeamSpec> for SupportedBeam {
    type Error = SupportedBeamError;

    fn try_from(spec: SupportedBeamSpec) -> Result<Self, SupportedBeamError> {
        Self::new(spec)
    }
}

impl From<SupportedBeam> for SupportedBeamSpec {
    fn from(beam: SupportedBeam) -> Self {
        beam.spec
    }
}

fn structure(spec: &SupportedBeamSpec, stiffness_nm2: f64) -> Structure {
    let l = spec.length_m;
    let places = spec.sections.iter().map(|section| section.to_m);
    let places = places.chain(spec.supports.iter().map(|support| support.at_m));
    let mut nodes: Vec<f64> = places.map(|x_m| x_m / l).collect();
    nodes.retain(|place| (SAME_PLACE..=1.0 - SAME_PLACE).contains(place));
    nodes.extend([0.0, 1.0]);
    nodes.sort_by(f64::total_cmp);
    nodes.dedup_by(|next, before| *next - *before <= SAME_PLACE);
    let hold = |place: &f64| {
        let here = |support: &&BeamSupport| (support.at_m / l - place).abs() <= SAME_PLACE;
        spec.supports.iter().find(here).map_or(SupportCompliance::default(), |support| {
            support_compliance(support.kind, l, stiffness_nm2)
        })
    };
    let element = |ends: &[f64]| {
        let middle_m = 0.5 * (ends[0] + ends[1]) * l;
        let covering = spec.sections.iter().find(|section| section.to_m >= middle_m);
        let section = covering.or(spec.sections.last())?;
        let stiffness = section.bending_stiffness(spec.youngs_modulus_pa) / stiffness_nm2;
        Some(Element { length: ends[1] - ends[0], stiffness, thickness_m: section.thickness_m })
    };
    let elements = nodes.windows(2).filter_map(element).collect();
    let holds = nodes.iter().map(hold).collect();
    Structure::new(l, nodes, holds, elements)
}

/// Compliances: 1 N makes V jump by l³/D, 1 N·m makes M jump by l²/D, slopes are multiplied by l.
fn support_compliance(kind: BeamSupportKind, l: f64, stiffness_nm2: f64) -> SupportCompliance {
    let rigid = |takes: bool| takes.then_some(0.0);
    match kind {
        BeamSupportKind::Elastic { stiffness_n_per_m, rotational_stiffness_nm_per_rad } => {
            SupportCompliance {
                yielding: Some(stiffness_nm2 / (stiffness_n_per_m * l.powi(3))),
                turning: rotational_stiffness_nm_per_rad.map(|stiffness| stiffness_nm2 / (stiffness * l)),
            }
        }
        _ => SupportCompliance {
            yielding: rigid(kind.has_reaction_force()),
            turning: rigid(kind.has_reaction_couple()),
        },
    }
}

const PEAK_STEPS: u32 = 32;
const HALVINGS: u32 = 60;

/// Largest value, by a scan and golden-section search. Exact to rounding for one maximum between neighbouring
/// positions, as on one element.
fn largest_within(length: f64, at: impl Fn(f64) -> f64) -> f64 {
    let place = |step: u32| length * f64::from(step) / f64::from(PEAK_STEPS);
    let (best, value) = (0..=PEAK_STEPS)
        .map(|step| (step, at(place(step))))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, f64::NAN));
    let around = (place(best.saturating_sub(1)), place((best + 1).min(PEAK_STEPS)));
    value.max(golden_section(around, at))
}

/// Golden-section search (Kiefer, Proc. Am. Math. Soc. 4, 1953).
fn golden_section((mut low, mut high): (f64, f64), at: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5f64.sqrt() - 1.0);
    let (mut left, mut right) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut left_value, mut right_value) = (at(left), at(right));
    for _ in 0..HALVINGS {
        if left_value > right_value {
            (high, right, right_value) = (right, left, left_value);
            left = high - ratio * (high - low);
            left_value = at(left);
        } else {
            (low, left, left_value) = (left, right, right_value);
            right = low + ratio * (high - low);
            right_value = at(right);
        }
    }
    left_value.max(right_value)
}

#[cfg(test)]
mod tests;
