//! Any bytes as frames: chunks do not change the result.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_live::frame::{BadFrame, Channel, Decoder, Frame};
use palpate_mechanics::units::Unit;
use std::sync::LazyLock;

static CHANNELS: LazyLock<Vec<Channel>> = LazyLock::new(|| {
    let channel = |name: &str| Channel { name: name.to_owned(), label: name.to_owned(), unit: Unit::NONE };
    vec![channel("a"), channel("b")]
});

fuzz_target!(|input: (bool, u8, &[u8])| {
    let (joins, cut, bytes) = input;
    let decoded = |length: usize| -> Vec<Result<Frame, BadFrame>> {
        let mut decoder = Decoder::new(&CHANNELS);
        if joins {
            decoder.join();
        }
        let mut frames = Vec::new();
        bytes.chunks(length.max(1)).for_each(|bytes| decoder.receive(bytes, |frame| frames.push(frame)));
        decoder.end(|frame| frames.push(frame));
        frames
    };
    let whole = decoded(bytes.len());
    assert_eq!(decoded(usize::from(cut)), whole);
    for frame in whole.into_iter().flatten() {
        assert!(frame.reading.len() == 2 && frame.reading.iter().all(|value| value.is_finite()));
    }
    Decoder::new(&CHANNELS).receive_message(bytes, |_| ());
});
