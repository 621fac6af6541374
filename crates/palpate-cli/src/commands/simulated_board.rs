//! `palpate simulated-board`: a board without hardware.

use crate::failure::{Complaint, Failure};
use crate::input;
use crate::progress::interrupted;
use crate::remark::remark;
use palpate_live::simulated_board::{BoardConfig, FaultConfig, Finger, Link, LinkUrl, SimulatedBoard};
use palpate_mechanics::units::{Dimension, Quantity, format_count};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Send what the board of a rig would send, with its noise and with faults, as a serial port or over a network.
///
/// Lines from the other end move its finger: `finger X Y FORCE` in mm and N, `lift`, `reset`; `disconnect` pulls its cable for a second.
#[derive(clap::Args)]
pub struct Arguments {
    /// The rig
    rig: PathBuf,
    /// Plug of the board: pty, pty:PATH, tcp://:PORT, udp://HOST:PORT, mqtt://HOST/TOPIC, or - for stdout
    #[arg(long, value_name = "LINK", default_value = "pty")]
    to: LinkUrl,
    /// Readings a second
    #[arg(long, value_name = "FREQUENCY", default_value = "100 Hz", value_parser = input::frequency)]
    rate: f64,
    /// Seed of noise, faults and the random finger
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Share of frames that are left out
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    drop: f64,
    /// Share of frames of which a part is missing
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    torn: f64,
    /// Pull the cable for a second, every so often
    #[arg(long, value_name = "TIME", value_parser = time)]
    disconnect_every: Option<f64>,
    /// Drift of each channel in a second, in its SI unit or raw; upward and downward channels in turn
    #[arg(long, value_name = "NUMBER", default_value_t = 0.0, allow_negative_numbers = true)]
    drift: f64,
    /// Random walk of each channel: its standard deviation after a second, in its SI unit or raw
    #[arg(long, value_name = "NUMBER", default_value_t = 0.0)]
    walk: f64,
    /// Share of a reading that follows the contact slowly
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    creep: f64,
    /// Time constant of the creep
    #[arg(long, value_name = "TIME", default_value = "5 s", value_parser = time)]
    creep_time: f64,
    /// A script of the finger: CSV of time in s, x and y in mm, force in N [default: a random finger]
    #[arg(long, value_name = "FILE.csv")]
    finger: Option<PathBuf>,
    /// End after so long
    #[arg(long, value_name = "TIME", value_parser = time)]
    for_time: Option<f64>,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err(format!("`{text}` must be a number from 0 to 1")),
    }
}

fn time(text: &str) -> Result<f64, String> {
    match Quantity::parse_as(text, Dimension::Time) {
        Ok(seconds) if seconds > 0.0 && seconds <= 1e9 => Ok(seconds),
        Ok(_) => Err(format!("`{text}` must be greater than 0, and at most 1e9 s")),
        Err(error) => Err(error.to_string()),
    }
}

/// Longest sleep, after which lines and signals are looked for.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Time for which the cable is pulled.
const AWAY: Duration = Duration::from_secs(1);

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let rig = input::read_rig(&arguments.rig)?;
    let mut finger = Finger::random(&rig, arguments.seed);
    if let Some(path) = &arguments.finger {
        finger =
            finger.with_script(&input::read_text(path)?).map_err(|error| Complaint::about(path, error))?;
    }
    let config = BoardConfig { rate_hz: arguments.rate, seed: arguments.seed };
    let faults = FaultConfig {
        dropped: arguments.drop,
        torn: arguments.torn,
        drift_per_s: arguments.drift,
        walk_per_root_s: arguments.walk,
        creep: arguments.creep,
        creep_s: arguments.creep_time,
    };
    let board = SimulatedBoard::new(&rig.setup, &config, finger)
        .map_err(|error| Complaint::about(&arguments.rig, error))?;
    let board = board.with_faults(faults, arguments.seed);
    let link = Link::open(&arguments.to).map_err(Complaint::new)?;
    remark!("{}", link.name());
    Plugged { board, link, away_until: None }.run(arguments)
}

/// A board at its link.
struct Plugged<'a> {
    board: SimulatedBoard<'a>,
    link: Link,
    away_until: Option<Instant>,
}

impl Plugged<'_> {
    fn run(mut self, arguments: &Arguments) -> Result<(), Failure> {
        let start = Instant::now();
        let every = arguments.disconnect_every.map(Duration::from_secs_f64);
        let mut next_disconnect = every.map(|every| start + every);
        let mut unsent = 0_u64;
        loop {
            let now = Instant::now();
            let is_over = arguments.for_time.is_some_and(|most| (now - start).as_secs_f64() >= most);
            if interrupted() || is_over {
                return self.finish(unsent);
            }
            self.obey()?;
            if next_disconnect.is_some_and(|at| now >= at) {
                next_disconnect = every.map(|every| now + every);
                self.disconnect()?;
            }
            if self.away_until.is_some_and(|until| now >= until) {
                self.away_until = None;
                remark!("{}", self.link.name());
            }
            while self.board.next_at() <= now - start {
                match self.board.next_frame() {
                    Some(_) if self.away_until.is_some() => unsent += 1,
                    Some(frame) => {
                        self.link.send(&frame).map_err(|error| crate::output::unprinted(&error))?;
                    }
                    None => {}
                }
            }
            let next = self.board.next_at().saturating_sub(start.elapsed());
            std::thread::sleep(next.clamp(Duration::from_micros(200), LOOK_EVERY));
        }
    }

    fn obey(&mut self) -> Result<(), Failure> {
        for line in self.link.lines() {
            if line.trim() == "disconnect" {
                self.disconnect()?;
            } else if let Err(problem) = self.board.finger_mut().obey(&line) {
                remark!("`{}`: {problem}", line.trim());
            }
        }
        Ok(())
    }

    fn disconnect(&mut self) -> Result<(), Failure> {
        self.link.disconnect().map_err(Complaint::new)?;
        self.away_until = Some(Instant::now() + AWAY);
        Ok(())
    }

    fn finish(&self, unsent: u64) -> Result<(), Failure> {
        let sent = self.board.sent();
        let words = format!(
            "{} frames whole, {} torn, {} left out; of these {} while unplugged, {} that nobody read",
            format_count(sent.whole),
            format_count(sent.torn),
            format_count(sent.dropped),
            format_count(unsent),
            format_count(self.link.unread),
        );
        if interrupted() {
            return Err(Failure::Interrupted(words));
        }
        remark!("{words}");
        Ok(())
    }
}
