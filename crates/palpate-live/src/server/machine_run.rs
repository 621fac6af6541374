//! Threads of a calibration by a person, or by a machine.

use super::lock::locked;
use super::machine::{Attendance, UNWATCHED};
use super::shared::Shared;
use crate::calibration::{Machine, MachineError, MachineNote, Motion, SetUpTask};
use crate::input::Input;
use crate::stage::{StageError, StageThread, StageUrl};
use crate::stamp::HostClock;
use palpate_rig::Stage;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Longest interval between checks of the stop.
const LOOK: Duration = Duration::from_millis(20);

/// Processes arrivals until a stop.
pub fn listen(inputs: &Receiver<Input>, shared: &Mutex<Shared>) {
    const LOOK: Duration = Duration::from_millis(100);
    loop {
        let arrived = match inputs.recv_timeout(LOOK) {
            Ok(Input::Arrived(arrived)) => arrived,
            Ok(Input::Stop) | Err(RecvTimeoutError::Disconnected) => return,
            Ok(Input::Command(_)) | Err(RecvTimeoutError::Timeout) => {
                locked(shared).check_source();
                continue;
            }
        };
        locked(shared).receive(&arrived);
    }
}

#[derive(Clone, Debug)]
pub struct MachineRun {
    pub url: StageUrl,
    pub stage: Stage,
    /// First set-up tasks; `None` for presses.
    pub set_up: Option<Vec<SetUpTask>>,
    pub stop: Arc<AtomicBool>,
    pub attendance: Arc<Attendance>,
    pub clock: HostClock,
}

impl MachineRun {
    /// Runs the machine; a failure is stored in `shared`.
    pub fn run(self, inputs: &Receiver<Input>, shared: &Mutex<Shared>) {
        self.attendance.note();
        self.attendance.set_needed(true);
        let outcome = self.try_to_run(inputs, shared).map_err(|error| match error {
            // The machine's thread may react first.
            MachineError::Stage(StageError::Stopped) if self.stop.load(Ordering::Relaxed) => {
                MachineError::ByHand
            }
            error => error,
        });
        self.attendance.set_needed(false);
        let mut shared = locked(shared);
        let left_out = shared.machine.omitted;
        if let Err(error) = outcome {
            shared.problem = Some(format!("{error}: {}", error.help()));
        } else if left_out > 0 && shared.problem.is_none() {
            shared.problem = Some(format!(
                "{left_out} presses were excluded, because they changed no reading or did not settle: continue to try them again"
            ));
        }
    }

    fn try_to_run(&self, inputs: &Receiver<Input>, shared: &Mutex<Shared>) -> Result<(), MachineError> {
        let thread = StageThread::open(&self.url, self.stage.clone(), Arc::clone(&self.stop), self.clock)?;
        {
            let machine = &mut locked(shared).machine;
            machine.firmware = Some(thread.firmware().name());
            machine.stopping = Some(thread.stopping());
        }
        let now = self.clock.elapsed();
        let mut machine = match &self.set_up {
            None => Machine::new(thread, self.stage.force_limit_n, now),
            Some(tasks) => {
                let mut machine = Machine::to_set_up(thread, self.stage.clone(), now);
                tasks.iter().cloned().for_each(|task| {
                    machine.ask(task);
                });
                machine
            }
        };
        loop {
            let arrived = match inputs.recv_timeout(LOOK) {
                Ok(Input::Arrived(arrived)) => Some(arrived),
                Ok(Input::Command(_)) | Err(RecvTimeoutError::Timeout) => None,
                // End of the server.
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
                None => shared.check_source(),
            };
            machine.stop_on_notes(&notes)?;
            while let Some(task) = shared.tasks.pop_front() {
                machine.ask(task);
            }
            let now = self.clock.elapsed();
            match machine.step(now, &mut shared.calibration)? {
                Some(MachineNote::Unseen | MachineNote::NoRest) => shared.machine.omitted += 1,
                Some(MachineNote::SetUp(note)) => shared.take_set_up(note),
                Some(MachineNote::Homing) | None => {}
            }
            shared.machine.take(now, &machine, &notes);
            if machine.is_done(&shared.calibration) {
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
