//! Runs the `palpate` command as its users do.

use std::fmt::Display;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// A folder with a rig, `rig.toml`.
pub fn folder(rig: impl Display) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    fs::write(folder.path().join("rig.toml"), rig.to_string()).expect("the temporary folder can be written");
    folder
}

/// The command, in a folder, without colours.
pub fn palpate(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.current_dir(folder).env("NO_COLOR", "1").stdin(Stdio::null());
    command
}

/// A process that is killed when it is dropped.
pub struct Running(pub Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs it to its end.
pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    palpate(folder).args(arguments).output().expect("the command starts")
}

/// Stdout of a command that was to succeed.
pub fn said(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{:?}\n{stderr}", output.status);
    String::from_utf8(output.stdout.clone()).expect("stdout is text")
}

/// Stdout, as JSON, of a command that was to succeed.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&said(&run(folder, &[arguments, &["--json"]].concat()))).expect("stdout is JSON")
}

/// Stderr of a command that was to end with `code`.
pub fn complained(output: &Output, code: i32) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    stderr
}
