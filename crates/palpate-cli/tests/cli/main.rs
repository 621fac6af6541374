//! The `palpate` command from outside, and the pages that it writes.
#![forbid(unsafe_code)]

mod bad_input;
mod broken_streams;
mod browser;
mod calibrate;
mod compare;
mod completions;
mod connections;
mod design;
mod digit;
mod feeds;
mod hand_at_terminal;
mod help;
mod how_to;
mod init;
mod json_names;
mod kept_alarms;
mod learnt;
mod limit;
mod live;
mod live_session;
mod nuisances;
mod outputs;
mod plane;
mod positions;
mod profile;
mod quiet;
mod readme;
mod recording_check;
mod recordings;
mod reference;
mod report_page;
mod sample_benches;
mod shards;
mod signals;
mod streams;
mod study;
mod support;
mod supported_beams;
mod tare;
mod track;
mod tutorials;
mod unread_sources;
mod verbs;
#[cfg(all(feature = "foxglove", feature = "ros"))]
mod wire;
