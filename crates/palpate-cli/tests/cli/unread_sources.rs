//! Every command that opens a source, with sources that bring no readings: the cause is said while the command runs, and the exit code is 3.
#![cfg(unix)]

use crate::support::attempt::{Attempt, wait_for_answer};
use crate::support::command::{folder, run, said};
use palpate_live::simulated_board::Link;
use std::fs::{self, File};
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::thread;
use tempfile::TempDir;

const READING: &str = "100.5,200.5,300.0,399.7\n";
const RIG: &str = include_str!("../field/base.toml");

/// A source that brings no readings, or none any more.
struct Source {
    name: &'static str,
    url: String,
    /// Words of its report: cause and last offending line.
    expected: &'static [&'static str],
    /// Words on a page that looks at a board without a rig.
    on_page: &'static [&'static str],
    had_readings: bool,
}

/// A server that sends these bytes to every client, and keeps the connection.
fn server(bytes: &'static [u8]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    thread::spawn(move || {
        let mut clients: Vec<TcpStream> = Vec::new();
        while let Ok((mut client, _)) = listener.accept() {
            let _ = client.write_all(bytes);
            clients.push(client);
        }
    });
    address.to_string()
}

fn sources(port: &str) -> Vec<Source> {
    let tcp = |bytes: &'static [u8]| format!("tcp://{}", server(bytes));
    let vanishing = [READING.repeat(50), "100.5,200.5,300.0\n".repeat(191)].concat().into_bytes().leak();
    // A broker's answer to a client whose password it does not take.
    let broker = format!("mqtt://{}/board", server(&[0x20, 2, 0, 5]));
    let all: [(&str, String, &[&str], &[&str]); 7] = [
        ("silent", tcp(b""), &["the source is connected but sends no data"], &["the board sends no data"]),
        (
            "carriage returns",
            tcp(b"hello\rhello\rhello\rhello\rhello\rhello\r"),
            &["frames in a row are not readings: a value is not a number", "the last is `hello`"],
            &["without values", "the last is `hello`"],
        ),
        (
            "wrong baud rate",
            tcp(b"\xFE\x80\x07\xFF\xFE\x80\x07\xFF\xFE"),
            &["9 bytes without the end of a line: `\\xFE\\x80\\x07", "check the baud rate"],
            &["no line has ended yet: `\\xFE\\x80\\x07"],
        ),
        (
            "missing port",
            "serial:///dev/palpate-none".to_owned(),
            &["cannot open /dev/palpate-none"],
            &["cannot open /dev/palpate-none"],
        ),
        (
            "port of another program",
            format!("serial://{port}"),
            &["another program has it open"],
            &["another program has it open"],
        ),
        ("refusing broker", broker, &["refuses: NotAuthorized"], &["refuses: NotAuthorized"]),
        (
            "vanished channel",
            tcp(vanishing),
            &["191 frames in a row are not readings", "the last is `100.5,200.5,300.0`"],
            &[],
        ),
    ];
    let source = |(name, url, expected, on_page)| Source {
        had_readings: name == "vanished channel",
        name,
        url,
        expected,
        on_page,
    };
    all.into_iter().map(source).collect()
}

/// A folder with a rig and its locator.
fn bench() -> TempDir {
    let bench = folder(format!("{RIG}\n[training]\narrangement = \"even\"\ncount = 5\n"));
    fs::copy(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/field/base.csv"),
        bench.path().join("base.csv"),
    )
    .unwrap();
    said(&run(bench.path(), &["fit", "rig.toml", "--data", "base.csv", "-o", "locator.json"]));
    bench
}

/// Waits until the problem on a page has these words.
fn wait_for_problem(address: &str, path: &str, words: &[&str]) {
    wait_for_answer(address, path, |answer| {
        let problem = answer["problem"].as_str().unwrap_or_default();
        words.iter().all(|words| problem.contains(words))
    });
}

#[test]
fn every_command_says_why_its_source_brings_no_readings() {
    let bench = bench();
    let link = Link::open(&"pty".parse().unwrap()).unwrap();
    // Serial ports are locked as files are.
    let held = File::open(link.name()).unwrap();
    held.lock().unwrap();
    thread::scope(|scope| {
        for (number, source) in sources(link.name()).into_iter().enumerate() {
            let folder = bench.path();
            scope.spawn(move || check(folder, number, &source));
        }
    });
}

/// Checks every command with a source.
fn check(folder: &Path, number: usize, source: &Source) {
    let Source { name, url, expected, on_page, had_readings } = source;
    let files = ["mcap", "csv", "json"].map(|kind| format!("{number}.{kind}"));
    let [mcap, csv, json] = files.each_ref().map(String::as_str);
    let listen = ["--listen", "127.0.0.1:0"];
    let begin = |arguments: &[&str]| Attempt::begin(folder, arguments);
    let calibrate = ["--presses", csv, "--out", json];
    let mut in_words = vec![
        ("record", begin(&["record", "locator.json", "--from", url, "--out", mcap])),
        ("calibrate", begin(&[&["calibrate", "rig.toml", "--from", url][..], &calibrate].concat())),
        ("serve", begin(&[&["serve", "locator.json", "--from", url][..], &listen].concat())),
    ];
    let calibrating =
        [&["serve", "rig.toml", "--calibrate", "--from", url][..], &calibrate, &listen].concat();
    let mut on_pages = vec![("serve --calibrate", "/api/calibration", expected, begin(&calibrating))];
    if !had_readings {
        let bring_up = begin(&[&["serve", "--from", url][..], &listen].concat());
        on_pages.push(("serve --from", "/api/bring-up", on_page, bring_up));
    }
    for (_, attempt) in &mut in_words {
        attempt.wait_for(expected);
    }
    for (_, path, words, attempt) in &mut on_pages {
        let address = attempt.address();
        wait_for_problem(&address, path, words);
    }
    let of_page = on_pages.into_iter().map(|(command, _, words, attempt)| (command, *words, attempt));
    let of_words = in_words.into_iter().map(|(command, attempt)| (command, *expected, attempt));
    for (command, words, attempt) in of_words.chain(of_page) {
        // The readings of a page that has shown some are nobody's loss.
        let code = if *had_readings && command.starts_with("serve") { 130 } else { 3 };
        let (found, last) = attempt.interrupt();
        assert_eq!(found, Some(code), "{name}, {command}: {last}");
        if code == 3 {
            assert!(words.iter().all(|words| last.contains(words)), "{name}, {command}: {last}");
            assert!(last.lines().count() <= 3, "{name}, {command}: {last}");
        }
    }
    assert!(!folder.join(csv).exists() && !folder.join(json).exists(), "{name}");
}
