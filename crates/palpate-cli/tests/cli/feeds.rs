//! Feeds that bring no readings, and recordings of other writers: exit codes and messages.

use crate::support::command::{complained, palpate, run, said};
use serde_json::Value;
use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::sync::LazyLock;
use tempfile::TempDir;

/// A file of the folder of recordings from other benches and writers.
fn field(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/field").join(name)
}

/// The bytes of a recording that another writer wrote, which is kept as hexadecimal digits.
fn recording_of_another_writer(name: &str) -> Vec<u8> {
    let text = fs::read_to_string(field(&format!("{name}.hex"))).unwrap();
    let digits: Vec<u8> =
        text.bytes().filter_map(|byte| char::from(byte).to_digit(16)).map(|digit| digit as u8).collect();
    digits.chunks(2).map(|pair| pair[0] << 4 | pair[1]).collect()
}

/// A folder with the locator of a strip of 100 mm with the channels S1 to S4.
static BENCH: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    for name in ["base.toml", "base.csv"] {
        fs::copy(field(name), folder.path().join(name)).unwrap();
    }
    said(&run(folder.path(), &["fit", "base.toml", "--data", "base.csv", "-o", "locator.json"]));
    folder
});

/// The output of a command that reads these bytes.
fn run_with(arguments: &[&str], input: &[u8]) -> Output {
    let mut command = palpate(BENCH.path());
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // A command that has ended reads no more.
    let _ = child.stdin.take().unwrap().write_all(input);
    child.wait_with_output().unwrap()
}

fn record(name: &str, input: &[u8]) -> Output {
    let _ = fs::remove_file(BENCH.path().join(name));
    run_with(&["record", "locator.json", "--from", "-", "--out", name, "--json"], input)
}

fn record_from(name: &str, url: &str) -> String {
    let arguments = ["record", "locator.json", "--from", url, "--out", name, "--duration", "0.3 s"];
    complained(&run(BENCH.path(), &arguments), 3)
}

const READING: &str = "100.5,200.5,300.0,399.7\n";

#[test]
fn a_session_without_a_reading_fails_with_the_cause_and_the_last_line() {
    let cases: [(&[u8], &[&str]); 6] = [
        (b"", &["there was no reading: the source ended"]),
        (
            b"hello\n",
            &[
                "1 frame is not a reading: a value is not a number; the last is `hello`; print a decimal number",
            ],
        ),
        (b"1,2,3\n", &["another number of values", "the last is `1,2,3`", "columns="]),
        (b"S1:1,S2:2,S3:3,X:4\n", &["a channel is missing", "the last is `S1:1,S2:2,S3:3,X:4`"]),
        (b"\x80\xFE\x07\xFF", &["not text", "the last is `\\x80\\xFE\\x07\\xFF`", "check the baud rate"]),
        (b"nan,1,2,3\nnan,1,2,3\n", &["a value is not a number", "the last is `nan,1,2,3`"]),
    ];
    for (i, (input, expected)) in cases.into_iter().enumerate() {
        let said = complained(&record(&format!("none-{i}.mcap"), input), 3);
        assert!(expected.iter().all(|words| said.contains(words)), "{expected:?}: {said}");
        assert!(said.trim().lines().count() <= 3, "{said}");
    }
    assert!(
        record_from("missing.mcap", "serial:///dev/palpate-none").contains("cannot open /dev/palpate-none")
    );
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let silent = record_from("silent.mcap", &format!("tcp://{}", server.local_addr().unwrap()));
    assert!(silent.contains("sends no data; check that the board is on"), "{silent}");
}

#[test]
fn a_channel_that_vanishes_midway_is_an_event_and_a_failure() {
    let input = [READING.repeat(50), "100.5,200.5,300.0\n".repeat(191)].concat();
    let output = record("vanishes.mcap", input.as_bytes());
    let said = complained(&output, 3);
    assert!(said.contains("the readings ended early: 191 frames in a row are not readings"), "{said}");
    assert!(said.contains("the last is `100.5,200.5,300.0`"), "{said}");
    let lines = String::from_utf8(output.stdout).unwrap();
    let objects = lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let troubles: Vec<Value> = objects.filter(|object| object["event"] == "trouble").collect();
    assert_eq!(troubles.len(), 1, "{troubles:?}");
    assert!(troubles[0]["text"].as_str().unwrap().contains("no readings: 191 frames"), "{troubles:?}");
    // A torn line now and then is none.
    let torn = [READING, "100.5,2\n", READING].concat();
    said_ok(&record("torn.mcap", torn.as_bytes()));
}

fn said_ok(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn lines_that_end_at_carriage_returns_are_read() {
    let recorded = record("cr.mcap", READING.replace('\n', "\r").repeat(20).as_bytes());
    said_ok(&recorded);
    assert!(String::from_utf8_lossy(&recorded.stderr).contains("20 readings"), "{recorded:?}");
    let file = fs::read(field("cr.csv")).unwrap();
    let located = said(&run_with(&["locate", "locator.json", "-"], &file));
    assert_eq!(located.lines().count(), 70, "{located}");
    assert_eq!(
        located,
        said(&run(BENCH.path(), &["locate", "locator.json", field("cr.csv").to_str().unwrap()]))
    );
    let mixed = String::from_utf8(file).unwrap().replace('\r', "\r\n");
    assert_eq!(said(&run_with(&["locate", "locator.json", "-"], mixed.as_bytes())), located);
    let none = complained(&run_with(&["locate", "locator.json", "-"], b"S1,S2,S3,S4\n"), 3);
    assert!(none.contains("a header and no reading"), "{none}");
}

#[test]
fn piped_readings_have_the_times_of_the_board() {
    let lines: String =
        (0..500).map(|i| format!("ms:{},S1:100,S2:200,S3:300,S4:40{}\n", 20 * i, i % 3)).collect();
    let output = record("piped.mcap", lines.as_bytes());
    said_ok(&output);
    let summary = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(summary.contains("500 readings in 10.0 s"), "{summary}");
}

#[test]
fn recordings_of_other_writers_are_replayed() {
    for name in ["zstd.mcap", "nochunk.mcap"] {
        fs::write(BENCH.path().join(name), recording_of_another_writer(name)).unwrap();
        let output = run(BENCH.path(), &["replay", name]);
        assert_eq!(said(&output).lines().count(), 60, "{name}");
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            words.contains("59 estimates, each equal to the recorded one to the last bit"),
            "{name}: {words}"
        );
    }
}

#[test]
fn blocks_that_cannot_be_read_are_counted_with_the_fault() {
    let bytes = recording_of_another_writer("zstd.mcap");
    let at = bytes.windows(4).position(|window| window == b"zstd").unwrap();
    let path = BENCH.path().join("other.mcap");
    let replay = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        run(BENCH.path(), &["replay", "other.mcap"])
    };
    let mut unknown = bytes.clone();
    unknown[at..at + 4].copy_from_slice(b"brot");
    let said = complained(&replay(&unknown), 3);
    assert!(
        said.contains("it contains no estimate") && said.contains("compression `brot` is unknown"),
        "{said}"
    );
    assert!(said.contains("1 blocks cannot be read"), "{said}");
    // The checksum stands before the length and the name of the compression.
    let mut checksum = bytes.clone();
    checksum[at - 8] ^= 1;
    let said = complained(&replay(&checksum), 3);
    assert!(said.contains("its checksum does not match its bytes"), "{said}");
    let mut damaged = bytes;
    damaged[at + 40..at + 60].fill(0xFF);
    complained(&replay(&damaged), 3);
    // Of messages outside chunks the checksum is that of the file, in the record before the summary; 0 stands for none.
    let mut loose = recording_of_another_writer("nochunk.mcap");
    let end = loose.windows(9).rposition(|window| window == [0x0F, 4, 0, 0, 0, 0, 0, 0, 0]).unwrap();
    loose[end + 9..end + 13].copy_from_slice(&0xE13C_A399_u32.to_le_bytes());
    said_ok(&replay(&loose));
    loose[end + 9] ^= 1;
    let said = complained(&replay(&loose), 3);
    assert!(said.contains("its bytes do not match its checksum"), "{said}");
    let said = complained(&replay(b"S1,S2,S3,S4\n1,2,3,4\n"), 2);
    assert!(said.contains("is not an MCAP file"), "{said}");
}

#[test]
fn a_recording_that_was_killed_is_recovered() {
    said_ok(&record("long.mcap", READING.repeat(5000).as_bytes()));
    let bytes = fs::read(BENCH.path().join("long.mcap")).unwrap();
    fs::write(BENCH.path().join("killed.mcap"), &bytes[..bytes.len() * 3 / 4]).unwrap();
    let recovered = said(&run(BENCH.path(), &["recover", "killed.mcap", "-o", "recovered.mcap"]));
    let replayed = |name: &str| {
        let output = run(BENCH.path(), &["replay", name]);
        (said(&output), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (before, words) = replayed("killed.mcap");
    assert!(words.contains("was cut off"), "{words}");
    let (after, words) = replayed("recovered.mcap");
    assert_eq!(before, after);
    let count = after.lines().count() - 1;
    assert!(
        count > 1000 && words.starts_with(&format!("{},{:03} estimates", count / 1000, count % 1000)),
        "{words}"
    );
    // The end may cut a reading off from its estimate.
    let is_recovered =
        |readings: usize| recovered.contains(&format!("{},{:03} readings", readings / 1000, readings % 1000));
    assert!(is_recovered(count) || is_recovered(count + 1), "{recovered} {count}");
    // A summary at the end: a footer that says where it begins.
    let bytes = fs::read(BENCH.path().join("recovered.mcap")).unwrap();
    let footer = &bytes[bytes.len() - 8 - 20..];
    assert!(u64::from_le_bytes(footer[..8].try_into().unwrap()) > 0);
    let refused = complained(&run(BENCH.path(), &["recover", "killed.mcap", "-o", "recovered.mcap"]), 2);
    assert!(refused.contains("exists already"), "{refused}");
}

#[test]
fn passwords_are_in_no_message() {
    for url in
        ["mqtt://me:hunter2@h/a/#/b", "mqtt://me:hun/ter2@h/a", "ftp://me:hunter2@h", "mqtt://me:hunter2@"]
    {
        for option in ["--from", "--mqtt"] {
            let from = if option == "--from" { &[][..] } else { &["--from", "-"] };
            let arguments = [&["record", "locator.json", "--out", "never.mcap", option, url], from].concat();
            let said = complained(&run(BENCH.path(), &arguments), 2);
            assert!(!said.contains("ter2"), "{said}");
        }
    }
    let said = record_from("refused.mcap", "mqtt://me:hunter2@127.0.0.1:1/a");
    assert!(!said.contains("hunter2") && said.contains("127.0.0.1:1 cannot be reached"), "{said}");
    let bytes = fs::read(BENCH.path().join("refused.mcap")).unwrap();
    assert!(!bytes.windows(7).any(|window| window == b"hunter2"));
}

#[test]
fn calibration_without_a_press_is_reported() {
    let rig = fs::read_to_string(field("base.toml")).unwrap();
    let rig = format!("{rig}\n[training]\narrangement = \"even\"\ncount = 5\n");
    fs::write(BENCH.path().join("training.toml"), rig).unwrap();
    let calibrate =
        ["calibrate", "training.toml", "--from", "-", "--presses", "cal.csv", "--out", "cal.json"];
    let said = complained(&run_with(&calibrate, READING.repeat(3).as_bytes()), 3);
    assert!(said.contains("no press is recorded"), "{said}");
    assert!(!said.contains("cannot read cal.csv"), "{said}");
}
