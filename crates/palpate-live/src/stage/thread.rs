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

/// Order to a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Homing.
    Home,
    /// Travel to a position.
    Travel(Position),
    /// Travel and press.
    Press {
        /// Position.
        position: Position,
        /// Depth in metres.
        depth_m: f64,
    },
    /// Lift.
    Lift,
    /// Move in metres, not below the height of travel.
    Jog([f64; 3]),
    /// Descent to a machine z in metres, not below the deepest press.
    Lower(f64),
}

/// State after an order, and position in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StagePosition {
    /// Lifted.
    Up([f64; 3]),
    /// Below the height of travel.
    Down([f64; 3]),
}

/// Machine in a thread, stopped if dropped during a move.
#[derive(Debug)]
pub struct StageThread {
    firmware: Firmware,
    stopping: Stopping,
    orders: Option<Sender<Order>>,
    done: Receiver<Result<StagePosition, StageError>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl StageThread {
    /// Connects to the machine; `stop` acts as [`Self::stop`].
    ///
    /// # Errors
    /// [`StageError`] of the connection.
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

    /// Firmware.
    pub fn firmware(&self) -> Firmware {
        self.firmware
    }

    /// Effect of a stop.
    pub fn stopping(&self) -> Stopping {
        self.stopping
    }

    /// Queues an order.
    pub fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // A failed thread has reported its error.
            let _ = orders.send(order);
        }
    }

    /// Outcome of the orders, once done.
    pub fn done(&self) -> Option<Result<StagePosition, StageError>> {
        self.done.try_recv().ok()
    }

    /// Stops the machine at once; the stop is sent on return.
    pub fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.join();
    }

    /// Waits for all orders.
    ///
    /// # Errors
    /// [`StageError`] of the last order.
    pub fn finish(mut self) -> Result<(), StageError> {
        self.order(Order::Lift);
        self.join();
        self.done.try_iter().try_for_each(|done| done.map(drop))
    }

    /// Ends the thread after its orders.
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
    tell: &Sender<Result<StagePosition, StageError>>,
) {
    loop {
        let done = match orders.try_recv() {
            Ok(order) => execute(&mut machine, order),
            // Reads for unexpected lines, and obeys a stop.
            Err(TryRecvError::Empty) => match machine.watch() {
                Ok(()) => continue,
                Err(error) => Err(error),
            },
            Err(TryRecvError::Disconnected) => {
                // The thread may end because of the stop.
                let _ = machine.halt_if_requested();
                return;
            }
        };
        let failed = done.is_err();
        if tell.send(done).is_err() || failed {
            return;
        }
    }
}

fn execute(machine: &mut GcodeStage<Box<dyn StageLink>>, order: Order) -> Result<StagePosition, StageError> {
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
        Order::Press { .. } | Order::Lower(_) => StagePosition::Down(at_m),
        Order::Home | Order::Travel(_) | Order::Lift | Order::Jog(_) => StagePosition::Up(at_m),
    })
}
