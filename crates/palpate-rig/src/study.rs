//! Study file: sections of a rig, an `[evaluation]`, and `[[arm]]`s.

use std::ops::Range;

use palpate_design::sensors::Method;
use palpate_estimators::evaluation::Portion;
use palpate_estimators::network::Precision;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::format_length_mm;
use serde::Deserialize;
use serde::de::IgnoredAny;
use sha2::{Digest, Sha256};
use toml::Spanned;
use toml::de::DeValue;

use crate::design::DesignKeys;
use crate::document::{self, At, place};
use crate::error::{RigError, RigProblem};
use crate::estimator::EstimatorKeys;
use crate::rig::Rig;
use crate::sections::{RigFile, RigSections};
use crate::sensors::SensorsKeys;
use crate::surface::SurfaceKeys;
use crate::training::{ContactKeys, TrainingKeys};
use crate::values::{Count, Length, OneOrMany, Positive};

/// Set of arms, each fitted once for each seed.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Name.
    pub name: String,
    /// Default number of seeds; at least 1.
    pub seeds: u64,
    /// Arithmetic of training in lanes.
    pub precision: Precision,
    /// Positions and tolerance of the evaluation.
    pub evaluation: EvaluationSettings,
    /// Arms, at least 1, with different names.
    pub arms: Vec<Arm>,
    /// SHA-256 of the study file, hexadecimal.
    pub digest: String,
}

/// One row of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Unique name.
    pub name: String,
    /// Rig; preparation replaces its layout by the requested one.
    pub rig: Rig,
    /// Requested layout by method.
    pub layout: Option<RequestedLayout>,
    /// Title of a shared figure in reports, if any.
    pub figure: Option<String>,
}

/// Request of a layout by a method.
#[derive(Clone, Debug, PartialEq)]
pub struct RequestedLayout {
    /// Method.
    pub method: Method,
    /// Bytes of the method in the study file.
    pub span: Range<usize>,
}

/// Positions and tolerance of a study's evaluation.
#[derive(Clone, Debug, PartialEq)]
pub struct EvaluationSettings {
    /// Even contact positions.
    pub positions: Vec<Position>,
    /// Readings per position with noisy sensors; at least 1.
    pub readings: usize,
    /// Tolerance of the effective length, m.
    pub tolerance_m: f64,
    /// Portions with separate errors.
    pub portions: Vec<Portion>,
    /// True for separate errors inside and outside the training span.
    pub training_span: bool,
}

/// A study file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StudyFile {
    /// Name, of letters, digits, `-` and `_`.
    name: At<String>,
    /// Seeds that each arm is fitted from; 100 by default.
    seeds: Option<Count<1, 1_000_000>>,
    /// The arithmetic of training networks.
    #[serde(default)]
    precision: Precision,
    /// The surface of every arm, which every study has.
    surface: Option<At<SurfaceKeys>>,
    /// Sensors of arms without `sensors`.
    sensors: Option<At<OneOrMany<SensorsKeys>>>,
    /// Contact of arms without `contact`.
    contact: Option<ContactKeys>,
    /// Calibration of arms without `training`.
    training: Option<At<TrainingKeys>>,
    /// The estimator; an arm's own keys replace these.
    // Read by [`estimator`].
    #[serde(rename = "estimator")]
    _estimator: Option<IgnoredAny>,
    /// Candidates for layouts by method.
    design: Option<At<DesignKeys>>,
    /// Positions and tolerance by which locators are judged; 399 positions, 5 readings at each by default.
    evaluation: Option<EvaluationKeys>,
    /// The arms: one row each, with sections of its own in the place of the study's.
    #[serde(default)]
    arm: Vec<ArmKeys>,
}

/// Positions and tolerance by which locators are judged.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EvaluationKeys {
    /// The first contact position.
    from: Positive<Length>,
    /// The last contact position.
    to: At<Positive<Length>>,
    /// The distance between neighbours.
    step: At<Positive<Length>>,
    /// Readings at each position; 5 by default.
    readings: Option<Count<1, 1000>>,
    /// Largest acceptable error; 2 mm by default.
    tolerance: Option<Positive<Length>>,
    /// Portions of the surface that are also judged by themselves.
    #[serde(default)]
    portions: Vec<At<PortionKeys>>,
    /// Whether errors between the outermost training positions, and beyond them, are also judged by themselves.
    #[serde(default)]
    training_span: bool,
}

#[derive(Deserialize)]
#[serde(expecting = "a list of 2 lengths, the smaller one first")]
struct PortionKeys(Positive<Length>, Positive<Length>);

/// One row of a study.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ArmKeys {
    /// Name, unique in the study, of letters, digits, `-`, `_`, and `.` between them.
    name: At<String>,
    /// The title of a figure that the arm shares with others; a figure of its own by default.
    figure: Option<String>,
    /// The method that places the sensors.
    layout: Option<At<Method>>,
    /// Sensors; the study's by default.
    sensors: Option<At<OneOrMany<SensorsKeys>>>,
    /// Contact; the study's by default.
    contact: Option<ContactKeys>,
    /// Calibration; the study's by default.
    training: Option<At<TrainingKeys>>,
    /// Own keys of the estimator, beside those of the study's.
    // Read by [`estimator`].
    #[serde(rename = "estimator")]
    _estimator: Option<IgnoredAny>,
}

impl Study {
    /// Reads a study file.
    ///
    /// # Errors
    /// [`RigError`] with place, value and bound.
    ///
    /// ```
    /// use palpate_rig::Study;
    ///
    /// let text = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../studies/paper.toml"));
    /// let study = Study::from_toml(text)?;
    /// assert_eq!((study.name.as_str(), study.arms.len()), ("paper", 12));
    /// assert_eq!(study.arms[0].rig.setup.layout().len(), 8);
    /// # Ok::<(), palpate_rig::RigError>(())
    /// ```
    pub fn from_toml(text: &str) -> Result<Self, RigError> {
        let document = document::parse(text)?;
        let file: StudyFile = document::read("", &document)?;
        let mut arms: Vec<Arm> = Vec::new();
        for (i, keys) in file.arm.iter().enumerate() {
            let arm = keys.build(&file, estimator(document.get_ref(), i)?)?;
            if arms.iter().any(|other| other.name == arm.name) {
                return Err(keys.name.place.refuse_value(format!("{} again", arm.name), "a name of its own"));
            }
            arms.push(arm);
        }
        let missing = |section| RigProblem::MissingSection { section }.without_place();
        let first = arms.first().ok_or_else(|| missing("[[arm]]"))?;
        let judging = file.evaluation_settings(first)?;
        Ok(Self {
            name: checked_name(&file.name)?,
            seeds: file.seeds.map_or(100, |seeds| seeds.get() as u64),
            precision: file.precision,
            evaluation: judging,
            arms,
            digest: Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect(),
        })
    }
}

fn estimator(document: &DeValue, arm: usize) -> Result<Option<EstimatorKeys>, RigError> {
    let base = document.get("estimator");
    let own = document.get("arm").and_then(|arms| arms.get_ref().get(arm)?.get_ref().get("estimator"));
    match (own, base) {
        (Some(own), Some(base)) => {
            let both = match (own.get_ref(), base.get_ref()) {
                (DeValue::Table(own), DeValue::Table(base)) => {
                    let mut both = base.clone();
                    both.extend(own.clone());
                    DeValue::Table(both)
                }
                (own, _) => own.clone(),
            };
            document::read("estimator", &Spanned::new(own.span(), both)).map(Some)
        }
        (own, base) => own.or(base).map(|keys| document::read("estimator", keys)).transpose(),
    }
}

impl ArmKeys {
    fn build(&self, base: &StudyFile, estimator: Option<EstimatorKeys>) -> Result<Arm, RigError> {
        let name = checked_arm_name(&self.name)?;
        let rig = RigFile {
            surface: base.surface.clone(),
            sensors: self.sensors.as_ref().or(base.sensors.as_ref()).cloned(),
            contact: self.contact.as_ref().or(base.contact.as_ref()).cloned(),
            training: self.training.as_ref().or(base.training.as_ref()).cloned(),
            estimator,
            design: base.design.clone(),
            ..RigFile::default()
        };
        let layout = self.asked_layout()?;
        let rig = Rig::from_sections(&RigSections::from(rig))?;
        if let (Some(surface), None) = (&base.surface, rig.setup.surface().model()) {
            return Err(surface
                .place
                .refuse_value("measured", "a surface with a model: a study simulates it"));
        }
        if rig.training.is_none() {
            return Err(RigProblem::MissingSection { section: "[training]" }.without_place());
        }
        Ok(Arm { name, rig, layout, figure: self.figure.clone() })
    }

    /// Sensor positions exclude a layout by method.
    fn asked_layout(&self) -> Result<Option<RequestedLayout>, RigError> {
        let Some(layout) = &self.layout else { return Ok(None) };
        for sensors in self.sensors.iter().flat_map(|sensors| sensors.sections()) {
            if let Some(key) = place(&sensors.positions).or(place(&sensors.grid)) {
                return Err(key.unused("`layout`"));
            }
        }
        Ok(Some(RequestedLayout { method: **layout, span: layout.place.span.clone() }))
    }
}

fn checked_name(name: &At<String>) -> Result<String, RigError> {
    if name.is_empty() || !name.chars().all(in_any_name) {
        return Err(name.place.refuse("of letters, digits, `-` and `_`"));
    }
    Ok((**name).clone())
}

/// An arm's name can be part of a file name: inner points only, to exclude hidden files and folders.
fn checked_arm_name(name: &At<String>) -> Result<String, RigError> {
    let fits = |c: char| in_any_name(c) || c == '.';
    if name.is_empty() || !name.chars().all(fits) || name.starts_with('.') || name.ends_with('.') {
        return Err(name.place.refuse("of letters, digits, `-`, `_`, and `.` between them"));
    }
    Ok((**name).clone())
}

fn in_any_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '-' || c == '_'
}

impl StudyFile {
    fn evaluation_settings(&self, first: &Arm) -> Result<EvaluationSettings, RigError> {
        let extent = first.rig.setup.surface().extent();
        if let (Some(surface), Extent::Plane { .. }) = (&self.surface, extent) {
            return Err(surface.place.refuse_value("a plane", "a line, along which a study judges"));
        }
        let default = EvaluationSettings {
            positions: (1..400).map(|i| Position::along(f64::from(i) / 400.0 * extent.length_m())).collect(),
            readings: 5,
            tolerance_m: 2e-3,
            portions: Vec::new(),
            training_span: false,
        };
        let Some(keys) = &self.evaluation else { return Ok(default) };
        Ok(EvaluationSettings {
            positions: keys.positions(extent.length_m())?,
            readings: keys.readings.map_or(default.readings, Count::get),
            tolerance_m: keys.tolerance.map_or(default.tolerance_m, |tolerance| tolerance.si),
            portions: keys.portions.iter().map(At::<PortionKeys>::build).collect::<Result<_, _>>()?,
            training_span: keys.training_span,
        })
    }
}

impl EvaluationKeys {
    fn positions(&self, length_m: f64) -> Result<Vec<Position>, RigError> {
        const MOST: usize = 100_000;
        let (from_m, to_m, step_m) = (self.from.si, self.to.si, self.step.si);
        if to_m < from_m || to_m > length_m {
            let [from, length] = [from_m, length_m].map(format_length_mm);
            let bound = format!("at least `from`, {from}, and at most the surface's length, {length}");
            return Err(self.to.place.refuse(bound));
        }
        // A rounding error of a millionth of a step does not lose the last position.
        let steps = ((to_m - from_m) / step_m + 1e-6).floor();
        if steps >= MOST as f64 {
            return Err(self
                .step
                .place
                .refuse(format!("a distance that makes at most {MOST} contact positions")));
        }
        Ok((0..=steps as usize).map(|i| Position::along(from_m + i as f64 * step_m)).collect())
    }
}

impl At<PortionKeys> {
    fn build(&self) -> Result<Portion, RigError> {
        let portion = Portion { from_m: self.0.si, to_m: self.1.si };
        if portion.from_m < portion.to_m {
            Ok(portion)
        } else {
            Err(self.place.refuse("a list of 2 lengths, the smaller one first"))
        }
    }
}
