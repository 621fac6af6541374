//! `palpate record`: a session recorded into a file.

use super::sink_options::SinkOptions;
use crate::failure::{Failure, UserError};
use crate::progress::{self, interrupted};
use crate::remark::{alert, remark};
use crate::session::SessionOptions;
use crate::target::{Inputs, Target};
use crate::{input, output, rules, stdout};
use palpate_live::event::Event;
use palpate_live::input::Input;
use palpate_live::pipeline;
use palpate_live::recording::{RecordingStatus, RecordingSwitch};
use palpate_live::rules::RulesByAction;
use palpate_live::session::Counters;
use palpate_live::sink::{AlarmSink, Alarms, Batch, CommandSink, JsonLines, MqttSink, MqttUrl, Sink};
use palpate_live::source::{Source, SourceUrl};
use palpate_live::stamp::HostClock;
use palpate_mechanics::units::format_count;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};

const EXAMPLES: &str = "\
Examples:
  # Record a simulated board for two seconds
  palpate record beam.json --from simulated:beam.toml --duration \"2 s\" -o session.mcap

  # Record a board at a serial port until Ctrl-C
  palpate record beam.json --from serial:///dev/ttyACM0 -o session.mcap";

/// Record readings and estimates of a board in an MCAP file
///
/// The file also contains the locator, so that `palpate replay` needs no other file.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Locator
    locator: PathBuf,
    /// Source of the readings: `serial:///dev/ttyACM0?baud=115200`, `tcp://host:port`, `udp://:port`, `mqtt://host/topic`,
    /// `file:recording.mcap?speed=1`, `simulated:RIG.toml?rate=100`, or `-` for stdin
    #[arg(long, value_name = "SOURCE")]
    from: SourceUrl,
    /// Write the recording to FILE.mcap, which must not exist
    #[arg(short, long, value_name = "FILE.mcap")]
    out: PathBuf,
    /// Stop after this time, such as "10 s" [default: at Ctrl-C, or at the end of the source]
    #[arg(long, value_name = "TIME", value_parser = input::time)]
    duration: Option<f64>,
    #[command(flatten)]
    session: SessionOptions,
    /// Print samples and events as lines of JSON
    #[arg(long)]
    json: bool,
    /// Publish samples and events to an MQTT broker: `mqtt://host/topic`
    #[arg(long, value_name = "URL")]
    mqtt: Option<MqttUrl>,
    /// Apply a rule file: publish its messages to the broker, and send its commands to the board
    #[arg(long, value_name = "FILE.toml")]
    rules: Option<PathBuf>,
    #[command(flatten)]
    outlets: SinkOptions,
}

const LOOK_EVERY: Duration = Duration::from_millis(20);

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    // Rejects an unusable path; the recorder itself creates the file, and overwrites no other.
    Target::new(&arguments.out, &Inputs::new([arguments.locator.as_path()]))?;
    if arguments.json && stdout::was_closed() {
        return Err(output::closed());
    }
    arguments.session.check_source(&arguments.from)?;
    let locator = input::read_locator(&arguments.locator)?;
    let clock = HostClock::new();
    let (to, from) = sync_channel(pipeline::WAITING);
    let mut session = arguments.session.session(&locator, &arguments.locator)?;
    session
        .set_columns(arguments.from.columns())
        .map_err(|error| UserError::new(format!("--from {}: {error}", arguments.from)))?;
    let mut sinks: Vec<Box<dyn Sink>> = vec![Box::new(Words)];
    let rules = rules::read(arguments.rules.as_deref(), session.extent())?;
    if let Some(path) = &arguments.rules {
        rules::check_force_rules(&rules, path, &locator)?;
    }
    let RulesByAction { publishing, commanding, alarming } = rules.by_action();
    if let (None, Some(path)) = (&arguments.mqtt, &arguments.rules) {
        rules::refuse_publishing(&publishing, path, "--mqtt mqtt://host/topic names a broker")?;
    }
    let mut unpublished = None;
    if let Some(url) = &arguments.mqtt {
        let sink = MqttSink::new(url, session.channels(), session.extent(), publishing, to.clone());
        let sink = sink.map_err(UserError::new)?;
        unpublished = Some((url, sink.lost()));
        sinks.push(Box::new(sink));
    }
    // Kept until the end, as the outlet owns Foxglove's server.
    let outlets = arguments.outlets.open()?;
    for open in &outlets {
        sinks.push(open(session.channels(), session.extent(), to.clone()).map_err(UserError::new)?);
    }
    let mut unprinted = None;
    if arguments.json {
        let lines = JsonLines::new(std::io::stdout(), session.channels(), session.extent(), to.clone());
        unprinted = Some(lines.failed());
        sinks.push(Box::new(lines));
    }
    let source = Source::open(&arguments.from, Path::new(""), clock, to.clone()).map_err(UserError::new)?;
    if !commanding.as_slice().is_empty() {
        let commander = source.commander().map_err(|error| {
            let user_error =
                UserError::new(format!("--from {}: --rules has a `command`: {error}", arguments.from));
            user_error.help("name a source with a way back, or remove rules with `command`")
        })?;
        sinks.push(Box::new(CommandSink::new(commanding, commander, to.clone())));
    }
    let alarms = Alarms::default();
    alarms.set(alarming);
    sinks.push(Box::new(AlarmSink::new(alarms, to.clone())));
    let estimation = arguments.session.config().estimation;
    let recording = RecordingSwitch::new(&locator, estimation, &arguments.from.to_string(), to.clone());
    let recording = recording.map_err(UserError::new)?;
    recording.begin(&arguments.out).map_err(UserError::new)?;
    sinks.push(Box::new(recording.clone()));
    let stop = Stop::after(arguments.duration, to)?;
    let fault = pipeline::run(&mut session, clock, &from, &mut sinks);
    drop((source, stop, sinks));
    progress::finish_after_signal();
    let status = recording.end().unwrap_or_default();
    if let Some((url, lost)) = unpublished {
        match lost.load(Ordering::Relaxed) {
            0 => {}
            lost => alert!("{} messages did not reach the broker {url}", format_count(lost)),
        }
    }
    let unprinted = unprinted.as_ref().and_then(|unprinted| unprinted.get());
    finish(arguments, &status, &session.counters(), fault, unprinted)
}

/// A `fault` of the feed is a failure.
fn finish(
    arguments: &Arguments,
    status: &RecordingStatus,
    counters: &Counters,
    fault: Option<String>,
    unprinted: Option<&std::io::Error>,
) -> Result<(), Failure> {
    let bad: u64 = counters.bad_frames.values().sum();
    let summary = format!(
        "{}: {} readings in {:.1} s, {:.2} MB; {} bad frames, {} lost by the board's count, {} gaps",
        arguments.out.display(),
        format_count(status.readings),
        status.seconds,
        status.bytes as f64 / 1e6,
        format_count(bad),
        format_count(counters.lost_frames),
        format_count(counters.gaps),
    );
    let lost =
        (status.lost > 0).then(|| format!("{} readings could not be recorded", format_count(status.lost)));
    let faults: Vec<String> = [lost, status.problem.clone(), fault].into_iter().flatten().collect();
    if !faults.is_empty() {
        return Err(Failure::DataLost(format!("{summary}; {}", faults.join("; "))));
    }
    // A reader that closes the pipe needs no more output; the recording is complete.
    if let Some(error) = unprinted.filter(|error| error.kind() != std::io::ErrorKind::BrokenPipe) {
        alert!("{summary}");
        return Err(output::print_failure(error));
    }
    if interrupted() {
        return Err(Failure::Interrupted(summary));
    }
    if arguments.json {
        remark!("{summary}");
        return Ok(());
    }
    output::print_line(summary)
}

/// Ends a session with [`Input::Stop`] at a signal, or after a time in seconds.
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    pub fn after(seconds: Option<f64>, to: SyncSender<Input>) -> Result<Self, Failure> {
        let done = Arc::new(AtomicBool::new(false));
        let watched = Arc::clone(&done);
        let end = seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
        let wait = move || {
            while !watched.load(Ordering::Relaxed) {
                if progress::interrupted() || end.is_some_and(|end| Instant::now() >= end) {
                    // A session that has already ended ignores it.
                    let _ = to.send(Input::Stop);
                    return;
                }
                std::thread::sleep(LOOK_EVERY);
            }
        };
        std::thread::Builder::new().name("stop".to_owned()).spawn(wait).map_err(UserError::new)?;
        Ok(Self(done))
    }
}

impl Drop for Stop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

pub struct Words;

impl Sink for Words {
    fn batch(&mut self, batch: &Arc<Batch>) {
        for record in batch.events() {
            match &record.event {
                Event::SourceOpened { name } => remark!("reading {name}"),
                Event::SourceLost { why } => alert!("the source is lost: {why}"),
                Event::Trouble { text } => alert!("{text}"),
                Event::Alarm { name, text } => alert!("alarm of rule `{name}`: {text}"),
                Event::Channel { name, state } => remark!("channel {name} is {}", state_in_words(*state)),
                _ => {}
            }
        }
    }
}

fn state_in_words(state: palpate_live::event::ChannelState) -> &'static str {
    use palpate_live::event::ChannelState::{Dead, Saturated, Well};
    match state {
        Well => "well again",
        Dead => "dead",
        Saturated => "saturated",
    }
}
