//! `palpate replay`: locates the readings of a recording again.

use crate::estimate_columns::{EstimateColumns, EstimateRows};
use crate::failure::{Failure, UserError};
use crate::progress::interrupted;
use crate::remark::remark;
use crate::session::SessionOptions;
use crate::{input, output};
use palpate_estimators::estimate_record::EstimateRecord;
use palpate_estimators::estimator::Locator;
use palpate_live::frame::Channel;
use palpate_live::input::{Arrival, TimedArrival};
use palpate_live::recording::{Head, Playback, Recorded};
use palpate_live::session::{Estimation, Output, Session};
use palpate_live::stamp::Stamp;
use palpate_mechanics::units::format_count;
use serde::Serialize;
use serde_json::{Map, Value};
use std::path::PathBuf;
use std::time::Duration;

const EXAMPLES: &str = "\
Examples:
  # Locate the readings again and compare
  palpate replay session.mcap

  # Track contacts in the recording
  palpate replay session.mcap --track";

/// Locate the readings of a recorded session again
///
/// By default the tared readings are located as in the session, and differences are counted. With --locator, --low-pass or --track the raw
/// readings pass through a session from its start.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Recording, whole or truncated
    recording: PathBuf,
    /// Locate the raw readings by this locator [default: the locator in the recording]
    #[arg(long, value_name = "LOCATOR")]
    locator: Option<PathBuf>,
    #[command(flatten)]
    session: SessionOptions,
    /// Print the estimate also where the status is `no_contact` or `outside_model`
    #[arg(long, conflicts_with = "json")]
    all: bool,
    /// Print one JSON object per reading, with the estimate whatever its status
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Line {
    number: u64,
    time_s: f64,
    #[serde(flatten)]
    estimate: EstimateRecord,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let playback = Playback::open(&arguments.recording).map_err(UserError::new)?;
    if !playback.is_whole() {
        remark!("{} was cut off, or is being written; it is read up to there", arguments.recording.display());
    }
    let (path, locator) = match &arguments.locator {
        None => {
            let path = &arguments.recording;
            let locator = playback.locator().map_err(|error| {
                UserError::new(error).help("--locator FILE locates its readings by another locator")
            })?;
            (path, input::parse_locator(path, locator)?)
        }
        Some(path) => {
            let locator = input::read_locator(path)?;
            check_channels(playback.head(), &locator)?;
            (path, locator)
        }
    };
    let columns = EstimateColumns::new(&locator, EstimateRows::by_option(arguments.all));
    let printer =
        Printer { out: &mut std::io::stdout().lock(), columns: (!arguments.json).then_some(columns) };
    if arguments.locator.is_none() && arguments.session.config().estimation == Estimation::Single {
        return by_the_same(arguments, &locator, playback, printer);
    }
    let session = arguments.session.session(&locator, path)?;
    by_another(arguments, session, playback, printer)
}

/// Repeats the recorded estimates and reports whether they are identical.
fn by_the_same(
    arguments: &Arguments,
    locator: &Locator,
    mut playback: Playback,
    mut printer: Printer<impl std::io::Write>,
) -> Result<(), Failure> {
    let extent = locator.setup.surface().extent();
    let follower = playback.head().estimation.follower(locator);
    let mut follower = follower.map_err(|error| UserError::for_path(&arguments.recording, error))?;
    printer.begin()?;
    let (mut count, mut others) = (0_u64, 0_u64);
    let units = Channel::all_of(&locator.setup);
    let mut reading = Vec::new();
    while let Some(recorded) = playback.next_recorded().map_err(UserError::new)? {
        if let Recorded::Reading { values, .. } = recorded {
            // The board's number times its unit, bitwise equal to the reading.
            reading =
                values.iter().zip(&units).map(|(value, channel)| value * channel.unit.factor()).collect();
            continue;
        }
        let Recorded::Estimate { number, unix_ns, located, estimate: before } = recorded else { continue };
        let single = locator.locate(&located).map_err(UserError::new)?;
        let estimate = match &mut follower {
            Some(follower) => follower.update(unix_ns, &reading, &located, single),
            None => single,
        };
        let line =
            Line { number, time_s: unix_ns as f64 * 1e-9, estimate: EstimateRecord::new(&estimate, extent) };
        count += 1;
        others += u64::from(!is_the_same(&line.estimate, &before));
        printer.print(&line)?;
        if interrupted() {
            return Err(Failure::Interrupted("stopped".to_owned()));
        }
    }
    output::flush(printer.out)?;
    check_losses(arguments, &playback, count, "estimate")?;
    let all = format_count(count);
    match others {
        0 => remark!("{all} estimates, each equal to the recorded one to the last bit"),
        _ => remark!(
            "{all} estimates; {} differ from those recorded by palpate {}",
            format_count(others),
            playback.head().version
        ),
    }
    Ok(())
}

fn by_another(
    arguments: &Arguments,
    mut session: Session,
    mut playback: Playback,
    mut printer: Printer<impl std::io::Write>,
) -> Result<(), Failure> {
    let extent = session.extent();
    printer.begin()?;
    let mut first_ns = None;
    let mut count = 0;
    let mut outputs = Vec::new();
    while let Some(recorded) = playback.next_recorded().map_err(UserError::new)? {
        let Recorded::Reading { unix_ns, values, .. } = recorded else { continue };
        let elapsed_ns = unix_ns.saturating_sub(*first_ns.get_or_insert(unix_ns));
        let at = Stamp { elapsed: Duration::from_nanos(elapsed_ns), unix_ns };
        let bytes = palpate_live::source::line(&values).into_bytes();
        session.receive(&TimedArrival { at, arrival: Arrival::Bytes(bytes) }, &mut outputs);
        for output in outputs.drain(..) {
            let Output::Sample(sample) = output else { continue };
            count += 1;
            let line = Line {
                number: sample.number,
                time_s: sample.unix_ns as f64 * 1e-9,
                estimate: EstimateRecord::new(&sample.estimate, extent),
            };
            printer.print(&line)?;
        }
        if interrupted() {
            return Err(Failure::Interrupted("stopped".to_owned()));
        }
    }
    output::flush(printer.out)?;
    check_losses(arguments, &playback, count, "reading")
}

/// Fails if parts are unreadable or no `record` exists; reports other programs' messages.
fn check_losses(arguments: &Arguments, playback: &Playback, count: u64, record: &str) -> Result<(), Failure> {
    let passed_over = playback.skipped();
    if passed_over.foreign > 0 {
        remark!("{} messages on topics of other programs are skipped", format_count(passed_over.foreign));
    }
    let nothing = (count == 0).then(|| format!("it contains no {record}"));
    let losses: Vec<String> = nothing.into_iter().chain(passed_over.loss()).collect();
    if losses.is_empty() {
        return Ok(());
    }
    Err(Failure::DataLost(format!("{}: {}", arguments.recording.display(), losses.join("; "))))
}

fn check_channels(head: &Head, locator: &Locator) -> Result<(), Failure> {
    let wanted: Vec<(String, String)> = Channel::all_of(&locator.setup)
        .into_iter()
        .map(|channel| (channel.name, channel.unit.to_string()))
        .collect();
    let there: Vec<(String, String)> =
        head.channels.iter().map(|channel| (channel.name.clone(), channel.unit.clone())).collect();
    if wanted == there {
        return Ok(());
    }
    let shown = |channels: &[(String, String)]| {
        channels.iter().map(|(name, unit)| format!("{name} ({unit})")).collect::<Vec<_>>().join(", ")
    };
    let message =
        format!("the recording has the channels {}; the locator needs {}", shown(&there), shown(&wanted));
    Err(UserError::new(message).into())
}

fn is_the_same(estimate: &EstimateRecord, before: &Map<String, Value>) -> bool {
    serde_json::to_value(estimate).is_ok_and(|now| now.as_object() == Some(before))
}

struct Printer<'a, W> {
    out: &'a mut W,
    /// Columns of the CSV; `None` for JSON.
    columns: Option<EstimateColumns>,
}

impl<W: std::io::Write> Printer<'_, W> {
    fn begin(&mut self) -> Result<(), Failure> {
        let heading = self.columns.map_or(String::new(), |columns| columns.heading("number,time_s"));
        output::print(self.out, heading.as_bytes())
    }

    fn print(&mut self, line: &Line) -> Result<(), Failure> {
        let text = match self.columns {
            None => serde_json::to_string(line).map_err(UserError::new)? + "\n",
            Some(columns) => {
                columns.row(vec![line.number.to_string(), format!("{:.6}", line.time_s)], &line.estimate)
            }
        };
        output::print(self.out, text.as_bytes())
    }
}
