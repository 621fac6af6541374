//! Thread of a session.

use crate::feed::FeedWatch;
use crate::input::{Arrival, Command, Input};
use crate::session::{Estimation, Output, Session};
use crate::sink::{Batch, ChannelRecord, Sink, StateRecord};
use crate::source::SourceUrl;
use crate::stamp::HostClock;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Most waiting inputs; the source then waits.
pub const WAITING: usize = 1024;
const STATE_EVERY: Duration = Duration::from_micros(16_667);

/// Error of a replay at another speed than 1.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a recording at speed={speed} has other times than its readings, by which a low-pass filter and a tracker go; use speed=1, or `palpate replay`"
)]
pub struct PaceError {
    /// Speed.
    pub speed: f64,
}

/// Checks the speed of a source, if the estimation depends on times.
///
/// # Errors
/// [`PaceError`].
pub fn check_pace(estimation: &Estimation, from: &SourceUrl) -> Result<(), PaceError> {
    match (estimation, from) {
        (Estimation::LowPass { .. } | Estimation::Track { .. }, SourceUrl::File { speed, .. })
            if *speed != 1.0 =>
        {
            Err(PaceError { speed: *speed })
        }
        _ => Ok(()),
    }
}

/// Runs a session to the end of source, senders or stop. Returns the fault of the feed, also an event.
pub fn run(
    session: &mut Session,
    clock: HostClock,
    inputs: &Receiver<Input>,
    sinks: &mut [Box<dyn Sink>],
) -> Option<String> {
    let mut source = None;
    let mut feed = FeedWatch::default();
    let mut next_state = Instant::now() + STATE_EVERY;
    loop {
        let mut outputs = Vec::new();
        let mut goes_on = true;
        match inputs.recv_timeout(next_state.saturating_duration_since(Instant::now())) {
            Ok(Input::Arrived(arrived)) => {
                match &arrived.arrival {
                    Arrival::Opened(name) | Arrival::Joined(name) | Arrival::Piped(name) => {
                        source = Some(name.clone());
                    }
                    Arrival::Lost(_) => source = None,
                    Arrival::Ended => goes_on = false,
                    Arrival::Backlog(_) | Arrival::Bytes(_) | Arrival::Message(_) => {}
                }
                session.receive(&arrived, &mut outputs);
                feed.receive(&arrived.arrival, clock.now().elapsed, session.frames());
            }
            Ok(Input::Command(command)) => session.command(clock.now(), command, &mut outputs),
            Err(RecvTimeoutError::Timeout) => {}
            Ok(Input::Stop) | Err(RecvTimeoutError::Disconnected) => goes_on = false,
        }
        let now = clock.now();
        if let Some(text) = feed.report(now.elapsed, session.frames()) {
            session.command(now, Command::Trouble(text), &mut outputs);
        }
        write_outputs(outputs, sinks);
        if Instant::now() >= next_state || !goes_on {
            let state = Arc::new(state(session, source.as_deref()));
            sinks.iter_mut().for_each(|sink| sink.state(&state));
            next_state = Instant::now() + STATE_EVERY;
        }
        if !goes_on {
            return feed.fault(session.frames());
        }
    }
}

fn write_outputs(outputs: Vec<Output>, sinks: &mut [Box<dyn Sink>]) {
    if !outputs.is_empty() {
        let batch = Arc::new(Batch { outputs });
        sinks.iter_mut().for_each(|sink| sink.batch(&batch));
    }
}

fn state(session: &Session, source: Option<&str>) -> StateRecord {
    let channels = session.channels().iter().zip(session.health()).map(|(channel, health)| {
        let factor = channel.unit.factor();
        ChannelRecord {
            state: health.state,
            // The range is infinite without readings, and JSON has no infinity.
            range: Some(health.range.map(|end| end / factor)).filter(|range| range[0] <= range[1]),
            noise_sd: health.noise_sd / factor,
        }
    });
    StateRecord {
        source: source.map(str::to_owned),
        rate_hz: session.rate_hz(),
        touched: session.is_touched(),
        counters: session.counters(),
        channels: channels.collect(),
    }
}
