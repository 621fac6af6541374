//! Descriptions of locators.

use super::parameters::{decimals, parameter_lines};
use crate::centroid::Weighting;
use crate::estimator::{CandidateErrors, Locator, Method};
use crate::influence::InfluenceLocator;
use crate::influence::measured::{MeasuredLocator, NuisanceRole};
use crate::interval_check::{Coverage, IntervalCheck, UNBOUNDED};
use crate::network::Topology;
use palpate_mechanics::units::{format_count, format_length_mm};
use palpate_numerics::FEWEST_FOR_95;

/// Describes setup, parameters, checks and recording.
pub fn locator(locator: &Locator) -> Vec<String> {
    let provenance = &locator.provenance;
    let mut lines = vec![format!(
        "a locator, {}, fitted by palpate {}, seed {}",
        locator.kind(),
        provenance.palpate,
        provenance.seed
    )];
    lines.extend(super::setup(&locator.setup));
    lines.extend(choice(&provenance.choice));
    lines.extend(method(locator));
    if let Some(check) = &locator.check {
        lines.push(if check.keeps_intervals() {
            format!(
                "status of an estimate: by {}; its interval: by errors at positions that were held out",
                check.in_words()
            )
        } else {
            format!("status and interval of an estimate: by {}", check.in_words())
        });
    }
    lines.push(match locator.false_alarm_rate() {
        Some(rate) if locator.untouched_scatter.is_some() => {
            format!(
                "false-alarm rate: {rate}, from noise and scatter of the untouched rows"
            )
        }
        Some(rate) => format!("false-alarm rate: {rate}, from the noise of the channels"),
        None => "untouched readings are not distinguished from contacts: the readings of the untouched surface are unknown"
            .to_owned(),
    });
    lines.extend(interval_check(locator.interval_check.as_ref()));
    let recording = &provenance.recording;
    let placement =
        recording.placement_sd_m.map_or_else(String::new, |sd_m| format!(", {}", super::placement(sd_m)));
    lines.push(format!("fitted to: {}, {} rows{placement}", recording.source, recording.rows));
    for digest in &recording.digests {
        lines.push(format!("    sha256 {digest}"));
    }
    lines
}

/// Describes the choice and its margin.
pub fn choice(tried: &[CandidateErrors]) -> Option<String> {
    let figures = |one: &CandidateErrors| {
        let [error, score] = [one.mean_error_m, one.interval_score_m].map(format_length_mm);
        format!("{} (mean error {error}, interval score {score})", one.name)
    };
    let (best, others) = tried.split_first()?;
    let Some(next) = others.first() else {
        return Some(format!("chosen at held-out positions: {}, the only one that suits", figures(best)));
    };
    if next.score_m() < best.score_m() {
        let others: Vec<String> = others.iter().map(figures).collect();
        return Some(format!(
            "chosen at held-out positions: {}, which is simpler and not significantly worse than {}",
            figures(best),
            others.join(", ")
        ));
    }
    let percent = 100.0 * (1.0 - best.score_m() / next.score_m());
    let behind: Vec<String> = others.iter().map(figures).collect();
    Some(format!(
        "chosen at held-out positions: {}, {percent:.0} % better than {}",
        figures(best),
        behind.join(", ")
    ))
}

/// Describes the interval check.
pub fn interval_check(check: Option<&IntervalCheck>) -> Vec<String> {
    let Some(check) = check else {
        return vec![format!(
            "95 % intervals: not checked, which takes presses at {FEWEST_FOR_95} places or more"
        )];
    };
    let line = |what: &str, per_unit: f64, unit: &str, coverage: Coverage| {
        let Coverage { before_percent, after_percent, added_sd, factor } = coverage;
        let added_sd = per_unit * added_sd;
        let added = format!("a standard deviation of {added_sd:.*} {unit}", decimals(added_sd, 2));
        let widened = match (added_sd > 0.0, factor > 1.0) {
            _ if factor >= UNBOUNDED => {
                "; some lie where an interval has no length, so that intervals are unbounded".to_owned()
            }
            (false, false) => String::new(),
            (false, true) => format!("; {after_percent:.1} % once widened by the factor {factor:.2}"),
            (true, false) => format!("; {after_percent:.1} % once widened by {added}"),
            (true, true) => {
                format!("; {after_percent:.1} % once widened by {added} and the factor {factor:.2}")
            }
        };
        format!(
            "95 % intervals at {} places held out: {before_percent:.1} % contain the {what}{widened}",
            check.places
        )
    };
    let position = line("position", 1e3, "mm", check.position);
    let outside = check.outside_model_percent().map(|percent| {
        format!(
            "presses held out that the estimator's model does not explain (`outside_model`): {percent:.1} %"
        )
    });
    let force = check.force.map(|force| line("force", 1.0, "N", force));
    [Some(position), force, outside].into_iter().flatten().collect()
}

fn method(locator: &Locator) -> Vec<String> {
    match &locator.method {
        Method::Network(network) => {
            let network = network.parts();
            let outcome = network.outcome;
            vec![
                format!("network: {} ({} weights)", shape(&network.topology), network.weights.len()),
                format!(
                    "training: {} after {} epochs, aggregate error {:.2e}",
                    outcome.status,
                    format_count(u64::from(outcome.epochs)),
                    outcome.aggregate_error
                ),
            ]
        }
        Method::Influence(InfluenceLocator::Beam(beam)) => vec![format!(
            "influence functions of {} sensors at {} nodes; {} at once",
            beam.table().sensors,
            beam.table().nodes(),
            match beam.contacts() {
                1 => "one contact".to_owned(),
                most => format!("up to {most} contacts"),
            }
        )],
        Method::Influence(InfluenceLocator::Plane(plane)) => vec![format!(
            "influence functions of {} sensors at {} × {} nodes; one contact at once",
            plane.table().sensors,
            plane.table().columns,
            plane.table().rows
        )],
        Method::Influence(InfluenceLocator::ForceLinear(linear)) => {
            parameter_lines(linear, &locator.setup.layout().names())
        }
        Method::Influence(InfluenceLocator::Measured(measured)) => vec![free(measured)],
        Method::NetworkLm(networks) => networks
            .members
            .iter()
            .map(|member| {
                format!(
                    "network: {}, {:.0} of {} weights in effect, log evidence {:.0}, {} iterations",
                    shape(&networks.topology),
                    member.effective_parameters,
                    member.weights.len(),
                    member.log_evidence,
                    member.iterations
                )
            })
            .collect(),
        Method::GaussianProcess(gaussian) => vec![format!(
            "Gaussian process from {} features through {} presses, log evidence {:.0}",
            gaussian.process.coordinates(),
            gaussian.process.points(),
            gaussian.process.log_evidence()
        )],
        Method::ClosedForm(_) => vec!["the equations of the beam, without learnt parameters".to_owned()],
        Method::Digit(_) => vec!["the equations of the bending finger, without learnt parameters".to_owned()],
        Method::Neighbours(neighbours) => {
            vec![format!("the {} nearest of {} presses", neighbours.count, neighbours.rows.len())]
        }
        Method::Centroid(centroid) => vec![match centroid.weighing {
            Weighting::Positions(_) => "the centroid of the sensors' positions, calibrated".to_owned(),
            Weighting::Channels => "the centroid of the channels at calibrated positions".to_owned(),
        }],
    }
}

fn free(measured: &MeasuredLocator) -> String {
    let table = measured.table();
    let counts = [table.x.count, table.y.count, table.nuisance.count];
    let nodes: Vec<String> = counts.iter().filter(|count| **count > 1).map(usize::to_string).collect();
    let (nuisance, why) = match measured.role() {
        NuisanceRole::None => ("", "no other quantity was recorded, or the rig requests it"),
        NuisanceRole::Force => (
            " and force",
            "the presses show that they are not a multiple of a function of the force, or the rig requests it",
        ),
        NuisanceRole::Other => (" and the nuisance coordinate", "the rig names a nuisance column"),
    };
    format!(
        "structure: free; readings learnt from the recording as functions of position{nuisance}, since {why}: {} nodes",
        nodes.join(" × ")
    )
}

fn shape(topology: &Topology) -> String {
    topology.sizes.iter().map(usize::to_string).collect::<Vec<_>>().join("–")
}
