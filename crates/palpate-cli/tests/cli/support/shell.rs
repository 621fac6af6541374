//! Lines of commands as a user types them, run by a shell that finds the command.

use std::env;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs a line in a folder by bash, with the command on its path.
pub fn run_line(folder: &Path, line: &str) -> Output {
    shell(folder, line).output().expect("bash starts")
}

/// A shell that runs a line in a folder, with the command on its path; its streams are piped.
pub fn shell(folder: &Path, line: &str) -> Command {
    let own = Path::new(env!("CARGO_BIN_EXE_palpate")).parent().expect("the command is in a folder");
    let others = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths(std::iter::once(own.to_owned()).chain(env::split_paths(&others)));
    let mut command = Command::new("bash");
    command
        .current_dir(folder)
        .args(["-c", line])
        .env("PATH", path.expect("no folder has a colon"))
        .env("NO_COLOR", "1");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}
