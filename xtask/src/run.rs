//! Commands with visible output.

use std::io::{self, BufRead, BufReader, IsTerminal, Read, Write};
use std::panic::resume_unwind;
use std::process::{Command, Stdio};
use std::thread::{self, JoinHandle};

use anyhow::{Context, Result};

pub struct CapturedOutput {
    pub succeeded: bool,
    /// Output without colours, then error output.
    pub lines: Vec<String>,
}

/// Joins a thread; forwards a panic.
pub fn joined<T>(thread: JoinHandle<T>) -> T {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

/// Runs a command with an empty standard input.
pub fn run_shown(command: &mut Command) -> Result<bool> {
    let status = command.stdin(Stdio::null()).status().with_context(|| cannot_start(command))?;
    Ok(status.success())
}

/// Runs a command, and shows and keeps its output.
pub fn run_captured(command: &mut Command) -> Result<CapturedOutput> {
    if io::stderr().is_terminal() {
        command.env("CARGO_TERM_COLOR", "always");
    }
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().with_context(|| cannot_start(command))?;
    let (out, err) = (child.stdout.take(), child.stderr.take());
    let lines = thread::scope(|scope| {
        let errors = scope.spawn(|| pass_on(err, io::stderr()));
        let mut lines = pass_on(out, io::stdout())?;
        lines.extend(errors.join().unwrap_or_else(|_| Ok(Vec::new()))?);
        io::Result::Ok(lines)
    })
    .with_context(|| format!("cannot pass on the output of {command:?}"))?;
    let status = child.wait().with_context(|| format!("cannot wait for {command:?}"))?;
    Ok(CapturedOutput { succeeded: status.success(), lines })
}

pub fn is_runnable(program: &str, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

pub fn first_line(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

fn cannot_start(command: &Command) -> String {
    format!("cannot start {}: is it installed and on PATH?", command.get_program().display())
}

fn pass_on(from: Option<impl Read>, mut to: impl Write) -> io::Result<Vec<String>> {
    let mut lines = Vec::new();
    let Some(from) = from else { return Ok(lines) };
    let mut from = BufReader::new(from);
    let mut line = Vec::new();
    while from.read_until(b'\n', &mut line)? > 0 {
        to.write_all(&line)?;
        to.flush()?;
        lines.push(without_colours(String::from_utf8_lossy(&line).trim_end()));
        line.clear();
    }
    Ok(lines)
}

fn without_colours(line: &str) -> String {
    let mut plain = String::with_capacity(line.len());
    let mut rest = line.chars();
    while let Some(character) = rest.next() {
        if character == '\u{1b}' {
            rest.by_ref().find(char::is_ascii_alphabetic);
        } else {
            plain.push(character);
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_dropped_and_text_is_kept() {
        assert_eq!(without_colours("\u{1b}[32;1m  Summary\u{1b}[0m [0.1s]"), "  Summary [0.1s]");
        assert_eq!(without_colours("plain"), "plain");
    }

    #[test]
    fn both_streams_of_a_command_are_kept() {
        let kept = run_captured(Command::new("sh").args(["-c", "echo out; echo err >&2; exit 3"])).unwrap();
        assert!(!kept.succeeded);
        assert_eq!(kept.lines, ["out", "err"]);
    }

    #[test]
    fn a_program_that_is_not_there_is_an_error_that_names_it() {
        let error = run_shown(&mut Command::new("no-such-program-at-all")).unwrap_err();
        assert!(error.to_string().contains("no-such-program-at-all"), "{error}");
        assert!(!is_runnable("no-such-program-at-all", &[]));
    }
}
