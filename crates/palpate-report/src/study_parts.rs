//! What the reports of all studies share: the arms' table, the run's facts, errors along the surface.

use maud::{Markup, html};

use super::error_lines::{banded, limit_line_or_assumed, tolerance_mark};
use super::numbers::{NOTHING, counted, mm, number, stretch, whole};
use super::page::{Table, numeric, short, text, value, words};
use super::{Axis, Chart, Series, StudyReport};
use palpate_estimators::evaluation::{Located, Portion, Quantiles};
use palpate_studies::{Arm, ArmOutcome, ArmResults};

/// An arm among the lines of a figure.
#[derive(Clone, Copy)]
pub(crate) struct ArmLine<'a> {
    pub arm: &'a str,
    pub label: &'a str,
    pub colour: usize,
}

impl<'a> StudyReport<'a> {
    /// The outcome of an arm that has at least one fit.
    pub(crate) fn outcome(&self, arm: &str) -> Option<&'a ArmOutcome> {
        self.outcomes.iter().find(|outcome| outcome.name == arm && !outcome.fits.is_empty())
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
        self.study.study.arms.first().map_or(f64::NAN, |arm| arm.rig.setup.surface.extent().length_m())
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

/// The spread over an arm's seeds of a figure of each contact: by position in mm.
pub(crate) fn along(outcome: &ArmOutcome, figure: impl Fn(&Located) -> f64) -> Vec<(f64, Quantiles)> {
    outcome.by_position(figure).into_iter().map(|(x_m, spread)| (x_m * 1e3, spread)).collect()
}

/// The location error of an arm in mm along the surface, with a band over its seeds where there are several; nothing without a fit.
pub(crate) fn errors(report: &StudyReport, line: &ArmLine, with_band: bool) -> Vec<Series> {
    let Some(outcome) = report.outcome(line.arm) else { return Vec::new() };
    let along = along(outcome, |located| located.error_m() * 1e3);
    banded(line.label, line.colour, &along, with_band && outcome.fits.len() > 1)
}

/// Location error along the surface, in mm on a logarithmic axis, against the limit of the first arm; `None` where no arm has a fit.
pub(crate) fn error_chart(report: &StudyReport, title: &str, arms: &[ArmLine]) -> Option<Chart> {
    let mut series: Vec<Series> = arms.iter().flat_map(|line| errors(report, line, true)).collect();
    if series.is_empty() {
        return None;
    }
    series.extend(arms.iter().find_map(|line| limit_line_or_assumed(&report.arm(line.arm)?.rig.setup)));
    Some(chart_of_errors(report, title, series))
}

/// A chart of location errors in mm along the surface, on a logarithmic axis, with the tolerance.
pub(crate) fn chart_of_errors(report: &StudyReport, title: &str, series: Vec<Series>) -> Chart {
    let length_mm = report.length_m() * 1e3;
    let x = Axis::linear("load position, mm").from_to(0.0, length_mm);
    let y = Axis::log10("location error, mm").from_to(LEAST_ERROR_MM, length_mm);
    Chart::new(title, x, y, series).with_marks(vec![tolerance_mark(report.study.judging().tolerance_m)])
}

/// Errors cross zero, which a logarithmic axis cannot show; below this nobody looks.
const LEAST_ERROR_MM: f64 = 0.05;

/// Every arm with its figures; a column only where some arm fills it.
pub(crate) fn arms_table(report: &StudyReport) -> Table {
    let mut columns = arm_columns(report);
    columns.retain(|column| column.cells.iter().any(Option::is_some));
    let rows = report.results.arms.iter().enumerate().map(|(i, arm)| {
        let cells = columns.iter().map(|column| column.cells[i].clone().unwrap_or_else(|| text(NOTHING)));
        std::iter::once(text(&arm.name)).chain(cells).collect()
    });
    let rows: Vec<Vec<Markup>> = rows.collect();
    let headings = columns.into_iter().map(|column| numeric(column.heading));
    let caption = html! {
        "Every arm: median over the seeds, and beneath it the range from the 5th to the 95th percentile. Errors are in % \
         of the surface's length."
    };
    Table::new(std::iter::once(short("arm")).chain(headings).collect::<Vec<_>>(), rows, caption)
}

/// A column of the arms' table: what it says of each arm, where it has something to say.
struct ArmColumn {
    heading: String,
    cells: Vec<Option<Markup>>,
}

fn arm_columns(report: &StudyReport) -> Vec<ArmColumn> {
    let column = |heading: &str, cell: &dyn Fn(&ArmResults) -> Option<Markup>| ArmColumn {
        heading: heading.to_owned(),
        cells: report.results.arms.iter().map(cell).collect(),
    };
    let spread = |heading: &str, of: &dyn Fn(&ArmResults) -> Option<Quantiles>| {
        column(heading, &|arm| Some(stacked(of(arm)?, number)))
    };
    let judging = report.study.judging();
    let in_words = |portion: &Portion| unbroken(&stretch(*portion));
    let all = report.judged_portion().map(|portion| in_words(&portion));
    let portions: Vec<String> = judging.portions.iter().map(in_words).collect();

    let mut columns = vec![
        column("seeds converged", &|arm| {
            let converged = whole(arm.converged? as f64);
            Some(text(format!("{converged} of {}", whole(arm.seeds as f64))))
        }),
        column("iterations", &|arm| Some(stacked(arm.epochs?, whole))),
    ];
    columns.extend(
        all.iter().map(|all| spread(&format!("average error, {all}, %"), &|arm| Some(arm.error_percent))),
    );
    columns.extend(portions.iter().enumerate().map(|(i, portion)| {
        let heading = format!("average error, {portion}, %");
        spread(&heading, &|arm| Some(arm.portions.get(i)?.error_percent))
    }));
    columns.extend([
        column("training positions, mm", &|arm| {
            let span = stretch(arm.training_span.as_ref()?.training_span);
            Some(text(unbroken(span.trim_end_matches(" mm"))))
        }),
        spread("average error between them, %", &|arm| {
            arm.training_span.as_ref()?.error_percent_within_training
        }),
        spread("beyond them, %", &|arm| arm.training_span.as_ref()?.error_percent_beyond_training),
        spread("largest error, %", &|arm| Some(arm.max_error_percent)),
        spread(&format!("effective length, {} mm, %", mm(judging.tolerance_m)), &|arm| {
            Some(arm.effective_length_percent)
        }),
    ]);
    columns.extend(all.iter().map(|all| {
        let heading = format!("limit's average error, {all}, %");
        column(&heading, &|arm| Some(value(arm.limit.as_ref()?.limit_error_percent)))
    }));
    columns.extend(portions.iter().enumerate().map(|(i, portion)| {
        let heading = format!("limit's, {portion}, %");
        column(&heading, &|arm| Some(value(arm.portions.get(i)?.limit_error_percent?)))
    }));
    columns.extend([
        spread("error over the limit's", &|arm| arm.limit.as_ref()?.error_over_limit),
        spread("95 % intervals that hold, %", &|arm| arm.coverage_percent),
    ]);
    columns
}

/// The median, and beneath it the range where there is one.
fn stacked(spread: Quantiles, shown: fn(f64) -> String) -> Markup {
    let [median, low, high] = [spread.median, spread.p05, spread.p95].map(shown);
    html! { (median) @if low != median || high != median { span.range { (low) "–" (high) } } }
}

/// A text that no line is broken within.
fn unbroken(text: &str) -> String {
    text.replace(' ', "\u{a0}").replace('–', "\u{2060}–\u{2060}")
}

/// How the study was run.
pub(crate) fn run_table(report: &StudyReport) -> Table {
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
    let rows = facts.iter().map(|(name, value)| vec![text(name), text(value)]);
    let caption =
        html! { "The run. Networks that an earlier run had left are not among the patterns presented." };
    Table::new([words("fact"), words("value")], rows, caption)
}

fn counted_seeds(seeds: u64) -> String {
    match seeds {
        0 | 1 => whole(seeds as f64),
        _ => format!("{}, numbered 0 to {}", whole(seeds as f64), whole((seeds - 1) as f64)),
    }
}

/// The study and the seeds that a page was made from.
pub(crate) fn source(report: &StudyReport) -> Markup {
    let run = report.run;
    html! {
        " from the study " code { (run.study) } ", SHA-256 " code { (run.study_sha256) } ", " (report.seeds_in_words())
        " of each arm, seeds from 0"
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
