//! `palpate profile`: the load profile of each reading.

use crate::failure::{Failure, UserError};
use crate::input::RigOrLocator;
use crate::lines::{Lines, Readings, Records};
use crate::output::{self, Table};
use crate::progress::Observer;
use crate::target::{Inputs, TargetFolder};
use palpate_estimators::estimator::{
    CentreOfPressure, LoadProfile, LoadSensors, LoadSensorsError, Patch, PatchLimit, Profiler, Status,
    patch_limits,
};
use palpate_estimators::simulate::simulate_loads_watched;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::{Extent, UniformLoad};
use palpate_report::{ProfileReport, profile_report};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  # Estimate the load of the first readings of a file
  head -4 touches.csv | palpate profile beam.toml -

  # Write a report about the first reading
  head -4 touches.csv | palpate profile beam.toml - --report load";

/// Estimate a distributed load: its total force, centre of pressure and patches
///
/// Every estimate has its 95 % interval; every patch has the physical limit of its position.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file or locator
    #[arg(value_name = "RIG|LOCATOR")]
    subject: PathBuf,
    /// CSV file of readings, `-` for stdin [default: simulate the rig's [[load]] sections]
    readings: Option<PathBuf>,
    /// Read a CSV without a header: one column for each channel, in the layout's order
    #[arg(long)]
    no_header: bool,
    /// Seed of the noise and imperfections of a simulated reading
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Write a report about the first reading into DIR: report.html and its figures
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Print one JSON object per reading
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.subject;
    let inputs =
        Inputs::new([Some(path), arguments.readings.as_ref()].into_iter().flatten().map(PathBuf::as_path));
    let report = arguments.report.as_ref();
    let report = report.map(|folder| TargetFolder::for_report(folder, &inputs)).transpose()?;
    let subject = RigOrLocator::read(path)?;
    let sensors = Observer::of_stages().watch(|watch| match &subject {
        RigOrLocator::Rig(rig) => LoadSensors::from_setup_watched(&rig.setup, watch),
        RigOrLocator::Locator(locator) => locator.load_sensors_watched(watch),
    });
    let sensors = sensors.map_err(|error| Failure::of_work(error, |error| sensors_error(error, path)))?;
    let profiler = Profiler::new(sensors);
    let mut printer = Printer {
        arguments,
        subject: &subject,
        profiler: &profiler,
        report: report.as_ref(),
        truth: &[],
        printed: 0,
    };
    match &arguments.readings {
        Some(readings) => printer.stream(readings),
        None => printer.simulated(),
    }
}

fn sensors_error(error: LoadSensorsError, path: &Path) -> UserError {
    let help = match error {
        LoadSensorsError::NoModel => {
            "give a surface with a model, such as `kind = \"beam\"`, or a locator that `palpate fit` fits with `kind = \"influence\"`"
        }
        LoadSensorsError::NotProportional(error) => error.help(),
        LoadSensorsError::Noise(ref error) => error.help(),
        LoadSensorsError::Surface(ref error) => error.help(),
    };
    UserError::for_path(path, error).help(help)
}

struct Printer<'a> {
    arguments: &'a Arguments,
    subject: &'a RigOrLocator,
    profiler: &'a Profiler<'a>,
    report: Option<&'a TargetFolder>,
    truth: &'a [UniformLoad],
    printed: u64,
}

impl Printer<'_> {
    fn simulated(&mut self) -> Result<(), Failure> {
        let loads: &[UniformLoad] = match self.subject {
            RigOrLocator::Rig(rig) => &rig.loads,
            RigOrLocator::Locator(_) => &[],
        };
        if loads.is_empty() {
            let path = self.arguments.subject.display();
            let user_error =
                UserError::new(format!("{path} has no [[load]] to simulate, and no readings are given"));
            let help = "name a file of readings, or add [[load]] with `from`, `to` and `force` to the rig";
            return Err(user_error.help(help).into());
        }
        self.truth = loads;
        let (setup, seed) = (self.subject.setup(), self.arguments.seed);
        let readings =
            Observer::of_stages().watch(|watch| simulate_loads_watched(setup, loads, 1, seed, watch));
        for reading in readings.map_err(|error| Failure::from_error(&error))? {
            self.print_profile(&reading, None)?;
        }
        Ok(())
    }

    fn stream(&mut self, path: &Path) -> Result<(), Failure> {
        let mut readings = {
            let records = if self.arguments.json { Records::Json } else { Records::None };
            Readings::new(Lines::open(path, records)?, self.subject.setup(), self.arguments.no_header)
        };
        while let Some(reading) = readings.next()? {
            self.print_profile(&reading, Some(readings.lines.count))?;
        }
        if self.printed == 0 && readings.lines.is_whole() {
            return Err(UserError::new(format!("{} contains no reading", readings.lines.name())).into());
        }
        readings.lines.finish("profile")
    }

    /// Prints the profile of a reading; the first one also gets a report.
    fn print_profile(&mut self, reading: &[f64], line: Option<u64>) -> Result<(), Failure> {
        let profile = self.profiler.profile(reading).map_err(UserError::new)?;
        let extent = self.profiler.cells().extent;
        let loads: Vec<UniformLoad> = profile.patches.iter().map(|patch| patch.as_load(extent)).collect();
        let limits = patch_limits(self.profiler.sensors(), &loads);
        self.printed += 1;
        if let (1, Some(report)) = (self.printed, self.report) {
            self.write_report(reading, &profile, limits.as_deref(), line, report)?;
        }
        let told = JsonProfile::new(self.profiler, &profile, limits.as_deref(), self.truth, line);
        if self.arguments.json {
            let json = serde_json::to_string(&told).map_err(UserError::new)?;
            return output::print_line(json);
        }
        print(&told)?;
        let folder = self.report.filter(|_| self.printed == 1).map(TargetFolder::path);
        output::print_report_path("\n", folder)
    }

    fn write_report(
        &self,
        reading: &[f64],
        profile: &LoadProfile,
        limits: Option<&[PatchLimit]>,
        line: Option<u64>,
        folder: &TargetFolder,
    ) -> Result<(), Failure> {
        let arguments = self.arguments;
        let source = match (&arguments.readings, line) {
            (Some(readings), Some(line)) => format!("{}, line {line}", readings.display()),
            _ => format!("{}, simulated with seed {}", arguments.subject.display(), arguments.seed),
        };
        let resolution = self.profiler.resolution(profile);
        let report = ProfileReport {
            title: &format!("The load on {}", arguments.subject.display()),
            layout: self.subject.setup().layout(),
            reading,
            profile,
            limits,
            resolution: resolution.as_ref(),
            truth: self.truth,
            source: &source,
        };
        folder.write_report(profile_report(&report))
    }
}

fn print(told: &JsonProfile) -> Result<(), Failure> {
    let interval = |value: &Interval, unit: &str| {
        format!("{:.3} {unit} ({})", value.value, ends(value.low, value.high, ""))
    };
    let heading = match told.line {
        Some(line) => format!("line {line}: {}", told.status),
        None => format!("simulated: {}", told.status),
    };
    output::print_line(heading)?;
    if told.status == Status::Ambiguous.name() {
        output::print_line(
            "the number of patches is not resolved: more than these explain the reading better, at 5 %",
        )?;
    }
    let misfit = if told.chi_squared < 1e6 {
        format!("{:.1}", told.chi_squared)
    } else {
        format!("{:.1e}", told.chi_squared)
    };
    output::print_line(format!("misfit {misfit}; noise alone rarely exceeds {:.1}", told.worst_misfit))?;
    let Some(centre) = &told.centre_x_mm else { return Ok(()) };
    output::print_line(format!(
        "total force         {}, for any shape of the load",
        interval(&told.total_n, "N")
    ))?;
    let InteriorForce { margin_mm, low_n, high_n } = told.interior;
    output::print_line(format!(
        "                    {} if no load lies within {margin_mm:.0} mm of an edge",
        ends(low_n, high_n, " N")
    ))?;
    output::print_line(format!("centre of pressure  {}", interval(centre, "mm")))?;
    if let Some(across) = &told.centre_y_mm {
        output::print_line(format!("            across  {}", interval(across, "mm")))?;
    }
    if let Some(width_mm) = told.resolution_mm {
        output::print_line(format!(
            "resolution          {width_mm:.0} mm, the median width of the averaging kernels"
        ))?;
    }
    let interval = |value: &Interval| format!("{:.3} ({})", value.value, ends(value.low, value.high, ""));
    output::print_line(format!("\n{}", JsonPatch::columns(&told.patches, "patch", told.extent, interval)))?;
    if told.loads.is_empty() {
        return Ok(());
    }
    let number = |value: &f64| format!("{value:.3}");
    output::print_line(format!("\n{}", JsonPatch::columns(&told.loads, "true load", told.extent, number)))
}

fn ends(low: f64, high: f64, unit: &str) -> String {
    match high.is_finite() {
        true => format!("{low:.3} to {high:.3}{unit}"),
        false => format!("{low:.3}{unit} or more"),
    }
}

/// Load profile of a reading; unidentifiable values are null.
#[derive(serde::Serialize)]
struct JsonProfile {
    /// Line of the reading; null for a simulated one.
    line: Option<u64>,
    status: &'static str,
    #[serde(rename = "misfit")]
    chi_squared: f64,
    worst_misfit: f64,
    total_n: Interval,
    #[serde(rename = "seen")]
    interior: InteriorForce,
    centre_x_mm: Option<Interval>,
    #[serde(skip_serializing_if = "Option::is_none")]
    centre_y_mm: Option<Interval>,
    /// Median width of the averaging kernels.
    resolution_mm: Option<f64>,
    patches: Vec<JsonPatch<Interval>>,
    loads: Vec<JsonPatch<f64>>,
    profile: Vec<JsonCell>,
    /// Residual of each channel over its noise; null for disabled channels.
    residuals: Vec<Option<f64>>,
    #[serde(skip)]
    extent: Extent,
}

/// 95 % interval of the total force if no load lies within `margin_mm` of an edge.
#[derive(Clone, Copy, serde::Serialize)]
struct InteriorForce {
    margin_mm: f64,
    low_n: f64,
    high_n: f64,
}

/// A value, its standard deviation and its 95 % interval; null where it is unbounded.
#[derive(serde::Serialize)]
struct Interval {
    value: f64,
    sd: f64,
    low: f64,
    high: f64,
}

/// A patch of the profile; with plain numbers, a simulated load.
#[derive(serde::Serialize)]
struct JsonPatch<T> {
    stretch_mm: [f64; 2],
    centre_x_mm: T,
    /// Coordinates across the width of a plane.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    #[serde(rename = "across")]
    transverse: Option<TransverseFields<T>>,
    force_n: T,
    /// Least standard deviations for evenly loaded patches of this number and size.
    limit_x_mm: Option<f64>,
    limit_force_n: Option<f64>,
}

#[derive(serde::Serialize)]
struct TransverseFields<T> {
    stretch_y_mm: [f64; 2],
    centre_y_mm: T,
    limit_y_mm: Option<f64>,
}

/// Density in N/mm on a line and N/mm² on a plane.
#[derive(serde::Serialize)]
struct JsonCell {
    x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    density: f64,
    low: f64,
    high: f64,
}

impl Interval {
    fn new(value: f64, sd: f64, (low, high): (f64, f64), unit: f64) -> Self {
        Self { value: value * unit, sd: sd * unit, low: low * unit, high: high * unit }
    }
}

impl JsonProfile {
    fn new(
        profiler: &Profiler,
        profile: &LoadProfile,
        limits: Option<&[PatchLimit]>,
        truth: &[UniformLoad],
        line: Option<u64>,
    ) -> Self {
        let extent = profile.cells.extent;
        let of_truth = patch_limits(profiler.sensors(), truth);
        let limit =
            |limits: Option<&[PatchLimit]>, i: usize| limits.and_then(|limits| limits.get(i).copied());
        let patches = profile.patches.iter().enumerate();
        let loads = truth.iter().enumerate();
        Self {
            line,
            status: profile.status.name(),
            chi_squared: profile.chi_squared,
            worst_misfit: profile.worst_misfit,
            total_n: Interval::new(profile.total_n, profile.total_sd_n, profile.bounds.total_95_n, 1.0),
            interior: InteriorForce {
                margin_mm: profile.bounds.margin_m * 1e3,
                low_n: profile.bounds.seen_95_n.0,
                high_n: profile.bounds.seen_95_n.1,
            },
            centre_x_mm: profile.centre.as_ref().map(x_mm),
            centre_y_mm: profile.centre.and_then(|centre| extent.if_plane(y_mm(&centre))),
            resolution_mm: profiler.resolution(profile).map(|resolution| resolution.median_width_m() * 1e3),
            patches: patches.map(|(i, patch)| JsonPatch::of_patch(patch, limit(limits, i), extent)).collect(),
            loads: loads
                .map(|(i, load)| JsonPatch::of_load(load, limit(of_truth.as_deref(), i), extent))
                .collect(),
            profile: (0..profile.cells.len()).map(|cell| JsonCell::new(profile, cell)).collect(),
            residuals: profile.residuals.clone(),
            extent,
        }
    }
}

impl JsonPatch<Interval> {
    fn of_patch(patch: &Patch, limit: Option<PatchLimit>, extent: Extent) -> Self {
        let Patch { from, to, centre, .. } = patch;
        let force_n = Interval::new(patch.force_n, patch.force_sd_n, patch.force_95_n, 1.0);
        Self::new([*from, *to], (x_mm(centre), y_mm(centre)), force_n, limit, extent)
    }
}

impl JsonPatch<f64> {
    fn of_load(load: &UniformLoad, limit: Option<PatchLimit>, extent: Extent) -> Self {
        let centre = load.centre();
        Self::new(
            [load.from(), load.to()],
            (centre.x_m * 1e3, centre.y_m * 1e3),
            load.force_n(),
            limit,
            extent,
        )
    }
}

impl<T> JsonPatch<T> {
    fn new(
        [from, to]: [Position; 2],
        (centre_x_mm, centre_y_mm): (T, T),
        force_n: T,
        limit: Option<PatchLimit>,
        extent: Extent,
    ) -> Self {
        Self {
            stretch_mm: [from.x_m * 1e3, to.x_m * 1e3],
            centre_x_mm,
            transverse: extent.if_plane(TransverseFields {
                stretch_y_mm: [from.y_m * 1e3, to.y_m * 1e3],
                centre_y_mm,
                limit_y_mm: limit.map(|limit| limit.sd_y_m * 1e3),
            }),
            force_n,
            limit_x_mm: limit.map(|limit| limit.sd_x_m * 1e3),
            limit_force_n: limit.map(|limit| limit.sd_force_n),
        }
    }

    fn columns(rows: &[Self], what: &str, extent: Extent, cell: fn(&T) -> String) -> String {
        fn stretch([from, to]: [f64; 2]) -> String {
            format!("{from:.0}–{to:.0}")
        }
        let limit = |limit: Option<f64>| limit.map_or_else(|| "–".to_owned(), |limit| format!("{limit:.3}"));
        let across = |row: &Self, of: &dyn Fn(&TransverseFields<T>) -> String| {
            row.transverse.as_ref().map_or(String::new(), of)
        };
        let table = Table::from_rows(rows.iter().zip(1..)).column(what, |(_, number)| number.to_string());
        let table = match extent {
            Extent::Line { .. } => table
                .column("stretch, mm", |(row, _)| stretch(row.stretch_mm))
                .column("centre, mm", |(row, _)| cell(&row.centre_x_mm))
                .column("limit", |(row, _)| limit(row.limit_x_mm)),
            Extent::Plane { .. } => table
                .column("x, mm", |(row, _)| stretch(row.stretch_mm))
                .column("y, mm", |(row, _)| across(row, &|across| stretch(across.stretch_y_mm)))
                .column("centre x, mm", |(row, _)| cell(&row.centre_x_mm))
                .column("limit", |(row, _)| limit(row.limit_x_mm))
                .column("centre y, mm", |(row, _)| across(row, &|across| cell(&across.centre_y_mm)))
                .column("limit", |(row, _)| across(row, &|across| limit(across.limit_y_mm))),
        };
        table
            .column("force, N", |(row, _)| cell(&row.force_n))
            .column("limit", |(row, _)| limit(row.limit_force_n))
            .to_string()
    }
}

impl JsonCell {
    fn new(profile: &LoadProfile, cell: usize) -> Self {
        let extent = profile.cells.extent;
        let per_mm = match extent {
            Extent::Line { .. } => 1e-3,
            Extent::Plane { .. } => 1e-6,
        };
        let (centre, (density, (low, high))) = (profile.cells.centre(cell), profile.density(cell));
        Self {
            x_mm: centre.x_m * 1e3,
            y_mm: extent.if_plane(centre.y_m * 1e3),
            density: density * per_mm,
            low: low * per_mm,
            high: high * per_mm,
        }
    }
}

fn x_mm(centre: &CentreOfPressure) -> Interval {
    Interval::new(centre.position.x_m, centre.sd_x_m, centre.x_95_m, 1e3)
}

fn y_mm(centre: &CentreOfPressure) -> Interval {
    Interval::new(centre.position.y_m, centre.sd_y_m, centre.y_95_m, 1e3)
}
