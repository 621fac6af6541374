//! `palpate design sensors`: which sensors where, against the even layout.

mod counts;
mod findings;
mod rig_file;
mod tables;

use super::{help, say_files};
use crate::failure::{Complaint, Failure};
use crate::progress::Observer;
use crate::{input, output};
use counts::{Counts, counts};
use palpate_design::sensors::SensorDesign;
use palpate_design::sensors::{
    CountPoint, DesignError, Designed, Method, SensorProblem, Verification, best_design,
};
use palpate_estimators::estimator::FitError;
use palpate_estimators::evaluation::EvaluationError;
use palpate_estimators::setup::Setup;
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_report::{SensorDesignReport, sensor_design_report};
use palpate_rig::Rig;
use std::path::{Path, PathBuf};

/// Where to put the sensors: layouts by several methods, scored by the location error that physics allows.
///
/// What they are chosen from and what they must keep to says the rig's [design]; without one, as many sensors of the rig's own
/// kinds are placed for contacts all over the surface.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file
    rig: PathBuf,
    /// Sensors to place [default: the rig's]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(1..=1000))]
    count: Option<u16>,
    /// How the limit falls with the number of sensors, as in `--counts 2..16`
    #[arg(long, value_name = "FROM..TO", value_parser = counts)]
    counts: Option<Counts>,
    /// The contact force [default: the rig's]
    #[arg(long, value_name = "FORCE", value_parser = input::force)]
    force: Option<f64>,
    /// Design for contacts whose force is not known; so it is for a rig without a force
    #[arg(long)]
    unknown_force: bool,
    /// Check the layouts by so many simulated calibrations each: fit, locate, measure [default: 3 with --out, else 0]
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "5",
          value_parser = clap::value_parser!(u16).range(0..=10_000))]
    verify: Option<u16>,
    /// Seed of the searches and simulations
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write the rig with the best layout
    #[arg(short, value_name = "RIG")]
    output: Option<PathBuf>,
    /// Folder for a report
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the designs as JSON
    #[arg(long)]
    json: bool,
}

/// Everything that was found out.
pub struct Outcome<'a> {
    rig: &'a Path,
    problem: &'a SensorProblem<'a>,
    designed: Vec<Designed>,
    /// What simulated calibrations say of some of them.
    verified: Vec<(Method, Verification)>,
    counts: Vec<CountPoint>,
    seed: u64,
}

impl Outcome<'_> {
    fn verification(&self, method: Method) -> Option<&Verification> {
        self.verified.iter().find(|(of, _)| *of == method).map(|(_, verification)| verification)
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let text = input::read_text(&arguments.rig)?;
    let rig = input::parse_rig(&arguments.rig, &text)?;
    if let Some(path) = &arguments.output {
        output::check_writable(path)?;
    }
    let (setup, design) = what_to_design(arguments, &rig)?;
    let observer = Observer::of_stages();
    let observe = |progress| observer.observe(progress);
    let watch = Watch::new(&observe);
    let problem =
        SensorProblem::new(&setup, &design, watch).map_err(|error| complaint(&error, &arguments.rig))?;
    let outcome = outcome(arguments, &rig, &problem, watch)?;
    drop(observer);
    if let (Some(path), Some(best)) = (&arguments.output, best_design(&outcome.designed)) {
        rig_file::write(path, &text, &best.layout)?;
    }
    if let Some(out) = &arguments.out {
        write_report(&outcome, &setup, out)?;
    }
    if arguments.json {
        return output::say_json(&findings::findings(&outcome));
    }
    tables::print(&outcome)?;
    say_files(arguments.output.as_deref(), arguments.out.as_deref())
}

/// The rig's bench and design, with what the command line says.
fn what_to_design(arguments: &Arguments, rig: &Rig) -> Result<(Setup, SensorDesign), Failure> {
    let force_n = arguments.force.or(rig.setup.force_n);
    let setup = Setup { force_n, ..rig.setup.clone() };
    let mut design = match &rig.design {
        Some(design) => design.clone(),
        None => SensorDesign::of(&rig.setup).map_err(|error| complaint(&error, &arguments.rig))?,
    };
    if arguments.unknown_force {
        design = design.unknown_force();
    }
    if let Some(count) = arguments.count {
        design.count = usize::from(count);
    }
    Ok((setup, design))
}

fn outcome<'a>(
    arguments: &'a Arguments,
    rig: &Rig,
    problem: &'a SensorProblem<'a>,
    watch: Watch,
) -> Result<Outcome<'a>, Failure> {
    let complain = |error: DesignError| complaint(&error, &arguments.rig);
    let designed = problem.all(arguments.seed, watch).map_err(complain)?;
    let counts = match &arguments.counts {
        None => Vec::new(),
        Some(range) => problem.counts(range.clone(), arguments.seed, watch).map_err(complain)?,
    };
    let calibrations = arguments.verify.unwrap_or(if arguments.out.is_some() { 3 } else { 0 });
    let mut verified = Vec::new();
    if calibrations > 0 {
        for designed in to_verify(&designed) {
            let verification = problem.verify(
                &designed.layout,
                &rig.estimator,
                usize::from(calibrations),
                arguments.seed,
                watch,
            );
            let complain = |error: EvaluationError<FitError>| match Failure::of(&error) {
                Failure::BadInput(_) => {
                    Complaint::new(format!("{}: cannot verify: {error}", arguments.rig.display())).into()
                }
                stopped => stopped,
            };
            verified.push((designed.method, verification.map_err(complain)?));
        }
    }
    Ok(Outcome { rig: &arguments.rig, problem, designed, verified, counts, seed: arguments.seed })
}

/// What the design is compared with, and the design; of searches that found the same, one.
fn to_verify(designed: &[Designed]) -> impl Iterator<Item = &Designed> {
    let best = best_design(designed).map(|best| best.method);
    designed.iter().filter(move |designed| !designed.method.is_search() || Some(designed.method) == best)
}

fn write_report(outcome: &Outcome, setup: &Setup, out: &Path) -> Result<(), Failure> {
    let report = SensorDesignReport {
        title: &format!("Sensors for {}", outcome.rig.display()),
        setup,
        problem: outcome.problem,
        designed: &outcome.designed,
        verified: &outcome.verified,
        counts: &outcome.counts,
        seed: outcome.seed,
    };
    let files = sensor_design_report(&report);
    output::write_report(out, files)
}

fn complaint(error: &DesignError, rig: &Path) -> Failure {
    if Cancelled::caused(error) {
        return Failure::stopped();
    }
    Complaint::new(format!("{}: {error}", rig.display())).help(help::for_sensors(error)).into()
}
