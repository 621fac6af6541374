//! `palpate calibrate`: a calibration by hand, guided press by press.

use crate::failure::{Complaint, Failure};
use crate::progress::{self, Observer};
use crate::remark::remark;
use crate::target::{Inputs, Target};
use crate::{input, output, target};
use palpate_design::positions::{PositionDesign, next_press};
use palpate_estimators::evaluation::cross_validate;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{self, Column, Columns, Recording, Row};
use palpate_live::calibration::{Guide, Press, Progress, Waiting};
use palpate_live::frame::{BadFrame, Channel, Decoder, Frame};
use palpate_live::input::{Arrival, Arrived, Input};
use palpate_live::pipeline::WAITING;
use palpate_live::source::{Source, SourceUrl};
use palpate_live::stamp::HostClock;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::format_length_mm;
use palpate_rig::Rig;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel, sync_channel};
use std::time::Duration;

/// Calibrate by pressing: says where to press, takes each press once its reading is at rest, and ends with a locator.
///
/// Positions and repeats are those of the rig's [training]. Every press is in the file of presses before the next one is asked for, and --resume
/// goes on from there. Between presses the surface is let go, and what it reads then is recorded too: offsets and drift follow from it.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file
    rig: PathBuf,
    /// Source of the readings: `serial:///dev/ttyACM0`, `tcp://host:port`, `udp://:port`, `mqtt://host/topic`, `file:recording.mcap`, `-` for stdin
    #[arg(long, value_name = "SOURCE")]
    from: SourceUrl,
    /// The recording of the presses
    #[arg(long, value_name = "FILE.csv")]
    presses: PathBuf,
    /// The locator to write
    #[arg(short, long, value_name = "LOCATOR")]
    out: PathBuf,
    /// Force of every press, as in `--force "2 N"` [default: the rig's, or unknown]
    #[arg(long, value_name = "FORCE", value_parser = input::force)]
    force: Option<f64>,
    /// Go on with the presses that the file of presses has
    #[arg(long)]
    resume: bool,
    /// Seed of the fit
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// Presses so far, and the file that has them.
struct Journal<'a> {
    rig_path: &'a Path,
    rig: &'a Rig,
    columns: Columns,
    target: Target,
    rows: Vec<Row>,
    /// Seconds by which the times of new rows come after those of the file.
    later_s: f64,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = Inputs::new([arguments.rig.as_path()]);
    let out = Target::new(&arguments.out, &inputs)?;
    let rig = input::read_rig(&arguments.rig)?;
    let mut journal = Journal::open(arguments, &rig, &inputs)?;
    let mut guide = Guide::new(plan(arguments, &rig, &journal.rows)?);
    if let Some((_, press)) = guide.next_press() {
        let extent = rig.setup.surface().extent();
        remark!("{} presses to go; the first at {}", guide.plan().len(), place(press, extent));
        remark!("r and Enter takes the last press back, s leaves the next out, q ends here");
        press_all(arguments, &mut guide, &mut journal)?;
    }
    finish(arguments, &rig, &out)
}

/// The presses of the rig's training positions that are not among those of before.
fn plan(arguments: &Arguments, rig: &Rig, before: &[Row]) -> Result<Vec<Press>, Failure> {
    let training = rig.training().map_err(|error| Complaint::about(&arguments.rig, error))?;
    let positions = training
        .positions(rig.setup.surface().extent())
        .map_err(|error| Complaint::about(&arguments.rig, error))?;
    let force_n = arguments.force.or(training.force_n).or(rig.setup.force_n());
    let mut plan = Vec::new();
    for position in positions {
        let done = before.iter().filter(|row| row.touches() && row.position == position).count();
        let left = training.repeats.saturating_sub(done);
        plan.extend(std::iter::repeat_n(Press { position, force_n }, left));
    }
    Ok(plan)
}

impl<'a> Journal<'a> {
    /// The file of presses, empty, or with the presses that it had.
    fn open(arguments: &'a Arguments, rig: &'a Rig, inputs: &Inputs) -> Result<Self, Failure> {
        let path = &arguments.presses;
        let target = Target::new(path, inputs)?;
        let columns = columns(rig).map_err(|complaint| Complaint::about(&arguments.rig, complaint))?;
        let mut journal =
            Self { rig_path: &arguments.rig, rig, columns, target, rows: Vec::new(), later_s: 0.0 };
        if path.exists() {
            if !arguments.resume {
                let complaint = Complaint::new(format!("{} is there already", path.display()));
                return Err(complaint
                    .help("--resume goes on with its presses; another name begins anew")
                    .into());
            }
            journal.rows = input::read_recording(&rig.setup, path)?.rows;
            let last_s = journal.rows.iter().filter_map(|row| row.time_s).fold(0.0, f64::max);
            // The time between two runs is not known; what drifted in it is told by the untouched rows of both.
            journal.later_s = last_s + 60.0;
        }
        Ok(journal)
    }

    fn add(&mut self, row: Row) -> Result<(), Failure> {
        let time_s = row.time_s.map(|time_s| time_s + self.later_s);
        self.rows.push(Row { time_s, ..row });
        self.save()
    }

    /// Takes the last press out, with the untouched rows after it.
    fn take_back(&mut self) -> Result<(), Failure> {
        if let Some(last) = self.rows.iter().rposition(Row::touches) {
            self.rows.truncate(last);
            self.save()?;
        }
        Ok(())
    }

    /// Presses that were recorded.
    fn presses(&self) -> usize {
        self.rows.iter().filter(|row| row.touches()).count()
    }

    fn save(&self) -> Result<(), Failure> {
        let mut rows = self.rows.clone();
        // An untouched row is told from a press by its force, where presses have one.
        if self.columns.force.is_none() || rows.iter().any(|row| row.force_n.is_none()) {
            rows.retain(Row::touches);
        }
        let recording = Recording::new(self.rig.setup.layout(), "calibration", rows);
        let comment =
            format!("palpate {}, pressed for {}", env!("CARGO_PKG_VERSION"), self.rig_path.display());
        let mut csv = Vec::new();
        recording::write_as(&recording, &self.columns, &comment, &mut csv)
            .map_err(|error| target::cannot("write", self.target.path(), &error))?;
        self.target.write(&csv)
    }
}

/// The columns of the file of presses: those that the rig reads.
fn columns(rig: &Rig) -> Result<Columns, Complaint> {
    let columns = rig.setup.recording_columns();
    if let Some(nuisance) = columns.nuisances().next() {
        return Err(Complaint::new(format!(
            "presses are recorded without the nuisance coordinate {}",
            nuisance.column
        ))
        .help("leave `nuisance` out of [recording], or record with a program of your own"));
    }
    let numbered = columns.channels.iter().any(|channel| matches!(channel.column, Column::Number(_)));
    if numbered {
        return Err(Complaint::new("presses are recorded in columns with names")
            .help("name the channels of [recording] instead of counting them"));
    }
    Ok(columns)
}

/// Presses of a plan, guided; those that are taken go to the journal.
fn press_all(arguments: &Arguments, guide: &mut Guide, journal: &mut Journal) -> Result<(), Failure> {
    let (to, inputs) = sync_channel(WAITING);
    let _source = Source::open(&arguments.from, Path::new("."), HostClock::new(), to)
        .map_err(|error| Complaint::new(format!("--from {}: {error}", arguments.from)))?;
    let keys = (arguments.from != SourceUrl::Stdin).then(keys);
    let mut decoder = Decoder::new(&Channel::all_of(&journal.rig.setup));
    decoder
        .set_columns(arguments.from.columns())
        .map_err(|error| Complaint::new(format!("--from {}: {error}", arguments.from)))?;
    let mut bad: BTreeMap<BadFrame, u64> = BTreeMap::new();
    ask(guide, journal);
    while guide.waiting() != Waiting::Nothing {
        if progress::interrupted() {
            return Err(stopped(arguments, journal));
        }
        match inputs.recv_timeout(Duration::from_millis(50)) {
            Ok(Input::Arrived(arrived)) => {
                let mut frames = Vec::new();
                let ended = receive(&arrived, &mut decoder, |frame| frames.push(frame));
                for frame in frames {
                    match frame {
                        Ok(frame) => take(guide.add(arrived.at.elapsed, &frame.reading), guide, journal)?,
                        Err(cause) => *bad.entry(cause).or_default() += 1,
                    }
                }
                if ended {
                    break;
                }
            }
            Ok(Input::Command(_) | Input::Stop) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        while let Some(key) = keys.as_ref().and_then(|keys| keys.try_recv().ok()) {
            press_key(&key, guide, journal)?;
        }
    }
    for (cause, count) in &bad {
        remark!("{count} frames were no reading: {}", cause.describe());
    }
    match guide.waiting() {
        Waiting::Nothing => Ok(()),
        _ => Err(Failure::DataLost(format!(
            "the source ended before all was pressed; {} presses are in {}, and --resume goes on",
            journal.presses(),
            arguments.presses.display()
        ))),
    }
}

/// Decodes what arrived; true when there will be no more.
fn receive(arrived: &Arrived, decoder: &mut Decoder, hand_on: impl FnMut(Result<Frame, BadFrame>)) -> bool {
    match &arrived.arrival {
        Arrival::Bytes(bytes) => decoder.receive(bytes, hand_on),
        Arrival::Message(bytes) => decoder.receive_message(bytes, hand_on),
        Arrival::Opened(name) => {
            decoder.open();
            remark!("readings from {name}");
        }
        Arrival::Joined(name) => {
            decoder.join();
            remark!("readings from {name}");
        }
        Arrival::Lost(why) => {
            decoder.open();
            remark!("the source went away: {why}; it is waited for");
        }
        Arrival::Ended => {
            decoder.end(hand_on);
            return true;
        }
    }
    false
}

/// Takes the outcome of a reading: a row for the journal, or another step that is waited for.
fn take(progress: Progress, guide: &Guide, journal: &mut Journal) -> Result<(), Failure> {
    match progress {
        Progress::None => return Ok(()),
        Progress::Waits(_) => {}
        Progress::Taken(row) => {
            let touches = row.touches();
            journal.add(row)?;
            if touches {
                remark!("taken: press {}{}", journal.presses(), repeatability(&journal.rows));
            }
        }
    }
    ask(guide, journal);
    Ok(())
}

/// Deviation of the last press from the mean of the others of its place and force, in words; empty where there are none.
fn repeatability(rows: &[Row]) -> String {
    let Some(last) = rows.last() else { return String::new() };
    let others: Vec<&Row> = rows[..rows.len() - 1]
        .iter()
        .filter(|row| row.touches() && row.position == last.position && row.force_n == last.force_n)
        .collect();
    let untouched = rows.iter().rev().find(|row| !row.touches());
    let Some(untouched) = untouched.filter(|_| !others.is_empty()) else { return String::new() };
    let mean =
        |channel: usize| others.iter().map(|row| row.reading[channel]).sum::<f64>() / others.len() as f64;
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>().sqrt();
    let channels = 0..last.reading.len();
    let off = norm(&mut channels.clone().map(|channel| last.reading[channel] - mean(channel)));
    let size = norm(&mut channels.map(|channel| mean(channel) - untouched.reading[channel]));
    if size > 0.0 {
        format!(", {:.2} % off the others of its place", 100.0 * off / size)
    } else {
        String::new()
    }
}

fn ask(guide: &Guide, journal: &Journal) {
    let extent = journal.rig.setup.surface().extent();
    match (guide.waiting(), guide.next_press()) {
        (Waiting::Untouched, _) => remark!("leave the surface alone"),
        (Waiting::Press, Some((number, press))) => {
            remark!("press at {} ({} of {})", place(press, extent), number + 1, guide.plan().len());
        }
        (Waiting::Rest, _) => remark!("hold"),
        (Waiting::Release, _) => remark!("let go"),
        (Waiting::Press | Waiting::Nothing, _) => {}
    }
}

/// A press in words.
fn place(press: Press, extent: Extent) -> String {
    let mm = |at_m: f64| format_length_mm(at_m);
    let place = match extent {
        Extent::Line { .. } => mm(press.position.x_m),
        Extent::Plane { .. } => format!("{}, {}", mm(press.position.x_m), mm(press.position.y_m)),
    };
    press.force_n.map_or_else(|| place.clone(), |force_n| format!("{place} with {force_n} N"))
}

/// Lines that are typed.
fn keys() -> Receiver<String> {
    let (to, keys) = channel();
    // The thread waits for the keyboard until the process ends.
    std::thread::spawn(move || {
        for line in std::io::stdin().lines().map_while(Result::ok) {
            if to.send(line).is_err() {
                return;
            }
        }
    });
    keys
}

fn press_key(key: &str, guide: &mut Guide, journal: &mut Journal) -> Result<(), Failure> {
    match key.trim() {
        "r" => {
            if guide.redo() {
                journal.take_back()?;
            } else {
                remark!("nothing was pressed yet");
            }
        }
        "s" => guide.skip(),
        "q" => guide.stop(),
        _ => remark!("r and Enter takes the last press back, s leaves the next out, q ends here"),
    }
    ask(guide, journal);
    Ok(())
}

fn stopped(arguments: &Arguments, journal: &Journal) -> Failure {
    Failure::Interrupted(format!(
        "stopped; {} presses are in {}, and --resume goes on",
        journal.presses(),
        arguments.presses.display()
    ))
}

/// Folds of the cross-validation.
const FOLDS: usize = 5;

/// Fits the rig's estimator to the presses on disk, and says how good it is and what more presses would gain.
fn finish(arguments: &Arguments, rig: &Rig, out: &Target) -> Result<(), Failure> {
    let recording = input::read_recording(&rig.setup, &arguments.presses)?;
    let task = FitTask::new(&rig.setup, &recording).seed(arguments.seed);
    let failed = |error: &(dyn std::error::Error + 'static)| match Failure::from_error(error) {
        Failure::BadInput(complaint) => complaint.help("press at more places: --resume goes on").into(),
        other => other,
    };
    let observer = Observer::of_rounds(rig.estimator.most_rounds());
    let locator =
        observer.watch(|watch| rig.estimator.fit_task(task.watch(watch))).map_err(|error| failed(&error))?;
    out.write(locator.to_json().map_err(Complaint::new)?.as_bytes())?;
    let presses = recording.touched().rows.len();
    output::say(format!("{} fitted to {presses} presses: {}", locator.kind(), arguments.out.display()))?;
    let touched = recording.touched();
    if touched.distinct_positions().len() >= FOLDS {
        let task = FitTask::new(&rig.setup, &recording).seed(arguments.seed);
        let held_out = observer.watch(|watch| cross_validate(&rig.estimator, task.watch(watch), FOLDS));
        match held_out {
            Ok(evaluation) => {
                if let Some(summary) = evaluation.summary(None) {
                    let (median, mean) =
                        (format_length_mm(summary.median_m), format_length_mm(summary.average_m));
                    output::say(format!(
                        "error at positions held out ({FOLDS} folds): median {median}, mean {mean}"
                    ))?;
                }
            }
            Err(error) => remark!("no error at positions held out: {error}"),
        }
    }
    let design = rig.training.as_ref().map_or_else(PositionDesign::default, PositionDesign::for_training);
    match observer.watch(|watch| next_press(&rig.setup, &touched, &design, watch)) {
        Ok(advice) if advice.is_enough() => {
            output::say("more presses would lower the error by less than 5 %".to_owned())?;
        }
        Ok(advice) => output::say(format!(
            "endlessly many more presses would lower the expected error by {:.0} %: `palpate design positions {} --data {}` says where",
            advice.remaining_gain_percent(),
            arguments.rig.display(),
            arguments.presses.display()
        ))?,
        Err(error) => remark!("no advice on more presses: {error}"),
    }
    Ok(())
}
