//! Jogs and touch-offs of a machine with the keys of a terminal, before a calibration.

use super::operator::print_notes;
use crate::progress;
use crate::remark::alert;
use palpate_live::calibration::{Calibration, Machine, MachineError, MachineNote, SetUpNote, SetUpTask};
use palpate_live::input::Input;
use palpate_live::stamp::HostClock;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::Duration;

const KEYS: &str = "keys, each with Enter: x+ x- y+ y- z+ z- move by a step, of fine (0.1 mm), normal (1 mm) or coarse (10 mm); t finds the height of the touch; b begins the presses; q ends here; Enter alone stops the machine at once";

const LOOK_EVERY: Duration = Duration::from_millis(20);
const FINE_M: f64 = 1e-4;
const NORMAL_M: f64 = 1e-3;
const COARSE_M: f64 = 1e-2;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JogEnd {
    Begin,
    Quit,
    Interrupted,
}

#[derive(Clone, Copy, Debug)]
pub struct JogOutcome {
    pub end: JogEnd,
    /// Height of the last touch, in metres of the machine.
    pub touch_z_m: Option<f64>,
}

#[derive(Clone, Debug, PartialEq)]
enum Key {
    Task(SetUpTask),
    Step(f64),
    End(JogEnd),
    Stop,
    Unknown,
}

pub struct Jog {
    machine: Machine,
    calibration: Calibration,
    clock: HostClock,
    step_m: f64,
    lines: VecDeque<String>,
    end: JogEnd,
    touch_z_m: Option<f64>,
}

impl Jog {
    pub fn new(machine: Machine, calibration: Calibration, clock: HostClock) -> Self {
        let (lines, end) = (VecDeque::new(), JogEnd::Quit);
        Self { machine, calibration, clock, step_m: NORMAL_M, lines, end, touch_z_m: None }
    }

    /// Executes typed lines until the operator ends the jogs, then lifts the finger.
    ///
    /// # Errors
    /// [`MachineError`] if the machine was stopped.
    pub fn run(
        mut self,
        inputs: &Receiver<Input>,
        keys: &Receiver<String>,
    ) -> Result<JogOutcome, MachineError> {
        alert!("{KEYS}");
        while !self.machine.is_done(&self.calibration) {
            if progress::interrupted() {
                // Dropping the machine stops it.
                return Ok(JogOutcome { end: JogEnd::Interrupted, touch_z_m: None });
            }
            let mut notes = Vec::new();
            match inputs.recv_timeout(LOOK_EVERY) {
                // No press is requested, so no row is written.
                Ok(Input::Arrived(arrived)) => drop(self.calibration.receive(&arrived, &mut notes)),
                Ok(Input::Command(_) | Input::Stop) | Err(RecvTimeoutError::Timeout) => {
                    self.calibration.check_feed(self.clock.elapsed(), &mut notes);
                }
                Err(RecvTimeoutError::Disconnected) => std::thread::sleep(LOOK_EVERY),
            }
            print_notes(&notes, &self.calibration, None);
            self.take_keys(keys)?;
            self.machine.stop_on_notes(&notes)?;
            match self.machine.step(self.clock.elapsed(), &mut self.calibration)? {
                Some(MachineNote::Homing) => alert!("the machine searches for its end stops"),
                Some(MachineNote::SetUp(note)) => {
                    if let SetUpNote::Touch(z_m) = note {
                        self.touch_z_m = Some(z_m);
                    }
                    alert!("{note}");
                }
                Some(MachineNote::Unseen | MachineNote::NoRest) | None => {}
            }
        }
        self.machine.finish()?;
        Ok(JogOutcome { end: self.end, touch_z_m: self.touch_z_m })
    }

    /// Executes a stop at once, and defers other lines until the machine rests.
    fn take_keys(&mut self, keys: &Receiver<String>) -> Result<(), MachineError> {
        loop {
            match keys.try_recv() {
                Ok(line) if line.trim().is_empty() => return self.machine.stop_by_hand(),
                Ok(line) => self.lines.push_back(line),
                Err(TryRecvError::Disconnected) if self.lines.is_empty() && self.machine.is_idle() => {
                    self.machine.ask(SetUpTask::End);
                    return Ok(());
                }
                Err(_) => break,
            }
        }
        if !self.machine.is_idle() {
            return Ok(());
        }
        let Some(line) = self.lines.pop_front() else { return Ok(()) };
        match meaning(line.trim(), self.step_m) {
            Key::Stop => return self.machine.stop_by_hand(),
            Key::Task(task) => {
                self.machine.ask(task);
            }
            Key::Step(step_m) => self.step_m = step_m,
            Key::End(end) => {
                self.end = end;
                self.machine.ask(SetUpTask::End);
            }
            Key::Unknown => alert!("{KEYS}"),
        }
        Ok(())
    }
}

fn meaning(line: &str, step_m: f64) -> Key {
    let jog = |axis: usize, by_m: f64| {
        let mut distances_m = [0.0; 3];
        distances_m[axis] = by_m;
        Key::Task(SetUpTask::Jog(distances_m))
    };
    match line {
        "x+" => jog(0, step_m),
        "x-" => jog(0, -step_m),
        "y+" => jog(1, step_m),
        "y-" => jog(1, -step_m),
        "z+" => jog(2, step_m),
        "z-" => jog(2, -step_m),
        "fine" => Key::Step(FINE_M),
        "normal" => Key::Step(NORMAL_M),
        "coarse" => Key::Step(COARSE_M),
        "t" => Key::Task(SetUpTask::TouchOff),
        "b" => Key::End(JogEnd::Begin),
        "q" => Key::End(JogEnd::Quit),
        "" => Key::Stop,
        _ => Key::Unknown,
    }
}
