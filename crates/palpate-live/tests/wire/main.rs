//! The sinks whose dependencies take minutes to compile, over real parts: Zenoh routers and WebSockets. `cargo xtask wire` runs them.
#![forbid(unsafe_code)]

mod bench;
mod foxglove;
mod ros;
