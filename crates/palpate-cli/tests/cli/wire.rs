//! `--ros` and `--foxglove` from outside, of a command that was built with both; `cargo xtask wire` runs these.

use crate::support::command::{Running, complained, folder, palpate, run, said};
use crate::support::examples::NOISY_BEAM;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::Stdio;
use std::time::Duration;
use tempfile::TempDir;

/// A folder with a rig and its locator.
fn bench() -> TempDir {
    let folder = folder(NOISY_BEAM);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    folder
}

/// Greeting of a server of Foxglove, up to the last of its topics, which come in any order.
fn greeting(address: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let request = format!(
        "GET / HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut told = Vec::new();
    let mut buffer = [0; 4096];
    let is_told = |told: &[u8]| {
        let told = String::from_utf8_lossy(told);
        ["/reading", "/estimate", "/event", "/contact"].iter().all(|topic| told.contains(topic))
    };
    while !is_told(&told) {
        let count = stream.read(&mut buffer).unwrap();
        assert!(count > 0, "{}", String::from_utf8_lossy(&told));
        told.extend(&buffer[..count]);
    }
    String::from_utf8_lossy(&told).into_owned()
}

#[test]
fn sessions_are_served_to_foxglove_and_survive_a_router_that_is_not_there() {
    let folder = bench();
    for verb in [
        &["record", "locator.json", "--out", "press.mcap"][..],
        &["serve", "locator.json", "--listen", "127.0.0.1:0"],
    ] {
        let mut command = palpate(folder.path());
        command.args(verb).args(["--from", "simulated:rig.toml?rate=100", "--foxglove", "127.0.0.1:0"]);
        command.args(["--ros", "tcp/127.0.0.1:1?domain=3&name=bench/left"]).stderr(Stdio::piped());
        let mut session = Running(command.spawn().unwrap());
        let lines = BufReader::new(session.0.stderr.take().unwrap()).lines().map(Result::unwrap);
        let mut lines = lines.inspect(|line| println!("{line}"));
        let address = lines.find_map(|line| line.split_once("ws://").map(|(_, address)| address.to_owned()));
        let told = greeting(&address.expect("the address of Foxglove"));
        assert!(told.contains("101 Switching Protocols") && told.contains("/estimate"), "{told}");
        if verb[0] == "record" {
            assert!(lines.any(|line| line.contains("tcp/127.0.0.1:1 cannot be reached; it is tried again")));
        }
    }
}

#[test]
fn a_recording_beside_a_router_that_is_not_there_is_whole() {
    let folder = bench();
    let record = ["record", "locator.json", "--from", "simulated:rig.toml?rate=100", "--out", "press.mcap"];
    let told = said(&run(
        folder.path(),
        &[&record[..], &["--duration", "1 s", "--ros", "tcp/127.0.0.1:1"]].concat(),
    ));
    assert!(told.contains("readings in"), "{told}");
}

#[test]
fn an_address_that_is_taken_is_refused() {
    let folder = bench();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let record = ["record", "locator.json", "--from", "simulated:rig.toml", "--out", "never.mcap"];
    let told = complained(&run(folder.path(), &[&record[..], &["--foxglove", &address]].concat()), 2);
    assert!(told.contains(&address) && told.contains("--foxglove 127.0.0.1:0"), "{told}");
    assert!(!folder.path().join("never.mcap").exists());
}
