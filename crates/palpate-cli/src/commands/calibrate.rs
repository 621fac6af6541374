//! `palpate calibrate`: a calibration by hand, guided press by press, or by a machine.

use crate::failure::{Complaint, Failure};
use crate::progress::{self, Observer};
use crate::remark::remark;
use crate::target::{Inputs, Target};
use crate::{input, output};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::Row;
use palpate_live::calibration::{
    self, Assessment, Calibration, CalibrationError, DepthKnowledge, Journal, JournalError, Machine,
    MachineError, MachineNote, Note, Press, Waiting,
};
use palpate_live::input::Input;
use palpate_live::pipeline::WAITING;
use palpate_live::source::{Source, SourceUrl};
use palpate_live::stage::{Order, StageError, StageThread, StageUrl};
use palpate_live::stamp::HostClock;
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::format_length_mm;
use palpate_numerics::watch::Cancelled;
use palpate_rig::{Rig, Stage};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel, sync_channel};
use std::time::Duration;

/// Calibrate by pressing: says where to press, takes each press once its reading is at rest, and ends with a locator.
///
/// Positions and repeats are those of the rig's [training]. Every press is in the file of presses before the next one is asked for, and --resume
/// goes on from there. Between presses the surface is let go, and what it reads then is recorded too: offsets and drift follow from it.
/// With --stage a machine presses by itself, as the rig's [stage] says: Enter or Ctrl-C stops it at once.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file
    rig: PathBuf,
    /// Source of the readings: `serial:///dev/ttyACM0`, `tcp://host:port`, `udp://:port`, `mqtt://host/topic`, `file:recording.mcap`, `-` for stdin
    #[arg(long, value_name = "SOURCE")]
    from: SourceUrl,
    /// A machine that presses: `gcode:serial:///dev/ttyUSB0?baud=115200` or `gcode:tcp://host:port`, of Marlin or GRBL firmware
    #[arg(long, value_name = "MACHINE")]
    stage: Option<StageUrl>,
    /// The recording of the presses
    #[arg(long, value_name = "FILE.csv")]
    presses: PathBuf,
    /// The locator to write
    #[arg(short, long, value_name = "LOCATOR")]
    out: PathBuf,
    /// Force of every press, as in `--force "2 N"` [default: the rig's, or unknown]
    #[arg(long, value_name = "FORCE", value_parser = input::force)]
    force: Option<f64>,
    /// Travel to every position at the height of travel, and press nowhere; nothing is read or written
    #[arg(long, requires = "stage")]
    dry_run: bool,
    /// Go on with the presses that the file of presses has
    #[arg(long)]
    resume: bool,
    /// Seed of the fit
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// Keys of a calibration by hand.
const KEYS: &str = "keys, each with Enter: r takes the last press back, s leaves the next out, u learns the untouched reading anew, q ends here";
/// Longest time without a look at keys, signals and the machine.
const LOOK_EVERY: Duration = Duration::from_millis(20);

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = Inputs::new([arguments.rig.as_path()]);
    let out = Target::new(&arguments.out, &inputs)?;
    Target::new(&arguments.presses, &inputs)?;
    let rig = input::read_rig(&arguments.rig)?;
    let machine = arguments.stage.as_ref();
    let stage = stage(&arguments.rig, &rig, machine, arguments.force)?;
    if let (true, Some(stage)) = (arguments.dry_run, &stage) {
        return dry_run(arguments, &rig, stage.clone());
    }
    let journal = journal(arguments, &rig, stage.as_ref())?;
    let depths_m = stage.as_ref().map_or(&[][..], |stage| &stage.depths_m);
    let plan = calibration::plan(&rig, arguments.force, depths_m, journal.rows())
        .map_err(|error| Complaint::about(&arguments.rig, error))?;
    if let Some(press) = plan.first() {
        let extent = rig.setup.surface().extent();
        remark!("{} presses to go; the first at {}", plan.len(), place(*press, extent));
        let columns = arguments.from.columns();
        let calibration = Calibration::new(&rig.setup, stage.as_ref(), columns, plan, journal)
            .map_err(|error| Complaint::new(format!("--from {}: {error}", arguments.from)))?;
        press_all(arguments, &rig, stage, calibration)?;
    }
    finish(arguments, &rig, &out)
}

/// The stage of the rig, where a machine presses.
pub fn stage(
    path: &Path,
    rig: &Rig,
    machine: Option<&StageUrl>,
    force_n: Option<f64>,
) -> Result<Option<Stage>, Failure> {
    if machine.is_none() {
        return Ok(None);
    }
    let Some(stage) = &rig.stage else {
        let complaint = Complaint::about(path, "--stage needs the rig's section [stage]");
        return Err(complaint.help("docs/live.md says how: origin, touch and depths at least").into());
    };
    if force_n.is_some() && (stage.load_cell.is_some() || stage.depths_m.len() > 1) {
        let why = if stage.load_cell.is_some() {
            "the load cell measures the force"
        } else {
            "presses of several depths have several forces"
        };
        return Err(Complaint::new(format!("--force does not go with the rig's [stage]: {why}"))
            .help("leave --force out")
            .into());
    }
    Ok(Some(stage.clone()))
}

/// The file of presses, empty, or with the presses that it had.
fn journal(arguments: &Arguments, rig: &Rig, stage: Option<&Stage>) -> Result<Journal, Failure> {
    let path = &arguments.presses;
    let depths = DepthKnowledge::for_stage(stage);
    if path.exists() && !arguments.resume {
        let complaint = Complaint::new(format!("{} is there already", path.display()));
        return Err(complaint.help("--resume goes on with its presses; another name begins anew").into());
    }
    let before = pressed_before(&arguments.rig, rig, path, depths)?;
    Journal::new(&rig.setup, path, pressed_for(&arguments.rig), before, depths)
        .map_err(|error| about_journal(&arguments.rig, &error))
}

/// Rows that a file of presses has already; none where there is no file.
pub fn pressed_before(
    rig_path: &Path,
    rig: &Rig,
    path: &Path,
    depths: DepthKnowledge,
) -> Result<Vec<Row>, Failure> {
    let columns = Journal::columns(&rig.setup, depths).map_err(|error| about_journal(rig_path, &error))?;
    match path.exists() {
        true => Ok(input::read_recording_as(&rig.setup, path, &columns)?.rows),
        false => Ok(Vec::new()),
    }
}

/// Comment of a file of presses.
pub fn pressed_for(rig: &Path) -> String {
    format!("palpate {}, pressed for {}", env!("CARGO_PKG_VERSION"), rig.display())
}

/// A complaint about presses that cannot be kept.
pub fn about_journal(rig: &Path, error: &JournalError) -> Failure {
    let complaint = match error {
        JournalError::Nuisance { .. } | JournalError::Numbered => Complaint::about(rig, error),
        _ => Complaint::new(error),
    };
    complaint.help(error.help()).into()
}

/// Presses of a plan, guided; those that are taken are on disk.
fn press_all(
    arguments: &Arguments,
    rig: &Rig,
    stage: Option<Stage>,
    mut calibration: Calibration,
) -> Result<(), Failure> {
    let keys = (arguments.from != SourceUrl::Stdin).then(keys);
    let (to, inputs) = sync_channel(WAITING);
    let _source = Source::open(&arguments.from, Path::new("."), HostClock::new(), to)
        .map_err(|error| Complaint::new(format!("--from {}: {error}", arguments.from)))?;
    let mut machine = machine(arguments, stage)?;
    let extent = rig.setup.surface().extent();
    if machine.is_none() {
        remark!("{KEYS}");
        ask(&calibration, extent);
    }
    let mut ended = false;
    while calibration.guide().waiting() != Waiting::Nothing && !ended {
        if progress::interrupted() {
            // The machine is stopped as it is dropped.
            drop(machine);
            return Err(stopped(arguments, &calibration));
        }
        let mut notes = Vec::new();
        match inputs.recv_timeout(LOOK_EVERY) {
            Ok(Input::Arrived(arrived)) => calibration
                .receive(&arrived, &mut notes)
                .map_err(|error| cannot_go_on(arguments, &calibration, error))?,
            Ok(Input::Command(_) | Input::Stop) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => ended = true,
        }
        ended |= notes.contains(&Note::Ended);
        say(&notes, &calibration, machine.is_none().then_some(extent));
        let key = keys.as_ref().and_then(|keys| keys.try_recv().ok());
        match (&mut machine, key) {
            (None, Some(key)) => press_key(&key, arguments, &mut calibration, extent)?,
            (None, None) => {}
            (Some(machine), key) => step(machine, key.as_deref(), &notes, &mut calibration)
                .map_err(|error| machine_ended(arguments, &calibration, &error))?,
        }
    }
    for (cause, count) in calibration.bad_frames() {
        remark!("{count} frames were no reading: {}", cause.describe());
    }
    if calibration.guide().waiting() != Waiting::Nothing {
        if let Some(machine) = machine {
            // No reading shows its finger any more.
            machine.finish().map_err(|error| machine_ended(arguments, &calibration, &error))?;
        }
        return Err(Failure::DataLost(format!(
            "the source ended before all was pressed; {}",
            goes_on(arguments, &calibration)
        )));
    }
    match machine {
        Some(machine) => machine.finish().map_err(|error| machine_ended(arguments, &calibration, &error)),
        None => Ok(()),
    }
}

/// The machine, connected, where one presses.
fn machine(arguments: &Arguments, stage: Option<Stage>) -> Result<Option<Machine>, Failure> {
    let (Some(url), Some(stage)) = (&arguments.stage, stage) else { return Ok(None) };
    let limit_n = stage.force_limit_n;
    Ok(Some(Machine::new(open_stage(url, stage)?, limit_n)))
}

/// Connects to a machine, which a signal stops at once; nothing moves yet.
fn open_stage(url: &StageUrl, stage: Stage) -> Result<StageThread, Failure> {
    let stop = Arc::default();
    progress::set_at_signal(&stop).map_err(Complaint::new)?;
    let thread = StageThread::open(url, stage, stop).map_err(|error| {
        if progress::interrupted() {
            return Failure::Interrupted("stopped before anything moved".to_owned());
        }
        let error = MachineError::from(error);
        Complaint::new(format!("--stage {url}: {error}")).help(error.help()).into()
    })?;
    remark!(
        "a machine of {} firmware at {url}; Enter stops it: {}",
        thread.firmware().name(),
        thread.stopping()
    );
    Ok(thread)
}

/// Homes, and travels to every position at the height of travel.
fn dry_run(arguments: &Arguments, rig: &Rig, stage: Stage) -> Result<(), Failure> {
    let Some(url) = &arguments.stage else { return Ok(()) };
    let plan = calibration::plan(rig, arguments.force, &[], &[])
        .map_err(|error| Complaint::about(&arguments.rig, error))?;
    let mut positions: Vec<_> = plan.iter().map(|press| press.position).collect();
    positions.dedup();
    let keys = keys();
    let mut thread = open_stage(url, stage)?;
    remark!("the machine looks for its end stops");
    let orders = std::iter::once(Order::Home).chain(positions.iter().copied().map(Order::Travel));
    for order in orders {
        thread.order(order);
        wait_for(&mut thread, &keys)?;
        if let Order::Travel(position) = order {
            let press = Press { position, force_n: None, depth_m: None };
            remark!("above {}", place(press, rig.setup.surface().extent()));
        }
    }
    thread.close();
    output::say(format!(
        "dry run: {} positions reached at the height of travel, none pressed",
        positions.len()
    ))
}

/// Waits for the end of a machine's move; anything that was typed stops it.
fn wait_for(thread: &mut StageThread, keys: &Receiver<String>) -> Result<(), Failure> {
    let ended = |error: MachineError| machine_failure(&error, "");
    loop {
        if let Some(done) = thread.done() {
            return done.map(drop).map_err(|error| ended(error.into()));
        }
        if keys.recv_timeout(LOOK_EVERY).is_ok() || progress::interrupted() {
            thread.stop();
            return Err(ended(MachineError::ByHand));
        }
        // Without a keyboard the channel is closed, and does not wait.
        std::thread::sleep(LOOK_EVERY / 10);
    }
}

/// Has the machine do what is next; anything that was typed stops it.
fn step(
    machine: &mut Machine,
    key: Option<&str>,
    notes: &[Note],
    calibration: &mut Calibration,
) -> Result<(), MachineError> {
    if key.is_some() {
        return machine.stop_by_hand();
    }
    machine.heed(notes)?;
    match machine.step(calibration)? {
        Some(MachineNote::Homing) => remark!("the machine looks for its end stops"),
        Some(MachineNote::Unseen) => remark!("left out: a press that no reading showed"),
        Some(MachineNote::NoRest) => remark!("left out: a press whose reading did not come to rest"),
        None => {}
    }
    Ok(())
}

fn machine_ended(arguments: &Arguments, calibration: &Calibration, error: &MachineError) -> Failure {
    machine_failure(error, &format!("; {}", goes_on(arguments, calibration)))
}

fn machine_failure(error: &MachineError, more: &str) -> Failure {
    let words = format!("{error}: {}{more}", error.help());
    match error {
        MachineError::ByHand | MachineError::Stage(StageError::Stopped) => Failure::Interrupted(words),
        MachineError::Stage(_) | MachineError::Silent => Failure::DataLost(words),
        _ => Failure::GoalMissed(words),
    }
}

fn cannot_go_on(arguments: &Arguments, calibration: &Calibration, error: CalibrationError) -> Failure {
    match error {
        CalibrationError::Journal(error) => about_journal(&arguments.rig, &error),
        CalibrationError::LoadCell { .. } => {
            Failure::GoalMissed(format!("{error}; {}", goes_on(arguments, calibration)))
        }
    }
}

/// Says what happened; a person at `hand`, on this surface, is told what to do next.
fn say(notes: &[Note], calibration: &Calibration, hand: Option<Extent>) {
    for note in notes {
        match note {
            Note::Opened(name) => remark!("readings from {name}"),
            Note::Lost(why) => remark!("the source went away: {why}; it is waited for"),
            Note::Unread(words) => remark!("{words}"),
            Note::Taken => {
                let rows = calibration.journal().rows();
                let off = calibration::last_deviation_percent(rows)
                    .map_or(String::new(), |off| format!(", {off:.2} % off the others of its place"));
                let force = rows.last().and_then(|row| row.force_n);
                let force = force.map_or(String::new(), |force_n| format!(" of {force_n:.3} N"));
                remark!("taken: press {}{force}{off}", calibration.journal().presses());
            }
            Note::Replaced => {
                remark!("the reading grew: press {} is taken anew", calibration.journal().presses());
            }
            Note::AskedAgain(doubt) => remark!("not taken: {doubt}"),
            Note::StillWaiting(words) => remark!("{words}"),
            Note::Saturated(name) => remark!("channel {name} reads the end of its range"),
            Note::Ended | Note::Waits(_) | Note::Untouched | Note::Overload(_) => {}
        }
        if let (Some(extent), Note::Taken | Note::AskedAgain(_) | Note::Waits(_)) = (hand, note) {
            ask(calibration, extent);
        }
    }
}

fn ask(calibration: &Calibration, extent: Extent) {
    let guide = calibration.guide();
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

fn press_key(
    key: &str,
    arguments: &Arguments,
    calibration: &mut Calibration,
    extent: Extent,
) -> Result<(), Failure> {
    match key.trim() {
        "r" => {
            if !calibration.redo().map_err(|error| about_journal(&arguments.rig, &error))? {
                remark!("nothing was pressed yet");
            }
        }
        "s" => calibration.skip(),
        "u" => calibration.relearn_untouched(),
        "q" => calibration.stop(),
        _ => remark!("{KEYS}"),
    }
    ask(calibration, extent);
    Ok(())
}

fn stopped(arguments: &Arguments, calibration: &Calibration) -> Failure {
    Failure::Interrupted(format!("stopped; {}", goes_on(arguments, calibration)))
}

/// Words on what is kept.
fn goes_on(arguments: &Arguments, calibration: &Calibration) -> String {
    let presses = calibration.journal().presses();
    if presses == 0 {
        return "no press was taken".to_owned();
    }
    format!("{presses} presses are in {}, and --resume goes on", arguments.presses.display())
}

/// Fits the rig's estimator to the presses on disk, and says how good it is and what more presses would gain.
fn finish(arguments: &Arguments, rig: &Rig, out: &Target) -> Result<(), Failure> {
    if !arguments.presses.exists() {
        let words =
            "the calibration ended before any press, so there is nothing to fit; run it again and press";
        return Err(Failure::GoalMissed(words.to_owned()));
    }
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
    let assessment = observer
        .watch(|watch| Assessment::new(rig, &recording, arguments.seed, watch))
        .map_err(|Cancelled| Failure::Interrupted("stopped before its error was estimated".to_owned()))?;
    if let Some(held_out) = assessment.held_out {
        let (median, mean) = (format_length_mm(held_out.median_m), format_length_mm(held_out.mean_m));
        let folds = held_out.folds;
        output::say(format!("error at positions held out ({folds} folds): median {median}, mean {mean}"))?;
    }
    assessment.remarks.iter().for_each(|remark| remark!("{remark}"));
    match assessment.gain {
        Some(gain) if gain.is_enough() => {
            output::say(format!("more presses would lower the error by less than {} %", gain.stop_percent))
        }
        Some(gain) => output::say(format!(
            "endlessly many more presses would lower the expected error by {:.0} %: `palpate design positions {} --data {}` says where",
            gain.percent,
            arguments.rig.display(),
            arguments.presses.display()
        )),
        None => Ok(()),
    }
}
