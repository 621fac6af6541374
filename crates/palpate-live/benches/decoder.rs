//! Frames of 8 channels that the decoder reads in a second of one core: cargo bench -p palpate-live --bench decoder
//!
//! CPU time, the median of nine runs.

use cpu_time::ProcessTime;
use palpate_live::frame::{Channel, Decoder, encode_into};
use palpate_mechanics::units::Unit;
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
        let mut seconds: Vec<f64> = (0..9).map(|_| decode(&channels, bytes)).collect();
        seconds.sort_by(f64::total_cmp);
        println!("{form:>8}: {:.2} million frames/s", f64::from(FRAMES) / seconds[seconds.len() / 2] * 1e-6);
    }
}

/// CPU seconds of decoding all frames in chunks as a source brings them.
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
