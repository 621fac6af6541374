//! `palpate track`: moving contacts, line by line or smoothed.

use crate::contact_lines::ContactLines;
use crate::failure::{Failure, UserError};
use crate::json::{Fields, Object, fields, object};
use crate::lines::{Lines, Parsing, Records};
use crate::output::Table;
use crate::remark::remark;
use crate::tare::{TareOption, TareOutcome, Taring};
use crate::target::{Inputs, TargetFolder};
use crate::{input, output};
use palpate_estimators::estimator::{
    Locator, SmoothTracker, Swing, Track, TrackedContact, Tracker, TrackerConfig, TransverseMotion,
};
use palpate_estimators::recording::{LineParser, TimedParser, TimedReading, csv_row};
use palpate_estimators::track_errors::{SpeedErrors, TrackErrors, sweep_speeds};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_numerics::watch::Watch;
use palpate_report::{TrackReport, track_report};
use serde_json::json;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  # Track a contact in a file of readings, ten per second
  palpate track beam.json touches.csv --rate \"10 Hz\"

  # Smooth the recording, and write a report
  palpate track beam.json touches.csv --rate \"10 Hz\" --smooth --report track";

/// Track a moving contact, or two
///
/// Filters a series of readings. On a line a locator with `contacts = 2` tracks two contacts; on a plane one contact is tracked. Times are those
/// of the column `time_s`, or follow from --rate. A terminal gets a line at the beginning, at changes and at the end of each contact; a file or a
/// pipe gets a row of CSV per reading. If the file contains the true contacts, the errors are printed on stderr at the end.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Influence locator whose readings follow the force
    locator: PathBuf,
    /// CSV file of readings, `-` for stdin [default: stdin]
    readings: Option<PathBuf>,
    /// Readings per second of a file without a column `time_s`, such as "100 Hz"
    #[arg(long, value_name = "FREQUENCY", value_parser = input::frequency)]
    rate: Option<f64>,
    /// Smooth the whole recording; prints after its last reading
    #[arg(long)]
    smooth: bool,
    /// First natural frequency of a simply supported beam, such as "12 Hz", to model its inertia with 1 % of the critical damping [default: no inertia]
    #[arg(long, value_name = "FREQUENCY", value_parser = input::frequency)]
    frequency: Option<f64>,
    /// Take the natural frequency and damping of the rig's [motion], and add the errors at other speeds to the report
    #[arg(long, value_name = "RIG", conflicts_with = "frequency")]
    rig: Option<PathBuf>,
    /// Seed of the simulations at other speeds
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    tare: TareOption,
    /// Print one JSON object per reading
    #[arg(long)]
    json: bool,
    /// Print one row of CSV per reading, also on a terminal
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Print the lines of a terminal, also to a file or a pipe
    #[arg(long, conflicts_with_all = ["json", "csv"])]
    text: bool,
    /// Write a report into DIR: report.html and its figures
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let report = arguments.report_folder()?;
    let locator = input::read_locator(&arguments.locator)?;
    let rig = arguments.rig.as_deref().map(input::read_rig).transpose()?;
    let told = arguments
        .frequency
        .map(|frequency_hz| Swing { frequency_hz, damping_ratio: ModalBeam::USUAL_DAMPING_RATIO });
    let beam = rig.as_ref().and_then(|rig| rig.motion).and_then(|moving| moving.beam);
    let own =
        beam.map(|beam| Swing { frequency_hz: beam.frequency_hz(1), damping_ratio: beam.damping_ratio() });
    let config = TrackerConfig { swing: told.or(own), ..TrackerConfig::default() };
    let tracking =
        locator.tracking(&config).map_err(|error| UserError::for_path(&arguments.locator, error))?;
    let extent = tracking.likelihood().extent();
    let format = match (arguments, extent, tracking.likelihood().most_contacts()) {
        (Arguments { json: true, .. }, ..) => Format::Json,
        _ if arguments.prints_text() => Format::Text(Box::default()),
        (_, Extent::Plane { .. }, _) => Format::Csv(Columns::Plane),
        (_, Extent::Line { .. }, 1) => Format::Csv(Columns::One),
        (_, Extent::Line { .. }, _) => Format::Csv(Columns::Two),
    };
    let keeps = arguments.smooth || arguments.report.is_some();
    let follower = if keeps {
        TrackFilter::Smoother(SmoothTracker::new(tracking.likelihood(), config))
    } else {
        TrackFilter::Filter(Tracker::new(tracking.likelihood(), config))
    };
    let taring = Taring::new(&arguments.tare.in_use(&locator), &locator, false)?;
    let records = if arguments.json { Records::Json } else { Records::None };
    let mut stream = Stream {
        arguments,
        taring,
        filter: follower,
        extent,
        format,
        lines: Lines::open(arguments.readings.as_deref().unwrap_or(Path::new("-")), records)?,
        times: 0,
        numbers: Vec::new(),
        truths: Vec::new(),
        filtered: Vec::new(),
    };
    // Readings that arrived before a signal are processed.
    let stopped = match stream.run(&locator) {
        Err(Failure::Interrupted(message)) if !stream.numbers.is_empty() => Some(message),
        ran => ran.map(|()| None)?,
    };
    let (filtered, smoothed) = stream.finish()?;
    stream.print_errors(&filtered, &smoothed);
    if let Some(folder) = &report {
        let sweep = match rig.as_ref().and_then(|rig| Some((rig, rig.motion.as_ref()?))) {
            Some((rig, moving)) if beam.is_some() => {
                let pressed = rig.training_setup().map_err(UserError::new)?;
                sweep_speeds(&locator, config, &pressed, moving, arguments.seed).map_err(UserError::new)?
            }
            _ => Vec::new(),
        };
        stream.report(folder, (&filtered, &smoothed), &sweep)?;
    }
    match stopped {
        Some(message) => Err(Failure::Interrupted(message)),
        None => stream.lines.finish("estimate"),
    }
}

impl Arguments {
    fn prints_text(&self) -> bool {
        self.text || (!self.csv && std::io::stdout().is_terminal())
    }

    fn report_folder(&self) -> Result<Option<TargetFolder>, Failure> {
        let read = [Some(&self.locator), self.readings.as_ref(), self.rig.as_ref()];
        let read = read.into_iter().flatten().map(PathBuf::as_path).chain(self.tare.path());
        let inputs = Inputs::new(read);
        self.report.as_ref().map(|folder| TargetFolder::for_report(folder, &inputs)).transpose()
    }
}

enum TrackFilter {
    Filter(Tracker),
    Smoother(SmoothTracker),
}

struct Stream<'a> {
    arguments: &'a Arguments,
    taring: Option<Taring<'a>>,
    filter: TrackFilter,
    extent: Extent,
    format: Format,
    lines: Lines,
    /// Number of readings, including skipped ones.
    times: u64,
    numbers: Vec<u64>,
    truths: Vec<Vec<Contact>>,
    /// Tracks for comparison with a truth, unless the smoother stores them.
    filtered: Vec<Track>,
}

impl Stream<'_> {
    fn run(&mut self, locator: &Locator) -> Result<(), Failure> {
        let columns = locator.setup.recording_columns();
        let parser = TimedParser::new(self.lines.name(), locator.setup.schema(&columns));
        let mut parsing = Parsing::new(parser, columns.header);
        let mut out = std::io::stdout().lock();
        if let Format::Csv(columns) = self.format {
            output::print(&mut out, (columns.heading() + "\n").as_bytes())?;
        }
        while let Some(reading) = parsing.next(&mut self.lines)? {
            if let Some(reading) = reading {
                self.update(reading, &mut out)?;
            }
            let parser = &mut parsing.parser;
            if !parser.progress().awaits_columns() && !parser.has_time() && self.arguments.rate.is_none() {
                let column =
                    columns.time.as_ref().map_or("`time_s`".to_owned(), |time| time.column.to_string());
                let user_error = UserError::new(format!("{} has no column {column}", self.lines.name()));
                return Err(user_error.help("--rate gives the number of readings per second").into());
            }
        }
        if parsing.parser.progress().awaits_columns() && self.lines.is_whole() {
            let user_error = UserError::new(format!("{} contains no reading", self.lines.name()));
            return Err(user_error.help("it must begin with a header").into());
        }
        self.taring.as_ref().map_or(Ok(()), |taring| taring.finish(self.lines.name()))
    }

    fn update(&mut self, mut reading: TimedReading, out: &mut impl Write) -> Result<(), Failure> {
        let rate_s = |rate_hz: f64| self.times as f64 / rate_hz;
        let time_s = reading.time_s.or(self.arguments.rate.map(rate_s)).unwrap_or(0.0);
        self.times += 1;
        let taken = match &mut self.taring {
            None => Ok(TareOutcome::Tared),
            Some(taring) => {
                let has_time = reading.time_s.is_some() || self.arguments.rate.is_some();
                taring.take(&mut reading.reading, has_time.then_some(time_s))
            }
        };
        match taken {
            Ok(TareOutcome::Tared | TareOutcome::Located(_)) => {}
            Ok(TareOutcome::Baseline) => return Ok(()),
            Err(error) => return self.lines.skip_reading(&error),
        }
        let track = match &mut self.filter {
            TrackFilter::Filter(tracker) => tracker.update(time_s, &reading.reading).map(Some),
            TrackFilter::Smoother(tracker) => tracker.update(time_s, &reading.reading).map(|()| None),
        };
        let track = match track {
            Ok(track) => track,
            Err(error) => return self.lines.skip_reading(&error),
        };
        self.truths.extend(reading.truth.clone());
        let Some(track) = track else {
            self.numbers.push(self.lines.count);
            return Ok(());
        };
        self.print(&track, self.lines.count, out)?;
        if reading.truth.is_some() {
            self.filtered.push(track);
        }
        // The reader of a pipe gets each estimate at once.
        output::flush(out)
    }

    /// Returns the tracks of filter and smoother; prints the deferred ones.
    fn finish(&mut self) -> Result<(Vec<Track>, Vec<Track>), Failure> {
        let mut out = std::io::stdout().lock();
        let TrackFilter::Smoother(tracker) = &self.filter else {
            self.print_summary(&mut out)?;
            return Ok((std::mem::take(&mut self.filtered), Vec::new()));
        };
        let filtered = tracker.filtered().to_vec();
        // Also after a signal, until the process is ended.
        let smoothed = match self.arguments.smooth {
            true => tracker.smoothed(Watch::NONE).map_err(|_| Failure::stopped())?,
            false => Vec::new(),
        };
        let shown = if self.arguments.smooth { &smoothed } else { &filtered };
        for (track, line) in shown.iter().zip(std::mem::take(&mut self.numbers)) {
            self.print(track, line, &mut out)?;
        }
        self.print_summary(&mut out)?;
        Ok((filtered, smoothed))
    }

    fn print(&mut self, track: &Track, line: u64, out: &mut impl Write) -> Result<(), Failure> {
        let text = match &mut self.format {
            Format::Json => json(track, line, self.extent)? + "\n",
            Format::Csv(columns) => columns.csv(track, line),
            Format::Text(contacts) => contacts.lines(track),
        };
        output::print(out, text.as_bytes())
    }

    fn print_summary(&self, out: &mut impl Write) -> Result<(), Failure> {
        match &self.format {
            Format::Text(contacts) => output::print(out, contacts.summary().as_bytes()),
            Format::Json | Format::Csv(_) => Ok(()),
        }
    }

    fn errors(&self, filtered: &[Track], smoothed: &[Track]) -> Vec<(&'static str, TrackErrors)> {
        let truths = &self.truths;
        let of = |name, tracks: &[Track]| {
            let known = !tracks.is_empty() && tracks.len() == truths.len();
            let errors = if known { TrackErrors::new(tracks, truths, self.extent) } else { None };
            errors.map(|errors| (name, errors))
        };
        [of("filter", filtered), of("smoother", smoothed)].into_iter().flatten().collect()
    }

    fn print_errors(&self, filtered: &[Track], smoothed: &[Track]) {
        let errors = self.errors(filtered, smoothed);
        if errors.is_empty() {
            return;
        }
        let mm = |error_m: f64| format!("{:.3}", error_m * 1e3);
        let percent = |share: f64| format!("{:.1}", share * 100.0);
        let table = Table::from_rows(errors)
            .column("average error, mm", |(name, _)| (*name).to_owned())
            .column("contacts", |(_, errors)| errors.tracked.to_string())
            .column("track", |(_, errors)| mm(errors.track_m))
            .column("single", |(_, errors)| mm(errors.single_m))
            .column("ratio", |(_, errors)| format!("{:.2}", errors.ratio()))
            .column("covered, %", |(_, errors)| percent(errors.track_covered))
            .column("single, %", |(_, errors)| percent(errors.single_covered))
            .column("number right, %", |(_, errors)| percent(errors.track_number_right));
        remark!("{table}");
    }

    fn report(
        &self,
        folder: &TargetFolder,
        (filtered, smoothed): (&[Track], &[Track]),
        sweep: &[SpeedErrors],
    ) -> Result<(), Failure> {
        let (tracks, how) = if smoothed.is_empty() { (filtered, "filter") } else { (smoothed, "smoother") };
        let known = self.truths.len() == tracks.len();
        let report = TrackReport {
            title: &format!("A contact followed through {}", self.lines.name()),
            source: self.lines.name(),
            extent: self.extent,
            tracks,
            how,
            truths: if known { &self.truths } else { &[] },
            errors: &self.errors(filtered, smoothed),
            sweep,
        };
        folder.write_report(track_report(&report))
    }
}

enum Format {
    Json,
    Csv(Columns),
    Text(Box<ContactLines>),
}

/// Cells are empty for a contact that does not touch.
#[derive(Clone, Copy)]
enum Columns {
    One,
    Two,
    Plane,
}

impl Columns {
    fn heading(self) -> String {
        let one =
            "line,time_s,position_mm,speed_m_per_s,force_n,low_mm,high_mm,force_low_n,force_high_n,touching";
        let second = "position_2_mm,speed_2_m_per_s,force_2_n,low_2_mm,high_2_mm,force_low_2_n,force_high_2_n,two_touching";
        match self {
            Self::One => one.to_owned(),
            Self::Two => format!("{one},{second}"),
            Self::Plane => "line,time_s,x_mm,y_mm,speed_x_m_per_s,speed_y_m_per_s,force_n,x_low_mm,x_high_mm,y_low_mm,y_high_mm,force_low_n,force_high_n,touching".to_owned(),
        }
    }

    fn csv(self, track: &Track, line: u64) -> String {
        let (first, second) = (track.contacts.first(), track.contacts.get(1));
        let mut cells = vec![line.to_string(), track.time_s.to_string()];
        cells.extend(match self {
            Self::One | Self::Two => cells_on_line(first),
            Self::Plane => cells_on_plane(first),
        });
        cells.push(cell(track.touching()));
        if let Self::Two = self {
            cells.extend(cells_on_line(second));
            cells.push(cell(track.numbers[2]));
        }
        csv_row(cells)
    }
}

fn cells_on_line(contact: Option<&TrackedContact>) -> Vec<String> {
    let Some(tracked) = contact else { return vec![String::new(); 7] };
    let (low_m, high_m) = tracked.x_95_m;
    let (low_n, high_n) = tracked.force_interval_95_n();
    let numbers =
        [tracked.x_m * 1e3, tracked.speed_m_per_s, tracked.force_n, low_m * 1e3, high_m * 1e3, low_n, high_n];
    numbers.map(cell).to_vec()
}

fn cells_on_plane(contact: Option<&TrackedContact>) -> Vec<String> {
    let on_plane = contact.and_then(|tracked| Some((tracked, tracked.transverse?)));
    let Some((tracked, across)) = on_plane else { return vec![String::new(); 11] };
    let ((x_low_m, x_high_m), (y_low_m, y_high_m)) = (tracked.x_95_m, across.y_95_m);
    let (low_n, high_n) = tracked.force_interval_95_n();
    let numbers = [
        tracked.x_m * 1e3,
        across.y_m * 1e3,
        tracked.speed_m_per_s,
        across.speed_m_per_s,
        tracked.force_n,
        x_low_m * 1e3,
        x_high_m * 1e3,
        y_low_m * 1e3,
        y_high_m * 1e3,
        low_n,
        high_n,
    ];
    numbers.map(cell).to_vec()
}

/// Numbers from this on are beyond the precision of a float with four decimals.
const LARGE: f64 = 1e11;

fn cell(number: f64) -> String {
    if number.abs() < LARGE { format!("{number:.4}") } else { format!("{number:.4e}") }
}

fn json(track: &Track, line: u64, extent: Extent) -> Result<String, Failure> {
    let Position { x_m, y_m } = track.single.contact.position;
    let object = object! {
        "line": line,
        "time_s": track.time_s,
        "touching": track.touching(),
        ..track.contacts.first().map(contact_fields),
        "two_touching": track.numbers[2],
        "second"?: track.contacts.get(1).map(|second| Object(contact_fields(second))),
        // Position from this reading alone; on a plane x and y.
        "single_mm": match extent {
            Extent::Line { .. } => json!(x_m * 1e3),
            Extent::Plane { .. } => json!([x_m * 1e3, y_m * 1e3]),
        },
        "single_status": track.single.status.name(),
    };
    serde_json::to_string(&object).map_err(|error| UserError::new(error).into())
}

fn contact_fields(tracked: &TrackedContact) -> impl Fields {
    let mm = |(low_m, high_m): (f64, f64)| [low_m * 1e3, high_m * 1e3];
    let [sd_m, sd_speed_m_per_s, sd_force_n] = tracked.sd;
    let (low_n, high_n) = tracked.force_interval_95_n();
    let across = |across: TransverseMotion| {
        fields! {
            "y_mm": across.y_m * 1e3,
            "speed_y_m_per_s": across.speed_m_per_s,
            "y_95_mm": mm(across.y_95_m),
            "sd_y_mm": across.sd[0] * 1e3,
            "sd_speed_y_m_per_s": across.sd[1],
            "covariance_mm2": across.covariance_m2 * 1e6,
        }
    };
    fields! {
        "x_mm": tracked.x_m * 1e3,
        "speed_m_per_s": tracked.speed_m_per_s,
        "force_n": tracked.force_n,
        "x_95_mm": mm(tracked.x_95_m),
        "sd_mm": sd_m * 1e3,
        "sd_speed_m_per_s": sd_speed_m_per_s,
        "sd_force_n": sd_force_n,
        "force_95_n": [low_n, high_n],
        ..tracked.transverse.map(across),
    }
}
