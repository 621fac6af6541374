//! Benches as they come, beside the same benches in a clean world: errors, coverage of intervals, statuses.

use crate::experiment::{Bench, Forces, Knowledge, World, Zero};
use crate::parallel::in_parallel;
use crate::results::{Results, mm, percent};
use crate::tally::{Figures, Tally};
use anyhow::{Context, Result};
use palpate::prelude::{Estimator, GaussianProcessEstimator, Influence, Rig};
use serde::Serialize;
use std::fmt::Write;

/// The benches, by their file in the folder `examples`.
pub const BENCHES: [(&str, &str); 4] = [
    ("real-strip", include_str!("../../../examples/real-strip.toml")),
    ("real-finger", include_str!("../../../examples/real-finger.toml")),
    ("real-skin", include_str!("../../../examples/real-skin.toml")),
    ("real-floor", include_str!("../../../examples/real-floor.toml")),
];

/// Size of the experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Names of the benches to run, of [`BENCHES`].
    pub benches: Vec<String>,
    /// Kinds of estimators to run; all that are compared where there are none.
    pub estimators: Vec<String>,
    /// Seeds of each bench, from 0 on; at least 1.
    pub seeds: u64,
    /// Contacts in use of each seed, about.
    pub contacts: usize,
}

impl Default for Options {
    fn default() -> Self {
        let benches = BENCHES.map(|(name, _)| name.to_owned()).to_vec();
        Self { benches, estimators: Vec::new(), seeds: 2, contacts: 100 }
    }
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableRow {
    /// The bench.
    pub bench: String,
    /// "model", or "measured" for raw channels without one.
    pub knowledge: &'static str,
    /// The estimator.
    pub estimator: String,
    /// "clean" or "imperfect".
    pub world: &'static str,
    /// "once" for readings that are tared before the first contact, "each" before each.
    pub tared: &'static str,
    /// Reason for missing figures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Figures over all seeds.
    #[serde(flatten)]
    pub figures: Figures,
}

const WORLDS: [(World, &str); 2] = [(World::Clean, "clean"), (World::Imperfect, "imperfect")];
const KNOWLEDGE: [(Knowledge, &str); 2] = [(Knowledge::Model, "model"), (Knowledge::Measured, "measured")];
const ZEROS: [(Zero, &str); 2] = [(Zero::Once, "once"), (Zero::Each, "each")];

/// Runs the experiment, several cases at a time; `progress` gets the name of a finished case, the number of finished cases and of all.
///
/// # Errors
/// A bench that is not known, or cannot be simulated.
pub fn run(options: &Options, progress: impl Fn(&str, usize, usize) + Sync) -> Result<Results<TableRow>> {
    run_on(&chosen(&options.benches)?, options, progress)
}

fn run_on(
    benches: &[(&'static str, &'static str)],
    options: &Options,
    progress: impl Fn(&str, usize, usize) + Sync,
) -> Result<Results<TableRow>> {
    let cases = cases(benches)?;
    let name = |case: &Case| format!("{}, {}, {}", case.name, case.knowledge.1, case.world.1);
    let rows = in_parallel(&cases, |case| case.rows(options), name, progress);
    let rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(Results::new("real-benches", (options.seeds, options.contacts), benches, rows))
}

fn chosen(names: &[String]) -> Result<Vec<(&'static str, &'static str)>> {
    let find = |name: &String| {
        let known = BENCHES.map(|(name, _)| name).join(", ");
        let bench = BENCHES.into_iter().find(|(bench, _)| bench == name);
        bench.with_context(|| format!("bench `{name}` does not exist; the benches are {known}"))
    };
    names.iter().map(find).collect()
}

/// A bench in a world, with what a locator is given of it.
struct Case {
    name: &'static str,
    rig: Rig,
    knowledge: (Knowledge, &'static str),
    world: (World, &'static str),
}

fn cases(benches: &[(&'static str, &'static str)]) -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for (name, toml) in benches {
        let rig = Rig::from_toml(toml).with_context(|| format!("examples/{name}.toml"))?;
        for knowledge in KNOWLEDGE {
            cases.extend(WORLDS.map(|world| Case { name, rig: rig.clone(), knowledge, world }));
        }
    }
    Ok(cases)
}

impl Case {
    /// Rows of every estimator by every zero, over all seeds.
    fn rows(&self, options: &Options) -> Result<Vec<TableRow>> {
        let (world, knowledge) = (self.world.0, self.knowledge.0);
        let bench = Bench { rig: &self.rig, world, knowledge, forces: Forces::UNKNOWN };
        let judged = judged(&bench, options).with_context(|| self.name.to_owned())?;
        let rows = judged.into_iter().flat_map(|(estimator, by_zero)| {
            by_zero.into_iter().map(move |(tared, figures, failure)| TableRow {
                bench: self.name.to_owned(),
                knowledge: self.knowledge.1,
                estimator: estimator.clone(),
                world: self.world.1,
                tared,
                failure,
                figures,
            })
        });
        Ok(rows.collect())
    }
}

/// The estimators that are compared: that of the rig, and the two that learn from a recording.
fn estimators(rig: &Rig) -> Vec<Estimator> {
    let mut estimators = vec![
        Estimator::Influence(Influence::default()),
        Estimator::GaussianProcess(GaussianProcessEstimator::default()),
    ];
    if estimators.iter().all(|estimator| estimator.kind() != rig.estimator.kind()) {
        estimators.insert(0, rig.estimator.clone());
    }
    estimators
}

type Judged = (String, Vec<(&'static str, Figures, Option<String>)>);

/// Figures of every estimator by every zero, over all seeds.
fn judged(bench: &Bench, options: &Options) -> Result<Vec<Judged>> {
    let mut estimators = estimators(bench.rig);
    estimators.retain(|estimator| {
        options.estimators.is_empty() || options.estimators.iter().any(|kind| kind == estimator.kind())
    });
    let zeros = ZEROS.map(|(zero, _)| zero);
    let extent = bench.rig.setup.surface().extent();
    let mut tallies = vec![(vec![Tally::new(extent); zeros.len()], None); estimators.len()];
    for seed in 0..options.seeds {
        let recordings = bench.record(options.contacts, seed)?;
        for (estimator, (tallies, failure)) in estimators.iter().zip(&mut tallies) {
            // An estimator that refuses a bench has a row with the reason.
            if let Err(error) = recordings.judge(estimator, seed, &zeros, tallies) {
                *failure = Some(format!("seed {seed}: {error:#}"));
            }
        }
    }
    let figures = |(tallies, failure): (Vec<Tally>, Option<String>)| {
        let named = ZEROS.iter().zip(tallies);
        named.map(|((_, name), tally)| (*name, tally.figures(), failure.clone())).collect()
    };
    Ok(estimators
        .iter()
        .map(|estimator| estimator.kind().to_owned())
        .zip(tallies.into_iter().map(figures))
        .collect())
}

impl Results<TableRow> {
    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let mut text = self.table_head("forces of 1, 0.5 and 2 times the presses in turn", &COLUMNS);
        for row in &self.rows {
            let TableRow { bench, knowledge, estimator, world, tared, figures, failure } = row;
            let _ = write!(text, "| {bench} | {knowledge} | {estimator} | {world} | {tared} | ");
            let _ = match failure {
                Some(failure) => writeln!(text, "{} | | | | | | | | |", failure.replace('|', "/")),
                None => writeln!(text, "{} |", cells(figures).join(" | ")),
            };
        }
        text
    }
}

const COLUMNS: [&str; 14] = [
    "bench",
    "surface",
    "estimator",
    "world",
    "tared",
    "median, mean error (mm)",
    "stated at held-out places",
    "position in 95 %",
    "force in 95 %",
    "outside model",
    "ambiguous",
    "missed",
    "untouched `no_contact`",
    "light found",
];

fn cells(figures: &Figures) -> Vec<String> {
    let mut cells = vec![format!("{}, {}", mm(figures.median_error_mm), mm(figures.mean_error_mm))];
    let whole = |share: Option<f64>| share.map_or("–".to_owned(), |share| format!("{share:.0}"));
    cells.push(format!("{} → {} %", whole(figures.said_before), whole(figures.said_after)));
    let shares = [
        figures.position_coverage,
        figures.force_coverage,
        figures.outside_model,
        figures.ambiguous,
        figures.missed,
        figures.untouched_no_contact,
        figures.light_found,
    ];
    cells.extend(shares.map(percent));
    cells
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn the_smallest_experiment_has_a_row_for_every_case_and_shows_the_worlds_apart() {
        let (benches, estimators) = (vec!["real-strip".to_owned()], vec!["influence".to_owned()]);
        let options = Options { benches, estimators, seeds: 1, contacts: 12 };
        // Fewer places than intervals are checked by.
        let (name, toml) = BENCHES[0];
        let small = toml.replace("count = 19", "count = 10").replace("repeats = 5", "repeats = 2");
        let calls = AtomicUsize::new(0);
        let results =
            run_on(&[(name, small.leak())], &options, |_, _, of| calls.store(of, Ordering::Relaxed)).unwrap();
        assert_eq!(calls.into_inner(), 4);
        assert_eq!(results.rows.len(), 2 * 2 * 2);
        assert!(
            results.rows.iter().all(|row| row.failure.is_none() && row.figures.touches == 12),
            "{results:?}"
        );
        let error_mm = |world: &str| {
            let row = results
                .rows
                .iter()
                .find(|row| row.world == world && row.knowledge == "model" && row.tared == "each");
            row.and_then(|row| row.figures.median_error_mm).unwrap()
        };
        assert!(
            error_mm("clean") < 1.0 && error_mm("imperfect") > error_mm("clean"),
            "{}",
            results.markdown()
        );
        assert_eq!(results.markdown().lines().count(), 4 + 8);
        let json = serde_json::to_value(&results).unwrap();
        assert_eq!(
            (json["seeds"][0].as_u64(), json["rigs"][0]["name"].as_str()),
            (Some(0), Some("real-strip"))
        );
    }

    #[test]
    fn an_unknown_bench_is_refused_with_those_that_there_are() {
        let options = Options { benches: vec!["real-bridge".to_owned()], ..Options::default() };
        let refused = run(&options, |_, _, _| ()).unwrap_err().to_string();
        assert_eq!(
            refused,
            "bench `real-bridge` does not exist; the benches are real-strip, real-finger, real-skin, real-floor"
        );
    }
}
