//! The web server over real sockets.
#![forbid(unsafe_code)]

mod client;
mod machine;
mod routes;
mod sinks;
