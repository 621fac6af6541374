//! `palpate profile`: how force is spread over the surface, reading by reading.

mod findings;
mod tables;

use crate::commands::locate::columns;
use crate::failure::{Complaint, Failure};
use crate::lines::Lines;
use crate::{input, output};
use findings::Findings;
use palpate_estimators::estimator::{
    LoadProfile, LoadSensors, LoadSensorsError, Locator, PatchLimit, Profiler, patch_limits,
};
use palpate_estimators::recording::ReadingParser;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::simulate_loads;
use palpate_mechanics::surface::UniformLoad;
use palpate_report::{ProfileReport, profile_report};
use palpate_rig::Rig;
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
    fn setup(&self) -> &Setup {
        match self {
            Self::Rig(rig) => &rig.setup,
            Self::Locator(locator) => &locator.setup,
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
        Subject::Rig(rig) => LoadSensors::of(&rig.setup),
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
        LoadSensorsError::Noise(error) => error.help(),
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
        let readings = simulate_loads(self.subject.setup(), loads, 1, self.arguments.seed);
        for reading in readings.map_err(Complaint::new)? {
            self.tell(&reading, None)?;
        }
        Ok(())
    }

    fn stream(&mut self, path: &Path) -> Result<(), Failure> {
        let mut lines = Lines::open(path)?;
        let columns = columns(self.subject.setup(), self.arguments.no_header);
        let mut parser = ReadingParser::new(&lines.name, &columns);
        let mut lost = 0;
        while let Some(line) = lines.next()? {
            match parser.parse_line(line) {
                Ok(None) => {}
                Ok(Some(reading)) => self.tell(&reading, Some(lines.count))?,
                Err(error) if parser.awaits_columns() => return Err(input::csv_complaint(&error)),
                Err(error) => {
                    lost += 1;
                    eprintln!("palpate: skipped: {error}");
                }
            }
        }
        if self.told == 0 && lost == 0 {
            return Err(Complaint::new(format!("{} holds no reading", lines.name)).into());
        }
        match lost {
            0 => Ok(()),
            lost => Err(Failure::DataLost(format!("{lost} of {} lines gave no profile", lines.count))),
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
        tables::print(&findings)?;
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
            layout: &self.subject.setup().layout,
            reading,
            profile,
            limits,
            resolution: resolution.as_ref(),
            truth: self.truth,
        };
        // The page holds its figures; the others are copies of them.
        let files = profile_report(&report);
        let page = files.iter().find(|file| file.name.ends_with(".html"));
        page.map_or(Ok(()), |page| output::write_file(path, &page.bytes))
    }
}
