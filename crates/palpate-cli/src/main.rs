//! The `palpate` command.
fn main() {}
