//! What the reports of all studies share: the arms' table, the run's facts, errors along the surface, the footer.

use maud::{Markup, html};

use super::limit_line::limit_line_or_assumed;
use super::numbers::{NOTHING, counted, mm, number, whole};
use super::page::{Table, numeric, short, text, words};
use super::{Axis, BandPoint, Chart, Mark, Series, SeriesKind, Stroke, StudyReport};
use palpate_estimators::evaluation::{Located, Portion, Spread};
use palpate_estimators::setup::Bench;
use palpate_studies::{Arm, ArmOutcome, ArmResults, TrainedSeed};

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
        self.arm(arm).map(|arm| &arm.rig.bench)
    }

    /// An arm as the study has it.
    pub(crate) fn arm(&self, name: &str) -> Option<&'a Arm> {
        self.study.study.arms.iter().find(|arm| arm.name == name)
    }

    /// What is fitted, one and many: networks, or locators where some arm has another estimator.
    pub(crate) fn noun(&self) -> [&'static str; 2] {
        let trained = self.results.arms.iter().all(|arm| arm.epochs.is_some());
        if trained { ["network", "networks"] } else { ["locator", "locators"] }
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
        let trained = || self.results.arms.iter().filter(|arm| arm.converged.is_some());
        let left: usize = trained().map(|arm| arm.seeds - arm.converged.unwrap_or(arm.seeds)).sum();
        let networks: usize = trained().map(|arm| arm.seeds).sum();
        (left > 0).then(|| {
            format!(
                "{} of {} did not converge; their figures are counted with the others.",
                whole(left as f64),
                counted(networks, "network", "networks")
            )
        })
    }
}

/// "20–380 mm".
pub(crate) fn portion_in_words(portion: Portion) -> String {
    format!("{}–{} mm", mm(portion.from_m), mm(portion.to_m))
}

/// The median and the range from the 5th to the 95th percentile, over an arm's seeds, of a figure of each contact, the mean of all
/// readings of a seed at a position: by position in mm.
pub(crate) fn along(outcome: &ArmOutcome, figure: impl Fn(&Located) -> f64) -> Vec<(f64, Spread)> {
    let by_position = |fit: &TrainedSeed| -> Vec<(f64, f64)> {
        let positions = fit.evaluation.located.chunk_by(|a, b| a.truth == b.truth);
        let mean = |readings: &[Located]| readings.iter().map(&figure).sum::<f64>() / readings.len() as f64;
        positions.map(|readings| (readings[0].truth.x_m * 1e3, mean(readings))).collect()
    };
    let seeds: Vec<Vec<(f64, f64)>> = outcome.fits.iter().map(by_position).collect();
    let Some(first) = seeds.first() else { return Vec::new() };
    let at = |i: usize| Spread::of(seeds.iter().filter_map(|seed| Some(seed.get(i)?.1)).collect());
    first.iter().enumerate().filter_map(|(i, (x_mm, _))| Some((*x_mm, at(i)?))).collect()
}

/// A band from the 5th to the 95th percentile and a line along the medians. A single seed has no band.
pub(crate) fn banded(drawn: Drawn<'_>, along: &[(f64, Spread)], seeds: usize) -> Vec<Series> {
    let band = along.iter().map(|&(x, spread)| BandPoint { x, low: spread.p05, high: spread.p95 }).collect();
    let line = along.iter().map(|&(x, spread)| (x, spread.median)).collect();
    let series = |label: &str, kind| Series { label: label.to_owned(), colour: drawn.colour, kind };
    let line = series(drawn.label, SeriesKind::Line { points: line, stroke: Stroke::Solid });
    if seeds < 2 { vec![line] } else { vec![series("", SeriesKind::Band { points: band }), line] }
}

/// Location error along the surface, in mm on a logarithmic axis, against the limit of the first arm; `None` where no arm has a fit.
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
    (!series.is_empty()).then(|| error_chart_of(report, title, series))
}

/// The same of series that are already there.
pub(crate) fn error_chart_of(report: &StudyReport, title: &str, series: Vec<Series>) -> Chart {
    let tolerance_m = report.study.judging().tolerance_m;
    Chart {
        title: title.to_owned(),
        x: Axis::linear("load position, mm").from_to(0.0, report.length_m() * 1e3),
        y: Axis::log10("location error, mm").from_to(LEAST_ERROR_MM, report.length_m() * 1e3),
        series,
        marks: vec![Mark::HorizontalLine {
            y: tolerance_m * 1e3,
            label: format!("tolerance, {} mm", mm(tolerance_m)),
        }],
        ..Chart::default()
    }
}

/// Errors cross zero, which a logarithmic axis cannot show; below this nobody looks.
const LEAST_ERROR_MM: f64 = 0.05;

/// Every arm with its figures; a column only where some arm fills it.
pub(crate) fn arms_table(report: &StudyReport, table: usize) -> Markup {
    let arms = &report.results.arms;
    let columns: Vec<ArmColumn> = arm_columns(report)
        .into_iter()
        .filter(|column| arms.iter().any(|arm| (column.of)(arm).is_some()))
        .collect();
    let row = |arm: &ArmResults| {
        let cells = columns.iter().map(|column| (column.of)(arm).unwrap_or_else(|| text(NOTHING)));
        std::iter::once(text(&arm.name)).chain(cells).collect()
    };
    let headings = columns.iter().map(|column| numeric(column.heading.clone()));
    Table {
        number: table,
        caption: html! {
            "Every arm: median over the seeds, and beneath it the range from the 5th to the 95th percentile. Errors are in % \
             of the surface's length."
        },
        columns: std::iter::once(short("arm")).chain(headings).collect(),
        rows: arms.iter().map(row).collect(),
    }
    .markup()
}

/// What a column says of an arm; nothing where it has nothing to say.
type Cell<'a> = dyn Fn(&ArmResults) -> Option<Markup> + 'a;

/// A column of the arms' table.
struct ArmColumn<'a> {
    heading: String,
    of: Box<Cell<'a>>,
}

fn arm_columns<'a>(report: &StudyReport) -> Vec<ArmColumn<'a>> {
    fn column<'a>(
        heading: impl Into<String>,
        of: impl Fn(&ArmResults) -> Option<Markup> + 'a,
    ) -> ArmColumn<'a> {
        ArmColumn { heading: heading.into(), of: Box::new(of) }
    }
    let error = |portion| format!("average error, {}, %", unbroken(&portion_in_words(portion)));
    let mut columns = vec![
        column("seeds converged", |arm| {
            let converged = whole(arm.converged? as f64);
            Some(text(format!("{converged} of {}", whole(arm.seeds as f64))))
        }),
        column("iterations", |arm| Some(stacked(arm.epochs?, whole))),
    ];
    columns.extend(
        report.judged_portion().map(|all| column(error(all), |arm| Some(stacked(arm.error_percent, number)))),
    );
    columns.extend(report.study.judging().portions.iter().enumerate().map(|(i, portion)| {
        column(error(*portion), move |arm| Some(stacked(arm.portions.get(i)?.error_percent, number)))
    }));
    let span = |arm: &ArmResults| arm.training_span.clone();
    columns.push(column("training positions, mm", move |arm| {
        Some(text(unbroken(portion_in_words(span(arm)?.training_span).trim_end_matches(" mm"))))
    }));
    columns.push(column("average error between them, %", move |arm| {
        Some(stacked(span(arm)?.error_percent_within_training?, number))
    }));
    columns.push(column("beyond them, %", move |arm| {
        Some(stacked(span(arm)?.error_percent_beyond_training?, number))
    }));
    columns.push(column("largest error, %", |arm| Some(stacked(arm.max_error_percent, number))));
    let tolerance = mm(report.study.judging().tolerance_m);
    columns.push(column(format!("effective length, {tolerance} mm, %"), |arm| {
        Some(stacked(arm.effective_length_percent, number))
    }));
    columns.extend(report.judged_portion().map(|all| {
        let heading = format!("limit's average error, {}, %", unbroken(&portion_in_words(all)));
        column(heading, |arm| Some(text(number(arm.limit.as_ref()?.limit_error_percent))))
    }));
    columns.extend(report.study.judging().portions.iter().enumerate().map(|(i, portion)| {
        let heading = format!("limit's, {}, %", unbroken(&portion_in_words(*portion)));
        column(heading, move |arm| Some(text(number(arm.portions.get(i)?.limit_error_percent?))))
    }));
    columns.push(column("error over the limit's", |arm| {
        Some(stacked(arm.limit.as_ref()?.error_over_limit?, number))
    }));
    columns.push(column("95 % intervals that hold, %", |arm| Some(stacked(arm.coverage_percent?, number))));
    columns
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
    let mut facts = vec![
        ("palpate", run.palpate.to_owned()),
        ("study", run.study.clone()),
        ("seeds of each arm", counted_seeds(run.seeds)),
        ("threads", whole(run.threads as f64)),
        ("width of the numbers", format!("{:?}", run.precision).to_lowercase()),
        ("arithmetic", run.arithmetic.clone()),
        ("time of the fits", format!("{} s", number(run.seconds))),
    ];
    if run.presentations > 0 {
        facts.push(("patterns presented in this run", whole(run.presentations as f64)));
        facts.push(("patterns presented per second", whole(run.presentations_per_second)));
    }
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
            dd { "The contact positions whose readings a " (report.noun()[0]) " is " (if report.noun()[0] == "network" { "trained on" } else { "fitted to" }) "." }
            dt { "Percentage error" }
            dd { "The distance between the true and the estimated position, in % of the surface's length." }
            dt { "Effective length" }
            dd { "The share of the surface where the estimate is within " (tolerance) " mm of the truth." }
            @if report.results.arms.iter().any(|arm| arm.epochs.is_some()) {
                dt { "Iteration" }
                dd { "One epoch: every training position shown to the network once." }
            }
            @if report.results.arms.iter().any(|arm| arm.limit.is_some()) {
                dt { "Limit" }
                dd {
                    "The mean error of the best unbiased estimator for the noise of these readings (Cramér–Rao bound). Where readings \
                     hardly tell the position, it is still known that the contact lies on the surface; the limit's average reckons \
                     with that. Error over the limit's: at contacts whose limit is at most 1/200 of the length, not at the very ends."
                }
            }
            @if report.results.arms.iter().any(|arm| arm.coverage_percent.is_some()) {
                dt { "95 % intervals that hold" }
                dd { "The share of estimates whose 95 % interval holds the true position: 95 % if the estimator knows how sure it can be." }
            }
            dt { "Seed" }
            dd {
                @if report.results.arms.iter().any(|arm| arm.limit.is_some()) {
                    "The number from which the noise of an arm's recording follows, and a network's random start; "
                } @else {
                    "The number from which a network's random start follows. Networks that differ in nothing else come out \
                     differently, so "
                }
                "each figure here is the median over the seeds of its arm, with the range in which all but the \
                 lowest and the highest twentieth of them lie (5–95 %)."
            }
        }
    }
}
