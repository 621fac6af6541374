//! `palpate calibrate`: a calibration by hand, guided press by press, or by a machine.

use super::jog::{Jog, JogEnd};
use super::operator::{self, place};
use crate::failure::{Complaint, Failure};
use crate::progress::{self, Observer};
use crate::remark::remark;
use crate::target::{Inputs, Target};
use crate::{input, output};
use palpate_estimators::description;
use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_estimators::recording::{Recording, Row, comment_with_placement};
use palpate_live::calibration::{
    self, Assessment, Calibration, CalibrationError, Check, DepthKnowledge, Journal, JournalError, Machine,
    MachineError, MachineNote, Note, Press, Statements, Waiting, Weights,
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

/// Calibrate by guided presses: each is taken once its reading is at rest, and the fit ends with a locator.
///
/// Positions and repeats are those of the rig's [training]. Every press is in the file of presses before the next one is asked for, and --resume
/// goes on from there. A person is asked first how well he meets the places, and for a second weight where one is too few. Between presses the surface is let go, and what it reads then is recorded too: offsets and drift follow from it.
/// With --stage a machine presses by itself, with the positions and depths of the rig's [stage]: Enter or Ctrl-C stops it at once.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig file
    rig: PathBuf,
    /// Source of the readings: `serial:///dev/ttyACM0`, `tcp://host:port`, `udp://:port`, `mqtt://host/topic`, `file:recording.mcap`, `-` for stdin
    #[arg(long, value_name = "SOURCE")]
    from: SourceUrl,
    #[cfg(feature = "gcode")]
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
    #[cfg(feature = "gcode")]
    /// Travel to every position at the height of travel without a press; no file is read or written but the rig
    #[arg(long, requires = "stage")]
    dry_run: bool,
    #[command(flatten)]
    operator: OperatorOptions,
    #[cfg(feature = "gcode")]
    /// Jog the machine by hand before the presses, and find the height at which its finger touches
    #[arg(long, requires = "stage", conflicts_with = "dry_run")]
    jog: bool,
    /// Check the locator by presses at five fresh places after the fit
    #[arg(long)]
    check: bool,
    /// Go on with the presses that the file of presses has
    #[arg(long)]
    resume: bool,
    /// Seed of the fit
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Run the clock so many times as fast, for a simulated board and machine of the same --clock-speed
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

/// A command without machines.
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
    /// How far off the asked place a person presses, as a standard deviation: `--placement "2 mm"` [default: the rig's, or asked for]
    #[arg(long, value_name = "LENGTH", value_parser = input::length)]
    placement: Option<f64>,
    /// A second weight, by which every other place is pressed too [default: asked for where one weight is too few]
    #[arg(long, value_name = "FORCE", value_parser = input::force, conflicts_with = "force_is_known")]
    #[cfg_attr(feature = "gcode", arg(conflicts_with = "stage"))]
    second_force: Option<f64>,
    /// Contacts in use have the force of the presses
    #[arg(long)]
    force_is_known: bool,
}

impl OperatorOptions {
    /// The first option that is given.
    pub fn given(&self) -> Option<&'static str> {
        match self.statements() {
            Statements { placement_sd_m: Some(_), .. } => Some("--placement"),
            Statements { second_force_n: Some(_), .. } => Some("--second-force"),
            Statements { force_is_known: true, .. } => Some("--force-is-known"),
            _ => None,
        }
    }

    /// The statements of the options.
    pub fn statements(&self) -> Statements {
        Statements {
            placement_sd_m: self.placement,
            second_force_n: self.second_force,
            force_is_known: self.force_is_known,
        }
    }
}

/// Longest time without a look at keys, signals and the machine.
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
        None => stated.or_known(&rig, arguments.force, in_file_m, &before),
        // The placement of the rig is that of a person.
        Some(_) => stated,
    };
    let depths_m = stage.as_ref().map_or_else(Vec::new, |stage| stage.depths_m.clone());
    let to_come = |statements: &Statements, rows: &[Row]| {
        calibration::plan(&rig, statements.weights(arguments.force), &depths_m, rows)
            .map_err(|error| Complaint::about(&arguments.rig, error))
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
    let comment = comment_with_placement(&pressed_for(&arguments.rig), statements.placement_sd_m);
    let bench = Bench { arguments, rig: &rig, keys: keys.as_ref(), clock };
    if let Some(press) = plan.first() {
        if let Some(force_n) = statements.single_weight_n(&rig, arguments.force).filter(|_| is_by_hand) {
            remark!("{}", operator::single_weight(force_n));
        }
        let journal = Journal::new(&rig.setup, &arguments.presses, comment.clone(), before, depths)
            .map_err(|error| about_journal(&arguments.rig, &error))?;
        let extent = rig.setup.surface().extent();
        remark!("{} presses to go; the first at {}", plan.len(), place(*press, extent));
        let calibration = bench.calibration(stage.as_ref(), plan, journal)?;
        let replan = |rows: &[Row]| to_come(&statements, rows);
        bench.press_all(stage.clone(), calibration, Some(&replan))?;
    }
    let (locator, recording) = finish(arguments, &rig, &out)?;
    let weights = statements.weights(arguments.force);
    let asks = is_by_hand && !arguments.check && bench.keys.is_some_and(operator::wants_check);
    if arguments.check || asks {
        bench.check(&locator, &recording.rows, weights, comment, statements.placement_sd_m, stage)?;
    }
    Ok(())
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

/// Rows that the file of presses has, and the placement that it says; none of a new file.
fn rows_before(
    arguments: &Arguments,
    rig: &Rig,
    depths: DepthKnowledge,
) -> Result<(Vec<Row>, Option<f64>), Failure> {
    let path = &arguments.presses;
    if path.exists() && !arguments.resume {
        let complaint = Complaint::new(format!("{} is there already", path.display()));
        return Err(complaint.help("--resume goes on with its presses; another name begins anew").into());
    }
    pressed_before(&arguments.rig, rig, path, depths)
}

/// Rows that a file of presses has already, and the placement that it says; none where there is no file.
pub fn pressed_before(
    rig_path: &Path,
    rig: &Rig,
    path: &Path,
    depths: DepthKnowledge,
) -> Result<(Vec<Row>, Option<f64>), Failure> {
    let columns = Journal::columns(&rig.setup, depths).map_err(|error| about_journal(rig_path, &error))?;
    match path.exists() {
        true => {
            let recording = input::read_recording_as(&rig.setup, path, &columns)?;
            Ok((recording.rows, recording.provenance.placement_sd_m))
        }
        false => Ok((Vec::new(), None)),
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

/// Presses that are missing from rows.
type Replan<'a> = &'a dyn Fn(&[Row]) -> Result<Vec<Press>, Complaint>;

/// The bench of a calibration, and the person at its keyboard.
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
            .map_err(|error| Complaint::new(format!("--from {from}: {error}")))?;
        Ok((source, inputs))
    }

    /// Jogs and touch-offs by the keys; the stage gets the height that is found. False where the operator ends it.
    fn set_up(&self, stage: &mut Stage) -> Result<bool, Failure> {
        let Self { arguments, rig, clock, .. } = self;
        let (Some(url), Some(keys)) = (arguments.machine(), self.keys) else {
            let complaint =
                Complaint::new("--jog needs the keyboard, and --from - takes the readings from it");
            return Err(complaint.help("give the readings by another source").into());
        };
        // Nothing is pressed, and no file is written.
        let journal =
            Journal::new(&rig.setup, &arguments.presses, String::new(), Vec::new(), DepthKnowledge::Unknown)
                .map_err(|error| about_journal(&arguments.rig, &error))?;
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
            JogEnd::Interrupted => Err(Failure::Interrupted("stopped; nothing was pressed".to_owned())),
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
            .map_err(|error| Complaint::new(format!("--from {from}: {error}")).into())
    }

    /// Asks for presses at fresh places, and says how far off the locator is there.
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
            return Err(
                Complaint::new("there is no place between those of the calibration to check at").into()
            );
        }
        let path = calibration::check_path(&arguments.presses);
        let depths = DepthKnowledge::for_stage(stage.as_ref());
        let journal = Journal::new(&rig.setup, &path, comment, Vec::new(), depths)
            .map_err(|error| about_journal(&arguments.rig, &error))?;
        remark!("check at {} fresh places; the presses are in {}", plan.len(), path.display());
        let calibration = self.calibration(stage.as_ref(), plan, journal)?;
        self.press_all(stage, calibration, None)?;
        if !path.exists() {
            remark!("no place was checked");
            return Ok(());
        }
        let recording = input::read_recording(&rig.setup, &path)?;
        let check = Check::new(locator, &recording).map_err(Complaint::new)?;
        operator::say_check(check.as_ref(), placement_sd_m, rig.setup.surface().extent())
    }

    /// Presses of a plan, guided; those that are taken are on disk. A press can be struck out where `replan` asks for it again.
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
            remark!("{}", help(replan.is_some()));
            operator::ask_for(&calibration, extent);
        }
        let mut ended = false;
        while calibration.guide().waiting() != Waiting::Nothing && !ended {
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
            operator::say(&notes, &calibration, machine.is_none().then_some(extent));
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
            remark!("{count} frames were no reading: {}", cause.describe());
        }
        if calibration.guide().waiting() != Waiting::Nothing {
            if let Some(machine) = machine {
                // No reading shows its finger any more.
                machine.finish().map_err(|error| machine_ended(arguments, &calibration, &error))?;
            }
            let cause = calibration.fault().unwrap_or("the source ended before all was pressed".to_owned());
            return Err(Failure::DataLost(format!("{cause}; {}", goes_on(arguments, &calibration))));
        }
        if let Some(fault) = calibration.fault().filter(|_| calibration.readings() == 0) {
            return Err(Failure::DataLost(format!("{fault}; {}", goes_on(arguments, &calibration))));
        }
        match machine {
            Some(machine) => machine.finish().map_err(|error| machine_ended(arguments, &calibration, &error)),
            None => Ok(()),
        }
    }
}

/// The machine, connected, where one presses.
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

/// Connects to a machine, which a signal stops at once; nothing moves yet.
fn open_stage(url: &StageUrl, stage: Stage, clock: HostClock) -> Result<StageThread, Failure> {
    let stop = Arc::default();
    // A machine that was stopped is lifted.
    progress::finish_after_signal();
    progress::set_at_signal(&stop).map_err(Complaint::new)?;
    let thread = StageThread::open(url, stage, stop, clock).map_err(|error| {
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
fn dry_run(arguments: &Arguments, rig: &Rig, stage: Stage, clock: HostClock) -> Result<(), Failure> {
    let Some(url) = arguments.machine() else { return Ok(()) };
    let weights = arguments.operator.statements().weights(arguments.force);
    let plan = calibration::plan(rig, weights, &stage.depths_m, &[])
        .map_err(|error| Complaint::about(&arguments.rig, error))?;
    let positions = calibration::dry_run(&plan);
    let keys = keys();
    let mut thread = open_stage(url, stage, clock)?;
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
    now: Duration,
    calibration: &mut Calibration,
) -> Result<(), MachineError> {
    if key.is_some() {
        return machine.stop_by_hand();
    }
    machine.heed(notes)?;
    match machine.step(now, calibration)? {
        Some(MachineNote::Homing) => remark!("the machine looks for its end stops"),
        Some(MachineNote::Unseen) => remark!("left out: a press that no reading showed"),
        Some(MachineNote::NoRest) => remark!("left out: a press whose reading did not come to rest"),
        Some(MachineNote::SetUp(note)) => remark!("{note}"),
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

/// Words on the keys.
fn help(can_strike: bool) -> &'static str {
    match can_strike {
        true => {
            "keys, each with Enter: r takes the last press back, s leaves the next out, u learns the untouched reading anew, l lists the presses, \
             x 7 strikes press 7 out, q ends here"
        }
        false => {
            "keys, each with Enter: r takes the last press back, s leaves the next out, u learns the untouched reading anew, q ends here"
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
    let about = |error: &JournalError| about_journal(&arguments.rig, error);
    match (key.trim(), replan) {
        ("r", _) => {
            if !calibration.redo().map_err(|error| about(&error))? {
                remark!("nothing was pressed yet");
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
                remark!("struck out; it is asked for again");
            } else {
                remark!("no such press; l lists them");
            }
        }
        (_, replan) => remark!("{}", help(replan.is_some())),
    }
    operator::ask_for(calibration, extent);
    Ok(())
}

fn stopped(arguments: &Arguments, calibration: &Calibration) -> Failure {
    match calibration.fault() {
        Some(fault) => Failure::DataLost(format!("stopped; {fault}; {}", goes_on(arguments, calibration))),
        None => Failure::Interrupted(format!("stopped; {}", goes_on(arguments, calibration))),
    }
}

/// Words on what is kept.
fn goes_on(arguments: &Arguments, calibration: &Calibration) -> String {
    let presses = calibration.journal().presses();
    if presses == 0 {
        return "no press was taken".to_owned();
    }
    let path = calibration.journal().path();
    match path == arguments.presses {
        true => format!("{presses} presses are in {}, and --resume goes on", path.display()),
        false => format!(
            "{presses} presses are in {}, and --resume --check begins the check again",
            path.display()
        ),
    }
}

/// Fits the rig's estimator to the presses on disk, and says how good it is and what more presses would gain.
fn finish(arguments: &Arguments, rig: &Rig, out: &Target) -> Result<(Locator, Recording), Failure> {
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
    let checked = description::interval_check(locator.interval_check.as_ref());
    checked.into_iter().try_for_each(output::say)?;
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
            output::say(format!("more presses would lower the error by less than {} %", gain.stop_percent))?;
        }
        Some(gain) => output::say(format!(
            "endlessly many more presses would lower the expected error by {:.0} %: `palpate design positions {} --data {}` says where",
            gain.percent,
            arguments.rig.display(),
            arguments.presses.display()
        ))?,
        None => {}
    }
    Ok((locator, recording))
}
