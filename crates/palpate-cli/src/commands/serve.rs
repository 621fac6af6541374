//! `palpate serve`: a session for browsers.

use super::calibrate::{OperatorOptions, journal_failure, journal_heading, load_presses, stage};
use super::record::Words;
use super::sink_options::SinkOptions;
use crate::failure::{Failure, UserError};
use crate::input::{self, RigOrLocator};
use crate::progress::{self, Observer};
use crate::remark::{alert, remark};
use crate::rules;
use crate::session::SessionOptions;
use crate::target::{Inputs, Target};
use palpate_estimators::estimator::{Auto, Estimator, Locator};
use palpate_estimators::fit::{Fit, FitTask};
use palpate_live::calibration::{DepthKnowledge, Journal, plan};
use palpate_live::rules::{Rules, RulesByAction};
use palpate_live::server::{
    Access, AccessError, AlarmFile, CalibrationPlan, Live, LiveError, Server, ServerError,
};
use palpate_live::simulated_board::BoardConfig;
use palpate_live::source::SourceUrl;
use palpate_live::stage::StageUrl;
use palpate_live::stamp::HostClock;
use palpate_mechanics::surface::Extent;
use palpate_rig::Rig;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Bench of the demonstration: the founding paper's, with noise.
const DEMO: &str = include_str!("../../samples/noisy-beam.toml");
const DEMO_NAME: &str = "examples/noisy-beam.toml";
const LOOK_EVERY: Duration = Duration::from_millis(20);

const EXAMPLES: &str = "\
Examples:
  # Serve a simulated board, and open http://127.0.0.1:8377
  palpate serve

  # Serve a board at a serial port
  palpate serve beam.json --from serial:///dev/ttyACM0";

/// Serve a live dashboard for web browsers
///
/// A rig is fitted first: to --data, to a simulated calibration, or with --calibrate to presses in the browser. With --from alone the page shows
/// the readings of the board, writes a rig and calibrates it. Without arguments a simulated board is served.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Locator, or rig file to fit [default: the bench of the founding paper]
    #[arg(value_name = "LOCATOR|RIG.toml")]
    locator: Option<PathBuf>,
    /// Source of the readings [default: a simulated board]: `serial:///dev/ttyACM0?baud=115200`, `tcp://host:port`, `udp://:port`, `mqtt://host/topic`,
    /// `file:recording.mcap?speed=1`, `simulated:RIG.toml?rate=100`, or `-` for stdin
    #[arg(long, value_name = "SOURCE")]
    from: Option<SourceUrl>,
    /// Fit the rig to this recording [default: a simulated calibration]
    #[arg(long, value_name = "FILE.csv", requires = "locator")]
    data: Option<PathBuf>,
    /// Calibrate the rig in the browser by guided presses
    #[arg(long, requires_all = ["locator", "from", "presses", "out"], conflicts_with = "data")]
    calibrate: bool,
    /// Write the presses of the calibration to FILE.csv; an existing file is continued
    #[arg(long, value_name = "FILE.csv", requires = "calibrate")]
    presses: Option<PathBuf>,
    /// Write the locator of the calibration to this file
    #[arg(short, long, value_name = "LOCATOR", requires = "calibrate")]
    out: Option<PathBuf>,
    /// Force of every press of the calibration, such as "2 N" [default: that of the rig, or unknown]
    #[arg(long, value_name = "FORCE", value_parser = input::force, requires = "calibrate")]
    force: Option<f64>,
    #[command(flatten)]
    operator: OperatorOptions,
    #[cfg(feature = "gcode")]
    /// Press by a machine with Marlin or GRBL firmware: `gcode:serial:///dev/ttyUSB0?baud=115200` or `gcode:tcp://host:port`
    #[arg(long, value_name = "MACHINE", requires = "calibrate")]
    stage: Option<StageUrl>,
    /// Let browsers record the session into DIR
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    #[command(flatten)]
    session: SessionOptions,
    /// Apply a rule file: send its commands to the board, and raise its alarms
    #[arg(long, value_name = "FILE.toml")]
    rules: Option<PathBuf>,
    /// Listen at this address; any but loopback needs --token
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8377")]
    listen: SocketAddr,
    /// Require this token in requests; `auto` generates one [default: none]
    #[arg(long, value_name = "TOKEN")]
    token: Option<String>,
    /// Accept this host name in requests, besides the address; may be repeated
    #[arg(long, value_name = "NAME")]
    host_name: Vec<String>,
    #[command(flatten)]
    outlets: SinkOptions,
    /// Seed of fits and simulations
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Speed up the clock of a calibration, as that of a simulated board and machine
    #[arg(long, value_name = "N", default_value_t = 1, hide = true, requires = "calibrate", value_parser = input::clock_speed())]
    clock_speed: u32,
}

impl Arguments {
    #[cfg(feature = "gcode")]
    fn machine(&self) -> Option<&StageUrl> {
        self.stage.as_ref()
    }

    #[cfg(not(feature = "gcode"))]
    fn machine(&self) -> Option<&StageUrl> {
        None
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(from) = &arguments.from {
        arguments.session.check_source(from)?;
    }
    if let Some(folder) = &arguments.record {
        check_folder(folder)?;
    }
    let token = match arguments.token.as_deref() {
        Some("auto") => Some(made_up_token()?),
        given => given.map(str::to_owned),
    };
    let access =
        Access::new(arguments.listen, token.clone(), arguments.host_name.clone()).map_err(refused)?;
    let mut sinks = arguments.outlets.open()?;
    sinks.push(Box::new(|_, _, _| Ok(Box::new(Words))));
    let live = match calibration(arguments)? {
        Some(plan) => {
            let extent = plan.rig.setup.surface().extent();
            let rules = rules_of(arguments, extent)?;
            let alarms = load_stored_alarms(arguments, &rules, extent)?;
            let clock = HostClock::with_speed(arguments.clock_speed);
            let live = Live::calibrating(plan, PathBuf::new(), clock);
            with_rules(configured(live, arguments), rules, alarms)
        }
        None => match (&arguments.locator, &arguments.from) {
            (None, Some(from)) => bringing_up(from, arguments)?,
            _ => live(arguments)?,
        },
    };
    let live = Arc::new(live.with_sinks(sinks));
    let server =
        Server::start(arguments.listen, access, Arc::clone(&live)).map_err(|error| match &error {
            ServerError::Listen { .. } => {
                UserError::new(&error).help("--listen 127.0.0.1:0 takes a port that is free")
            }
            ServerError::Run(_) => UserError::new(&error),
        })?;
    let has_subject = arguments.locator.is_some() || arguments.from.is_none();
    if !arguments.calibrate && has_subject {
        begin(&live, arguments)?;
    }
    let query = token.map_or_else(String::new, |token| format!("?token={token}"));
    alert!("palpate: open http://{}/{query} in a browser; Ctrl-C ends it", server.address());
    while !progress::interrupted() {
        std::thread::sleep(LOOK_EVERY);
    }
    // The session ends first, so that browsers get its last messages.
    let fault = live.end();
    drop(server);
    if let Some(fault) = fault {
        return Err(Failure::DataLost(fault));
    }
    Err(Failure::Interrupted("the server was ended".to_owned()))
}

/// Rejects a path that is not a folder or cannot be created; the first recording creates it.
fn check_folder(folder: &Path) -> Result<(), Failure> {
    // The last ancestor of a relative path is empty: the working folder.
    let is_there = |path: &&Path| path.as_os_str().is_empty() || path.symlink_metadata().is_ok();
    match folder.ancestors().find(is_there) {
        Some(found) if !found.as_os_str().is_empty() && !found.is_dir() => {
            let user_error =
                UserError::new(format!("--record {}: {} is not a folder", folder.display(), found.display()));
            Err(user_error.help("name the folder that recordings go into").into())
        }
        _ => Ok(()),
    }
}

/// Serves a board without a rig, which browsers make and calibrate.
fn bringing_up(from: &SourceUrl, arguments: &Arguments) -> Result<Live, Failure> {
    if let Some(path) = &arguments.rules {
        let user_error = UserError::new(format!("--rules {}: rules need a locator", path.display()));
        return Err(user_error.help("name the locator, or omit --rules").into());
    }
    let live = Live::bringing_up(from.clone(), PathBuf::new())
        .map_err(|error| UserError::new(error).help("--from names the source"))?;
    Ok(configured(live, arguments))
}

fn live(arguments: &Arguments) -> Result<Live, Failure> {
    let path = arguments.locator.as_deref().unwrap_or(Path::new(DEMO_NAME));
    let read = match &arguments.locator {
        None => RigOrLocator::Rig(Box::new(input::parse_rig(path, DEMO)?)),
        Some(path) => RigOrLocator::read(path)?,
    };
    // Read before a fit, which may take long.
    let extent = read.setup().surface().extent();
    let rules = rules_of(arguments, extent)?;
    let alarms = load_stored_alarms(arguments, &rules, extent)?;
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let (locator, simulated) = match read {
        RigOrLocator::Locator(locator) => {
            if arguments.data.is_some() {
                let user_error = UserError::for_path(path, "--data is for rigs, and this is a locator");
                return Err(user_error.help("leave --data out").into());
            }
            (*locator, None)
        }
        RigOrLocator::Rig(rig) => {
            let locator = fitted(&rig, path, arguments)?;
            let can_be = rig.setup.surface().model().is_some();
            let config = BoardConfig { seed: arguments.seed, ..BoardConfig::default() };
            (locator, can_be.then_some((*rig, config)))
        }
    };
    if let Some(path) = &arguments.rules {
        rules::check_force_rules(&rules.commanding, path, &locator)?;
        rules::check_force_rules(&rules.alarming, path, &locator)?;
    }
    if let Some(StoredAlarms { file, rules, .. }) = &alarms {
        let about =
            |problem| UserError::for_path(file.path(), problem).help("correct the file, or remove it");
        rules.check_alarms(&locator).map_err(about)?;
    }
    if let Err(error) = locator.tare() {
        remark!("warning: no tare, so offsets that have moved stay in the readings: {error}");
    }
    // A locator that does not fit the options is refused before the server starts.
    arguments.session.session(&locator, path)?;
    // Paths in URLs are relative to the working folder, as in the arguments.
    let live = with_rules(Live::new(locator, &name, simulated, PathBuf::new()), rules, alarms);
    Ok(configured(live, arguments))
}

fn rules_of(arguments: &Arguments, extent: Extent) -> Result<RulesByAction, Failure> {
    let rules = rules::read(arguments.rules.as_deref(), extent)?.by_action();
    if let Some(path) = &arguments.rules {
        rules::refuse_publishing(&rules.publishing, path, "`palpate record --mqtt` has one")?;
    }
    Ok(rules)
}

fn with_rules(live: Live, rules: RulesByAction, alarms: Option<StoredAlarms>) -> Live {
    let live = live.with_commands(rules.commanding);
    match alarms {
        Some(StoredAlarms { file, text, rules }) => live.with_alarm_file(file, text, rules),
        None => live.with_alarms(rules.alarming),
    }
}

struct StoredAlarms {
    file: AlarmFile,
    text: String,
    rules: Rules,
}

/// Alarms beside the locator or in the folder of recordings; `None` with --rules or without a file.
fn load_stored_alarms(
    arguments: &Arguments,
    rules: &RulesByAction,
    extent: Extent,
) -> Result<Option<StoredAlarms>, Failure> {
    let beside = arguments.out.as_ref().or(arguments.locator.as_ref()).map(|path| AlarmFile::for_path(path));
    let in_folder = || arguments.record.as_ref().map(|folder| AlarmFile::in_folder(folder));
    let Some(file) = beside.or_else(in_folder).filter(|_| rules.alarming.as_slice().is_empty()) else {
        return Ok(None);
    };
    let text = file.read().map_err(|error| UserError::for_path(file.path(), error))?;
    let rules = match text.trim() {
        "" => Rules::default(),
        _ => rules::read(Some(file.path()), extent)?,
    };
    if !rules.as_slice().is_empty() {
        remark!("alarms of {}", file.path().display());
    }
    Ok(Some(StoredAlarms { file, text, rules }))
}

fn configured(live: Live, arguments: &Arguments) -> Live {
    let live = live.with_sessions(arguments.session.config());
    match &arguments.record {
        Some(folder) => live.with_recordings(folder.clone()),
        None => live,
    }
}

fn calibration(arguments: &Arguments) -> Result<Option<CalibrationPlan>, Failure> {
    let Arguments {
        calibrate: true,
        locator: Some(path),
        from: Some(from),
        presses: Some(presses),
        out: Some(out),
        ..
    } = arguments
    else {
        return match arguments.operator.given() {
            Some(option) => Err(UserError::new(format!("{option} is for a calibration"))
                .help("add --calibrate with --presses and --out, or omit it")
                .into()),
            None => Ok(None),
        };
    };
    if !input::is_toml(path) {
        let user_error = UserError::for_path(path, "--calibrate is for rigs, and this is a locator");
        return Err(user_error.help("name the rig that is to be calibrated").into());
    }
    let inputs = Inputs::new([path.as_path()]);
    Target::new(out, &inputs)?;
    Target::new(presses, &inputs)?;
    let rig = input::read_rig(path)?;
    // An impossible calibration is refused here, where its place in the file is known.
    let stage = stage(path, &rig, arguments.machine(), arguments.force)?;
    let depths = DepthKnowledge::for_stage(stage.as_ref());
    let (before, in_file_m) = load_presses(path, &rig, presses, depths)?;
    let depths_m = stage.as_ref().map_or(&[][..], |stage| &stage.depths_m);
    let stated = arguments.operator.statements();
    let statements = match &stage {
        None => stated.with_known_values(&rig, arguments.force, in_file_m, &before),
        // The rig's placement error is that of a person.
        Some(_) => stated,
    };
    plan(&rig, statements.weights(arguments.force), depths_m, &before)
        .map_err(|error| UserError::for_path(path, error))?;
    let comment = journal_heading(path);
    Journal::new(&rig.setup, presses, comment.clone(), Vec::new(), depths)
        .map_err(|error| journal_failure(path, &error))?;
    Ok(Some(CalibrationPlan {
        rig,
        from: from.clone(),
        presses: presses.clone(),
        out: out.clone(),
        comment,
        force_n: arguments.force,
        machine: arguments.machine().cloned(),
        before,
        statements,
        seed: arguments.seed,
    }))
}

fn fitted(rig: &Rig, path: &Path, arguments: &Arguments) -> Result<Locator, Failure> {
    if let Estimator::Auto(Auto { only }) = &rig.estimator
        && only.is_empty()
    {
        let user_error =
            UserError::for_path(path, "the estimator is `auto`, and its choice may take minutes");
        return Err(user_error
            .help("name its candidates by `only`, or `palpate fit` it once and serve the locator")
            .into());
    }
    let recording = match &arguments.data {
        Some(data) => input::read_recording(&rig.setup, data)?,
        None => {
            let simulated =
                Observer::of_stages().watch(|watch| rig.simulate_calibration_watched(arguments.seed, watch));
            simulated.map_err(|error| {
                let about = |error| UserError::for_path(path, error);
                Failure::of_work(error, |error| {
                    about(error).help("--data names a recording to fit; --calibrate makes one in the browser")
                })
            })?
        }
    };
    let needed = rig.estimator.positions_needed();
    recording.check_distinct_positions(needed).map_err(UserError::new)?;
    let task = FitTask::new(&rig.setup, &recording).seed(arguments.seed);
    Observer::of_rounds(rig.estimator.most_rounds())
        .watch(|watch| rig.estimator.fit_task(task.watch(watch)))
        .map_err(|error| Failure::from_error(&error))
}

fn begin(live: &Live, arguments: &Arguments) -> Result<(), Failure> {
    let begun = match (&arguments.from, &arguments.locator) {
        (Some(url), _) => live.begin(url),
        (None, None) => live.begin_simulated(),
        (None, Some(_)) => {
            remark!(
                "palpate: no source yet; --from names one, and the page offers a simulated board of a rig"
            );
            Ok(())
        }
    };
    begun.map_err(|error: LiveError| UserError::new(error).help("--from names the source").into())
}

fn refused(error: AccessError) -> Failure {
    let help = match error {
        AccessError::NoToken { .. } => "--token auto makes one up; or listen at 127.0.0.1",
        AccessError::Token { .. } => "--token auto makes one up",
    };
    UserError::new(error).help(help).into()
}

/// Returns 128 random bits in hexadecimal digits.
fn made_up_token() -> Result<String, Failure> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| {
        UserError::new(format!("no random numbers for a token: {error}")).help("give one")
    })?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
