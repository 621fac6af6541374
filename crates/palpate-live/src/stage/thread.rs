//! The thread of a machine: it executes orders, and obeys a stop at any time.

use super::error::StageError;
use super::firmware::Firmware;
use super::gcode::{GcodeStage, Stopping};
use super::link::StageLink;
use super::url::StageUrl;
use crate::stamp::HostClock;
use palpate_mechanics::contact::Position;
use palpate_rig::Stage;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;

/// Work for a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Home: move to the end stops.
    Home,
    /// Travel to a position at the height of travel.
    Travel(Position),
    /// Travel to a position, and press there.
    Press {
        /// The position.
        position: Position,
        /// The depth.
        depth_m: f64,
    },
    /// Lift the finger.
    Lift,
    /// Move by these distances along x, y and z, in metres, at the height of travel or above.
    Jog([f64; 3]),
    /// Lower the finger to this z, in metres of the machine, but not below the deepest press.
    Lower(f64),
}

/// State of a machine after its work, with its position in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Done {
    /// The finger is lifted.
    Up([f64; 3]),
    /// The finger is below the height of travel.
    Down([f64; 3]),
}

/// A machine in a thread of its own. Dropping this during a move stops the machine.
#[derive(Debug)]
pub struct StageThread {
    firmware: Firmware,
    stopping: Stopping,
    orders: Option<Sender<Order>>,
    done: Receiver<Result<Done, StageError>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl StageThread {
    /// Opens the link and connects to the machine; the clock provides the time of the link. Setting `stop` stops the machine at any time, as
    /// [`Self::stop`] does.
    ///
    /// # Errors
    /// [`StageError`] if the machine is missing, or does not answer.
    pub fn open(
        url: &StageUrl,
        stage: Stage,
        stop: Arc<AtomicBool>,
        clock: HostClock,
    ) -> Result<Self, StageError> {
        let machine = GcodeStage::connect(url.open(clock)?, stage, Arc::clone(&stop))?;
        let (firmware, stopping) = (machine.firmware(), machine.stopping());
        let (orders, received) = channel();
        let (tell, done) = channel();
        let run = move || run(machine, &received, &tell);
        let thread = std::thread::Builder::new().name("stage".to_owned()).spawn(run)?;
        Ok(Self { firmware, stopping, orders: Some(orders), done, stop, thread: Some(thread) })
    }

    /// The machine's firmware.
    pub fn firmware(&self) -> Firmware {
        self.firmware
    }

    /// The way in which a stop acts on the machine.
    pub fn stopping(&self) -> Stopping {
        self.stopping
    }

    /// Orders work; returns at once.
    pub fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // A thread that has failed has reported its error.
            let _ = orders.send(order);
        }
    }

    /// The outcome of the ordered work, once it is done.
    pub fn done(&self) -> Option<Result<Done, StageError>> {
        self.done.try_recv().ok()
    }

    /// Stops the machine during any work. The stop has been sent when this returns.
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

    /// Ends the thread after the ordered work; the machine stays in its final state.
    pub fn close(&mut self) {
        self.join();
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
) {
    loop {
        let done = match orders.try_recv() {
            Ok(order) => obey(&mut machine, order),
            // Waits for a line for the time of one read, and obeys a stop.
            Err(TryRecvError::Empty) => match machine.watch() {
                Ok(()) => continue,
                Err(error) => Err(error),
            },
            Err(TryRecvError::Disconnected) => {
                // The thread may be ended by the stop.
                let _ = machine.heed_stop();
                return;
            }
        };
        let failed = done.is_err();
        if tell.send(done).is_err() || failed {
            return;
        }
    }
}

fn obey(machine: &mut GcodeStage<Box<dyn StageLink>>, order: Order) -> Result<Done, StageError> {
    match order {
        Order::Home => machine.home()?,
        Order::Travel(position) => machine.travel(position)?,
        Order::Lift => machine.lift()?,
        Order::Jog(by_m) => machine.jog(by_m)?,
        Order::Press { position, depth_m } => {
            machine.travel(position)?;
            machine.press(depth_m)?;
        }
        Order::Lower(z_m) => machine.lower(z_m)?,
    }
    let at_m = machine.position_m().ok_or(StageError::NotHomed)?;
    Ok(match order {
        Order::Press { .. } | Order::Lower(_) => Done::Down(at_m),
        Order::Home | Order::Travel(_) | Order::Lift | Order::Jog(_) => Done::Up(at_m),
    })
}
