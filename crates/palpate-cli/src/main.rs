//! The `palpate` command.
#![forbid(unsafe_code)]

fn main() {}
