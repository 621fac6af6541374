//! Designs as people read them.

use super::Outcome;
use crate::failure::Failure;
use crate::output;
use crate::table::table;
use palpate_design::sensors::DesignCriterion;
use palpate_design::sensors::{CountPoint, Designed, best_design, enough};
use palpate_mechanics::units::{format_count, format_length_mm};

pub fn print(outcome: &Outcome) -> Result<(), Failure> {
    let (problem, design) = (outcome.problem, outcome.problem.design());
    output::say(format!(
        "{}: {} of {} candidate sensors, {} contacts, {} N, force {}; score: {}\n",
        outcome.rig.display(),
        design.count,
        format_count(problem.candidates() as u64),
        problem.contacts().len(),
        problem.force_n(),
        problem.force().name(),
        score_in_words(design.criterion)
    ))?;
    output::say(designs(outcome))?;
    if outcome.designed.iter().any(|designed| !designed.assessment.keeps_constraints) {
        output::say("* breaks a constraint of [design]")?;
    }
    output::say("")?;
    for designed in &outcome.designed {
        output::say(format!(
            "{}: {}",
            designed.method.name(),
            designed.layout.places_in_words(outcome.problem.extent())
        ))?;
    }
    if let Some(best) = best_design(&outcome.designed) {
        output::say(format!("\nBest: {}", gain(outcome, best)))?;
    }
    if outcome.counts.is_empty() { Ok(()) } else { print_counts(outcome) }
}

fn score_in_words(criterion: DesignCriterion) -> &'static str {
    match criterion {
        DesignCriterion::MeanLimit => "mean limit with the prior, mm",
        DesignCriterion::WorstLimit => "largest limit with the prior, mm",
        DesignCriterion::WithinTolerance => "contacts beyond the tolerance, %",
        DesignCriterion::DOptimality => "mean of ½·ln det of the least covariance",
    }
}

fn designs(outcome: &Outcome) -> String {
    let design = outcome.problem.design();
    let tolerance = format!("within {}, %", format_length_mm(design.tolerance_m));
    let mut heading = vec!["layout", "score", "mean limit, mm", "largest, mm", &tolerance, "one dead: score"];
    if design.has_costs() {
        heading.push("cost");
    }
    if !outcome.verified.is_empty() {
        heading.push("simulated error, mm");
    }
    let unit = design.criterion.score_scale();
    let rows = outcome.designed.iter().map(|designed| {
        let worth = &designed.assessment;
        let star = if worth.keeps_constraints { "" } else { " *" };
        let mut row = vec![
            format!("{}{star}", designed.method.name()),
            figure(Some(worth.score * unit)),
            figure(worth.mean_limit_m.map(|limit| limit * 1e3)),
            figure(worth.worst_limit_m.map(|limit| limit * 1e3)),
            format!("{:.1}", worth.within_tolerance_percent),
            figure(worth.score_one_dead.map(|score| score * unit)),
        ];
        if design.has_costs() {
            row.push(format!("{}", worth.cost));
        }
        if !outcome.verified.is_empty() {
            let told = outcome.verification(designed.method).map(|verification| {
                format!("{:.3} ± {:.3}", verification.mean_error_m * 1e3, verification.standard_error_m * 1e3)
            });
            row.push(told.unwrap_or_else(|| "–".to_owned()));
        }
        row
    });
    table(&heading, rows)
}

/// How much better than the even layout.
fn gain(outcome: &Outcome, best: &Designed) -> String {
    let name = best.method.name();
    let even = outcome.designed.iter().find(|designed| designed.method.name() == "even");
    let limits = even.and_then(|even| {
        let (even_m, best_m) = (even.assessment.mean_limit_m?, best.assessment.mean_limit_m?);
        Some((even_m * 1e3, best_m * 1e3, 100.0 * (1.0 - best_m / even_m)))
    });
    let Some((even_mm, best_mm, percent)) = limits else { return name.to_owned() };
    let compared = |percent: f64| {
        if percent >= 0.0 { format!("{percent:.1} % below") } else { format!("{:.1} % above", -percent) }
    };
    let mut words = format!(
        "{name}, mean limit {best_mm:.3} mm, {} the even layout's {even_mm:.3} mm",
        compared(percent)
    );
    let errors =
        even.and_then(|even| Some((outcome.verification(even.method)?, outcome.verification(best.method)?)));
    if let Some((even, best)) = errors {
        let percent = 100.0 * (1.0 - best.mean_error_m / even.mean_error_m);
        words += &format!(
            "; in simulation its error is {:.3} mm, {} the even layout's {:.3} mm",
            best.mean_error_m * 1e3,
            compared(percent),
            even.mean_error_m * 1e3
        );
    }
    words
}

fn print_counts(outcome: &Outcome) -> Result<(), Failure> {
    let unit = outcome.problem.design().criterion.score_scale();
    let row = |point: &CountPoint| {
        let even = point.even.as_ref();
        vec![
            point.count.to_string(),
            figure(even.map(|even| even.score * unit)),
            figure(even.and_then(|even| even.mean_limit_m).map(|limit| limit * 1e3)),
            figure(Some(point.designed.score * unit)),
            figure(point.designed.mean_limit_m.map(|limit| limit * 1e3)),
            figure(point.designed.worst_limit_m.map(|limit| limit * 1e3)),
            format!("{:.1}", point.designed.within_tolerance_percent),
        ]
    };
    let heading = [
        "sensors",
        "even: score",
        "mean limit, mm",
        "designed: score",
        "mean limit, mm",
        "largest, mm",
        "within, %",
    ];
    output::say(format!("\n{}", table(&heading, outcome.counts.iter().map(row))))?;
    match enough(&outcome.counts) {
        Some(count) => output::say(format!("\n{count} sensors come within 10 % of the score of the most.")),
        None => Ok(()),
    }
}

/// Three decimals, or a whole number where there are many digits before them; a dash for none.
fn figure(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(value) if value >= 100.0 => format_count(value.round() as u64),
        Some(value) => format!("{value:.3}"),
    }
}
