//! The study file: a rig's sections, an `[evaluation]`, and `[[arm]]`s that replace some of them.

use std::ops::Range;

use serde::Deserialize;
use sha2::{Digest, Sha256};
use toml::Spanned;

use super::{Arm, AskedLayout, Judging, Study};
use palpate_design::sensors::Method;
use palpate_estimators::evaluation::Portion;
use palpate_estimators::network::Precision;
use palpate_mechanics::contact::Position;
use palpate_mechanics::units::{Dimension, format_length_mm};
use palpate_rig::{
    ContactSection, DesignSection, EstimatorSection, RawQuantity, RigError, RigProblem, RigSections,
    SensorsSections, SurfaceSection, TrainingSection, choice, count, positive, validate,
};

/// A study file that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct StudyError {
    /// What is wrong.
    pub problem: StudyProblem,
    /// The bytes of the document that are meant; `None` when something is not there at all.
    pub span: Option<Range<usize>>,
}

/// What is wrong with a study file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyProblem {
    /// One of the rig's sections.
    #[error(transparent)]
    Rig(RigError),
    /// A study needs at least one arm.
    #[error("the study has no [[arm]]; it needs at least 1")]
    NoArms,
    /// Two arms with one name.
    #[error("two arms are called `{name}`; each needs a name of its own")]
    SameName {
        /// The name.
        name: String,
    },
    /// A name that cannot stand in a table.
    #[error("the name `{name}` has a character that is neither a letter, a digit, `-` nor `_`")]
    Name {
        /// The name.
        name: String,
    },
    /// No seeds to fit from.
    #[error("`seeds` is {value}; it must be at least 1 and at most {most}")]
    Seeds {
        /// The number.
        value: i64,
        /// Its bound.
        most: u64,
    },
    /// An arithmetic that does not exist.
    #[error("`precision` is `{word}`; it must be `f64` or `f32`")]
    Precision {
        /// What the file says.
        word: String,
    },
    /// Contact positions that end before they begin, or beside the surface.
    #[error(
        "`to` is {}; it must be at least `from`, {}, and at most the surface's length, {}",
        format_length_mm(*to_m),
        format_length_mm(*from_m),
        format_length_mm(*length_m)
    )]
    End {
        /// Where they end, in metres.
        to_m: f64,
        /// Where they begin, in metres.
        from_m: f64,
        /// The surface's length, in metres.
        length_m: f64,
    },
    /// Far too many contact positions.
    #[error("`step` is {}, which makes more than {most} contact positions", format_length_mm(*step_m))]
    Step {
        /// The distance between two, in metres.
        step_m: f64,
        /// How many there may be.
        most: usize,
    },
    /// A portion that is not two lengths in rising order.
    #[error("a portion is two lengths, the smaller one first")]
    Portion,
    /// A surface with two coordinates.
    #[error("a study judges along a line; this surface has a width as well")]
    Plane,
    /// A surface without a model.
    #[error(
        "arm `{arm}` cannot be simulated: a study needs a surface with a model, a force and training positions"
    )]
    NotSimulated {
        /// The arm.
        arm: String,
    },
}

impl From<RigError> for StudyError {
    fn from(error: RigError) -> Self {
        let span = error.span.clone();
        Self { problem: StudyProblem::Rig(error), span }
    }
}

impl StudyProblem {
    fn at(self, span: Range<usize>) -> StudyError {
        StudyError { problem: self, span: Some(span) }
    }
}

/// The most seeds a study takes.
const MOST_SEEDS: u64 = 1_000_000;
/// The most contact positions a study judges at.
const MOST_POSITIONS: usize = 100_000;
/// The most readings at each of them.
const MOST_READINGS: usize = 1000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StudyFile {
    name: Spanned<String>,
    seeds: Option<Spanned<i64>>,
    precision: Option<Spanned<String>>,
    surface: Option<Spanned<SurfaceSection>>,
    sensors: Option<Spanned<SensorsSections>>,
    contact: Option<Spanned<ContactSection>>,
    training: Option<Spanned<TrainingSection>>,
    estimator: Option<Spanned<EstimatorSection>>,
    design: Option<Spanned<DesignSection>>,
    evaluation: Option<Spanned<EvaluationSection>>,
    #[serde(default)]
    arm: Vec<ArmSection>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EvaluationSection {
    from: Spanned<RawQuantity>,
    to: Spanned<RawQuantity>,
    step: Spanned<RawQuantity>,
    readings: Option<Spanned<i64>>,
    tolerance: Option<Spanned<RawQuantity>>,
    #[serde(default)]
    portions: Vec<Spanned<Vec<Spanned<RawQuantity>>>>,
    #[serde(default)]
    training_span: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ArmSection {
    name: Spanned<String>,
    figure: Option<String>,
    layout: Option<Spanned<String>>,
    sensors: Option<Spanned<SensorsSections>>,
    contact: Option<Spanned<ContactSection>>,
    training: Option<Spanned<TrainingSection>>,
    estimator: Option<Spanned<EstimatorSection>>,
}

impl Study {
    /// Reads a study file.
    ///
    /// # Errors
    /// [`StudyError`], with the place in `text`, the value and its bound.
    pub fn from_toml(text: &str) -> Result<Self, StudyError> {
        let file: StudyFile = toml::from_str(text).map_err(RigError::from_toml)?;
        let arms = file.arm.iter().map(|arm| file.arm(arm)).collect::<Result<Vec<_>, _>>()?;
        let Some(first) = arms.first() else {
            return Err(StudyError { problem: StudyProblem::NoArms, span: None });
        };
        for (i, arm) in arms.iter().enumerate() {
            if arms[..i].iter().any(|other| other.name == arm.name) {
                return Err(StudyProblem::SameName { name: arm.name.clone() }.at(file.arm[i].name.span()));
            }
        }
        let extent = first.rig.bench.surface.extent();
        if let (true, Some(surface)) = (extent.is_plane(), &file.surface) {
            return Err(StudyProblem::Plane.at(surface.span()));
        }
        let length_m = extent.length_m;
        Ok(Self {
            name: checked_name(&file.name)?,
            seeds: file.seeds()?,
            precision: file.precision()?,
            judging: judging(file.evaluation.as_ref(), length_m)?,
            arms,
            digest: Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect(),
        })
    }
}

impl StudyFile {
    fn seeds(&self) -> Result<u64, StudyError> {
        let Some(seeds) = &self.seeds else { return Ok(100) };
        let value = *seeds.get_ref();
        match u64::try_from(value) {
            Ok(count @ 1..=MOST_SEEDS) => Ok(count),
            _ => Err(StudyProblem::Seeds { value, most: MOST_SEEDS }.at(seeds.span())),
        }
    }

    fn precision(&self) -> Result<Precision, StudyError> {
        match self.precision.as_ref().map(|word| (word.get_ref().as_str(), word.span())) {
            None | Some(("f64", _)) => Ok(Precision::F64),
            Some(("f32", _)) => Ok(Precision::F32),
            Some((word, span)) => Err(StudyProblem::Precision { word: word.to_owned() }.at(span)),
        }
    }

    /// The base's sections; those of the arm take the place of the base's, its estimator's keys that of single keys.
    fn arm(&self, arm: &ArmSection) -> Result<Arm, StudyError> {
        let name = checked_name(&arm.name)?;
        let layout = arm.asked_layout()?;
        let rig = validate(&RigSections {
            surface: self.surface.clone(),
            sensors: arm.sensors.clone().or_else(|| self.sensors.clone()),
            contact: arm.contact.clone().or_else(|| self.contact.clone()),
            training: arm.training.clone().or_else(|| self.training.clone()),
            estimator: self.estimator_of(arm),
            recording: None,
            motion: None,
            load: None,
            design: self.design.clone(),
        })?;
        let pressed_n = rig.pressed_bench().force_n;
        if rig.bench.surface.model().is_none() || pressed_n.is_none() || rig.training.is_none() {
            return Err(StudyProblem::NotSimulated { arm: name }.at(arm.name.span()));
        }
        Ok(Arm { name, rig, layout, figure: arm.figure.clone() })
    }

    /// The arm's keys, and the base's where the arm is silent.
    fn estimator_of(&self, arm: &ArmSection) -> Option<Spanned<EstimatorSection>> {
        match (arm.estimator.clone(), &self.estimator) {
            (Some(own), Some(base)) => Some(Spanned::new(own.span(), own.into_inner().over(base.get_ref()))),
            (own, base) => own.or_else(|| base.clone()),
        }
    }
}

impl ArmSection {
    /// The layout by its method, which leaves nothing for positions to say.
    fn asked_layout(&self) -> Result<Option<AskedLayout>, RigError> {
        let Some(layout) = &self.layout else { return Ok(None) };
        let method = choice("layout", layout, &Method::NAMED.map(|method| (method.name(), method)))?;
        for (sensors, _) in self.sensors.iter().flat_map(|all| all.get_ref().each(all.span())) {
            let places = [
                sensors.positions.as_ref().map(|key| ("positions", key.span())),
                sensors.grid.as_ref().map(|key| ("grid", key.span())),
            ];
            if let Some((key, span)) = places.into_iter().flatten().next() {
                return Err(RigProblem::UnusedKey { key, with: "`layout`" }.at(span));
            }
        }
        Ok(Some(AskedLayout { method, place: layout.span() }))
    }
}

/// A length greater than 0.
fn positive_length(key: &'static str, raw: &Spanned<RawQuantity>) -> Result<f64, RigError> {
    positive(key, raw, Dimension::Length)
}

fn checked_name(name: &Spanned<String>) -> Result<String, StudyError> {
    let text = name.get_ref();
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if text.is_empty() || !text.chars().all(fits) {
        return Err(StudyProblem::Name { name: text.clone() }.at(name.span()));
    }
    Ok(text.clone())
}

/// Without an `[evaluation]`: 399 positions, 5 readings at each, tolerance 2 mm, no portions.
fn judging(section: Option<&Spanned<EvaluationSection>>, length_m: f64) -> Result<Judging, StudyError> {
    const TOLERANCE_M: f64 = 2e-3;
    const READINGS: usize = 5;
    let Some(section) = section.map(Spanned::get_ref) else {
        let positions = (1..400).map(|i| Position::along(f64::from(i) / 400.0 * length_m)).collect();
        return Ok(Judging {
            positions,
            readings: READINGS,
            tolerance_m: TOLERANCE_M,
            portions: Vec::new(),
            training_span: false,
        });
    };
    let readings = section.readings.as_ref().map_or(Ok(READINGS), |raw| {
        count("readings", raw, 1..=MOST_READINGS, "at least 1 and at most 1000")
    })?;
    let tolerance_m = match &section.tolerance {
        Some(tolerance) => positive_length("tolerance", tolerance)?,
        None => TOLERANCE_M,
    };
    let portions = section.portions.iter().map(portion).collect::<Result<_, _>>()?;
    Ok(Judging {
        positions: positions(section, length_m)?,
        readings,
        tolerance_m,
        portions,
        training_span: section.training_span,
    })
}

fn positions(section: &EvaluationSection, length_m: f64) -> Result<Vec<Position>, StudyError> {
    let from_m = positive_length("from", &section.from)?;
    let to_m = positive_length("to", &section.to)?;
    let step_m = positive_length("step", &section.step)?;
    if to_m < from_m || to_m > length_m {
        return Err(StudyProblem::End { to_m, from_m, length_m }.at(section.to.span()));
    }
    // A rounding error of a millionth of a step does not lose the last position.
    let steps = ((to_m - from_m) / step_m + 1e-6).floor();
    if steps >= MOST_POSITIONS as f64 {
        return Err(StudyProblem::Step { step_m, most: MOST_POSITIONS }.at(section.step.span()));
    }
    Ok((0..=steps as usize).map(|i| Position::along(from_m + i as f64 * step_m)).collect())
}

fn portion(raw: &Spanned<Vec<Spanned<RawQuantity>>>) -> Result<Portion, StudyError> {
    let [from, to] = raw.get_ref().as_slice() else { return Err(StudyProblem::Portion.at(raw.span())) };
    let portion =
        Portion { from_m: positive_length("portions", from)?, to_m: positive_length("portions", to)? };
    if portion.from_m < portion.to_m { Ok(portion) } else { Err(StudyProblem::Portion.at(raw.span())) }
}
