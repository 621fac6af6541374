//! Frames of 8 channels per second that the decoder reads on one core: cargo bench -p palpate-live --bench decoder
//!
//! CPU time, the median of nine runs. For comparison, the bench measures the minimum work on such bytes: the search for line ends by `str::lines` of
//! the standard library, or for the zeros of COBS frames. For plain values it also splits the lines at commas and parses the numbers, without names,
//! checks and time.

use cpu_time::ProcessTime;
use palpate_live::frame::{Channel, Decoder, encode_into};
use palpate_mechanics::units::Unit;
use palpate_testing::figure::figure;
use std::fmt::Write;

const FRAMES: u32 = 200_000;
const CHANNELS: usize = 8;

fn main() {
    let channel = |i: usize| Channel { name: format!("s{i}"), label: format!("c{i}"), unit: Unit::NONE };
    let channels: Vec<Channel> = (0..CHANNELS).map(channel).collect();
    let value = |n: u32, i: usize| (f64::from(n) * 0.37 + i as f64 * 12.1).sin() as f32 * 100.0;
    let (mut plain, mut named, mut json, mut binary) =
        (String::new(), String::new(), String::new(), Vec::new());
    for n in 0..FRAMES {
        let values: Vec<f32> = (0..CHANNELS).map(|i| value(n, i)).collect();
        let join = |show: &dyn Fn(usize) -> String| (0..CHANNELS).map(show).collect::<Vec<_>>().join(",");
        // Writing into a string cannot fail.
        let _ = writeln!(plain, "{}", join(&|i| format!("{:.3}", values[i])));
        let _ = writeln!(named, "{}", join(&|i| format!("c{i}:{:.3}", values[i])));
        let _ = writeln!(json, "{{{}}}", join(&|i| format!("\"c{i}\":{:.3}", values[i])));
        encode_into(&mut binary, n, n, &values);
    }
    let streams = [
        ("values", plain.as_bytes()),
        ("names", named.as_bytes()),
        ("JSON", json.as_bytes()),
        ("binary", &binary),
    ];
    for (form, bytes) in streams {
        let rate = million_a_second(|| decode(&channels, bytes));
        let found = million_a_second(|| find(bytes, form == "binary"));
        figure(&format!("decoder: {form}"), rate, "M frames/s");
        println!(
            "{form:>8}: {rate:.2} million frames/s; search only {found:.2}, {:.1} times as many",
            found / rate
        );
    }
    let (rate, read) =
        (million_a_second(|| decode(&channels, plain.as_bytes())), million_a_second(|| read_plainly(&plain)));
    println!("  values: read plainly {read:.2} million lines/s, {:.2} times as many", read / rate);
}

/// Median rate of nine runs of all frames, in millions per second; `run` returns its CPU seconds.
fn million_a_second(run: impl Fn() -> f64) -> f64 {
    let mut seconds: Vec<f64> = (0..9).map(|_| run()).collect();
    seconds.sort_by(f64::total_cmp);
    f64::from(FRAMES) / seconds[seconds.len() / 2] * 1e-6
}

/// CPU seconds of the search for the ends of all frames.
fn find(bytes: &[u8], is_binary: bool) -> f64 {
    let start = ProcessTime::now();
    let count = match (is_binary, std::str::from_utf8(bytes)) {
        (false, Ok(text)) => text.lines().count(),
        _ => bytes.iter().filter(|byte| **byte == 0).count(),
    };
    let seconds = start.elapsed().as_secs_f64();
    assert!(std::hint::black_box(count) >= FRAMES as usize);
    seconds
}

/// CPU seconds of splitting all lines at their commas and parsing the numbers.
fn read_plainly(text: &str) -> f64 {
    let start = ProcessTime::now();
    let sum: f64 =
        text.lines().flat_map(|line| line.split(',')).filter_map(|cell| cell.parse::<f64>().ok()).sum();
    let seconds = start.elapsed().as_secs_f64();
    assert!(std::hint::black_box(sum).is_finite());
    seconds
}

/// CPU seconds of decoding all frames, in chunks as from a source.
fn decode(channels: &[Channel], bytes: &[u8]) -> f64 {
    let mut decoder = Decoder::new(channels);
    let (mut frames, mut sum) = (0, 0.0);
    let start = ProcessTime::now();
    for chunk in bytes.chunks(4096) {
        decoder.receive(chunk, |frame| {
            frames += 1;
            sum += frame.map_or(f64::NAN, |frame| frame.reading[0]);
        });
    }
    let seconds = start.elapsed().as_secs_f64();
    assert!(frames == FRAMES && sum.is_finite());
    seconds
}
