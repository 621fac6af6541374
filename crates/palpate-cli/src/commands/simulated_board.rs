//! `palpate simulated-board`: a board without hardware.

use crate::failure::{Failure, UserError};
use crate::progress::interrupted;
use crate::remark::{alert, remark};
use crate::{input, output, stdout};
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation};
use palpate_live::simulated_board::{
    BoardConfig, FaultConfig, Finger, FrameForm, Link, LinkUrl, LoadCell, SimulatedBoard,
};
#[cfg(feature = "gcode")]
use palpate_live::stage::{Firmware, MachineConfig, SimulatedMachine};
use palpate_live::stamp::HostClock;
use palpate_mechanics::units::format_count;
use palpate_rig::Rig;
use std::path::PathBuf;
use std::time::Duration;

const EXAMPLES: &str = "\
Examples:
  # Print the frames of a board for one second
  palpate simulated-board beam.toml --to - --duration \"1 s\"

  # Simulate a board at a pseudo-terminal until Ctrl-C; its path is printed
  palpate simulated-board beam.toml";

/// Simulate the board of a rig at a serial port or over a network
///
/// The board sends readings with the rig's noise and with faults. It accepts the lines `finger X Y FORCE` in mm and N, `lift`, `reset`, and
/// `disconnect` for one second. Other lines count as commands and are shown on stderr.
#[derive(clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub struct Arguments {
    /// Rig file
    rig: PathBuf,
    /// Connection of the board: `pty`, `pty:PATH`, `tcp://:PORT`, `udp://HOST:PORT`, `mqtt://HOST/TOPIC`, or `-` for stdout
    #[arg(long, value_name = "LINK", default_value = "pty")]
    to: LinkUrl,
    /// Readings per second
    #[arg(long, value_name = "FREQUENCY", default_value = "100 Hz", value_parser = input::frequency)]
    rate: f64,
    /// Seed of noise, faults and the random finger
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Share of frames that are lost, from 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = input::share)]
    drop: f64,
    /// Share of frames that are incomplete, from 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = input::share)]
    torn: f64,
    /// Disconnect for one second at this interval, such as "30 s" [default: never]
    #[arg(long, value_name = "TIME", value_parser = input::time)]
    disconnect_every: Option<f64>,
    /// Drift of each channel per second, in its SI unit or raw, with alternating sign [default: that of the rig]
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true)]
    drift: Option<f64>,
    /// Standard deviation of each channel's random walk after one second, in its SI unit or raw [default: that of the rig]
    #[arg(long, value_name = "NUMBER")]
    walk: Option<f64>,
    /// Creep as a share of the reading, from 0 to 1 [default: that of the rig]
    #[arg(long, value_name = "SHARE", value_parser = input::share)]
    creep: Option<f64>,
    /// Time constant of the creep, such as "5 s" [default: that of the rig, or 5 s]
    #[arg(long, value_name = "TIME", value_parser = input::time)]
    creep_time: Option<f64>,
    /// Width of the hysteresis as a share of each channel's range, from 0 to 1 [default: that of the rig]
    #[arg(long, value_name = "SHARE", value_parser = input::share)]
    hysteresis: Option<f64>,
    /// Residue after a contact as a share of its largest reading, from 0 to 1 [default: that of the rig]
    #[arg(long, value_name = "SHARE", value_parser = input::share)]
    residue: Option<f64>,
    /// Time constant of the residue, such as "20 s" [default: that of the rig, or 20 s]
    #[arg(long, value_name = "TIME", value_parser = input::time)]
    residue_time: Option<f64>,
    /// Step of the converters, in the channels' SI unit or raw [default: the resolution of the rig's sensors]
    #[arg(long, value_name = "NUMBER")]
    converter_step: Option<f64>,
    /// Number of repetitions of each reading, as by a logger that is faster than its sensors [default: that of the rig]
    #[arg(long, value_name = "N")]
    repeated_readings: Option<u32>,
    /// Move the finger by a CSV of time in s, x and y in mm, and force in N [default: a random finger]
    #[arg(long, value_name = "FILE.csv")]
    finger: Option<PathBuf>,
    #[cfg(feature = "gcode")]
    /// Connection of a machine that moves the finger by G-code on the rig's [stage]: `pty`, `pty:PATH` or `tcp://:PORT`
    #[arg(long, value_name = "LINK", conflicts_with = "finger")]
    stage: Option<LinkUrl>,
    #[cfg(feature = "gcode")]
    /// Firmware of the machine
    #[arg(long, value_name = "FIRMWARE", default_value = "marlin", requires = "stage")]
    firmware: FirmwareName,
    #[cfg(feature = "gcode")]
    /// Behaviour of the machine, separated by commas: `no-greeting`, `greeting=12s`, `delay=500ms`, `no-emergency-parser`, `paced`, `homing=90s`,
    /// `soft-limit-x=200mm`, and faults such as `unknown@G1 Z:3`, at the third line that begins with `G1 Z`
    #[arg(long, value_name = "PARTS", requires = "stage")]
    machine: Option<MachineConfig>,
    /// Send the load cell of the rig's [stage] with this noise, such as "5 mN"
    #[arg(long, value_name = "FORCE", value_parser = input::force)]
    load_cell: Option<f64>,
    /// Format of the frames: text lines, or binary with number, time and checksum
    #[arg(long, value_name = "FORM", default_value = "text")]
    frames: FrameName,
    /// Error of the board's clock in parts per million, positive if it is fast; binary frames only
    #[arg(long, value_name = "NUMBER", default_value_t = 0.0, allow_negative_numbers = true, value_parser = ppm)]
    clock_ppm: f64,
    /// Stop after this time, such as "10 s" [default: at Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = input::time)]
    duration: Option<f64>,
    /// Speed up the clock of board and machine
    #[arg(long, value_name = "N", default_value_t = 1, hide = true, value_parser = input::clock_speed())]
    clock_speed: u32,
}

/// Name of a form of frames.
#[derive(Clone, Copy, clap::ValueEnum)]
enum FrameName {
    Text,
    Binary,
}

#[cfg(feature = "gcode")]
/// Name of a firmware.
#[derive(Clone, Copy, clap::ValueEnum)]
enum FirmwareName {
    Marlin,
    Grbl,
}

fn ppm(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(ppm) if (-1e5..=1e5).contains(&ppm) => Ok(ppm),
        _ => Err(format!("`{text}` must be a number from -100000 to 100000")),
    }
}

const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Time for which the cable is disconnected.
const AWAY: Duration = Duration::from_secs(1);

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.to == LinkUrl::Stdout && stdout::was_closed() {
        return Err(output::closed());
    }
    let rig = input::read_rig(&arguments.rig)?;
    let mut finger = Finger::random(&rig, arguments.seed);
    if let Some(path) = &arguments.finger {
        finger =
            finger.with_script(&input::read_text(path)?).map_err(|error| UserError::for_path(path, error))?;
    }
    let load_cell = load_cell(arguments, &rig)?;
    let frames = match arguments.frames {
        FrameName::Binary => FrameForm::Binary { clock_ppm: arguments.clock_ppm },
        FrameName::Text if arguments.clock_ppm == 0.0 => FrameForm::Text,
        FrameName::Text => {
            let user_error = UserError::new("--clock-ppm needs binary frames: text frames carry no time");
            return Err(user_error.help("add --frames binary").into());
        }
    };
    let config = BoardConfig { rate_hz: arguments.rate, seed: arguments.seed, load_cell, frames };
    let board = SimulatedBoard::new(&rig.setup, &config, finger)
        .and_then(|board| board.with_faults(arguments.faults(&rig), arguments.seed))
        .map_err(|error| UserError::for_path(&arguments.rig, error))?;
    #[cfg(feature = "gcode")]
    let machine = machine(arguments, &rig)?;
    let link = Link::open(&arguments.to).map_err(UserError::new)?;
    alert!("{}", link.name());
    ConnectedBoard {
        board,
        link,
        #[cfg(feature = "gcode")]
        machine,
        away_until: None,
        commands: 0,
    }
    .run(arguments)
}

/// Default time constants of creep and hysteresis, in seconds, if only the share is given.
const CREEP_S: f64 = 5.0;
const RESIDUE_S: f64 = 20.0;

impl Arguments {
    fn faults(&self, rig: &Rig) -> FaultConfig {
        let faults = FaultConfig::of_setup(&rig.setup);
        let Imperfections { hysteresis, creep, residue, drift, repeated_readings, .. } = faults.imperfections;
        let [first, second] = creep;
        let amount = |option: Option<f64>, of_rig| option.map_or(of_rig, Amount::Value);
        let imperfections = Imperfections {
            hysteresis: self.hysteresis.unwrap_or(hysteresis),
            creep: [relaxation(first, self.creep, self.creep_time, CREEP_S), second],
            residue: relaxation(residue, self.residue, self.residue_time, RESIDUE_S),
            drift: OffsetDrift {
                line_per_s: amount(self.drift, drift.line_per_s),
                walk_per_root_s: amount(self.walk, drift.walk_per_root_s),
            },
            repeated_readings: self.repeated_readings.unwrap_or(repeated_readings),
            ..faults.imperfections
        };
        FaultConfig {
            dropped: self.drop,
            torn: self.torn,
            converter_step: self.converter_step,
            imperfections,
        }
    }
}

fn relaxation(of_rig: Relaxation, share: Option<f64>, time_s: Option<f64>, usual_s: f64) -> Relaxation {
    let rig_s = if of_rig.share > 0.0 { of_rig.time_s } else { usual_s };
    Relaxation { share: share.unwrap_or(of_rig.share), time_s: time_s.unwrap_or(rig_s) }
}

fn load_cell(arguments: &Arguments, rig: &Rig) -> Result<Option<LoadCell>, Failure> {
    let Some(noise_n) = arguments.load_cell else { return Ok(None) };
    match rig.stage.as_ref().and_then(|stage| stage.load_cell.clone()) {
        Some(name) => Ok(Some(LoadCell { name, noise_n })),
        None => {
            let message = "--load-cell needs the name of its values, `load_cell` of the rig's [stage]";
            Err(UserError::for_path(&arguments.rig, message).into())
        }
    }
}

#[cfg(feature = "gcode")]
fn machine(arguments: &Arguments, rig: &Rig) -> Result<Option<ConnectedMachine>, Failure> {
    let Some(url) = &arguments.stage else { return Ok(None) };
    if !matches!(url, LinkUrl::Pty(_) | LinkUrl::Tcp(_)) {
        let user_error = UserError::new(format!("--stage {url}: a machine answers what it is sent"));
        return Err(user_error.help("give it a way back: pty, pty:PATH or tcp://:PORT").into());
    }
    let Some(stage) = &rig.stage else {
        return Err(UserError::for_path(&arguments.rig, "--stage needs the rig's section [stage]").into());
    };
    let force_n = rig.training.as_ref().and_then(|training| training.force_n).or(rig.setup.force_n());
    let firmware = match arguments.firmware {
        FirmwareName::Marlin => Firmware::Marlin,
        FirmwareName::Grbl => Firmware::Grbl,
    };
    let extent = rig.setup.surface().extent();
    let config = arguments.machine.clone().unwrap_or_default();
    let machine =
        SimulatedMachine::with_config(firmware, stage.clone(), extent, force_n.unwrap_or(1.0), config);
    let link = Link::open(url).map_err(UserError::new)?;
    alert!("a machine of {} firmware at {}", firmware.name(), link.name());
    Ok(Some(ConnectedMachine { machine, link, was_there: false, was_stopped: false }))
}

#[cfg(feature = "gcode")]
struct ConnectedMachine {
    machine: SimulatedMachine,
    link: Link,
    was_there: bool,
    was_stopped: bool,
}

#[cfg(feature = "gcode")]
impl ConnectedMachine {
    fn work(&mut self, now: Duration) -> std::io::Result<()> {
        self.machine.advance_to(now);
        let Some(bytes) = self.link.bytes()? else {
            self.was_there = false;
            return Ok(());
        };
        if !std::mem::replace(&mut self.was_there, true) {
            self.machine.open();
        }
        self.machine.receive(&bytes);
        let is_stopped = self.machine.is_stopped();
        if is_stopped && !self.was_stopped {
            let finger = if self.machine.contact().is_some() { "pressing" } else { "up" };
            remark!("the machine was stopped with its finger {finger}");
        }
        self.was_stopped = is_stopped;
        match self.machine.take_answers() {
            answers if answers.is_empty() => Ok(()),
            answers => self.link.send(&answers),
        }
    }
}

struct ConnectedBoard<'a> {
    board: SimulatedBoard<'a>,
    link: Link,
    #[cfg(feature = "gcode")]
    machine: Option<ConnectedMachine>,
    away_until: Option<Duration>,
    commands: u64,
}

impl ConnectedBoard<'_> {
    fn run(mut self, arguments: &Arguments) -> Result<(), Failure> {
        let clock = HostClock::with_speed(arguments.clock_speed);
        let every = arguments.disconnect_every.map(Duration::from_secs_f64);
        let mut next_disconnect = every;
        let mut unsent = 0_u64;
        loop {
            let now = clock.elapsed();
            let is_over = arguments.duration.is_some_and(|most| now.as_secs_f64() >= most);
            if interrupted() || is_over {
                return self.finish(unsent);
            }
            self.execute_commands(now)?;
            while let Some(news) = self.link.next_message() {
                remark!("{news}");
            }
            #[cfg(feature = "gcode")]
            if let Some(machine) = &mut self.machine {
                machine.work(now).map_err(UserError::new)?;
                self.board.finger_mut().set_contact(machine.machine.contact());
            }
            if next_disconnect.is_some_and(|at| now >= at) {
                next_disconnect = every.map(|every| now + every);
                self.disconnect(now)?;
            }
            if self.away_until.is_some_and(|until| now >= until) {
                self.away_until = None;
                remark!("{}", self.link.name());
            }
            while self.board.next_at() <= now {
                match self.board.next_frame() {
                    Some(_) if self.away_until.is_some() => unsent += 1,
                    Some(frame) => {
                        self.link.send(&frame).map_err(|error| crate::output::print_failure(&error))?;
                    }
                    None => {}
                }
            }
            let next = self.board.next_at().saturating_sub(clock.elapsed()) / arguments.clock_speed;
            std::thread::sleep(next.clamp(Duration::from_micros(200), LOOK_EVERY));
        }
    }

    fn execute_commands(&mut self, now: Duration) -> Result<(), Failure> {
        for line in self.link.lines() {
            let line = line.trim();
            if line == "disconnect" {
                self.disconnect(now)?;
            } else if !Finger::is_command(line) {
                self.commands += 1;
                remark!("command {}: {line}", self.commands);
            } else if let Err(problem) = self.board.finger_mut().execute(line) {
                alert!("`{line}`: {problem}");
            }
        }
        Ok(())
    }

    fn disconnect(&mut self, now: Duration) -> Result<(), Failure> {
        self.link.disconnect().map_err(UserError::new)?;
        self.away_until = Some(now + AWAY);
        Ok(())
    }

    fn finish(&self, unsent: u64) -> Result<(), Failure> {
        let sent = self.board.sent();
        let words = format!(
            "{} frames whole, {} torn, {} dropped ({} while unplugged, {} unread); {} commands received",
            format_count(sent.whole),
            format_count(sent.torn),
            format_count(sent.dropped),
            format_count(unsent),
            format_count(self.link.unread),
            format_count(self.commands),
        );
        if interrupted() {
            return Err(Failure::Interrupted(words));
        }
        remark!("{words}");
        Ok(())
    }
}
