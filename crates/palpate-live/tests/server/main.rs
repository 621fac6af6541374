//! The web server over real sockets.
#![forbid(unsafe_code)]

mod bring_up;
mod client;
mod machine;
mod routes;
mod sinks;
