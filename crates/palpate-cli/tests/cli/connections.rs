//! `palpate serve` among connections that ask nothing or half of something: who asks is answered all the same, with few file descriptors too.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::command::Running;

/// Longest wait for an answer: less than the time after which half a request is let go by itself.
const PATIENCE: Duration = Duration::from_secs(5);

/// A served simulated board that may have so many files open, and its address.
fn serve(most_files: u32) -> (Running, String) {
    let script = format!("ulimit -n {most_files}; exec \"$0\" serve --listen 127.0.0.1:0");
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_palpate")]).stderr(Stdio::piped());
    let mut child = command.stdin(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
    let address = lines.find_map(|line| Some(line.split_once("http://")?.1.split_once('/')?.0.to_owned()));
    (Running(child), address.expect("the server says where it is"))
}

/// A connection with this much of a request.
fn begun(address: &str, request: &str) -> TcpStream {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    // One that is one too many may have been let go already.
    let _ = stream.write_all(request.as_bytes());
    stream
}

/// The answer to a request without a body; empty without any.
fn answer(address: &str, method: &str, path: &str) -> String {
    let head = format!("{method} {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n");
    let mut answer = Vec::new();
    let _ = begun(address, &format!("{head}Content-Length: 0\r\n\r\n")).read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

/// A browser on the stream.
fn follow(address: &str) -> TcpStream {
    let head = format!("GET /api/stream HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\n");
    let key = "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    begun(address, &format!("{head}{key}"))
}

#[test]
fn idle_connections_do_not_block_others() {
    let (_server, address) = serve(128);
    let mut browser = follow(&address);
    let half_head = format!("GET /api/session HTTP/1.1\r\nHost: {address}\r\n");
    let half_body = format!("POST /api/mark HTTP/1.1\r\nHost: {address}\r\nContent-Length: 90\r\n\r\n{{\"te");
    for half in ["", &half_head, &half_body] {
        let _held: Vec<TcpStream> = (0..200).map(|_| begun(&address, half)).collect();
        let asked = Instant::now();
        let stopped = answer(&address, "POST", "/api/emergency-stop");
        println!("{:?} to the emergency stop among 200 of {half:?}", asked.elapsed());
        // The demonstration has no machine, and says so.
        assert!(stopped.starts_with("HTTP/1.1 404") && stopped.contains("does not calibrate"), "{stopped}");
        assert!(answer(&address, "GET", "/api/session").starts_with("HTTP/1.1 200"));
    }
    let (start, mut bytes) = (Instant::now(), [0; 4096]);
    while start.elapsed() < Duration::from_millis(300) {
        assert!(browser.read(&mut bytes).unwrap() > 0, "the stream goes on");
    }
}
