//! `palpate calibrate`: a calibration by hand or by a machine, guided press by press.

use super::jog::{Jog, JogEnd};
use super::operator::{self, place};
use crate::failure::{Failure, UserError};
use crate::json::object;
use crate::progress::{self, Observer};
use crate::remark::{alert, remark};
use crate::target::{Inputs, Target};
use crate::{input, output};
use palpate_estimators::description;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{Recording, Row, comment_with_placement};
use palpate_live::calibration::{
    self, Assessment, AwaitedStep, Calibration, CalibrationError, Check, DepthKnowledge, Journal,
    JournalError, Machine, MachineError, MachineNote, Note, Press, Statements, Weights,
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
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel, sync_channel};
use std::time::Duration;

const EXAMPLES: &str = "\
Examples:
  # Calibrate a board at a serial port
  palpate calibrate beam.toml --from serial:///dev/ttyACM0 --presses pressed.csv -o b.json

  # Continue later with the remaining presses
  palpate calibrate beam.toml --from serial:///dev/ttyACM0 --presses pressed.csv -o b.json --resume";

/// Calibrate a board by guided presses, and write a locator
///
/// Positions and repeats are those of the rig's [training]. A press is recorded once its reading is at rest, and is on disk before the next is
/// requested. Between presses the untouched surface is recorded, for offsets and drift. A person is asked for the accuracy of the placement, and for
/// a second weight if one is too few. With --stage a machine presses at the positions and depths of the rig's [stage]; Enter or Ctrl-C stops it
/// at once.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file
    rig: PathBuf,
    /// Source of the readings: `serial:///dev/ttyACM0?baud=115200`, `tcp://host:port`, `udp://:port`, `mqtt://host/topic`,
    /// `file:recording.mcap?speed=1`, `simulated:RIG.toml?rate=100`, or `-` for stdin
    #[arg(long, value_name = "SOURCE")]
    from: SourceUrl,
    #[cfg(feature = "gcode")]
    /// Press by a machine with Marlin or GRBL firmware: `gcode:serial:///dev/ttyUSB0?baud=115200` or `gcode:tcp://host:port`
    #[arg(long, value_name = "MACHINE")]
    stage: Option<StageUrl>,
    /// Write the presses to FILE.csv
    #[arg(long, value_name = "FILE.csv")]
    presses: PathBuf,
    /// Write the locator to this file
    #[arg(short, long, value_name = "LOCATOR")]
    out: PathBuf,
    /// Force of every press, such as "2 N" [default: that of the rig, or unknown]
    #[arg(long, value_name = "FORCE", value_parser = input::force)]
    force: Option<f64>,
    #[cfg(feature = "gcode")]
    /// Move the machine over every position without a press, and write no file
    #[arg(long, requires = "stage")]
    dry_run: bool,
    #[command(flatten)]
    operator: OperatorOptions,
    #[cfg(feature = "gcode")]
    /// Jog the machine by keys before the presses, and find the height of contact
    #[arg(long, requires = "stage", conflicts_with = "dry_run")]
    jog: bool,
    /// Check the locator after the fit by presses at five other positions
    #[arg(long)]
    check: bool,
    /// Continue an existing file of presses
    #[arg(long)]
    resume: bool,
    /// Seed of the fit
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Print the result as a line of JSON, and that of a check as another
    #[arg(long)]
    json: bool,
    /// Speed up the clock, as that of a simulated board and machine
    #[arg(long, value_name = "N", default_value_t = 1, hide = true, value_parser = input::clock_speed())]
    clock_speed: u32,
}

#[cfg(feature = "gcode")]
impl Arguments {
    fn machine(&self) -> Option<&StageUrl> {
        self.stage.as_ref()
    }

    fn is_dry_run(&self) -> bool {
        self.dry_run
    }

    fn jogs(&self) -> bool {
        self.jog
    }
}

#[cfg(not(feature = "gcode"))]
impl Arguments {
    fn machine(&self) -> Option<&StageUrl> {
        None
    }

    fn is_dry_run(&self) -> bool {
        false
    }

    fn jogs(&self) -> bool {
        false
    }
}

/// Statements of the person who presses.
#[derive(clap::Args)]
pub struct OperatorOptions {
    /// Standard deviation of the pressed from the requested position, such as "2 mm" [default: that of the rig, or asked for]
    #[arg(long, value_name = "LENGTH", value_parser = input::length)]
    placement: Option<f64>,
    /// Press every other position also with a second weight, such as "4 N" [default: asked for if one weight is too few]
    #[arg(long, value_name = "FORCE", value_parser = input::force, conflicts_with = "known_force")]
    #[cfg_attr(feature = "gcode", arg(conflicts_with = "stage"))]
    second_force: Option<f64>,
    /// Assume that contacts in use have the force of the presses
    #[arg(long)]
    known_force: bool,
}

impl OperatorOptions {
    pub fn given(&self) -> Option<&'static str> {
        match self.statements() {
            Statements { placement_sd_m: Some(_), .. } => Some("--placement"),
            Statements { second_force_n: Some(_), .. } => Some("--second-force"),
            Statements { force_is_known: true, .. } => Some("--known-force"),
            _ => None,
        }
    }

    pub fn statements(&self) -> Statements {
        Statements {
            placement_sd_m: self.placement,
            second_force_n: self.second_force,
            force_is_known: self.known_force,
        }
    }
}

const LOOK_EVERY: Duration = Duration::from_millis(20);

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = Inputs::new([arguments.rig.as_path()]);
    let out = Target::new(&arguments.out, &inputs)?;
    Target::new(&arguments.presses, &inputs)?;
    let rig = input::read_rig(&arguments.rig)?;
    let machine = arguments.machine();
    let mut stage = stage(&arguments.rig, &rig, machine, arguments.force)?;
    let clock = HostClock::with_speed(arguments.clock_speed);
    if let (true, Some(stage)) = (arguments.is_dry_run(), &stage) {
        return dry_run(arguments, &rig, stage.clone(), clock);
    }
    let depths = DepthKnowledge::for_stage(stage.as_ref());
    let (before, in_file_m) = rows_before(arguments, &rig, depths)?;
    let stated = arguments.operator.statements();
    let known = match &stage {
        None => stated.with_known_values(&rig, arguments.force, in_file_m, &before),
        // The rig's placement error is that of a person.
        Some(_) => stated,
    };
    let depths_m = stage.as_ref().map_or_else(Vec::new, |stage| stage.depths_m.clone());
    let to_come = |statements: &Statements, rows: &[Row]| {
        calibration::plan(&rig, statements.weights(arguments.force), &depths_m, rows)
            .map_err(|error| UserError::for_path(&arguments.rig, error))
    };
    let is_by_hand = stage.is_none() && !to_come(&known, &before)?.is_empty();
    let keys = (arguments.from != SourceUrl::Stdin).then(keys);
    if let (true, Some(set_up)) = (arguments.jogs(), &mut stage) {
        let bench = Bench { arguments, rig: &rig, keys: keys.as_ref(), clock };
        if !bench.set_up(set_up)? {
            return Ok(());
        }
    }
    let statements = match (&keys, is_by_hand) {
        (Some(keys), true) => operator::ask(known, &rig, arguments.force, keys)?,
        _ => known,
    };
    let rig = statements.applied_to(&rig, arguments.force);
    let plan = to_come(&statements, &before)?;
    let comment = comment_with_placement(&journal_heading(&arguments.rig), statements.placement_sd_m);
    let bench = Bench { arguments, rig: &rig, keys: keys.as_ref(), clock };
    if let Some(press) = plan.first() {
        if let Some(force_n) = statements.single_weight_n(&rig, arguments.force).filter(|_| is_by_hand) {
            alert!("{}", operator::single_weight(force_n));
        }
        let journal = Journal::new(&rig.setup, &arguments.presses, comment.clone(), before, depths)
            .map_err(|error| journal_failure(&arguments.rig, &error))?;
        let extent = rig.setup.surface().extent();
        alert!("{} presses to go; the first at {}", plan.len(), place(*press, extent));
        let calibration = bench.calibration(stage.as_ref(), plan, journal)?;
        let replan = |rows: &[Row]| to_come(&statements, rows);
        bench.press_all(stage.clone(), calibration, Some(&replan))?;
    }
    let (locator, recording) = finish(arguments, &rig, &out)?;
    let weights = statements.weights(arguments.force);
    let asks = is_by_hand && !arguments.check && bench.keys.is_some_and(operator::asks_for_check);
    if arguments.check || asks {
        bench.check(&locator, &recording.rows, weights, comment, statements.placement_sd_m, stage)?;
    }
    Ok(())
}

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
        let user_error = UserError::for_path(path, "--stage needs the rig's section [stage]");
        return Err(user_error
            .help("docs/how-to/press-with-a-machine.md describes it; `origin`, `touch` and `depths` are required")
            .into());
    };
    if force_n.is_some() && (stage.load_cell.is_some() || stage.depths_m.len() > 1) {
        let why = if stage.load_cell.is_some() {
            "the load cell measures the force"
        } else {
            "presses of several depths have several forces"
        };
        return Err(UserError::new(format!("--force does not go with the rig's [stage]: {why}"))
            .help("leave --force out")
            .into());
    }
    Ok(Some(stage.clone()))
}

fn rows_before(
    arguments: &Arguments,
    rig: &Rig,
    depths: DepthKnowledge,
) -> Result<(Vec<Row>, Option<f64>), Failure> {
    let path = &arguments.presses;
    if path.exists() && !arguments.resume {
        let user_error = UserError::new(format!("{} exists already", path.display()));
        return Err(user_error
            .help("--resume continues with its presses; another name starts a new calibration")
            .into());
    }
    load_presses(&arguments.rig, rig, path, depths)
}

/// Returns the rows and the placement of a presses file; no rows without a file.
pub fn load_presses(
    rig_path: &Path,
    rig: &Rig,
    path: &Path,
    depths: DepthKnowledge,
) -> Result<(Vec<Row>, Option<f64>), Failure> {
    let columns = Journal::columns(&rig.setup, depths).map_err(|error| journal_failure(rig_path, &error))?;
    match path.exists() {
        true => {
            let recording = input::read_recording_as(&rig.setup, path, &columns)?;
            Ok((recording.rows, recording.provenance.placement_sd_m))
        }
        false => Ok((Vec::new(), None)),
    }
}

pub fn journal_heading(rig: &Path) -> String {
    format!("palpate {}, pressed for {}", env!("CARGO_PKG_VERSION"), rig.display())
}

pub fn journal_failure(rig: &Path, error: &JournalError) -> Failure {
    let user_error = match error {
        JournalError::Nuisance { .. } | JournalError::Numbered => UserError::for_path(rig, error),
        _ => UserError::new(error),
    };
    user_error.help(error.help()).into()
}

type Replan<'a> = &'a dyn Fn(&[Row]) -> Result<Vec<Press>, UserError>;

struct Bench<'a> {
    arguments: &'a Arguments,
    rig: &'a Rig,
    keys: Option<&'a Receiver<String>>,
    clock: HostClock,
}

impl Bench<'_> {
    fn open_source(&self) -> Result<(Source, Receiver<Input>), Failure> {
        let from = &self.arguments.from;
        let (to, inputs) = sync_channel(WAITING);
        let source = Source::open(from, Path::new("."), self.clock, to)
            .map_err(|error| UserError::new(format!("--from {from}: {error}")))?;
        Ok((source, inputs))
    }

    /// Jogs, touches off and sets the stage's surface height. Returns false if the operator quits.
    fn set_up(&self, stage: &mut Stage) -> Result<bool, Failure> {
        let Self { arguments, rig, clock, .. } = self;
        let (Some(url), Some(keys)) = (arguments.machine(), self.keys) else {
            let user_error =
                UserError::new("--jog needs the keyboard, and --from - takes the readings from it");
            return Err(user_error.help("give the readings by another source").into());
        };
        // This calibration has no presses, so it writes no file.
        let journal =
            Journal::new(&rig.setup, &arguments.presses, String::new(), Vec::new(), DepthKnowledge::Unknown)
                .map_err(|error| journal_failure(&arguments.rig, &error))?;
        let calibration = self.calibration(Some(stage), Vec::new(), journal)?;
        let (_source, inputs) = self.open_source()?;
        let thread = open_stage(url, stage.clone(), *clock)?;
        let machine = Machine::to_set_up(thread, stage.clone(), clock.elapsed());
        let outcome = Jog::new(machine, calibration, *clock)
            .run(&inputs, keys)
            .map_err(|error| machine_failure(&error, ""))?;
        if let Some(touch_z_m) = outcome.touch_z_m {
            stage.touch_z_m = touch_z_m;
        }
        match outcome.end {
            JogEnd::Begin => Ok(true),
            JogEnd::Quit => Ok(false),
            JogEnd::Interrupted => Err(Failure::Interrupted("stopped before the first press".to_owned())),
        }
    }

    fn calibration(
        &self,
        stage: Option<&Stage>,
        plan: Vec<Press>,
        journal: Journal,
    ) -> Result<Calibration, Failure> {
        let from = &self.arguments.from;
        Calibration::new(&self.rig.setup, stage, from.columns(), plan, journal)
            .map_err(|error| UserError::new(format!("--from {from}: {error}")).into())
    }

    fn check(
        &self,
        locator: &Locator,
        rows: &[Row],
        weights: Weights,
        comment: String,
        placement_sd_m: Option<f64>,
        stage: Option<Stage>,
    ) -> Result<(), Failure> {
        let Self { arguments, rig, .. } = self;
        let depths_m = stage.as_ref().map_or(&[][..], |stage| &stage.depths_m);
        let plan = calibration::check_presses(rig, rows, weights, depths_m);
        if plan.is_empty() {
            return Err(UserError::new("no check position lies between those of the calibration").into());
        }
        let path = calibration::check_path(&arguments.presses);
        let depths = DepthKnowledge::for_stage(stage.as_ref());
        let journal = Journal::new(&rig.setup, &path, comment, Vec::new(), depths)
            .map_err(|error| journal_failure(&arguments.rig, &error))?;
        alert!("check at {} fresh places; the presses are in {}", plan.len(), path.display());
        let calibration = self.calibration(stage.as_ref(), plan, journal)?;
        self.press_all(stage, calibration, None)?;
        if !path.exists() {
            alert!("no place was checked");
            return Ok(());
        }
        let recording = input::read_recording(&rig.setup, &path)?;
        let check = Check::new(locator, &recording).map_err(UserError::new)?;
        if let (true, Some(check)) = (arguments.json, &check) {
            return output::print_json_line(&object! { "check": operator::check_json(check) });
        }
        operator::print_check(check.as_ref(), placement_sd_m, rig.setup.surface().extent())
    }

    /// Guides the presses of a plan. With `replan`, the operator can delete and repeat a press.
    fn press_all(
        &self,
        stage: Option<Stage>,
        mut calibration: Calibration,
        replan: Option<Replan>,
    ) -> Result<(), Failure> {
        let Self { arguments, rig, keys, clock } = self;
        let (_source, inputs) = self.open_source()?;
        let mut machine = machine(arguments, stage, *clock)?;
        let extent = rig.setup.surface().extent();
        if machine.is_none() {
            alert!("{}", help(replan.is_some()));
            operator::ask_for(&calibration, extent);
        }
        let mut ended = false;
        while calibration.guide().awaited_step() != AwaitedStep::Nothing && !ended {
            if progress::interrupted() {
                if let Some(machine) = &mut machine {
                    machine.stop_by_hand().map_err(|error| machine_ended(arguments, &calibration, &error))?;
                }
                return Err(stopped(arguments, &calibration));
            }
            let mut notes = Vec::new();
            match inputs.recv_timeout(LOOK_EVERY) {
                Ok(Input::Arrived(arrived)) => calibration
                    .receive(&arrived, &mut notes)
                    .map_err(|error| cannot_go_on(arguments, &calibration, error))?,
                Ok(Input::Command(_) | Input::Stop) | Err(RecvTimeoutError::Timeout) => {
                    calibration.check_feed(clock.now().elapsed, &mut notes);
                }
                Err(RecvTimeoutError::Disconnected) => ended = true,
            }
            ended |= notes.contains(&Note::Ended);
            operator::print_notes(&notes, &calibration, machine.is_none().then_some(extent));
            let key = keys.as_ref().and_then(|keys| keys.try_recv().ok());
            match (&mut machine, key) {
                (None, Some(key)) => press_key(&key, arguments, &mut calibration, extent, replan)?,
                (None, None) => {}
                (Some(machine), key) => {
                    step(machine, key.as_deref(), &notes, clock.elapsed(), &mut calibration)
                        .map_err(|error| machine_ended(arguments, &calibration, &error))?;
                }
            }
        }
        for (cause, count) in calibration.bad_frames() {
            alert!("{count} frames were not readings: {}", cause.describe());
        }
        if calibration.guide().awaited_step() != AwaitedStep::Nothing {
            if let Some(machine) = machine {
                machine.finish().map_err(|error| machine_ended(arguments, &calibration, &error))?;
            }
            let cause = calibration.fault().unwrap_or("the source ended before all was pressed".to_owned());
            return Err(Failure::DataLost(format!("{cause}; {}", resumption_text(arguments, &calibration))));
        }
        if let Some(fault) = calibration.fault().filter(|_| calibration.readings() == 0) {
            return Err(Failure::DataLost(format!("{fault}; {}", resumption_text(arguments, &calibration))));
        }
        match machine {
            Some(machine) => machine.finish().map_err(|error| machine_ended(arguments, &calibration, &error)),
            None => Ok(()),
        }
    }
}

fn machine(
    arguments: &Arguments,
    stage: Option<Stage>,
    clock: HostClock,
) -> Result<Option<Machine>, Failure> {
    let (Some(url), Some(stage)) = (arguments.machine(), stage) else { return Ok(None) };
    let limit_n = stage.force_limit_n;
    let thread = open_stage(url, stage, clock)?;
    Ok(Some(Machine::new(thread, limit_n, clock.elapsed())))
}

/// Connects to a machine, which a signal stops at once; it does not move yet.
fn open_stage(url: &StageUrl, stage: Stage, clock: HostClock) -> Result<StageThread, Failure> {
    let stop = Arc::default();
    // A stopped machine lifts its finger.
    progress::finish_after_signal();
    progress::set_at_signal(&stop).map_err(UserError::new)?;
    let thread = StageThread::open(url, stage, stop, clock).map_err(|error| {
        if progress::interrupted() {
            return Failure::Interrupted("stopped before anything moved".to_owned());
        }
        let error = MachineError::from(error);
        UserError::new(format!("--stage {url}: {error}")).help(error.help()).into()
    })?;
    alert!(
        "a machine of {} firmware at {url}; Enter stops it: {}",
        thread.firmware().name(),
        thread.stopping()
    );
    Ok(thread)
}

fn dry_run(arguments: &Arguments, rig: &Rig, stage: Stage, clock: HostClock) -> Result<(), Failure> {
    let Some(url) = arguments.machine() else { return Ok(()) };
    let weights = arguments.operator.statements().weights(arguments.force);
    let plan = calibration::plan(rig, weights, &stage.depths_m, &[])
        .map_err(|error| UserError::for_path(&arguments.rig, error))?;
    let positions = calibration::dry_run(&plan);
    let keys = keys();
    let mut thread = open_stage(url, stage, clock)?;
    alert!("the machine searches for its end stops");
    let orders = std::iter::once(Order::Home).chain(positions.iter().copied().map(Order::Travel));
    for order in orders {
        thread.order(order);
        wait_for(&mut thread, &keys)?;
        if let Order::Travel(position) = order {
            let press = Press { position, force_n: None, depth_m: None };
            alert!("above {}", place(press, rig.setup.surface().extent()));
        }
    }
    thread.close();
    if arguments.json {
        return output::print_json_line(&object! { "dry_run_positions": positions.len() });
    }
    output::print_line(format!(
        "dry run: {} positions reached at the height of travel, none pressed",
        positions.len()
    ))
}

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
        // Without a keyboard the channel is closed, and receiving does not wait.
        std::thread::sleep(LOOK_EVERY / 10);
    }
}

fn step(
    machine: &mut Machine,
    key: Option<&str>,
    notes: &[Note],
    now: Duration,
    calibration: &mut Calibration,
) -> Result<(), MachineError> {
    if key.is_some() {
        return machine.stop_by_hand();
    }
    machine.stop_on_notes(notes)?;
    match machine.step(now, calibration)? {
        Some(MachineNote::Homing) => alert!("the machine searches for its end stops"),
        Some(MachineNote::Unseen) => alert!("press excluded: it changed no reading"),
        Some(MachineNote::NoRest) => alert!("press excluded: its reading did not settle"),
        Some(MachineNote::SetUp(note)) => alert!("{note}"),
        None => {}
    }
    Ok(())
}

fn machine_ended(arguments: &Arguments, calibration: &Calibration, error: &MachineError) -> Failure {
    machine_failure(error, &format!("; {}", resumption_text(arguments, calibration)))
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
        CalibrationError::Journal(error) => journal_failure(&arguments.rig, &error),
        CalibrationError::LoadCell { .. } => {
            Failure::GoalMissed(format!("{error}; {}", resumption_text(arguments, calibration)))
        }
    }
}

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

fn help(can_strike: bool) -> &'static str {
    match can_strike {
        true => {
            "keys, each with Enter: r removes the last press, s skips the next, u measures the untouched reading again, l lists the presses, \
             x 7 removes press 7, q ends the calibration"
        }
        false => {
            "keys, each with Enter: r removes the last press, s skips the next, u measures the untouched reading again, q ends the calibration"
        }
    }
}

fn press_key(
    key: &str,
    arguments: &Arguments,
    calibration: &mut Calibration,
    extent: Extent,
    replan: Option<Replan>,
) -> Result<(), Failure> {
    let about = |error: &JournalError| journal_failure(&arguments.rig, error);
    match (key.trim(), replan) {
        ("r", _) => {
            if !calibration.redo().map_err(|error| about(&error))? {
                alert!("no press is recorded yet");
            }
        }
        ("s", _) => calibration.skip(),
        ("u", _) => calibration.relearn_untouched(),
        ("q", _) => calibration.stop(),
        ("l", Some(_)) => operator::list(calibration.journal().rows(), extent),
        (key, Some(replan)) if key.starts_with("x ") => {
            let press = key[2..].trim().parse::<usize>().ok().and_then(|press| press.checked_sub(1));
            let is_struck = match press {
                Some(press) => calibration.strike(press).map_err(|error| about(&error))?,
                None => false,
            };
            if is_struck {
                let to_come = replan(calibration.journal().rows())?;
                calibration.replan(to_come);
                alert!("removed; it is requested again");
            } else {
                alert!("no such press; l lists them");
            }
        }
        (_, replan) => alert!("{}", help(replan.is_some())),
    }
    operator::ask_for(calibration, extent);
    Ok(())
}

fn stopped(arguments: &Arguments, calibration: &Calibration) -> Failure {
    match calibration.fault() {
        Some(fault) => {
            Failure::DataLost(format!("stopped; {fault}; {}", resumption_text(arguments, calibration)))
        }
        None => Failure::Interrupted(format!("stopped; {}", resumption_text(arguments, calibration))),
    }
}

fn resumption_text(arguments: &Arguments, calibration: &Calibration) -> String {
    let presses = calibration.journal().presses();
    if presses == 0 {
        return "no press is recorded".to_owned();
    }
    let path = calibration.journal().path();
    match path == arguments.presses {
        true => format!("{presses} presses are in {}; --resume continues", path.display()),
        false => format!(
            "{presses} presses are in {}, and --resume --check begins the check again",
            path.display()
        ),
    }
}

/// Fits the estimator to the presses on disk, and reports errors and the gain of more presses.
fn finish(arguments: &Arguments, rig: &Rig, out: &Target) -> Result<(Locator, Recording), Failure> {
    if !arguments.presses.exists() {
        let words =
            "the calibration ended before any press, so no locator can be fitted; run it again and press";
        return Err(Failure::GoalMissed(words.to_owned()));
    }
    let recording = input::read_recording(&rig.setup, &arguments.presses)?;
    let task = FitTask::new(&rig.setup, &recording).seed(arguments.seed);
    let failed = |error: &(dyn std::error::Error + 'static)| match Failure::from_error(error) {
        Failure::BadInput(user_error) => {
            user_error.help("press at more positions: --resume continues").into()
        }
        other => other,
    };
    let observer = Observer::of_rounds(rig.estimator.most_rounds());
    let locator =
        observer.watch(|watch| rig.estimator.fit_task(task.watch(watch))).map_err(|error| failed(&error))?;
    out.write(locator.to_json().map_err(UserError::new)?.as_bytes())?;
    let presses = recording.touched().rows.len();
    let assess = || {
        let assessment = observer.watch(|watch| Assessment::new(rig, &recording, arguments.seed, watch));
        assessment
            .map_err(|Cancelled| Failure::Interrupted("stopped before its error was estimated".to_owned()))
    };
    if arguments.json {
        output::print_json_line(&result(arguments, &locator, presses, &assess()?))?;
        return Ok((locator, recording));
    }
    output::print_line(format!(
        "{} fitted to {presses} presses: {}",
        locator.kind(),
        arguments.out.display()
    ))?;
    let checked = description::interval_check(locator.interval_check.as_ref());
    checked.into_iter().try_for_each(output::print_line)?;
    let assessment = assess()?;
    if let Some(held_out) = assessment.held_out {
        let (median, mean) = (format_length_mm(held_out.median_m), format_length_mm(held_out.mean_m));
        let folds = held_out.folds;
        output::print_line(format!(
            "error at held-out positions ({folds} folds): median {median}, mean {mean}"
        ))?;
    }
    assessment.remarks.iter().for_each(|remark| remark!("{remark}"));
    match assessment.gain {
        Some(gain) if gain.is_enough() => {
            output::print_line(format!(
                "more presses would lower the error by less than {} %",
                gain.stop_percent
            ))?;
        }
        Some(gain) => output::print_line(format!(
            "unlimited further presses would lower the expected error by {:.0} %: `palpate design positions {} --data {}` proposes positions",
            gain.percent,
            arguments.rig.display(),
            arguments.presses.display()
        ))?,
        None => {}
    }
    Ok((locator, recording))
}

fn result(
    arguments: &Arguments,
    locator: &Locator,
    presses: usize,
    assessment: &Assessment,
) -> impl Serialize + use<> {
    let held_out = assessment.held_out.as_ref().map(|held_out| {
        object! {
            "folds": held_out.folds,
            "median_mm": held_out.median_m * 1e3,
            "mean_mm": held_out.mean_m * 1e3,
        }
    });
    let gain = assessment
        .gain
        .as_ref()
        .map(|gain| object! { "percent": gain.percent, "stop_below_percent": gain.stop_percent });
    object! {
        "palpate": env!("CARGO_PKG_VERSION"),
        "locator": arguments.out.display().to_string(),
        "recording": arguments.presses.display().to_string(),
        "estimator": locator.kind(),
        "seed": arguments.seed,
        "presses": presses,
        "interval_check": locator.interval_check,
        "held_out": held_out,
        "gain_of_more_presses": gain,
        "remarks": assessment.remarks.clone(),
    }
}
