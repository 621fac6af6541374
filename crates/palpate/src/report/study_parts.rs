//! What the reports of all studies share: the arms' table, the run's facts, errors along the surface, the footer.

use maud::{Markup, html};

use super::limit_line::limit_line_or_assumed;
use super::numbers::{counted, mm, number, whole};
use super::page::{Table, numeric, short, text, words};
use super::{Axis, BandPoint, Chart, Mark, Series, SeriesKind, Stroke, StudyReport};
use crate::bench::Bench;
use crate::evaluation::{Located, Portion, Spread};
use crate::study::{ArmOutcome, ArmResults};

/// How an arm is drawn and named.
#[derive(Clone, Copy)]
pub(crate) struct Drawn<'a> {
    pub arm: &'a str,
    pub label: &'a str,
    pub colour: usize,
}

impl<'a> StudyReport<'a> {
    /// The outcome of an arm that has at least one fit.
    pub(crate) fn outcome(&self, arm: &str) -> Option<&'a ArmOutcome> {
        self.outcomes.iter().find(|outcome| outcome.name == arm && !outcome.fits.is_empty())
    }

    /// The bench of an arm.
    fn bench(&self, arm: &str) -> Option<&'a Bench> {
        self.study.study.arms.iter().find(|other| other.name == arm).map(|arm| &arm.rig.bench)
    }

    /// Fits of all arms.
    pub(crate) fn networks(&self) -> usize {
        self.results.arms.iter().map(|arm| arm.seeds).sum()
    }

    /// "25 seeds", or "3 to 25 seeds" where the arms differ.
    pub(crate) fn seeds_in_words(&self) -> String {
        let seeds = self.results.arms.iter().map(|arm| arm.seeds);
        match (seeds.clone().min(), seeds.max()) {
            (Some(fewest), Some(most)) if fewest < most => {
                format!("{} to {}", whole(fewest as f64), counted(most, "seed", "seeds"))
            }
            (_, most) => counted(most.unwrap_or(0), "seed", "seeds"),
        }
    }

    /// First and last of the positions where locators are judged, in metres.
    pub(crate) fn judged_portion(&self) -> Option<Portion> {
        let positions = &self.study.judging().positions;
        Some(Portion { from_m: positions.first()?.x_m, to_m: positions.last()?.x_m })
    }

    /// Length of the surface in metres; that of the first arm.
    pub(crate) fn length_m(&self) -> f64 {
        self.study.study.arms.first().map_or(f64::NAN, |arm| arm.rig.bench.surface.extent().length_m)
    }

    /// A sentence on the networks that did not converge; none where all did.
    pub(crate) fn not_converged(&self) -> Option<String> {
        let left: usize = self.results.arms.iter().map(|arm| arm.seeds - arm.converged).sum();
        (left > 0).then(|| {
            format!(
                "{} of {} did not converge; their figures are counted with the others.",
                whole(left as f64),
                counted(self.networks(), "network", "networks")
            )
        })
    }
}

/// "20–380 mm".
pub(crate) fn portion_in_words(portion: Portion) -> String {
    format!("{}–{} mm", mm(portion.from_m), mm(portion.to_m))
}

/// The median and the range from the 5th to the 95th percentile, over an arm's seeds, of a figure of each contact: by
/// position in mm.
pub(crate) fn along(outcome: &ArmOutcome, figure: impl Fn(&Located) -> f64) -> Vec<(f64, Spread)> {
    let Some(first) = outcome.fits.first() else { return Vec::new() };
    let at = |i: usize| {
        let answers = outcome.fits.iter().filter_map(|fit| fit.evaluation.located.get(i));
        Spread::of(answers.map(&figure).collect())
    };
    let located = first.evaluation.located.iter().enumerate();
    located.filter_map(|(i, located)| Some((located.truth.x_m * 1e3, at(i)?))).collect()
}

/// A band from the 5th to the 95th percentile and a line along the medians. A single seed has no band.
pub(crate) fn banded(drawn: Drawn<'_>, along: &[(f64, Spread)], seeds: usize) -> Vec<Series> {
    let band = along.iter().map(|&(x, spread)| BandPoint { x, low: spread.p05, high: spread.p95 }).collect();
    let line = along.iter().map(|&(x, spread)| (x, spread.median)).collect();
    let series = |label: &str, kind| Series { label: label.to_owned(), colour: drawn.colour, kind };
    let line = series(drawn.label, SeriesKind::Line { points: line, stroke: Stroke::Solid });
    if seeds < 2 { vec![line] } else { vec![series("", SeriesKind::Band { points: band }), line] }
}

/// Location error along the surface, in mm on a logarithmic axis; `None` where no arm has a fit.
pub(crate) fn error_chart(report: &StudyReport, title: &str, arms: &[Drawn]) -> Option<Chart> {
    let mut series: Vec<Series> = arms
        .iter()
        .filter_map(|drawn| Some((drawn, report.outcome(drawn.arm)?)))
        .flat_map(|(drawn, outcome)| {
            banded(*drawn, &along(outcome, |located| located.error_m() * 1e3), outcome.fits.len())
        })
        .collect();
    if !series.is_empty() {
        series.extend(arms.iter().find_map(|drawn| limit_line_or_assumed(report.bench(drawn.arm)?)));
    }
    let tolerance_m = report.study.judging().tolerance_m;
    (!series.is_empty()).then(|| Chart {
        title: title.to_owned(),
        x: Axis::linear("load position, mm").from_to(0.0, report.length_m() * 1e3),
        y: Axis::log10("location error, mm").from_to(LEAST_ERROR_MM, report.length_m() * 1e3),
        series,
        marks: vec![Mark::HorizontalLine {
            y: tolerance_m * 1e3,
            label: format!("tolerance, {} mm", mm(tolerance_m)),
        }],
        ..Chart::default()
    })
}

/// Errors cross zero, which a logarithmic axis cannot show; below this nobody looks.
const LEAST_ERROR_MM: f64 = 0.05;

/// Every arm with its figures.
pub(crate) fn arms_table(report: &StudyReport, table: usize) -> Markup {
    let portions = &report.study.judging().portions;
    let mut columns = vec![short("arm"), numeric("seeds converged"), numeric("iterations")];
    let judged = report.judged_portion().into_iter().chain(portions.iter().copied());
    columns.extend(
        judged.map(|portion| numeric(format!("average error, {}, %", unbroken(&portion_in_words(portion))))),
    );
    columns.push(numeric("largest error, %"));
    columns.push(numeric(format!("effective length, {} mm, %", mm(report.study.judging().tolerance_m))));
    Table {
        number: table,
        caption: html! {
            "Every arm: median over the seeds, and beneath it the range from the 5th to the 95th percentile. Errors are in % \
             of the surface's length."
        },
        columns,
        rows: report.results.arms.iter().map(arm_row).collect(),
    }
    .markup()
}

fn arm_row(arm: &ArmResults) -> Vec<Markup> {
    let mut cells = vec![
        text(&arm.name),
        text(format!("{} of {}", whole(arm.converged as f64), whole(arm.seeds as f64))),
        stacked(arm.epochs, whole),
        stacked(arm.error_percent, number),
    ];
    cells.extend(arm.portions.iter().map(|portion| stacked(portion.error_percent, number)));
    cells.push(stacked(arm.max_error_percent, number));
    cells.push(stacked(arm.effective_length_percent, number));
    cells
}

/// The median, and beneath it the range where there is one.
fn stacked(spread: Spread, shown: fn(f64) -> String) -> Markup {
    let [median, low, high] = [spread.median, spread.p05, spread.p95].map(shown);
    html! { (median) @if low != median || high != median { span.range { (low) "–" (high) } } }
}

/// The same text without a place to break a line.
fn unbroken(text: &str) -> String {
    text.replace(' ', "\u{a0}").replace('–', "\u{2060}–\u{2060}")
}

/// How the study was run.
pub(crate) fn run_table(report: &StudyReport, table: usize) -> Markup {
    let run = report.run;
    let facts = [
        ("palpate", run.palpate.to_owned()),
        ("study", run.study.clone()),
        ("seeds of each arm", counted_seeds(run.seeds)),
        ("threads", whole(run.threads as f64)),
        ("width of the numbers", format!("{:?}", run.precision).to_lowercase()),
        ("arithmetic", run.arithmetic.clone()),
        ("patterns presented in this run", whole(run.presentations as f64)),
        ("time of the fits", format!("{} s", number(run.seconds))),
        ("patterns presented per second", whole(run.presentations_per_second)),
    ];
    Table {
        number: table,
        caption: html! { "The run. Networks that an earlier run had left are not among the patterns presented." },
        columns: vec![words("fact"), words("value")],
        rows: facts.iter().map(|(name, value)| vec![text(name), text(value)]).collect(),
    }
    .markup()
}

fn counted_seeds(seeds: u64) -> String {
    match seeds {
        0 | 1 => whole(seeds as f64),
        _ => format!("{}, numbered 0 to {}", whole(seeds as f64), whole((seeds - 1) as f64)),
    }
}

/// Which palpate, study and seeds a page is of.
pub(crate) fn footer(report: &StudyReport) -> Markup {
    let run = report.run;
    html! {
        p {
            "Made by palpate " (run.palpate) " from the study " code { (run.study) } ", SHA-256 "
            code { (run.study_sha256) } ", " (report.seeds_in_words()) " of each arm, seeds from 0."
        }
    }
}

/// What the words of a study mean.
pub(crate) fn glossary(report: &StudyReport) -> Markup {
    let tolerance = mm(report.study.judging().tolerance_m);
    html! {
        dl {
            dt { "Training positions" }
            dd { "The contact positions whose readings a network is trained on." }
            dt { "Percentage error" }
            dd { "The distance between the true and the estimated position, in % of the surface's length." }
            dt { "Effective length" }
            dd { "The share of the surface where the estimate is within " (tolerance) " mm of the truth." }
            dt { "Iteration" }
            dd { "One epoch: every training position shown to the network once." }
            dt { "Seed" }
            dd {
                "The number from which a network's random start follows. Networks that differ in nothing else come out \
                 differently, so each figure here is the median over the seeds of its arm, with the range in which all but the \
                 lowest and the highest twentieth of them lie (5–95 %)."
            }
        }
    }
}
