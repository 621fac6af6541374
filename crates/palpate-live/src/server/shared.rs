use super::machine::MachineState;
use crate::calibration::{Calibration, CalibrationError, Note, SetUpNote, SetUpTask, last_deviation_percent};
use crate::feed::REPEATED_READINGS;
use crate::input::TimedArrival;
use crate::stamp::HostClock;
use std::collections::VecDeque;

pub struct Shared {
    pub calibration: Calibration,
    pub clock: HostClock,
    pub source: Option<String>,
    pub last_percent: Option<f64>,
    pub problem: Option<String>,
    /// Reason for a repeated request, or awaited condition.
    pub hint: Option<String>,
    pub machine: MachineState,
    pub tasks: VecDeque<SetUpTask>,
}

impl Shared {
    pub fn receive(&mut self, arrived: &TimedArrival) -> Vec<Note> {
        let mut notes = Vec::new();
        let received = self.calibration.receive(arrived, &mut notes);
        notes.iter().cloned().for_each(|note| self.take(note));
        if let Err(error) = received {
            self.fail(&error);
        }
        notes
    }

    /// Checks the source during silence.
    pub fn check_source(&mut self) -> Vec<Note> {
        let mut notes = Vec::new();
        self.calibration.check_feed(self.clock.now().elapsed, &mut notes);
        notes.iter().cloned().for_each(|note| self.take(note));
        notes
    }

    fn take(&mut self, note: Note) {
        match note {
            Note::Opened(name) => (self.source, self.problem) = (Some(name), None),
            Note::Lost(why) => {
                (self.source, self.problem) = (None, Some(format!("the source is lost: {why}")));
            }
            Note::NoReadings(words) => self.problem = Some(words),
            Note::ReadingsAgain => self.problem = None,
            Note::Ended => {
                (self.source, self.problem) = (None, Some("the source has ended".to_owned()));
            }
            Note::Taken => {
                self.last_percent = last_deviation_percent(self.calibration.journal().rows());
                (self.problem, self.hint) = (None, None);
            }
            Note::Replaced => {
                self.last_percent = last_deviation_percent(self.calibration.journal().rows());
                self.hint = Some("The reading grew: the press was recorded again.".to_owned());
            }
            Note::AskedAgain(reason) => self.hint = Some(format!("Press rejected: {reason}. Press again.")),
            Note::StillWaiting(words) => self.hint = Some(words),
            Note::Saturated(name) => {
                self.problem = Some(format!("channel {name} reads the end of its range: press less, redo"));
            }
            Note::RepeatedReadings => self.hint = Some(format!("Note: {REPEATED_READINGS}.")),
            Note::Waits(_) | Note::Untouched | Note::Overload(_) => {}
        }
    }

    pub fn take_set_up(&mut self, note: SetUpNote) {
        if let SetUpNote::Touch(z_m) = note {
            self.machine.touch_z_m = Some(z_m);
        }
        self.hint = Some(sentence(&note.to_string()));
    }

    /// Stops after a failed recording.
    fn fail(&mut self, error: &CalibrationError) {
        self.calibration.stop();
        self.problem = Some(error.to_string());
    }
}

fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}
