//! `simulated:rig.toml`: a simulated board within the process.

use super::{InputSender, SourceError};
use crate::input::Arrival;
use crate::simulated_board::{BoardConfig, Finger, SimulatedBoard};
use palpate_rig::Rig;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between arrivals, as through USB.
const BURST: Duration = Duration::from_millis(1);

pub fn open(outlet: InputSender, path: &Path, rate_hz: f64, seed: u64) -> Result<(), SourceError> {
    let complaint = |error: String| SourceError::Rig { path: path.display().to_string(), error };
    let text = std::fs::read_to_string(path).map_err(|error| complaint(error.to_string()))?;
    let rig = Rig::from_toml(&text).map_err(|error| complaint(error.to_string()))?;
    let name = format!("a simulated board ({})", path.display());
    open_rig(outlet, rig, BoardConfig { rate_hz, seed, ..BoardConfig::default() }, name)
}

pub fn open_rig(outlet: InputSender, rig: Rig, config: BoardConfig, name: String) -> Result<(), SourceError> {
    // Rejects a rig that cannot be simulated before the thread starts.
    SimulatedBoard::new(&rig.setup, &config, Finger::random(&rig, config.seed))?;
    std::thread::Builder::new().name("source".to_owned()).spawn(move || run(&outlet, &rig, &config, name))?;
    Ok(())
}

fn run(outlet: &InputSender, rig: &Rig, config: &BoardConfig, name: String) {
    let Ok(mut board) = SimulatedBoard::new(&rig.setup, config, Finger::random(rig, config.seed)) else {
        return;
    };
    let start = Instant::now();
    let mut goes_on = outlet.send(Arrival::Opened(name));
    while goes_on {
        std::thread::sleep(BURST.max(board.next_at().saturating_sub(start.elapsed())));
        let bytes = board.send_until(start.elapsed());
        goes_on = if bytes.is_empty() { !outlet.is_stopped() } else { outlet.send(Arrival::Bytes(bytes)) };
    }
}
