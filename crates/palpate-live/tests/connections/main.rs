//! Connections over real parts: pseudo-terminals, sockets, a broker.
#![forbid(unsafe_code)]

mod bench;
mod broker;
mod sources;
