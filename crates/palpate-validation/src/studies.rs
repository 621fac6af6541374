//! Study files: arms are rows, seeds are calibrations.

use crate::experiment::{Experiment, Progress, Size};
use crate::statistics::{Sample, Share};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::evaluation::{EvaluatedContact, Evaluation, Portion};
use palpate::estimators::network::TrainingStatus;
use palpate::mechanics::sensing::SensorKind;
use palpate::prelude::{Estimator, Watch};
use palpate_studies::{
    Arm, ArmOutcome, ArmResults, PreparedStudy, RunOptions, Study, StudyResults, TrainedSeed,
};
use std::sync::atomic::{AtomicUsize, Ordering};

pub const PRESS_SPACING: Experiment = Experiment {
    name: "press-spacing",
    title: "How far apart to press",
    method: "`studies/spread.toml` with 100 seeds: the founding paper's network with normalized output learns clean readings at even positions, of which the last mirrors the first. \
             Errors are those of contacts at 1 to 399 mm; effective length is the share of these contacts with errors of at most 2 mm.",
    seed: 0,
    run: |size, progress| PRESS_SPACING_STUDY.run(size, progress),
};

pub const SENSING_POSITIONS: Experiment = Experiment {
    name: "sensing-positions",
    title: "Where to measure",
    method: "`studies/sensing-positions.toml` with 100 seeds: eight deflection sensors of 5 µm noise on the founding paper's beam, 30 even training positions pressed once each with 3 N, \
             layouts found for contacts of 20 to 380 mm. Contacts are at 1 to 399 mm, the bound is the mean error at the Cramér–Rao bound and a flat prior, and the network stops after 20,000 epochs.",
    seed: 0,
    run: |size, progress| SENSING_POSITIONS_STUDY.run(size, progress),
};

pub const SENSOR_KINDS: Experiment = Experiment {
    name: "sensor-kinds",
    title: "What to measure",
    method: "`studies/sensor-kinds.toml` with 100 seeds: the influence locator on the founding paper's beam, 30 even training positions pressed five times each with 3 N, noise of 5 µm, 1 µε and 5 mN. \
             Contacts are at 1 to 399 mm; the designed layout is `refined`.",
    seed: 0,
    run: |size, progress| SENSOR_KINDS_STUDY.run(size, progress),
};

const PRESS_SPACING_STUDY: StudyTable = StudyTable {
    toml: include_str!("../../../studies/spread.toml"),
    seeds: [100, 8],
    is_quick: |arm| arm.name.starts_with("n10"),
    title: "Errors by the number of positions and the place of the first.",
    labels: &["positions", "first at"],
    names: |arm| {
        let training = arm.rig.training().context("the arm has training positions")?;
        let positions = training.positions(arm.rig.setup.surface().extent())?;
        let first = positions.first().context("the arm has a training position")?;
        Ok(vec![positions.len().to_string(), format!("{:.0} mm", 1e3 * first.x_m)])
    },
    measures: &[
        (Measure::Error, "mean error"),
        (Measure::ErrorWithinSpan, "between the positions"),
        (Measure::ErrorBeyondSpan, "beyond them"),
        (Measure::EffectiveLength, "effective length"),
        (Measure::Epochs, "epochs"),
        (Measure::Converged, "converged"),
    ],
};

const SENSING_POSITIONS_STUDY: StudyTable = StudyTable {
    toml: include_str!("../../../studies/sensing-positions.toml"),
    seeds: [100, 20],
    is_quick: |arm| matches!(arm.rig.estimator, Estimator::Influence(_)),
    title: "Errors by the layout.",
    labels: &["estimator", "force", "layout"],
    names: |arm| {
        let layout = arm.layout.as_ref().context("the arm has a layout")?;
        Ok(vec![arm.rig.estimator.kind().to_owned(), force(arm), layout.method.name().to_owned()])
    },
    measures: &[
        (Measure::ErrorIn(0), "mean error at 20–380 mm"),
        (Measure::BoundIn(0), "its bound"),
        (Measure::Error, "mean error of the whole beam"),
        (Measure::EffectiveLength, "effective length"),
        (Measure::Covered, "covered"),
    ],
};

const SENSOR_KINDS_STUDY: StudyTable = StudyTable {
    toml: include_str!("../../../studies/sensor-kinds.toml"),
    seeds: [100, 20],
    is_quick: |_| true,
    title: "Errors by the sensors.",
    labels: &["force", "sensors"],
    names: |arm| Ok(vec![force(arm), sensors(arm)]),
    measures: &[
        (Measure::Error, "mean error of the whole beam"),
        (Measure::ErrorIn(1), "mean error at 1–20 mm"),
        (Measure::LargestError, "largest error"),
        (Measure::EffectiveLength, "effective length"),
        (Measure::Covered, "covered"),
    ],
};

fn force(arm: &Arm) -> String {
    arm.rig.setup.force().name().to_owned()
}

/// Numbers of sensors by kind, such as "6 deflection, 2 reaction".
fn sensors(arm: &Arm) -> String {
    let of_kind = |kind: SensorKind| {
        let sensors = arm.rig.setup.layout().sensors();
        let count = sensors.iter().filter(|sensor| sensor.kind == kind).count();
        (count > 0).then(|| format!("{count} {}", kind.name()))
    };
    let kinds: Vec<String> = SensorKind::ALL.into_iter().filter_map(of_kind).collect();
    format!("{}{}", if arm.layout.is_some() { "designed: " } else { "" }, kinds.join(", "))
}

struct StudyTable {
    toml: &'static str,
    /// Full and quick.
    seeds: [u64; 2],
    /// Of the quick size.
    is_quick: fn(&Arm) -> bool,
    title: &'static str,
    labels: &'static [&'static str],
    /// Values of the labels.
    names: fn(&Arm) -> Result<Vec<String>>,
    measures: &'static [(Measure, &'static str)],
}

#[derive(Clone, Copy)]
enum Measure {
    Error,
    LargestError,
    /// Mean error in a portion.
    ErrorIn(usize),
    /// Mean error at the bound in a portion.
    BoundIn(usize),
    ErrorWithinSpan,
    ErrorBeyondSpan,
    EffectiveLength,
    Epochs,
    Converged,
    Covered,
}

impl StudyTable {
    fn run(&self, size: Size, progress: Progress) -> Result<Vec<Table>> {
        let [full, quick] = self.seeds;
        let is_quick = size == Size::Quick;
        let rows = self.rows(size.pick(full, quick), |arm| !is_quick || (self.is_quick)(arm), progress)?;
        let columns = self.measures.iter().map(|(measure, name)| measure.column(name)).collect();
        Ok(vec![Table { rows, ..Table::new(self.title, self.labels, columns) }])
    }

    fn rows(&self, seeds: u64, keeps: impl Fn(&Arm) -> bool, progress: Progress) -> Result<Vec<Row>> {
        let mut study = Study::from_toml(self.toml)?;
        study.arms.retain(keeps);
        let study = PreparedStudy::new(study, Watch::NONE)?;
        let arms = &study.study.arms;
        let (finished, fits) = (AtomicUsize::new(0), arms.len() * seeds as usize);
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let outcomes = study.run(
            RunOptions { seeds, threads },
            Vec::new(),
            &|fit| progress(&arms[fit.arm].name, finished.fetch_add(1, Ordering::Relaxed) + 1, fits),
            Watch::NONE,
        )?;
        let results = StudyResults::new(&outcomes, &study);
        let tolerance_m = study.evaluation_settings().tolerance_m;
        let row = |((arm, outcome), results): ((&Arm, &ArmOutcome), &ArmResults)| {
            let arm_fits = ArmFits { arm, results, fits: &outcome.fits, tolerance_m };
            let names = (self.names)(arm)?;
            let labels: Vec<&str> = names.iter().map(String::as_str).collect();
            Ok(Row::new(
                &labels,
                self.measures.iter().map(|(measure, _)| arm_fits.figure(*measure)).collect(),
            ))
        };
        arms.iter().zip(&outcomes).zip(&results.arms).map(row).collect()
    }
}

impl Measure {
    fn column(self, name: &str) -> Column {
        match self {
            Self::Error | Self::ErrorIn(_) | Self::ErrorWithinSpan | Self::ErrorBeyondSpan => {
                Column { decimals: 3, ..Column::mm(name, Goal::Smaller) }
            }
            Self::LargestError => Column::mm(name, Goal::Smaller),
            Self::BoundIn(_) => Column { decimals: 3, ..Column::mm(name, Goal::None) },
            Self::EffectiveLength => Column::percent(name, Goal::Larger),
            Self::Epochs => Column { decimals: 0, ..Column::new(name, "", Goal::None) },
            Self::Converged => Column::percent(name, Goal::Larger),
            Self::Covered => Column::percent(name, Goal::COVERAGE),
        }
    }
}

/// One for each seed.
struct ArmFits<'a> {
    arm: &'a Arm,
    results: &'a ArmResults,
    fits: &'a [TrainedSeed],
    tolerance_m: f64,
}

impl ArmFits<'_> {
    fn figure(&self, measure: Measure) -> Option<Figure> {
        let portion = |number: usize| self.results.portions.get(number);
        let span = || self.results.training_span.as_ref().map(|span| span.training_span);
        match measure {
            Measure::Error => self.mean(|fit| Some(1e3 * fit.evaluation.summary(None)?.average_m)),
            Measure::LargestError => self.mean(|fit| Some(1e3 * fit.evaluation.summary(None)?.largest_m)),
            Measure::ErrorIn(number) => {
                let portion = Some(portion(number)?.portion);
                self.mean(|fit| Some(1e3 * fit.evaluation.summary(portion)?.average_m))
            }
            Measure::BoundIn(number) => {
                let percent = portion(number)?.limit_error_percent?;
                let length_m = self.arm.rig.setup.surface().extent().length_m();
                Some(Figure::exact(10.0 * percent * length_m))
            }
            Measure::ErrorWithinSpan => self.mean(|fit| error_mm(&fit.evaluation, span()?, true)),
            Measure::ErrorBeyondSpan => self.mean(|fit| error_mm(&fit.evaluation, span()?, false)),
            Measure::EffectiveLength => self.share(|located| Some(located.error_m() <= self.tolerance_m)),
            Measure::Epochs => self.mean(|fit| Some(f64::from(fit.training?.epochs))),
            Measure::Converged => {
                let mut converged = Share::default();
                for fit in self.fits {
                    converged.add(fit.seed, fit.training?.status == TrainingStatus::Converged);
                }
                converged.percent()
            }
            Measure::Covered => self.share(|located| located.covered.map(|covered| covered.x)),
        }
    }

    fn mean(&self, figure: impl Fn(&TrainedSeed) -> Option<f64>) -> Option<Figure> {
        let mut sample = Sample::default();
        for fit in self.fits {
            sample.add(fit.seed, figure(fit)?);
        }
        sample.mean()
    }

    /// Share of the contacts that may have a property.
    fn share(&self, has_property: impl Fn(&EvaluatedContact) -> Option<bool>) -> Option<Figure> {
        let mut share = Share::default();
        for fit in self.fits {
            for located in &fit.evaluation.located {
                if let Some(has_property) = has_property(located) {
                    share.add(fit.seed, has_property);
                }
            }
        }
        share.percent()
    }
}

/// Mean inside or outside a portion.
fn error_mm(evaluation: &Evaluation, portion: Portion, inside: bool) -> Option<f64> {
    let located = evaluation.located.iter().filter(|located| portion.contains(located.truth) == inside);
    let located = located.copied().collect();
    Some(1e3 * Evaluation { located, ..*evaluation }.summary(None)?.average_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_reactions_locate_contacts_near_an_end() {
        let keeps = |arm: &Arm| {
            matches!(arm.name.as_str(), "unknown-deflection-8" | "unknown-deflection-6-reaction-2")
        };
        let rows = SENSOR_KINDS_STUDY.rows(1, keeps, &|_, _, _| {}).unwrap();
        assert_eq!(rows[1].labels, ["unknown", "6 deflection, 2 reaction"]);
        let [alone, with_reactions] = [0, 1].map(|row| rows[row].figures[1].unwrap().value);
        assert!(with_reactions < 0.05 * alone, "{rows:?}");
    }

    #[test]
    fn errors_are_small_between_the_positions_and_large_beyond_them() {
        let rows = PRESS_SPACING_STUDY.rows(1, |arm| arm.name == "n10-from-80", &|_, _, _| {}).unwrap();
        assert_eq!(rows[0].labels, ["10", "80 mm"]);
        let [within, beyond] = [1, 2].map(|figure| rows[0].figures[figure].unwrap().value);
        assert!(within < 0.1 * beyond, "{rows:?}");
    }
}
