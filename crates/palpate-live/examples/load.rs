//! Load of the live server over real sockets, with a recording beside it: latency, losses, CPU seconds, memory.
//!
//! ```console
//! $ cargo run --release -p palpate-live --example load [SECONDS]
//! ```
//! The board is simulated, and the browsers are threads, in the same process: the printed CPU seconds include theirs.
#![allow(clippy::print_stdout, reason = "it prints a table")]

use cpu_time::ProcessTime;
use palpate_estimators::fit::{Fit, FitTask};
use palpate_live::server::{Access, Live, Server};
use palpate_live::simulated_board::BoardConfig;
use palpate_rig::Rig;
use std::error::Error;
use std::net::{SocketAddr, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tungstenite::{Message, WebSocket};

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
/// Number of browsers at 60 Hz in the case with many.
const MANY: usize = 200;

/// A case: readings per second, browsers that follow at 60 Hz, browsers that never read, and whether the session is recorded.
struct Case {
    rate_hz: f64,
    browsers: usize,
    asleep: usize,
    records: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let seconds: f64 = std::env::args().nth(1).map_or(Ok(10.0), |text| text.parse())?;
    println!(
        "readings/s  browsers  asleep  samples  lost  recorded  lost  median ms  p99 ms  worst ms  CPU %  memory MB: start, end  messages at 60 Hz"
    );
    for case in [
        Case { rate_hz: 1_000.0, browsers: 1, asleep: 0, records: false },
        Case { rate_hz: 20_000.0, browsers: 1, asleep: 0, records: false },
        Case { rate_hz: 20_000.0, browsers: 1, asleep: 0, records: true },
        Case { rate_hz: 1_000.0, browsers: MANY, asleep: 0, records: false },
        Case { rate_hz: 1_000.0, browsers: 1, asleep: 3, records: false },
    ] {
        run(&case, Duration::from_secs_f64(seconds))?;
    }
    Ok(())
}

fn run(case: &Case, length: Duration) -> Result<(), Box<dyn Error>> {
    let rig = Rig::from_toml(RIG)?;
    let recording = rig.simulate(0)?;
    let locator = rig.estimator.fit_task(FitTask::new(&rig.setup, &recording))?;
    let config = BoardConfig { rate_hz: case.rate_hz, seed: 1, ..BoardConfig::default() };
    let folder = tempfile::tempdir()?;
    let live = Live::new(locator, "load", Some((rig, config)), PathBuf::new());
    let live = Arc::new(live.with_recordings(folder.path().to_owned()));
    let address: SocketAddr = "127.0.0.1:0".parse()?;
    let server = Server::start(address, Access::new(address, None, Vec::new())?, Arc::clone(&live))?;
    let address = server.address();
    let all = std::thread::spawn({
        let mut socket = follow(address, "?form=binary&rate=all")?;
        move || packets(&mut socket)
    });
    let browsers: Vec<JoinHandle<usize>> = (0..case.browsers)
        .map(|_| {
            let mut socket = follow(address, "")?;
            Ok(std::thread::spawn(move || std::iter::from_fn(|| socket.read().ok()).count()))
        })
        .collect::<Result<_, Box<dyn Error>>>()?;
    let _asleep = (0..case.asleep).map(|_| follow(address, "?rate=all")).collect::<Result<Vec<_>, _>>()?;
    live.begin_simulated()?;
    if case.records {
        live.begin_recording(None)?;
    }
    // One-time allocations are complete by then.
    std::thread::sleep(Duration::from_secs(1));
    let (before_mb, cpu, start) = (memory_mb(), ProcessTime::now(), Instant::now());
    std::thread::sleep(length);
    let share = cpu.elapsed().as_secs_f64() / start.elapsed().as_secs_f64();
    let after_mb = memory_mb();
    let recorded = live.end_recording()?.map(|status| (status.readings, status.lost));
    live.end();
    // Data in transit arrive before the connections end.
    std::thread::sleep(Duration::from_millis(200));
    drop(server);
    let Packets { mut latencies_ms, sent, lost } = all.join().map_err(|_| "a reader has panicked")?;
    latencies_ms.sort_by(f64::total_cmp);
    let at = |share: f64| {
        latencies_ms.get((share * (latencies_ms.len() - 1) as f64) as usize).copied().unwrap_or(f64::NAN)
    };
    let mut messages = Vec::new();
    for browser in browsers {
        messages.push(browser.join().map_err(|_| "a browser has panicked")?);
    }
    let (least, most) = (messages.iter().min().unwrap_or(&0), messages.iter().max().unwrap_or(&0));
    println!(
        "{:>10} {:>9} {:>7} {:>8} {:>5} {:>9} {:>5} {:>10.2} {:>7.2} {:>9.1} {:>6.0} {:>17.1}, {:.1} {:>12}–{}",
        case.rate_hz,
        case.browsers,
        case.asleep,
        sent,
        lost,
        recorded.map_or_else(|| "–".to_owned(), |(readings, _)| readings.to_string()),
        recorded.map_or_else(|| "–".to_owned(), |(_, lost)| lost.to_string()),
        at(0.5),
        at(0.99),
        at(1.0),
        100.0 * share,
        before_mb,
        after_mb,
        least,
        most,
    );
    Ok(())
}

fn follow(address: SocketAddr, query: &str) -> Result<WebSocket<TcpStream>, Box<dyn Error>> {
    let stream = TcpStream::connect(address)?;
    let (socket, _) = tungstenite::client(format!("ws://{address}/api/stream{query}"), stream)
        .map_err(|error| error.to_string())?;
    Ok(socket)
}

/// Latencies and losses of a client that receives all packets.
struct Packets {
    /// Times from the last byte of each arrival to its packet.
    latencies_ms: Vec<f64>,
    /// Number of samples, including lost ones.
    sent: u64,
    /// Number of lost samples.
    lost: u64,
}

fn packets(socket: &mut WebSocket<TcpStream>) -> Packets {
    let (mut latencies_ms, mut lost, mut expected) = (Vec::new(), 0, 0);
    while let Ok(message) = socket.read() {
        let now_ns = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos() as u64;
        let Message::Binary(packet) = message else { continue };
        let channels = usize::from(u16::from_le_bytes([packet[2], packet[3]]));
        let mut last_ns = now_ns;
        for sample in packet[8..].chunks_exact(48 + 4 * channels) {
            let u64_at = |at: usize| sample[at..at + 8].try_into().map_or(0, u64::from_le_bytes);
            lost += u64_at(0).saturating_sub(expected);
            expected = u64_at(0) + 1;
            last_ns = u64_at(8);
        }
        // Among readings that arrived together, only the last one has the time of its last byte.
        latencies_ms.push(now_ns.saturating_sub(last_ns) as f64 * 1e-6);
    }
    Packets { latencies_ms, sent: expected, lost }
}

/// Resident memory from /proc; NaN without it.
fn memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kb =
        status.lines().find_map(|line| line.strip_prefix("VmRSS:")?.trim().strip_suffix(" kB")?.parse().ok());
    kb.unwrap_or(f64::NAN) * 1e-3
}
