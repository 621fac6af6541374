//! Commands that run while a test follows what they say, and servers among them that are asked.

use super::command::{Running, palpate};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Longest wait for a message, under load too; a silence is reported after 3 s.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// A command that runs, and the lines of its stderr.
pub struct Attempt {
    child: Running,
    lines: Receiver<String>,
    said: String,
}

impl Attempt {
    /// Starts it in a folder.
    pub fn begin(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = palpate(folder);
        command.args(arguments).stdin(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        let (to, lines) = channel();
        thread::spawn(move || stderr.lines().map_while(Result::ok).try_for_each(|line| to.send(line)));
        Self { child: Running(child), lines, said: String::new() }
    }

    /// Waits until its stderr has all these words.
    pub fn wait_for(&mut self, words: &[&str]) {
        let end = Instant::now() + PATIENCE;
        while !words.iter().all(|words| self.said.contains(words)) {
            let line = self.lines.recv_timeout(end.saturating_duration_since(Instant::now()));
            let line = line.unwrap_or_else(|_| panic!("no {words:?} in {}", self.said));
            self.said += &(line + "\n");
        }
    }

    /// The next line of its stderr, where one is there.
    pub fn line(&mut self) -> Option<String> {
        let line = self.lines.try_recv().ok()?;
        self.said += &format!("{line}\n");
        Some(line)
    }

    /// All lines so far.
    pub fn said(&self) -> &str {
        &self.said
    }

    /// Its exit code, once it has ended; the outer `None` while it runs.
    pub fn ended(&mut self) -> Option<Option<i32>> {
        self.child.0.try_wait().unwrap().map(|status| status.code())
    }

    /// Address of the server that it is.
    pub fn address(&mut self) -> String {
        self.wait_for(&["http://"]);
        let (_, rest) = self.said.split_once("http://").unwrap();
        rest.split('/').next().unwrap().to_owned()
    }

    /// Interrupts it; returns its exit code and the last words on stderr.
    pub fn interrupt(mut self) -> (Option<i32>, String) {
        Command::new("kill").args(["-INT", &self.child.0.id().to_string()]).status().unwrap();
        let code = self.child.0.wait().unwrap().code();
        (code, self.lines.iter().collect::<Vec<_>>().join("\n"))
    }
}

/// Waits until a server answers with JSON of a kind.
pub fn wait_for_answer(address: &str, path: &str, is_expected: impl Fn(&Value) -> bool) {
    let end = Instant::now() + PATIENCE;
    loop {
        let answer = get(address, path);
        if is_expected(&answer) {
            return;
        }
        assert!(Instant::now() < end, "{path}: {answer}");
        thread::sleep(Duration::from_millis(100));
    }
}

/// The JSON that a server answers.
pub fn get(address: &str, path: &str) -> Value {
    ask(address, "GET", path, "")
}

/// The JSON that a server answers to what is posted.
pub fn post(address: &str, path: &str, body: &Value) -> Value {
    ask(address, "POST", path, &body.to_string())
}

fn ask(address: &str, method: &str, path: &str, body: &str) -> Value {
    let mut stream = TcpStream::connect(address).unwrap();
    let head = format!("{method} {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n");
    let kind = format!("Content-Type: application/json\r\nContent-Length: {}\r\n\r\n", body.len());
    stream.write_all([&head, &kind, body].concat().as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (_, body) = answer.split_once("\r\n\r\n").unwrap();
    serde_json::from_str(body).unwrap_or_else(|error| panic!("{error}: {answer}"))
}
