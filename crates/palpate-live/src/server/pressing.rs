//! The threads of a calibration that runs: readings to a person's presses, or to a machine's.

use super::lock::locked;
use super::machine::{Attendance, UNWATCHED};
use super::shared::Shared;
use crate::calibration::{Machine, MachineError, MachineNote, Motion, Waiting};
use crate::input::Input;
use crate::stage::{StageThread, StageUrl};
use palpate_rig::Stage;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Longest wait until the machine and its stop are looked at again.
const LOOK: Duration = Duration::from_millis(20);

/// Takes what the source brings, until it is told to stop.
pub fn listen(inputs: &Receiver<Input>, shared: &Mutex<Shared>) {
    /// Longest wait for what is next.
    const LOOK: Duration = Duration::from_millis(100);
    loop {
        let arrived = match inputs.recv_timeout(LOOK) {
            Ok(Input::Arrived(arrived)) => arrived,
            Ok(Input::Stop) | Err(RecvTimeoutError::Disconnected) => return,
            Ok(Input::Command(_)) | Err(RecvTimeoutError::Timeout) => {
                locked(shared).look();
                continue;
            }
        };
        locked(shared).receive(&arrived);
    }
}

/// A run of a machine, without its readings.
#[derive(Clone, Debug)]
pub struct MachineRun {
    pub url: StageUrl,
    pub stage: Stage,
    /// Set, the machine is stopped whatever it does.
    pub stop: Arc<AtomicBool>,
    pub attendance: Arc<Attendance>,
}

impl MachineRun {
    /// Presses until all is pressed or the machine ends; what ended it early is the problem of `shared`.
    pub fn press(self, inputs: &Receiver<Input>, shared: &Mutex<Shared>) {
        self.attendance.note();
        self.attendance.set_needed(true);
        let outcome = self.try_to_press(inputs, shared);
        self.attendance.set_needed(false);
        let mut shared = locked(shared);
        let left_out = shared.machine.left_out;
        if let Err(error) = outcome {
            shared.problem = Some(format!("{error}: {}", error.help()));
        } else if left_out > 0 && shared.problem.is_none() {
            shared.problem = Some(format!(
                "{left_out} presses were left out, which no reading showed or which did not come to rest: go on to try them again"
            ));
        }
    }

    fn try_to_press(&self, inputs: &Receiver<Input>, shared: &Mutex<Shared>) -> Result<(), MachineError> {
        let thread = StageThread::open(&self.url, self.stage.clone(), Arc::clone(&self.stop))?;
        {
            let machine = &mut locked(shared).machine;
            machine.firmware = Some(thread.firmware().name());
            machine.stopping = Some(thread.stopping());
        }
        let mut machine = Machine::new(thread, self.stage.force_limit_n);
        loop {
            let arrived = match inputs.recv_timeout(LOOK) {
                Ok(Input::Arrived(arrived)) => Some(arrived),
                Ok(Input::Command(_)) | Err(RecvTimeoutError::Timeout) => None,
                // The server ends.
                Ok(Input::Stop) | Err(RecvTimeoutError::Disconnected) => return machine.stop_by_hand(),
            };
            if self.stop.load(Ordering::Relaxed) {
                return machine.stop_by_hand();
            }
            if self.attendance.is_absent() {
                locked(shared).machine.motion = Some(Motion::Lifting);
                machine.finish()?;
                return Err(MachineError::Unwatched { seconds: UNWATCHED.as_secs() });
            }
            let mut shared = locked(shared);
            let notes = match arrived {
                Some(arrived) => shared.receive(&arrived),
                None => shared.look(),
            };
            machine.heed(&notes)?;
            if let Some(MachineNote::Unseen | MachineNote::NoRest) = machine.step(&mut shared.calibration)? {
                shared.machine.left_out += 1;
            }
            shared.machine.take(&machine, &notes);
            if shared.calibration.guide().waiting() == Waiting::Nothing {
                shared.machine.motion = Some(Motion::Lifting);
                break;
            }
        }
        match machine.finish() {
            Err(_) if self.stop.load(Ordering::Relaxed) => Err(MachineError::ByHand),
            finished => finished,
        }
    }
}
