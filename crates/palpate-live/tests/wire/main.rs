//! Tests of the sinks with slow-to-compile dependencies, over real Zenoh routers and WebSockets. `cargo xtask wire` runs them.
#![forbid(unsafe_code)]

mod bench;
mod foxglove;
mod ros;
