//! A session of a simulated board that sends its outputs to a sink.

use palpate_estimators::estimator::Locator;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_live::input::{Arrival, Command, Input, TimedArrival};
use palpate_live::session::{Session, SessionConfig};
use palpate_live::simulated_board::{BoardConfig, Finger, SimulatedBoard};
use palpate_live::sink::{Batch, Sink};
use palpate_live::stamp::HostClock;
use palpate_rig::Rig;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

const RIG: &str = include_str!("../../../../examples/noisy-beam.toml");

/// Timeout of all waits, for a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// A rig and its locator.
pub fn fitted() -> (Rig, Locator) {
    let rig = Rig::from_toml(RIG).unwrap();
    let presses = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &presses)).unwrap();
    (rig, locator)
}

/// A board at 200 Hz and its session.
pub struct Bench<'a> {
    board: SimulatedBoard<'a>,
    pub session: Session<'a>,
    clock: HostClock,
}

impl<'a> Bench<'a> {
    pub fn new(rig: &'a Rig, locator: &'a Locator) -> Self {
        let config = BoardConfig { rate_hz: 200.0, seed: 3, ..BoardConfig::default() };
        Self {
            board: SimulatedBoard::new(&rig.setup, &config, Finger::random(rig, 3)).unwrap(),
            session: Session::new(locator, &SessionConfig::default()).unwrap(),
            clock: HostClock::new(),
        }
    }

    /// Sends frames of the board through the session into a sink. Returns their batches.
    pub fn send(&mut self, frames: usize, sink: &mut impl Sink) -> Vec<Arc<Batch>> {
        let mut batches = Vec::new();
        for _ in 0..frames {
            let arrival = Arrival::Bytes(self.board.send_until(self.board.next_at()));
            let mut outputs = Vec::new();
            self.session.receive(&TimedArrival { at: self.clock.now(), arrival }, &mut outputs);
            if !outputs.is_empty() {
                let batch = Arc::new(Batch { outputs });
                sink.batch(&batch);
                batches.push(batch);
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        batches
    }
}

/// The next problem that a sink reports.
pub fn next_problem(told: &Receiver<Input>) -> String {
    match told.recv_timeout(PATIENCE) {
        Ok(Input::Command(Command::Trouble(text))) => text,
        other => panic!("{other:?}"),
    }
}
