//! A machine without hardware: lines of G-code in, answers and the contact of its finger out.

use super::gcode::Firmware;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use palpate_rig::Stage;
use std::io::{self, Read, Write};
use std::sync::{Arc, Mutex, PoisonError};

/// A machine over a surface, which answers at once and is where it is sent at once.
#[derive(Clone, Debug)]
pub struct SimulatedMachine {
    shared: Arc<Mutex<State>>,
}

#[derive(Debug)]
struct State {
    firmware: Firmware,
    setup: Stage,
    extent: Extent,
    /// Force of a press to its greatest depth, in newtons.
    force_n: f64,
    received: Vec<u8>,
    answers: Vec<u8>,
    /// The finger's x, y and z, in metres; `None` before it is homed.
    at_m: Option<[f64; 3]>,
    stopped: bool,
}

impl SimulatedMachine {
    /// A machine whose finger presses with `force_n` at the greatest depth of `setup`.
    pub fn new(firmware: Firmware, setup: Stage, extent: Extent, force_n: f64) -> Self {
        let state = State {
            firmware,
            setup,
            extent,
            force_n,
            received: Vec::new(),
            answers: greeting(firmware).to_vec(),
            at_m: None,
            stopped: false,
        };
        Self { shared: Arc::new(Mutex::new(state)) }
    }

    /// The contact of its finger: the force grows with the depth. `None` while it does not touch.
    pub fn contact(&self) -> Option<Contact> {
        let state = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        let [x_m, y_m, z_m] = state.at_m?;
        let depth_m = state.setup.touch_z_m - z_m;
        let (from_x_m, from_y_m) = state.setup.origin_m;
        let position = Position { x_m: x_m - from_x_m, y_m: y_m - from_y_m };
        let on_surface = (0.0..=state.extent.length_m()).contains(&position.x_m)
            && state.extent.width_m().is_none_or(|width_m| (0.0..=width_m).contains(&position.y_m));
        (depth_m > 0.0 && on_surface)
            .then(|| Contact { position, force_n: state.force_n * depth_m / state.setup.deepest_m() })
    }

    /// Starts anew, as a board does whose port is opened: it greets, and is not homed.
    pub fn reset(&self) {
        let mut state = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        state.received.clear();
        state.answers = greeting(state.firmware).to_vec();
        (state.at_m, state.stopped) = (None, false);
    }

    /// True once it was stopped.
    pub fn is_stopped(&self) -> bool {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner).stopped
    }
}

fn greeting(firmware: Firmware) -> &'static [u8] {
    match firmware {
        Firmware::Marlin => b"start\necho:Marlin 2.1.2\n",
        Firmware::Grbl => b"\r\nGrbl 1.1h ['$' for help]\r\n",
    }
}

impl Read for SimulatedMachine {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut state = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        if state.answers.is_empty() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        let count = buffer.len().min(state.answers.len());
        buffer[..count].copy_from_slice(&state.answers[..count]);
        state.answers.drain(..count);
        Ok(count)
    }
}

impl Write for SimulatedMachine {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut state = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
        for byte in bytes {
            match byte {
                0x18 => state.stopped = true,
                b'!' => {}
                b'\n' => {
                    let line =
                        String::from_utf8_lossy(&std::mem::take(&mut state.received)).trim().to_owned();
                    let answer = state.answer(&line);
                    state.answers.extend(answer.bytes().chain(*b"\r\n"));
                }
                byte => state.received.push(*byte),
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl State {
    fn answer(&mut self, line: &str) -> String {
        match line {
            _ if self.stopped => "error:9".to_owned(),
            "M112" => {
                self.stopped = true;
                "Error:Printer halted. kill() called!".to_owned()
            }
            "M115" if self.firmware == Firmware::Marlin => "FIRMWARE_NAME:Marlin 2.1.2\nok".to_owned(),
            "$I" if self.firmware == Firmware::Grbl => "[VER:1.1h.20190825:]\nok".to_owned(),
            "G28" | "$H" => {
                self.at_m = Some([0.0, 0.0, self.setup.touch_z_m + 10.0 * self.setup.clearance_m]);
                "ok".to_owned()
            }
            _ if line.starts_with("G1 ") => self.go(line),
            "G21" | "G90" | "M400" => "ok".to_owned(),
            _ if line.starts_with("G4 ") => "ok".to_owned(),
            _ => "error:20".to_owned(),
        }
    }

    fn go(&mut self, line: &str) -> String {
        let Some(at_m) = &mut self.at_m else { return "error:9".to_owned() };
        for word in line.split_ascii_whitespace().skip(1) {
            let (axis, number) = word.split_at(1);
            let Ok(value_mm) = number.parse::<f64>() else { return "error:2".to_owned() };
            match axis {
                "X" => at_m[0] = value_mm * 1e-3,
                "Y" => at_m[1] = value_mm * 1e-3,
                "Z" => at_m[2] = value_mm * 1e-3,
                "F" => {}
                _ => return "error:20".to_owned(),
            }
        }
        "ok".to_owned()
    }
}
