//! Progress bars on a terminal, and signals that stop long work.

use crate::remark::{alert, is_quiet};
use indicatif::{ProgressBar, ProgressStyle};
use palpate_numerics::watch::{Progress, Watch};
use std::error::Error;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Number of the received signal; 0 for none. Signal handlers write it.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);
/// Time from a signal to a forced end of the process.
const PATIENCE: Duration = Duration::from_millis(700);
static FINISHES: AtomicBool = AtomicBool::new(false);
const INTERRUPT: usize = 2;

/// Lets Ctrl-C, SIGTERM or a closed terminal stop long work. The process ends soon after in any
/// case: all written files are complete at any time. See [`finish_after_signal`] for work that must
/// not be cut off.
pub fn install_signal_handler() {
    if let Err(error) = begin_to_listen() {
        alert!("Ctrl-C will end palpate at once: {error}");
    }
}

/// Signals that ask a process to end. They need a real handler: signals that are only blocked reach
/// the threads of serial ports, where `ppoll` unblocks them.
#[cfg(unix)]
fn ends() -> Vec<i32> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    let mut ends = vec![SIGINT, SIGTERM, SIGQUIT];
    // `nohup` makes the process ignore it.
    if !ignores(SIGHUP) {
        ends.push(SIGHUP);
    }
    ends
}

/// Returns true if the process was started with a signal ignored, as Linux reports in hexadecimal.
#[cfg(unix)]
fn ignores(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & (1 << (signal - 1)) != 0
}

#[cfg(unix)]
fn begin_to_listen() -> Result<(), Box<dyn Error>> {
    let ends = ends();
    for signal in &ends {
        signal_hook::flag::register_usize(*signal, Arc::clone(&SIGNAL), *signal as usize)?;
    }
    let mut signals = signal_hook::iterator::Signals::new(ends)?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        let mut signals = signals.forever();
        if signals.next().is_some() {
            std::thread::sleep(PATIENCE);
            if FINISHES.load(Ordering::Relaxed) {
                alert!("palpate: finishing; press Ctrl-C again to end at once");
                signals.next();
            }
            end();
        }
    })?;
    Ok(())
}

#[cfg(not(unix))]
fn begin_to_listen() -> Result<(), Box<dyn Error>> {
    Ok(ctrlc::set_handler(|| {
        let is_first = SIGNAL.swap(INTERRUPT, Ordering::Relaxed) == 0;
        std::thread::sleep(PATIENCE);
        if is_first && FINISHES.load(Ordering::Relaxed) {
            return alert!("palpate: finishing; press Ctrl-C again to end at once");
        }
        end();
    })?)
}

/// Sets a flag at once if a signal asks the process to end or to be suspended: a machine must not
/// continue unwatched.
#[cfg(all(feature = "live", unix))]
pub fn set_at_signal(flag: &Arc<AtomicBool>) -> std::io::Result<()> {
    for signal in ends().into_iter().chain([signal_hook::consts::SIGTSTP]) {
        signal_hook::flag::register(signal, Arc::clone(flag))?;
    }
    Ok(())
}

/// Has no effect without signals: a caller of [`interrupted`] sets the flag.
#[cfg(all(feature = "live", not(unix)))]
pub fn set_at_signal(_: &Arc<AtomicBool>) -> std::io::Result<()> {
    Ok(())
}

/// Lets the command finish its work after a first signal: close a recording, lift a machine. A
/// second signal ends the process.
#[cfg(feature = "live")]
pub fn finish_after_signal() {
    FINISHES.store(true, Ordering::Relaxed);
}

fn end() {
    alert!("palpate: stopped");
    std::process::exit(interrupted_code().into());
}

pub fn interrupted() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// Exit code of an interrupted command: 128 and the signal, as in shells.
pub fn interrupted_code() -> u8 {
    let signal = match SIGNAL.load(Ordering::Relaxed) {
        0 => INTERRUPT,
        signal => signal,
    };
    128 + signal as u8
}

const OF_LENGTH: &str = "{msg} {wide_bar} {pos}/{len}  {prefix}";
const OF_ANY_LENGTH: &str = "{msg} {spinner} {prefix} {elapsed} so far";

/// A bar of `length` steps on stderr; 0 for an unknown length.
pub fn bar(length: u64, what: &str) -> ProgressBar {
    let bar = if is_quiet() { ProgressBar::hidden() } else { ProgressBar::new(length) };
    set_template(&bar, if length == 0 { OF_ANY_LENGTH } else { OF_LENGTH });
    bar.set_message(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

fn set_template(bar: &ProgressBar, template: &str) {
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
}

/// Observer of long work: shows a bar on a terminal, and stops the work after Ctrl-C.
pub struct Observer {
    bar: ProgressBar,
    state: Mutex<State>,
}

struct State {
    rounds: u64,
    stage: &'static str,
    start: Instant,
}

const STAGE_STEPS: f64 = 1000.0;

impl Observer {
    /// Observer of an iteration of at most `most` rounds; 0 for an unknown number.
    pub fn of_rounds(most: u64) -> Self {
        Self::new(bar(most, "fitting"))
    }

    /// Observer of work that reports stages; the bar restarts with every stage.
    pub fn of_stages() -> Self {
        Self::new(bar(STAGE_STEPS as u64, "beginning"))
    }

    fn new(bar: ProgressBar) -> Self {
        Self { bar, state: Mutex::new(State { rounds: 0, stage: "", start: Instant::now() }) }
    }

    pub fn watch<T>(&self, work: impl FnOnce(Watch) -> T) -> T {
        work(Watch::new(&|progress| self.observe(progress)))
    }

    fn observe(&self, progress: Progress) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        match progress {
            Progress::Round => self.round(&mut state),
            Progress::Stage { name, share } => self.stage(&mut state, name, share),
            Progress::Counted { name, unit, done, of } => self.counted(&mut state, name, unit, done, of),
        }
        !interrupted()
    }

    fn round(&self, state: &mut State) {
        // Often enough for the eye, and rare enough to take no time.
        const EVERY: u64 = 64;
        state.rounds += 1;
        // Rounds within a stage do not advance its bar.
        if !state.stage.is_empty() || !state.rounds.is_multiple_of(EVERY) {
            return;
        }
        match self.bar.length() {
            None | Some(0) => self.bar.set_prefix(format!("{} steps,", state.rounds)),
            Some(length) => {
                self.bar.set_position(state.rounds);
                let rate = state.rounds as f64 / state.start.elapsed().as_secs_f64();
                let most = duration(length.saturating_sub(state.rounds) as f64 / rate);
                self.bar.set_prefix(format!("{rate:.0} epochs/s, at most {most} left"));
            }
        }
    }

    fn stage(&self, state: &mut State, name: &'static str, share: f64) {
        self.begin(state, name, STAGE_STEPS as u64);
        if share > 0.0 {
            self.bar.set_position((share * STAGE_STEPS) as u64);
            let left_s = state.start.elapsed().as_secs_f64() * (1.0 - share) / share;
            self.bar.set_prefix(format!("about {} left of this", duration(left_s)));
        }
    }

    fn counted(&self, state: &mut State, name: &'static str, unit: &str, done: usize, of: usize) {
        self.begin(state, name, of as u64);
        if done > 0 {
            self.bar.set_position(done as u64);
            let rate = done as f64 / state.start.elapsed().as_secs_f64();
            let left = duration(of.saturating_sub(done) as f64 / rate);
            self.bar.set_prefix(format!("{} {unit}/s, about {left} left of this", per_second(rate)));
        }
    }

    fn begin(&self, state: &mut State, name: &'static str, length: u64) {
        if state.stage != name {
            state.stage = name;
            state.start = Instant::now();
            self.bar.set_position(0);
            self.bar.set_prefix("");
            self.bar.set_length(length);
            set_template(&self.bar, OF_LENGTH);
            self.bar.set_message(name);
        }
    }
}

fn per_second(rate: f64) -> String {
    if rate < 10.0 { format!("{rate:.1}") } else { format!("{rate:.0}") }
}

impl Drop for Observer {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

pub fn duration(seconds: f64) -> String {
    let seconds = seconds.max(0.0).round() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_read_well() {
        assert_eq!([0.25, 9.9, 127.4, 5210.0].map(per_second), ["0.2", "9.9", "127", "5210"]);
    }

    #[test]
    fn durations_read_well() {
        assert_eq!([0.4, 59.6, 80.0, 7265.0].map(duration), ["0 s", "1 min 0 s", "1 min 20 s", "2 h 1 min"]);
    }
}
