//! `palpate inspect`: what any of palpate's files holds, in words.

use super::learnt;
use crate::failure::Failure;
use crate::json::object;
use crate::{input, output};
use palpate_estimators::arrangement::{Arrangement, Training};
use palpate_estimators::centroid::Weighing;
use palpate_estimators::estimator::{Locator, Method};
use palpate_estimators::influence::InfluenceLocator;
use palpate_estimators::influence::measured::{MeasuredLocator, NuisanceRole};
use palpate_estimators::network::Topology;
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{Extent, SurfaceSpec};
use palpate_mechanics::units::{Dimension, Quantity, format_count, format_length_mm};
use palpate_rig::Rig;
use std::path::{Path, PathBuf};

/// Say in words what a file holds: a rig, a study, a locator, a recording or a study's networks.
#[derive(clap::Args)]
pub struct Arguments {
    /// The file
    file: PathBuf,
    /// The rig whose recording it is, to read a CSV by
    #[arg(long, value_name = "RIG")]
    rig: Option<PathBuf>,
    /// Print what is said as JSON, and what a locator of a surface without a model has learnt of it as numbers
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.file;
    let text = input::read_text(path)?;
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let mut fitted = None;
    let lines = match extension.to_ascii_lowercase().as_str() {
        "toml" if text.lines().any(|line| line.trim_start().starts_with("[[arm]]")) => study(path, &text)?,
        "toml" => rig(&input::read_rig(path)?),
        "csv" => csv(path, &text, arguments.rig.as_deref())?,
        _ => locator(fitted.insert(input::parse_locator(path, &text)?)),
    };
    if !arguments.json {
        return output::say(lines.join("\n"));
    }
    output::say_json(&object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "file": path.display().to_string(),
        "says": lines,
        "estimator"?: fitted.as_ref().map(|locator| locator.kind()),
        "learnt"?: fitted.as_ref().and_then(learnt::of_locator).map(|(linear, names)| learnt::json(linear, &names)),
    })
}

fn rig(rig: &Rig) -> Vec<String> {
    let mut lines = vec!["a rig".to_owned()];
    lines.extend(setup(&rig.setup));
    if let Some(training) = &rig.training {
        lines.push(format!("training positions: {}", training_words(training)));
    }
    lines.push(format!("estimator: {}", rig.estimator.kind()));
    lines.extend(
        rig.estimator
            .settings(&rig.setup)
            .iter()
            .map(|setting| format!("    {}: {}", setting.name, setting.value)),
    );
    lines
}

fn setup(setup: &Setup) -> Vec<String> {
    let extent = setup.surface().extent();
    let modulus = |value| Quantity { value, dimension: Dimension::Modulus };
    let surface = match setup.surface() {
        SurfaceSpec::Beam(beam) => format!(
            "simply supported beam, {} × {} × {}, Young's modulus {}",
            format_length_mm(beam.length_m()),
            format_length_mm(beam.width_m()),
            format_length_mm(beam.thickness_m()),
            modulus(beam.youngs_modulus_pa())
        ),
        SurfaceSpec::SupportedBeam(beam) => format!(
            "beam, {} long, {}; section {}; Young's modulus {}",
            format_length_mm(extent.length_m()),
            beam.spec().supports_in_words(),
            beam.spec().sections_in_words(),
            modulus(beam.spec().youngs_modulus_pa)
        ),
        SurfaceSpec::Plate(plate) => format!(
            "plate, {} × {} × {}, Young's modulus {}, Poisson's ratio {}",
            format_length_mm(plate.spec().length_m),
            format_length_mm(plate.spec().width_m),
            format_length_mm(plate.spec().thickness_m),
            modulus(plate.spec().youngs_modulus_pa),
            plate.spec().poissons_ratio
        ),
        SurfaceSpec::Digit(digit) => format!(
            "flexible digit, {} × {} × {}, Young's modulus {}, contact forces {}; E·I/l² is {:.3} N",
            format_length_mm(digit.length_m()),
            format_length_mm(digit.width_m()),
            format_length_mm(digit.thickness_m()),
            modulus(digit.youngs_modulus_pa()),
            digit.direction().name(),
            digit.characteristic_force_n()
        ),
        SurfaceSpec::Measured(_) => match extent.width_m() {
            Some(width_m) => {
                format!("measured, {} × {}", format_length_mm(extent.length_m()), format_length_mm(width_m))
            }
            None => format!("measured, {} long", format_length_mm(extent.length_m())),
        },
    };
    let force = setup.force_n().map_or("unknown".to_owned(), |force_n| format!("{force_n} N, known"));
    vec![
        format!("surface: {surface}"),
        format!("sensors: {}", layout(setup.layout(), extent)),
        format!("contact force: {force}"),
    ]
}

fn layout(layout: &Layout, extent: Extent) -> String {
    let names: Vec<String> = layout
        .sensors()
        .iter()
        .map(|sensor| match sensor.kind {
            SensorKind::Raw => sensor.name.clone(),
            kind => format!("{kind} at {}", extent.place_in_words(sensor.position)),
        })
        .collect();
    let separator = match extent {
        Extent::Line { .. } => ", ",
        Extent::Plane { .. } => "; ",
    };
    format!("{}: {}", layout.len(), names.join(separator))
}

fn training_words(training: &Training) -> String {
    let rule = match &training.arrangement {
        Arrangement::Even => "evenly".to_owned(),
        Arrangement::Chebyshev => "at Chebyshev's nodes".to_owned(),
        Arrangement::EvenOver { portion: (start, end) } => {
            format!("evenly from {start:.4} to {end:.4} of the length")
        }
        Arrangement::Grid { columns, rows } => format!("a grid of {columns} × {rows}"),
        Arrangement::EdgeDense { middle, .. } => format!("edge-dense, {middle} in the middle"),
        Arrangement::Explicit(_) => "as listed".to_owned(),
    };
    format!("{}, {rule}, {} × each", training.count, training.repeats)
}

fn study(path: &Path, text: &str) -> Result<Vec<String>, Failure> {
    let study = input::parse_study(&path.display().to_string(), text)?;
    let mut lines = vec![format!(
        "the study {}: {} arms × {} seeds, judged at {} positions",
        study.name,
        study.arms.len(),
        study.seeds,
        study.judging.positions.len()
    )];
    if let Some(arm) = study.arms.first() {
        lines.extend(setup(&arm.rig.setup));
    }
    for arm in &study.arms {
        let training = arm.rig.training.as_ref().map_or_else(String::new, training_words);
        let asked = arm.layout.as_ref().map(|layout| format!(", layout {}", layout.method.name()));
        let (kind, asked) = (arm.rig.estimator.kind(), asked.unwrap_or_default());
        lines.push(format!("arm {}: {training}, {kind}{asked}", arm.name));
    }
    Ok(lines)
}

fn locator(locator: &Locator) -> Vec<String> {
    let provenance = &locator.provenance;
    let mut lines = vec![format!(
        "a locator, {}, fitted by palpate {}, seed {}",
        locator.kind(),
        provenance.palpate,
        provenance.seed
    )];
    lines.extend(setup(&locator.setup));
    lines.extend(method(locator));
    if let Some(check) = &locator.check {
        lines.push(format!("status and interval of an estimate: by {}", check.in_words()));
    }
    lines.push(match locator.false_alarm_rate() {
        Some(rate) => format!("untouched readings taken for a contact: {rate}, by the noise of the channels"),
        None => "untouched readings are not told from contacts: it does not know what the board reads then"
            .to_owned(),
    });
    let recording = &provenance.recording;
    lines.push(format!("fitted to: {}, {} rows", recording.source, recording.rows));
    for digest in &recording.digests {
        lines.push(format!("    sha256 {digest}"));
    }
    lines
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
            learnt::in_words(linear, &locator.setup.layout().names())
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
        Method::ClosedForm(_) => vec!["the beam's own equations; nothing was learnt".to_owned()],
        Method::Digit(_) => vec!["the bending finger's own equations; nothing was learnt".to_owned()],
        Method::Neighbours(neighbours) => {
            vec![format!("the {} nearest of {} presses", neighbours.count, neighbours.rows.len())]
        }
        Method::Centroid(centroid) => vec![match centroid.weighing {
            Weighing::Positions(_) => "the centroid of the sensors' positions, calibrated".to_owned(),
            Weighing::Channels => {
                "the centroid of the channels, whose positions calibration finds".to_owned()
            }
        }],
    }
}

fn free(measured: &MeasuredLocator) -> String {
    let table = measured.table();
    let counts = [table.x.count, table.y.count, table.nuisance.count];
    let nodes: Vec<String> = counts.iter().filter(|count| **count > 1).map(usize::to_string).collect();
    let (nuisance, why) = match measured.role() {
        NuisanceRole::None => ("", "nothing else was recorded that they depend on, or the rig asks for it"),
        NuisanceRole::Force => (
            " and force",
            "they are no multiple of a function of the force, as far as the presses tell, or the rig asks for it",
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

/// Description of a CSV file: with a rig as its recording, otherwise as a table.
fn csv(path: &Path, text: &str, rig: Option<&Path>) -> Result<Vec<String>, Failure> {
    let Some(rig) = rig else { return Ok(table(text)) };
    let setup = input::read_rig(rig)?.setup;
    let recording = input::read_recording(&setup, path)?;
    let positions = recording.distinct_positions();
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ends = |of: fn(&Position) -> f64| {
        let (low, high) = range(&mut positions.iter().map(of));
        format!("{} to {}", format_length_mm(low), format_length_mm(high))
    };
    let positioned = match setup.surface().extent() {
        Extent::Line { .. } => ends(|at| at.x_m),
        Extent::Plane { .. } => format!("{} along, {} across", ends(|at| at.x_m), ends(|at| at.y_m)),
    };
    let mut lines = vec![
        format!("a recording: {} rows at {} positions", recording.rows.len(), positions.len()),
        format!("positions: {positioned}"),
    ];
    for (i, (name, kind)) in recording.channels.iter().zip(&recording.kinds).enumerate() {
        let (low, high) = range(&mut recording.rows.iter().map(|row| row.reading[i]));
        let shown = |value| Quantity { value, dimension: kind.dimension() };
        lines.push(format!("channel {name} ({kind}): {} to {}", shown(low), shown(high)));
    }
    Ok(lines)
}

fn table(text: &str) -> Vec<String> {
    let comments = text.lines().take_while(|line| line.starts_with('#'));
    let mut lines: Vec<String> =
        comments.map(|line| line.trim_start_matches(['#', ' ']).to_owned()).collect();
    let mut rows = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let columns = rows.next().unwrap_or_default();
    lines.push(format!("a table of {} rows", rows.count()));
    lines.push(format!("columns: {}", columns.replace(',', ", ")));
    lines.push("--rig RIG reads it as a recording of that rig".to_owned());
    lines
}
