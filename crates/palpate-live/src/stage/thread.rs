//! The thread of a machine: orders to it, and the stop that it heeds whatever it does.

use super::gcode::{Firmware, GcodeStage, StageError, StageLink};
use super::url::StageUrl;
use palpate_mechanics::contact::Position;
use palpate_rig::Stage;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Work for a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// To look for its end stops.
    Home,
    /// To travel to a position, and to press there.
    Press {
        /// The position.
        position: Position,
        /// The depth.
        depth_m: f64,
    },
    /// To lift its finger.
    Lift,
}

/// State of a machine after its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// The finger is lifted.
    Up,
    /// The finger presses.
    Down,
}

/// Longest time in which a stop is not seen while there is nothing to do.
const LOOK: Duration = Duration::from_millis(10);

/// A machine in a thread of its own, which is stopped when this is dropped while it moves.
#[derive(Debug)]
pub struct StageThread {
    firmware: Firmware,
    orders: Option<Sender<Order>>,
    done: Receiver<Result<Done, StageError>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl StageThread {
    /// Opens the link, and greets the machine. Setting `stop` stops it whatever it does, as [`Self::stop`] does.
    ///
    /// # Errors
    /// [`StageError`] where it is not there, or does not answer.
    pub fn open(url: &StageUrl, stage: Stage, stop: Arc<AtomicBool>) -> Result<Self, StageError> {
        let machine = GcodeStage::connect(url.open()?, stage, Arc::clone(&stop))?;
        let firmware = machine.firmware();
        let (orders, received) = channel();
        let (tell, done) = channel();
        let heeds = Arc::clone(&stop);
        let run = move || run(machine, &received, &tell, &heeds);
        let thread = std::thread::Builder::new().name("stage".to_owned()).spawn(run)?;
        Ok(Self { firmware, orders: Some(orders), done, stop, thread: Some(thread) })
    }

    /// The machine's firmware.
    pub fn firmware(&self) -> Firmware {
        self.firmware
    }

    /// Asks for work; returns at once.
    pub fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // One that has failed has said so.
            let _ = orders.send(order);
        }
    }

    /// The outcome of the work that was asked for, once it is done.
    pub fn done(&self) -> Option<Result<Done, StageError>> {
        self.done.try_recv().ok()
    }

    /// Stops the machine, whatever it does; it has been sent the stop when this returns.
    pub fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.join();
    }

    /// Waits until all work is done.
    ///
    /// # Errors
    /// [`StageError`] of the last work.
    pub fn finish(mut self) -> Result<(), StageError> {
        self.order(Order::Lift);
        self.join();
        self.done.try_iter().try_for_each(|done| done.map(drop))
    }

    fn join(&mut self) {
        drop(self.orders.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for StageThread {
    fn drop(&mut self) {
        if self.thread.is_some() {
            self.stop();
        }
    }
}

fn run(
    mut machine: GcodeStage<Box<dyn StageLink>>,
    orders: &Receiver<Order>,
    tell: &Sender<Result<Done, StageError>>,
    stop: &AtomicBool,
) {
    loop {
        let done = match orders.recv_timeout(LOOK) {
            Ok(Order::Home) => machine.home().map(|()| Done::Up),
            Ok(Order::Lift) => machine.lift().map(|()| Done::Up),
            Ok(Order::Press { position, depth_m }) => {
                machine.travel(position).and_then(|()| machine.press(depth_m)).map(|()| Done::Down)
            }
            Err(RecvTimeoutError::Timeout) if stop.load(Ordering::Relaxed) => {
                machine.check_stop().map(|()| Done::Up)
            }
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => {
                // The stop may be what ends it.
                let _ = machine.check_stop();
                return;
            }
        };
        let failed = done.is_err();
        if tell.send(done).is_err() || failed {
            return;
        }
    }
}
