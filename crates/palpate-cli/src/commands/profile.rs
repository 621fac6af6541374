//! `palpate profile`: how force is spread over the surface, reading by reading.

mod findings;

use crate::commands::locate::{columns, open};
use crate::failure::{Complaint, Failure};
use crate::table::table;
use crate::{input, interrupt, output};
use findings::{Findings, Interval, TrueLoad};
use palpate::bench::Bench;
use palpate::estimator::{
    LoadProfile, LoadSensorsError, Locator, PatchLimit, Profiler, bench_load_sensors, patch_limits,
};
use palpate::mechanics::UniformLoad;
use palpate::recording::ReadingParser;
use palpate::report::{ProfileReport, profile_report};
use palpate::rig::Rig;
use palpate::simulate::simulate_loads;
use std::io::BufRead;
use std::path::{Path, PathBuf};

/// Tell how force is spread over the surface: total, centre of pressure and patches, with intervals and limits.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file, or a locator
    subject: PathBuf,
    /// The readings; `-` for stdin; without them the rig's [[load]] sections are simulated
    readings: Option<PathBuf>,
    /// The readings have no header: a row is one value a channel, in the layout's order
    #[arg(long)]
    no_header: bool,
    /// Seed of noise and faults of a simulated reading
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// A page about the first reading
    #[arg(long, value_name = "PAGE.html")]
    report: Option<PathBuf>,
    /// Print one JSON object a line
    #[arg(long)]
    json: bool,
}

/// What readings are told by.
enum Subject {
    Rig(Box<Rig>),
    Locator(Box<Locator>),
}

impl Subject {
    fn bench(&self) -> &Bench {
        match self {
            Self::Rig(rig) => &rig.bench,
            Self::Locator(locator) => &locator.bench,
        }
    }

    /// Loads that are simulated where there are no readings.
    fn loads(&self) -> &[UniformLoad] {
        match self {
            Self::Rig(rig) => &rig.loads,
            Self::Locator(_) => &[],
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(report) = &arguments.report {
        output::check_writable(report)?;
    }
    let path = &arguments.subject;
    let is_rig = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let subject = if is_rig {
        Subject::Rig(Box::new(input::read_rig(path)?))
    } else {
        Subject::Locator(Box::new(input::read_locator(path)?))
    };
    let sensors = match &subject {
        Subject::Rig(rig) => bench_load_sensors(&rig.bench),
        Subject::Locator(locator) => locator.load_sensors(),
    };
    let profiler = Profiler::new(sensors.map_err(|error| sensors_complaint(error, path))?);
    let mut printer = Printer { arguments, subject: &subject, profiler: &profiler, truth: &[], told: 0 };
    match &arguments.readings {
        Some(readings) => printer.stream(readings),
        None => printer.simulated(),
    }
}

fn sensors_complaint(error: LoadSensorsError, path: &Path) -> Complaint {
    let help = match error {
        LoadSensorsError::NoModel => "give a surface with a model, such as `kind = \"beam\"`",
        LoadSensorsError::SingularNoise { .. } => {
            "add `noise = \"5 um\"` to [sensors], in the unit of the readings"
        }
        LoadSensorsError::AllDead { .. } => "take sensors out of `dead` in [sensors]",
    };
    Complaint::new(format!("{}: {error}", path.display())).help(help)
}

struct Printer<'a> {
    arguments: &'a Arguments,
    subject: &'a Subject,
    profiler: &'a Profiler<'a>,
    /// The loads that were simulated.
    truth: &'a [UniformLoad],
    /// Readings that gave a profile.
    told: u64,
}

impl Printer<'_> {
    fn simulated(&mut self) -> Result<(), Failure> {
        let loads = self.subject.loads();
        if loads.is_empty() {
            let path = self.arguments.subject.display();
            let complaint =
                Complaint::new(format!("{path} has no [[load]] to simulate, and no readings are given"));
            let help = "name a file of readings, or add [[load]] with `from`, `to` and `force` to the rig";
            return Err(complaint.help(help).into());
        }
        self.truth = loads;
        let readings = simulate_loads(self.subject.bench(), loads, 1, self.arguments.seed);
        for reading in readings.map_err(Complaint::new)? {
            self.tell(&reading, None)?;
        }
        Ok(())
    }

    fn stream(&mut self, path: &Path) -> Result<(), Failure> {
        let (name, mut source) = open(path)?;
        let columns = columns(self.subject.bench(), self.arguments.no_header);
        let mut parser = ReadingParser::new(&name, &columns);
        let (mut line, mut number, mut lost) = (Vec::new(), 0, 0);
        while !interrupt::asked() {
            line.clear();
            let read = source.read_until(b'\n', &mut line);
            if read.map_err(|error| Complaint::new(format!("cannot read {name}: {error}")))? == 0 {
                break;
            }
            number += 1;
            match parser.parse_line(&line) {
                Ok(None) => {}
                Ok(Some(reading)) => self.tell(&reading, Some(number))?,
                Err(error) if parser.awaits_columns() => return Err(input::csv_complaint(&error)),
                Err(error) => {
                    lost += 1;
                    eprintln!("palpate: skipped: {error}");
                }
            }
        }
        if self.told == 0 && lost == 0 {
            return Err(Complaint::new(format!("{name} holds no reading")).into());
        }
        match lost {
            0 => Ok(()),
            lost => Err(Failure::DataLost(format!("{lost} of {number} lines gave no profile"))),
        }
    }

    /// Prints the profile of a reading, and writes the page about the first.
    fn tell(&mut self, reading: &[f64], line: Option<u64>) -> Result<(), Failure> {
        let profile = self.profiler.profile(reading).map_err(Complaint::new)?;
        let extent = self.profiler.cells().extent;
        let loads: Vec<UniformLoad> = profile.patches.iter().map(|patch| patch.as_load(extent)).collect();
        let limits = patch_limits(self.profiler.sensors(), &loads);
        self.told += 1;
        if let (1, Some(path)) = (self.told, &self.arguments.report) {
            self.write_report(reading, &profile, limits.as_deref(), path)?;
        }
        let findings = Findings::of(self.profiler, &profile, limits.as_deref(), self.truth, line);
        if self.arguments.json {
            let json = serde_json::to_string(&findings).map_err(Complaint::new)?;
            return output::say(json);
        }
        print(&findings)?;
        match (self.told, &self.arguments.report) {
            (1, Some(path)) => output::say(format!("\nReport: {}", path.display())),
            _ => Ok(()),
        }
    }

    fn write_report(
        &self,
        reading: &[f64],
        profile: &LoadProfile,
        limits: Option<&[PatchLimit]>,
        path: &Path,
    ) -> Result<(), Failure> {
        let resolution = self.profiler.resolution(profile);
        let report = ProfileReport {
            title: &format!("The load on {}", self.arguments.subject.display()),
            layout: &self.subject.bench().layout,
            reading,
            profile,
            limits,
            resolution: resolution.as_ref(),
            truth: self.truth,
        };
        let files = profile_report(&report).map_err(Complaint::new)?;
        // The page holds its figures; the others are copies of them.
        let page = files.iter().find(|file| file.name.ends_with(".html"));
        page.map_or(Ok(()), |page| output::write_file(path, &page.bytes))
    }
}

fn print(findings: &Findings) -> Result<(), Failure> {
    let interval = |value: &Interval, unit: &str| {
        format!("{:.3} {unit} ({:.3} to {:.3})", value.value, value.low, value.high)
    };
    let heading = match findings.line {
        Some(line) => format!("line {line}: {}", findings.status),
        None => format!("simulated: {}", findings.status),
    };
    output::say(heading)?;
    output::say(format!(
        "misfit {:.1}; noise seldom makes more than {:.1}",
        findings.misfit, findings.worst_misfit
    ))?;
    let Some(centre) = &findings.centre_x_mm else { return Ok(()) };
    output::say(format!("total force         {}", interval(&findings.total_n, "N")))?;
    output::say(format!("centre of pressure  {}", interval(centre, "mm")))?;
    if let Some(width_mm) = findings.resolution_mm {
        output::say(format!(
            "resolution          {width_mm:.0} mm, the median width of the averaging kernels"
        ))?;
    }
    let heading = ["patch", "stretch, mm", "centre, mm", "limit", "force, N", "limit"];
    let limit = |limit: Option<f64>| limit.map_or_else(|| "–".to_owned(), |limit| format!("{limit:.3}"));
    let cell = |value: &Interval| format!("{:.3} ({:.3} to {:.3})", value.value, value.low, value.high);
    let rows = findings.patches.iter().enumerate().map(|(i, patch)| {
        let [from, to] = patch.stretch_mm;
        vec![
            (i + 1).to_string(),
            format!("{from:.0}–{to:.0}"),
            cell(&patch.centre_x_mm),
            limit(patch.limit_x_mm),
            cell(&patch.force_n),
            limit(patch.limit_force_n),
        ]
    });
    output::say(format!("\n{}", table(&heading, rows)))?;
    if findings.loads.is_empty() {
        return Ok(());
    }
    let rows = findings.loads.iter().enumerate().map(|(i, load): (usize, &TrueLoad)| {
        vec![
            (i + 1).to_string(),
            format!("{:.0}–{:.0}", load.stretch_mm[0], load.stretch_mm[1]),
            format!("{:.3}", load.centre_x_mm),
            limit(load.limit_x_mm),
            format!("{:.3}", load.force_n),
            limit(load.limit_force_n),
        ]
    });
    let heading = ["true load", "stretch, mm", "centre, mm", "limit", "force, N", "limit"];
    output::say(format!("\n{}", table(&heading, rows)))
}
