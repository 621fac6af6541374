//! Simulated machine: G-code in, answers and contact out, in the caller's time.

use super::firmware::Firmware;
use super::link::StageLink;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_rig::Stage;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Greeting at the opening of the port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Greeting {
    /// At once.
    #[default]
    AtOnce,
    /// Later; the board does not read until then.
    After(Duration),
    /// Without a greeting.
    None,
}

/// Fault of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// The line is unknown.
    Unknown,
    /// The line is lost.
    Lost,
    /// Answers stop.
    Silence,
    /// The line is requested again.
    Resend,
    /// The machine is not homed, and refuses the line.
    HomeFirst,
    /// Halt with an error.
    Error,
    /// Restart instead of the line.
    Reset,
    /// Restart during the move.
    ResetMoving,
    /// End stop during the move.
    Endstop,
    /// Second `ok`.
    ExtraOk,
}

/// Fault at the `nth` line that begins with `line`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineFault {
    /// Fault.
    pub kind: FaultKind,
    /// Beginning of the line.
    pub line: String,
    /// Number of the line, from 1.
    pub nth: u32,
}

/// Behaviour of a simulated machine.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineConfig {
    /// Greeting.
    pub greeting: Greeting,
    /// Delay of answers.
    pub delay: Duration,
    /// True for stops during a move (Marlin).
    pub emergency_parser: bool,
    /// True for moves in real duration.
    pub is_paced: bool,
    /// Duration of homing.
    pub homing: Duration,
    /// Limits of x, y and z, in metres of the machine.
    pub soft_limits_m: Option<[(f64, f64); 3]>,
    /// Faults.
    pub faults: Vec<MachineFault>,
}

impl Default for MachineConfig {
    fn default() -> Self {
        Self {
            greeting: Greeting::AtOnce,
            delay: Duration::ZERO,
            emergency_parser: true,
            is_paced: false,
            homing: Duration::ZERO,
            soft_limits_m: None,
            faults: Vec::new(),
        }
    }
}

/// Error of an invalid description.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` describes no machine; parts, separated by commas, are `no-greeting`, `greeting=12s`, `delay=500ms`, `no-emergency-parser`, `paced`, `homing=90s`, `soft-limit-x=200mm` and a fault with its line, as in `unknown@G1 Z:3`: unknown, lost, silence, resend, home-first, error, reset, reset-moving, endstop or extra-ok"
)]
pub struct MachineConfigError(String);

impl FromStr for MachineConfig {
    type Err = MachineConfigError;

    fn from_str(text: &str) -> Result<Self, MachineConfigError> {
        let mut config = Self::default();
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            config.take(part).ok_or_else(|| MachineConfigError(part.to_owned()))?;
        }
        Ok(config)
    }
}

impl MachineConfig {
    fn take(&mut self, part: &str) -> Option<()> {
        if let Some((kind, line)) = part.split_once('@') {
            let (line, nth) = line.rsplit_once(':').unwrap_or((line, "1"));
            let (kind, nth) = (fault_kind(kind)?, nth.parse().ok().filter(|nth| *nth > 0)?);
            self.faults.push(MachineFault { kind, line: line.to_owned(), nth });
            return Some(());
        }
        match part.split_once('=').unwrap_or((part, "")) {
            ("no-greeting", "") => self.greeting = Greeting::None,
            ("greeting", time) => self.greeting = Greeting::After(duration(time)?),
            ("delay", time) => self.delay = duration(time)?,
            ("no-emergency-parser", "") => self.emergency_parser = false,
            ("paced", "") => self.is_paced = true,
            ("homing", time) => self.homing = duration(time)?,
            ("soft-limit-x", length) => {
                let most_m: f64 = length.strip_suffix("mm")?.parse::<f64>().ok()? * 1e-3;
                let any = (f64::NEG_INFINITY, f64::INFINITY);
                self.soft_limits_m = Some([(f64::NEG_INFINITY, most_m), any, any]);
            }
            _ => return None,
        }
        Some(())
    }
}

fn duration(text: &str) -> Option<Duration> {
    let (number, unit_s) = match text.strip_suffix("ms") {
        Some(number) => (number, 1e-3),
        None => (text.strip_suffix('s')?, 1.0),
    };
    Duration::try_from_secs_f64(number.parse::<f64>().ok()? * unit_s).ok()
}

fn fault_kind(name: &str) -> Option<FaultKind> {
    Some(match name {
        "unknown" => FaultKind::Unknown,
        "lost" => FaultKind::Lost,
        "silence" => FaultKind::Silence,
        "resend" => FaultKind::Resend,
        "home-first" => FaultKind::HomeFirst,
        "error" => FaultKind::Error,
        "reset" => FaultKind::Reset,
        "reset-moving" => FaultKind::ResetMoving,
        "endstop" => FaultKind::Endstop,
        "extra-ok" => FaultKind::ExtraOk,
        _ => return None,
    })
}

/// Simulated machine over a surface.
#[derive(Clone, Debug)]
pub struct SimulatedMachine {
    state: Arc<Mutex<State>>,
}

impl SimulatedMachine {
    /// Machine; `force_n` acts at the greatest depth.
    pub fn new(firmware: Firmware, setup: Stage, extent: Extent, force_n: f64) -> Self {
        Self::with_config(firmware, setup, extent, force_n, MachineConfig::default())
    }

    /// Machine with a behaviour.
    pub fn with_config(
        firmware: Firmware,
        setup: Stage,
        extent: Extent,
        force_n: f64,
        config: MachineConfig,
    ) -> Self {
        let seen = vec![0; config.faults.len()];
        let mut state = State {
            firmware,
            setup,
            extent,
            force_n,
            config,
            now: Duration::ZERO,
            received: Vec::new(),
            lines: VecDeque::new(),
            answers: VecDeque::new(),
            at_m: [0.0; 3],
            shift_m: [0.0; 3],
            motion: None,
            wait: None,
            deaf_until: Duration::ZERO,
            resets_at: None,
            is_homed: false,
            mode: Mode::Ready,
            stopped_at: None,
            line_counts: seen,
            faults_met: 0,
            unsafe_moves: 0,
        };
        state.open();
        Self { state: Arc::new(Mutex::new(state)) }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Contact of the finger; `None` in air.
    pub fn contact(&self) -> Option<Contact> {
        let state = self.state();
        if !state.is_homed && state.shift_m == [0.0; 3] {
            return None;
        }
        let [x_m, y_m, z_m] = state.place_m();
        let depth_m = state.setup.touch_z_m - z_m;
        let (from_x_m, from_y_m) = state.setup.origin_m;
        let position = Position { x_m: x_m - from_x_m, y_m: y_m - from_y_m };
        let on_surface = (0.0..=state.extent.length_m()).contains(&position.x_m)
            && state.extent.width_m().is_none_or(|width_m| (0.0..=width_m).contains(&position.y_m));
        (depth_m > 0.0 && on_surface)
            .then(|| Contact { position, force_n: state.force_n * depth_m / state.setup.deepest_m() })
    }

    /// Opens the port, which may reset the board.
    pub fn open(&self) {
        self.state().open();
    }

    /// Receives bytes.
    pub fn receive(&self, bytes: &[u8]) {
        self.state().receive(bytes);
    }

    /// Advances the time, never backwards.
    pub fn advance_to(&self, now: Duration) {
        self.state().advance_to(now);
    }

    /// Takes due answers.
    pub fn take_answers(&self) -> Vec<u8> {
        self.state().take_answers()
    }

    /// True between a stop and the next opening.
    pub fn is_stopped(&self) -> bool {
        self.stopped_at().is_some()
    }

    /// Time of the first effective stop since the opening.
    pub fn stopped_at(&self) -> Option<Duration> {
        self.state().stopped_at
    }

    /// True during a move.
    pub fn is_moving(&self) -> bool {
        self.state().motion.is_some()
    }

    /// Faults so far.
    pub fn faults_met(&self) -> usize {
        self.state().faults_met
    }

    /// Moves after a fault or before homing, without lifts.
    pub fn unsafe_moves(&self) -> usize {
        self.state().unsafe_moves
    }

    /// Link in virtual time.
    pub fn link(&self) -> SimulatedLink {
        SimulatedLink { machine: self.clone(), is_waited_for: Duration::from_millis(10) }
    }
}

/// Link in virtual time: an idle read takes 10 ms.
#[derive(Clone, Debug)]
pub struct SimulatedLink {
    machine: SimulatedMachine,
    is_waited_for: Duration,
}

impl Read for SimulatedLink {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut state = self.machine.state();
        if !state.has_answers() {
            let now = state.now + self.is_waited_for;
            state.advance_to(now);
        }
        let answers = state.take_bytes(buffer.len());
        if answers.is_empty() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        buffer[..answers.len()].copy_from_slice(&answers);
        Ok(answers.len())
    }
}

impl Write for SimulatedLink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.machine.receive(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl StageLink for SimulatedLink {
    fn now(&self) -> Duration {
        self.machine.state().now
    }

    fn reset_by_dtr(&mut self) -> io::Result<bool> {
        let mut state = self.machine.state();
        state.reset();
        state.note_stop();
        Ok(true)
    }

    fn has_dtr(&self) -> bool {
        true
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Ready,
    Halted,
    Held,
    /// After an alarm, or before homing.
    Alarm,
    Silent,
}

#[derive(Clone, Copy, Debug)]
struct Motion {
    from_m: [f64; 3],
    to_m: [f64; 3],
    start: Duration,
    end: Duration,
}

#[derive(Debug)]
struct State {
    firmware: Firmware,
    setup: Stage,
    extent: Extent,
    force_n: f64,
    config: MachineConfig,
    now: Duration,
    received: Vec<u8>,
    lines: VecDeque<String>,
    answers: VecDeque<(Duration, u8)>,
    at_m: [f64; 3],
    /// Finger minus machine coordinates.
    shift_m: [f64; 3],
    motion: Option<Motion>,
    wait: Option<(Duration, String)>,
    deaf_until: Duration,
    resets_at: Option<Duration>,
    is_homed: bool,
    mode: Mode,
    stopped_at: Option<Duration>,
    line_counts: Vec<u32>,
    faults_met: usize,
    unsafe_moves: usize,
}

const BUSY_EVERY: Duration = Duration::from_secs(2);

impl State {
    fn open(&mut self) {
        match self.config.greeting {
            Greeting::None => {}
            Greeting::AtOnce => self.restart(Duration::ZERO),
            Greeting::After(time) => self.restart(time),
        }
        self.stopped_at = None;
    }

    fn reset(&mut self) {
        self.restart(Duration::ZERO);
    }

    fn restart(&mut self, boot: Duration) {
        let place_m = self.place_m();
        // A board starts at its origin; the finger of an unhomed one is up.
        if self.is_homed || self.shift_m != [0.0; 3] {
            self.shift_m = place_m;
        }
        (self.at_m, self.motion, self.wait, self.is_homed) = ([0.0; 3], None, None, false);
        self.lines.clear();
        self.received.clear();
        self.answers.clear();
        self.resets_at = None;
        self.deaf_until = self.now + boot;
        self.mode = Mode::Ready;
        let greeting = match self.firmware {
            Firmware::Marlin => "start\necho:Marlin 2.1.2\n",
            Firmware::Grbl => "\r\nGrbl 1.1h ['$' for help]\r\n",
        };
        self.queue_reply_at(self.deaf_until, greeting);
        if self.firmware == Firmware::Grbl {
            self.mode = Mode::Alarm;
        }
    }

    fn machine_m(&self) -> [f64; 3] {
        let Some(Motion { from_m, to_m, start, end }) = self.motion else { return self.at_m };
        let share = if end > start {
            ((self.now.saturating_sub(start)).as_secs_f64() / (end - start).as_secs_f64()).min(1.0)
        } else {
            1.0
        };
        std::array::from_fn(|axis| from_m[axis] + share * (to_m[axis] - from_m[axis]))
    }

    fn place_m(&self) -> [f64; 3] {
        let at_m = self.machine_m();
        std::array::from_fn(|axis| at_m[axis] + self.shift_m[axis])
    }

    fn queue_reply(&mut self, text: &str) {
        self.queue_reply_at(self.now + self.config.delay, text);
    }

    fn queue_reply_at(&mut self, at: Duration, text: &str) {
        if self.mode != Mode::Silent {
            self.answers.extend(text.bytes().map(|byte| (at, byte)));
        }
    }

    fn has_answers(&self) -> bool {
        self.answers.front().is_some_and(|(at, _)| *at <= self.now)
    }

    fn take_answers(&mut self) -> Vec<u8> {
        self.take_bytes(usize::MAX)
    }

    fn take_bytes(&mut self, most: usize) -> Vec<u8> {
        let count = self.answers.iter().take(most).take_while(|(at, _)| *at <= self.now).count();
        self.answers.drain(..count).map(|(_, byte)| byte).collect()
    }

    fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if self.now < self.deaf_until {
                continue;
            }
            match (self.firmware, byte) {
                (Firmware::Grbl, b'?') => self.answer_status(),
                (Firmware::Grbl, b'!') => self.feed_hold(),
                (Firmware::Grbl, 0x18) => self.soft_reset(),
                (_, b'\n') => {
                    let line = String::from_utf8_lossy(&self.received).trim().to_owned();
                    self.received.clear();
                    let is_emergency = line == "M112" || line == "M410";
                    if self.firmware == Firmware::Marlin && self.config.emergency_parser && is_emergency {
                        self.interrupt(&line);
                    } else {
                        self.lines.push_back(line);
                    }
                }
                (_, byte) => self.received.push(*byte),
            }
        }
        let now = self.now;
        self.advance_to(now);
    }

    fn advance_to(&mut self, to: Duration) {
        let to = to.max(self.now);
        loop {
            if let Some(at) = self.resets_at
                && at <= to
                && self.wait.as_ref().is_none_or(|(end, _)| at <= *end)
            {
                self.now = self.now.max(at);
                self.reset();
                continue;
            }
            if let Some((end, answer)) = &self.wait {
                if *end > to {
                    break;
                }
                self.now = self.now.max(*end);
                let answer = answer.clone();
                self.wait = None;
                self.rest_if_done();
                self.queue_reply(&answer);
                continue;
            }
            self.rest_if_done();
            let Some(line) = self.lines.pop_front() else { break };
            self.execute(&line);
        }
        self.now = to;
        self.rest_if_done();
    }

    fn rest_if_done(&mut self) {
        if self.motion.is_some_and(|motion| motion.end <= self.now) {
            self.motion = None;
        }
    }

    fn freeze(&mut self) {
        self.at_m = self.machine_m();
        (self.motion, self.wait) = (None, None);
        self.lines.clear();
    }

    /// Executes `M112` or `M410`, even during another command.
    fn interrupt(&mut self, line: &str) {
        if self.mode == Mode::Silent {
            // A silent machine may still receive.
            self.freeze();
            if line == "M112" {
                self.note_stop();
            }
            return;
        }
        self.freeze();
        let now = self.now;
        self.answers.retain(|(at, _)| *at <= now);
        if line == "M112" {
            self.mode = Mode::Halted;
            self.note_stop();
            self.queue_reply("Error:Printer halted. kill() called!\n");
        } else if self.mode == Mode::Ready {
            self.queue_reply("ok\n");
        }
    }

    fn note_stop(&mut self) {
        self.stopped_at.get_or_insert(self.now);
    }

    fn feed_hold(&mut self) {
        if matches!(self.mode, Mode::Ready | Mode::Silent) {
            self.at_m = self.machine_m();
            (self.motion, self.wait) = (None, None);
            if self.mode == Mode::Ready {
                self.mode = Mode::Held;
            }
        }
    }

    /// After a feed hold, a reset keeps the position.
    fn soft_reset(&mut self) {
        self.note_stop();
        if self.mode == Mode::Silent {
            return;
        }
        let is_kept = self.mode == Mode::Held && self.is_homed;
        self.freeze();
        self.answers.clear();
        self.mode = if is_kept { Mode::Ready } else { Mode::Alarm };
        self.queue_reply("\r\nGrbl 1.1h ['$' for help]\r\n");
    }

    fn answer_status(&mut self) {
        let state = match self.mode {
            Mode::Silent => return,
            Mode::Alarm | Mode::Halted => "Alarm",
            Mode::Held => "Hold:0",
            Mode::Ready if self.motion.is_some() => "Run",
            Mode::Ready => "Idle",
        };
        let [x_mm, y_mm, z_mm] = self.machine_m().map(|at_m| at_m * 1e3);
        self.queue_reply(&format!(
            "<{state}|MPos:{x_mm:.3},{y_mm:.3},{z_mm:.3}|FS:0,0|WCO:0.000,0.000,0.000>\r\n"
        ));
    }

    fn execute(&mut self, line: &str) {
        match self.mode {
            Mode::Halted if self.firmware == Firmware::Marlin => return,
            // A silent machine still executes commands.
            Mode::Silent | Mode::Halted | Mode::Ready | Mode::Held | Mode::Alarm => {}
        }
        match self.due_fault(line) {
            Some(kind) => {
                self.fail(kind, line);
                self.faults_met += 1;
            }
            None => self.execute_command(line),
        }
    }

    fn due_fault(&mut self, line: &str) -> Option<FaultKind> {
        let mut due = None;
        for (fault, seen) in self.config.faults.iter().zip(&mut self.line_counts) {
            if line.starts_with(&fault.line) {
                *seen += 1;
                if *seen == fault.nth {
                    due = Some(fault.kind);
                }
            }
        }
        due
    }

    fn fail(&mut self, kind: FaultKind, line: &str) {
        let is_marlin = self.firmware == Firmware::Marlin;
        match kind {
            FaultKind::Unknown if is_marlin => {
                self.queue_reply(&format!("echo:Unknown command: \"{line}\"\nok\n"));
            }
            FaultKind::Unknown => self.queue_reply("error:20\r\n"),
            FaultKind::Lost => {}
            FaultKind::Silence => {
                self.execute_command(line);
                self.answers.clear();
                self.mode = Mode::Silent;
                if let Some((_, answer)) = &mut self.wait {
                    answer.clear();
                }
            }
            FaultKind::Resend if is_marlin => {
                self.queue_reply(
                    "Error:Line Number is not Last Line Number+1, Last Line: 0\nResend: 1\nok\n",
                );
            }
            FaultKind::Resend => self.queue_reply("error:2\r\n"),
            FaultKind::HomeFirst if is_marlin => self.queue_reply("echo:Home XYZ First\nok\n"),
            FaultKind::HomeFirst => {
                (self.mode, self.is_homed) = (Mode::Alarm, false);
                self.queue_reply("error:9\r\n");
            }
            FaultKind::Error if is_marlin => {
                self.freeze();
                self.queue_reply("Error:Printer halted. kill() called!\n");
                self.mode = Mode::Halted;
            }
            FaultKind::Error => {
                self.freeze();
                self.queue_reply("ALARM:1\r\n[MSG:Reset to continue]\r\n");
                self.mode = Mode::Alarm;
            }
            FaultKind::Reset => self.reset(),
            FaultKind::ResetMoving => {
                self.execute_command(line);
                let end = self.motion.map_or(self.now, |motion| motion.end);
                self.resets_at = Some(self.now + (end - self.now) / 2);
            }
            FaultKind::Endstop => self.hit_endstop(line),
            FaultKind::ExtraOk => {
                self.execute_command(line);
                match &mut self.wait {
                    Some((_, answer)) => answer.push_str("ok\n"),
                    None => self.queue_reply("ok\n"),
                }
            }
        }
    }

    fn hit_endstop(&mut self, line: &str) {
        let from_m = self.at_m;
        self.execute_command(line);
        let missing_m: [f64; 3] = std::array::from_fn(|axis| (self.at_m[axis] - from_m[axis]) / 2.0);
        for (shift_m, missing_m) in self.shift_m.iter_mut().zip(missing_m) {
            *shift_m -= missing_m;
        }
        match self.firmware {
            Firmware::Marlin => {
                let x_mm = (self.at_m[0] - missing_m[0]) * 1e3;
                self.queue_reply(&format!("echo:endstops hit:  X:{x_mm:.2}\n"));
            }
            Firmware::Grbl => {
                self.freeze();
                self.queue_reply("ALARM:1\r\n[MSG:Reset to continue]\r\n");
                self.mode = Mode::Alarm;
            }
        }
    }

    fn execute_command(&mut self, line: &str) {
        match self.firmware {
            Firmware::Marlin => self.execute_marlin(line),
            Firmware::Grbl => self.execute_grbl(line),
        }
    }

    fn execute_marlin(&mut self, line: &str) {
        match line {
            "" => {}
            "M112" => {
                self.freeze();
                self.mode = Mode::Halted;
                self.note_stop();
                self.answers.extend(b"Error:Printer halted. kill() called!\n".map(|byte| (self.now, byte)));
            }
            "M115" => {
                let parser = u8::from(self.config.emergency_parser);
                self.queue_reply(&format!(
                    "FIRMWARE_NAME:Marlin 2.1.2 (simulated) SOURCE_CODE_URL:none PROTOCOL_VERSION:1.0\nCap:EEPROM:1\nCap:EMERGENCY_PARSER:{parser}\nok\n"
                ));
            }
            "M114" => {
                let [x_mm, y_mm, z_mm] = self.machine_m().map(|at_m| at_m * 1e3);
                self.queue_reply(&format!(
                    "X:{x_mm:.2} Y:{y_mm:.2} Z:{z_mm:.2} E:0.00 Count X:0 Y:0 Z:0\nok\n"
                ));
            }
            "G21" | "G90" | "M410" => self.queue_reply("ok\n"),
            "G28" => self.home(),
            "M400" => self.wait_for_moves(),
            _ if line.starts_with("M118 ") => self.queue_reply(&format!("{}\nok\n", &line[5..])),
            _ if line.starts_with("G1 ") => self.start_move(line),
            _ => self.queue_reply(&format!("echo:Unknown command: \"{line}\"\nok\n")),
        }
    }

    fn execute_grbl(&mut self, line: &str) {
        let is_locked = matches!(self.mode, Mode::Alarm | Mode::Halted | Mode::Held);
        match line {
            "" => self.queue_reply("ok\r\n"),
            "$I" => self.queue_reply("[VER:1.1h.20190825:]\r\n[OPT:V,15,128]\r\nok\r\n"),
            "$H" if self.mode != Mode::Held => self.home(),
            _ if is_locked => self.queue_reply("error:9\r\n"),
            "G21" | "G90" | "G94" | "G54" => self.queue_reply("ok\r\n"),
            _ if line.starts_with("G1 ") => self.start_move(line),
            _ if line.starts_with("G4 ") => self.wait_for_moves(),
            _ => self.queue_reply("error:20\r\n"),
        }
    }

    fn home(&mut self) {
        self.at_m = [0.0, 0.0, self.setup.touch_z_m + 10.0 * self.setup.clearance_m];
        (self.shift_m, self.is_homed, self.motion) = ([0.0; 3], true, None);
        self.mode = Mode::Ready;
        self.wait_until(self.now + self.config.homing);
    }

    fn wait_for_moves(&mut self) {
        self.wait_until(self.motion.map_or(self.now, |motion| motion.end));
    }

    fn wait_until(&mut self, end: Duration) {
        let end = end.max(self.now);
        if self.firmware == Firmware::Marlin {
            let mut busy = self.now + BUSY_EVERY;
            while busy < end {
                self.queue_reply_at(busy, "echo:busy: processing\n");
                busy += BUSY_EVERY;
            }
        }
        self.wait = Some((end, "ok\r\n".to_owned()));
    }

    fn start_move(&mut self, line: &str) {
        let (mut to_m, mut speed_m_per_s) = (self.at_m, f64::INFINITY);
        for word in line.split_ascii_whitespace().skip(1) {
            let (Some(axis), Ok(value)) = (word.chars().next(), word.get(1..).unwrap_or("").parse::<f64>())
            else {
                return self.queue_reply("Error:number\n");
            };
            match axis {
                'X' => to_m[0] = value * 1e-3,
                'Y' => to_m[1] = value * 1e-3,
                'Z' => to_m[2] = value * 1e-3,
                'F' if value > 0.0 => speed_m_per_s = value / 60e3,
                _ => return self.queue_reply("Error:word\n"),
            }
        }
        if let Some(limits_m) = self.config.soft_limits_m {
            let within_m: [f64; 3] =
                std::array::from_fn(|axis| to_m[axis].clamp(limits_m[axis].0, limits_m[axis].1));
            if self.firmware == Firmware::Grbl && within_m != to_m {
                self.mode = Mode::Alarm;
                return self.queue_reply("ALARM:2\r\n[MSG:Reset to continue]\r\n");
            }
            to_m = within_m;
        }
        let lifts = to_m[..2] == self.at_m[..2] && to_m[2] >= self.at_m[2];
        if (self.faults_met > 0 || !self.is_homed) && !lifts {
            self.unsafe_moves += 1;
        }
        let from_m = self.machine_m();
        let start = self.motion.map_or(self.now, |motion| motion.end).max(self.now);
        let way_m = from_m.iter().zip(to_m).map(|(from, to)| (to - from).powi(2)).sum::<f64>().sqrt();
        let time = Duration::try_from_secs_f64(way_m / speed_m_per_s).unwrap_or_default();
        if self.config.is_paced {
            self.motion = Some(Motion { from_m, to_m, start, end: start + time });
        }
        self.at_m = to_m;
        self.queue_reply("ok\r\n");
    }
}
