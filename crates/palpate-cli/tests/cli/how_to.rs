//! The code blocks of docs/how-to, docs/explanation and docs/reference: commands run, rigs are read, and C compiles. Python's blocks are in
//! python/tests/test_how_to.py, and Rust's is a documentation test of `palpate`.
#![cfg(unix)]

use std::cell::RefCell;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use palpate_testing::data;
use palpate_testing::skip::skip;
use tempfile::TempDir;
use toml_edit::{DocumentMut, Item};

use crate::support::attempt::{self, Attempt, wait_for_answer};
use crate::support::board::Board;
use crate::support::command::{Running, palpate, run, said};
use crate::support::examples::{NOISY_BEAM, PAPER, PLATE, SENSOR_KINDS_STUDY};
use crate::support::toml::Toml;
use crate::tutorials::{copy, words};

/// Pages that programs write, or that mkdocs fills.
const GENERATED: [&str; 3] = ["reference/commands.md", "reference/python.md", "reference/rig-keys.md"];

struct Block {
    language: String,
    text: String,
}

struct Page {
    name: String,
    blocks: Vec<Block>,
}

impl Page {
    fn blocks<'a>(&'a self, language: &'a str) -> impl Iterator<Item = &'a str> {
        self.blocks.iter().filter(move |block| block.language == language).map(|block| block.text.as_str())
    }
}

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn pages() -> Vec<Page> {
    let mut pages = Vec::new();
    for folder in ["how-to", "explanation", "reference"] {
        for entry in fs::read_dir(project().join("docs").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = format!("{folder}/{}", path.file_name().unwrap().to_str().unwrap());
            if !GENERATED.contains(&name.as_str()) {
                pages.push(Page { name, blocks: blocks(&fs::read_to_string(path).unwrap()) });
            }
        }
    }
    pages.sort_by(|a, b| a.name.cmp(&b.name));
    assert!(pages.len() > 40, "{}", pages.len());
    pages
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks = Vec::new();
    let mut open: Option<Block> = None;
    for line in page.lines() {
        match (line.trim_start().strip_prefix("```"), &mut open) {
            (Some(_), Some(_)) => blocks.extend(open.take()),
            (Some(language), None) => {
                open = Some(Block { language: language.to_owned(), text: String::new() });
            }
            (None, Some(block)) => block.text += &format!("{line}\n"),
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a block has no end");
    blocks
}

#[test]
fn every_block_is_in_a_language_that_is_checked() {
    for page in pages() {
        for block in &page.blocks {
            // A block without a language is an output or a line of a board.
            let is_checked = match block.language.as_str() {
                "" | "sh" | "toml" | "python" | "c" => true,
                "rust" => page.name == "reference/rust.md",
                _ => false,
            };
            assert!(is_checked, "{}: {}\n{}", page.name, block.language, block.text);
        }
    }
}

/// How to make a file that commands name: the command that writes it, whose own files are made first; without a command a
/// file of the project, or one that a block of the page contains.
const FILES: [(&str, &[&str]); 16] = [
    ("rig.toml", &["cp", "bench.toml", "rig.toml"]),
    ("presses.csv", &["simulate", "bench.toml", "-o", "presses.csv"]),
    ("begun.csv", &["simulate", "bench.toml", "-o", "begun.csv"]),
    ("recording.csv", &["simulate", "bench.toml", "-o", "recording.csv"]),
    ("readings.csv", &["simulate", "bench.toml", "--seed", "1", "-o", "readings.csv"]),
    ("touches.csv", &["simulate", "bench.toml", "--seed", "1", "-o", "touches.csv"]),
    ("untouched.csv", &["simulate", "bench.toml", "--seed", "2", "-o", "untouched.csv"]),
    ("locator.json", &["fit", "bench.toml", "-o", "locator.json"]),
    ("other.json", &["fit", "bench.toml", "--seed", "1", "-o", "other.json"]),
    ("board.json", &["fit", "bench.toml", "-o", "board.json"]),
    ("press.mcap", &["record", "locator.json", "--from", BOARD, "--duration", "1 s", "--out", "press.mcap"]),
    (
        "killed.mcap",
        &["record", "locator.json", "--from", BOARD, "--duration", "1 s", "--out", "killed.mcap"],
    ),
    ("coarse.toml", &[]),
    ("alarms.toml", &[]),
    ("machine.toml", &[]),
    ("examples/", &[]),
];
const BOARD: &str = "simulated:bench.toml?rate=500";

/// Parts of commands that need hardware, another host or a long time, and what stands for them.
const REPLACED: [(&str, &str); 11] = [
    ("serial:///dev/ttyACM0", "serial://FOLDER/ttyACM0"),
    ("192.168.1.5:8377", "127.0.0.1:0"),
    ("mqtt://user@host:1883/", "mqtt://user@127.0.0.1:1/"),
    ("mqtt://host/", "mqtt://127.0.0.1:1/"),
    ("--duration \"10 s\"", "--duration \"1 s\""),
    ("compare rig.toml", "compare rig.toml --only influence --only neighbours"),
    ("--counts 2..16", "--counts 2..3 --verify 1"),
    ("examples/paper.toml --count 5", "coarse.toml --count 2"),
    (
        "positions examples/training-positions.toml",
        "positions examples/training-positions.toml --count 4 SEARCH",
    ),
    ("--count 20 --repeats 5", "--count 20 --repeats 5 SEARCH"),
    ("SEARCH", "--trials 1 --calibrations 1 --verify 1"),
];

/// Why a command is not run; its options are checked instead.
fn exemption(words: &[String]) -> Option<&'static str> {
    let has = |word: &str| words.iter().any(|other| other == word);
    if has("…") {
        return Some("is a part of a command");
    }
    if has("--foxglove") || has("--ros") {
        return Some("needs a feature that takes minutes to compile");
    }
    match words[1].as_str() {
        "calibrate" => Some("needs a hand or a machine"),
        "simulated-board" if has("--stage") => Some("serves a calibration of 50 s"),
        "study" if has("paper") => Some("takes hours of a cluster"),
        "compare" if words[2].starts_with("examples/") => Some("takes minutes"),
        _ => None,
    }
}

/// Programs of other projects, whose lines are not checked.
const OTHERS: [&str; 3] = ["export", "ros2", "sbatch"];

/// A folder with the files of a page, which are made when a command first names them.
struct Bench<'a> {
    folder: TempDir,
    page: &'a Page,
    board: RefCell<Option<Running>>,
}

impl<'a> Bench<'a> {
    fn new(page: &'a Page) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let rig = match page.name.as_str() {
            // Raw channels whose offsets move.
            "how-to/tare.md" => fs::read_to_string(project().join("examples/real-strip.toml")).unwrap(),
            // A known force makes simulated calibrations cheap.
            "how-to/choose-where-to-press.md" => NOISY_BEAM.to_owned(),
            _ => beam(),
        };
        fs::write(folder.path().join("bench.toml"), rig).unwrap();
        Self { folder, page, board: RefCell::new(None) }
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Makes the files that a command names; those that it writes only where another command is to read them.
    fn make_inputs(&self, words: &[String]) {
        let is_output = |i: usize| i > 0 && ["-o", "--out"].contains(&words[i - 1].as_str());
        for (i, word) in words.iter().enumerate() {
            for (name, command) in FILES {
                if word.contains(name) && !is_output(i) && !self.path().join(name).exists() {
                    self.make(name, command);
                }
            }
        }
    }

    fn make(&self, name: &str, command: &[&str]) {
        let to = self.path().join(name);
        match command {
            [] if name.ends_with('/') => copy(&project().join(name), &to),
            [] if name == "coarse.toml" => {
                fs::write(to, format!("{PAPER}\n[design]\nsites = \"40 mm\"\n")).unwrap();
            }
            [] => {
                let block = self.page.blocks("toml").find(|block| block.starts_with(&format!("# {name}\n")));
                fs::write(to, block.unwrap_or_else(|| panic!("{}: no block is {name}", self.page.name)))
                    .unwrap();
            }
            ["cp", from, _] => {
                fs::copy(self.path().join(from), to).unwrap();
            }
            _ => {
                self.make_inputs(&command.iter().map(|&word| word.to_owned()).collect::<Vec<_>>());
                said(&run(self.path(), command));
            }
        }
    }

    /// Starts a board at a pseudo-terminal, `ttyACM0` in the folder.
    fn start_board(&self) {
        if self.board.borrow().is_none() {
            let port = self.path().join("ttyACM0");
            let mut board = palpate(self.path());
            board.args(["simulated-board", "bench.toml", "--rate", "200 Hz", "--to"]);
            board.arg(format!("pty:{}", port.display())).stderr(Stdio::null());
            *self.board.borrow_mut() = Some(Running(board.spawn().unwrap()));
            while !port.exists() {
                thread::sleep(Duration::from_millis(5));
            }
        }
    }

    /// Runs a command to its end, or until it has a reading.
    fn run(&self, line: &str) {
        let name = &self.page.name;
        let line = REPLACED.iter().fold(line.to_owned(), |line, (from, to)| line.replace(from, to));
        let line = line.replace("FOLDER", self.path().to_str().unwrap());
        let mut words = words(&line);
        if let Some(end) = words.iter().position(|word| word == ">") {
            words.truncate(end);
        }
        self.make_inputs(&words);
        if line.contains("/ttyACM0") {
            self.start_board();
        }
        let has = |word: &str| words.iter().any(|other| other == word);
        let mut arguments: Vec<&str> = words[1..].iter().map(String::as_str).collect();
        if arguments[0] == "record" && !has("--duration") {
            arguments.extend(["--duration", "1 s"]);
        }
        if arguments[0] == "serve" {
            let address = if has("--listen") { &[][..] } else { &["--listen", "127.0.0.1:0"] };
            let mut attempt = Attempt::begin(self.path(), &[&arguments, address].concat());
            if has("-") {
                attempt.address();
                return;
            }
            wait_for_reading(&mut attempt);
            let (code, stderr) = attempt.interrupt();
            assert_eq!(code, Some(130), "{name}: {line}\n{stderr}");
        } else if arguments[0] == "simulated-board" {
            Attempt::begin(self.path(), &arguments).wait_for(&["/dev/pts/"]);
        } else {
            let mut command = palpate(self.path());
            if has("-") {
                self.make_inputs(&["readings.csv".to_owned()]);
                command.stdin(File::open(self.path().join("readings.csv")).unwrap());
            }
            let output = command.args(&arguments).output().unwrap();
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{name}: {line}: {:?}\n{stderr}", output.status.code());
        }
    }
}

/// Waits until a server has a reading of its source.
fn wait_for_reading(attempt: &mut Attempt) {
    let address = attempt.address();
    let token = attempt.said().split_once("?token=").map(|(_, rest)| rest.split_whitespace().next().unwrap());
    let path = |request: &str| format!("/api/{request}?token={}", token.unwrap_or_default());
    // A board without a locator has no samples.
    let is_raw = attempt::get(&address, &path("bring-up"))["channels"].is_array();
    if is_raw {
        wait_for_answer(&address, &path("bring-up"), |answer| answer["rate_hz"].as_f64() > Some(0.0));
    } else {
        wait_for_answer(&address, &path("history"), |answer| answer["samples"][0].is_object());
    }
}

/// The founding paper's beam with an unknown force and few presses.
fn beam() -> String {
    let rig = Toml::parse(NOISY_BEAM).remove("contact").add("training.force", "3 N");
    rig.set("training.repeats", 2).to_string()
}

/// Checks that a verb has every option of a command, and that the project has every file that it names.
fn check_options(page: &Page, words: &[String]) {
    let line = words.join(" ");
    let verb: Vec<&str> =
        words[1..].iter().take(if words[1] == "design" { 2 } else { 1 }).map(String::as_str).collect();
    let help = said(&run(&project(), &[&verb[..], &["--help"]].concat()));
    for word in &words[1..] {
        if word.starts_with('-') && word.len() > 1 {
            let has_option = help.split_whitespace().any(|other| other.trim_end_matches(',') == word);
            assert!(has_option, "{}: no {word} in {line}", page.name);
        }
        let is_file = ["examples/", "studies/"].iter().any(|folder| word.starts_with(folder));
        assert!(!is_file || project().join(word).exists(), "{}: no {word}", page.name);
    }
}

/// Checks that the command has the features that a line of cargo names.
fn check_features(page: &Page, words: &[String]) {
    let manifest = include_str!("../../Cargo.toml");
    let (_, features) = manifest.split_once("[features]").unwrap();
    for pair in words.windows(2).filter(|pair| pair[0] == "--features") {
        assert!(features.contains(&format!("\n{} = ", pair[1])), "{}: no feature {}", page.name, pair[1]);
    }
}

fn check_line(bench: &Bench, line: &str) {
    let words = words(line);
    match words.first().map(String::as_str) {
        None => {}
        Some("palpate") => match exemption(&words) {
            Some(reason) => {
                eprintln!("not run, as it {reason}: {line}");
                check_options(bench.page, &words);
            }
            None => bench.run(line),
        },
        Some("cargo") => check_features(bench.page, &words),
        Some(other) => {
            let program = other.rsplit("$(").next().unwrap();
            assert!(OTHERS.contains(&program), "{}: neither run nor checked: {line}", bench.page.name);
            for inner in words.iter().filter(|word| word.starts_with("palpate ")) {
                check_line(bench, inner);
            }
        }
    }
}

fn check_commands(page: &Page) {
    let bench = Bench::new(page);
    for block in page.blocks("sh") {
        for line in block.replace("\\\n", " ").lines().filter(|line| !line.starts_with('#')) {
            if let Some((_, name)) = line.split_once("$PALPATE_DATA/") {
                let Some(path) = data::recording(name.split(' ').next().unwrap()) else { continue };
                let folder = path.ancestors().nth(2).unwrap().to_str().unwrap();
                check_line(&bench, &line.replace("$PALPATE_DATA", folder));
            } else {
                check_line(&bench, line);
            }
        }
    }
}

fn check_commands_of(folder: &str) {
    let pages = pages();
    for page in pages.iter().filter(|page| page.name.starts_with(folder)) {
        check_commands(page);
    }
}

#[test]
fn commands_of_how_to_pages_run() {
    check_commands_of("how-to/");
}

#[test]
fn commands_of_explanations_run() {
    check_commands_of("explanation/");
}

#[test]
fn commands_of_the_reference_run() {
    check_commands_of("reference/");
}

/// Commands that read a table of a rig, beside `inspect`.
fn readers(table: &str) -> &'static [&'static str] {
    match table {
        "surface" | "sensors" | "training" => &["limit", "rig.toml", "--force", "3 N"],
        "estimator" => &["fit", "rig.toml", "-o", "locator.json"],
        "load" => &["profile", "rig.toml"],
        "imperfections" => &["simulate", "rig.toml", "-o", "simulated.csv"],
        "design" => &["design", "sensors", "rig.toml", "--force", "3 N"],
        "recording" => &["inspect", "presses.csv", "--rig", "rig.toml"],
        "stage" => &["inspect", "rig.toml"],
        _ => panic!("no command is known to read [{table}]"),
    }
}

#[test]
fn toml_blocks_are_accepted() {
    for page in pages() {
        for block in page.blocks("toml") {
            let folder = tempfile::tempdir().unwrap();
            let document: DocumentMut =
                block.parse().unwrap_or_else(|error| panic!("{}: {error}", page.name));
            let mut commands = if document.contains_key("rule") {
                // Commands of the page read a file of rules.
                let name = block.lines().next().and_then(|line| line.strip_prefix("# ")).unwrap();
                assert!(page.blocks("sh").any(|block| block.contains(name)), "{}: {name}", page.name);
                Vec::new()
            } else if document.contains_key("arm") {
                let study = Toml::parse(SENSOR_KINDS_STUDY).remove("arm").to_string();
                fs::write(folder.path().join("study.toml"), merged(&study, &document)).unwrap();
                vec![&["study", "study.toml", "--seeds", "1"][..]]
            } else {
                write_rig(folder.path(), &page, &document);
                let has_model = !block.contains("kind = \"measured\"");
                let tables = document.iter().map(|(table, _)| table);
                tables.filter(|&table| has_model || table == "recording").map(readers).collect()
            };
            commands.dedup();
            for command in commands {
                let output = run(folder.path(), command);
                let stderr = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{}:\n{block}\n{command:?}: {stderr}", page.name);
            }
        }
    }
}

/// Writes the rig of a block, and presses where it has columns.
fn write_rig(folder: &Path, page: &Page, block: &DocumentMut) {
    let is_plate = block.get("surface").is_some_and(|surface| surface["kind"].as_str() == Some("plate"));
    let base = if is_plate || page.name == "explanation/plane.md" {
        PLATE.to_owned()
    } else if block.contains_key("recording") && !block.contains_key("surface") {
        // A strip with times, and a column for marks of untouched rows.
        let presses = fs::read_to_string(project().join("examples/data/strip-presses.csv")).unwrap();
        let mark = |(i, line): (usize, &str)| match i {
            0 => format!("{line}\n"),
            1 => format!("{line},idle\n"),
            _ => format!("{line},{}\n", u8::from(line.split(',').nth(2) == Some("0.00"))),
        };
        let marked: String = presses.lines().enumerate().map(mark).collect();
        fs::write(folder.join("presses.csv"), marked).unwrap();
        said(&run(folder, &["init", "presses.csv", "--untouched", "idle"]))
    } else {
        // No sensor is over the supports of another beam, at 1/3 and 2/3 of its length.
        Toml::parse(&beam()).set("sensors.count", 7).to_string()
    };
    if block.contains_key("recording") && block.contains_key("surface") {
        fs::write(folder.join("presses.csv"), Board::new(1).calibration(30)).unwrap();
    }
    let rig = merged(&base, block);
    fs::write(folder.join("rig.toml"), rig).unwrap();
}

/// A file with the tables of a block in place of its own; keys of [recording] replace single ones.
fn merged(base: &str, block: &DocumentMut) -> String {
    let mut base: DocumentMut = base.parse().unwrap();
    // A surface with its sensors is a rig, if perhaps without presses.
    if block.contains_key("surface") && block.contains_key("sensors") {
        base.retain(|name, _| name == "training");
    }
    for (name, item) in block.iter() {
        match (base.get_mut(name).and_then(Item::as_table_mut), item.as_table()) {
            (Some(old), Some(new)) if name == "recording" => {
                new.iter().for_each(|(key, item)| drop(old.insert(key, item.clone())));
            }
            _ => {
                base.insert(name, item.clone());
            }
        }
    }
    base.to_string()
}

#[test]
fn c_blocks_compile() {
    for page in pages() {
        for block in page.blocks("c") {
            let (includes, body): (Vec<_>, Vec<_>) =
                block.lines().map(str::trim).partition(|line| line.starts_with('#'));
            // The names that are a board's own.
            let source = format!(
                "{}\nuint32_t micros(void);\nvoid uart_write(const uint8_t *, size_t);\n\
                 void send(const float *values)\n{{\nstatic uint32_t sequence;\n{}\n}}\n",
                includes.join("\n"),
                body.join("\n")
            );
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("block.c");
            fs::write(&file, source).unwrap();
            let mut compiler = Command::new("cc");
            compiler.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only", "-I"]);
            compiler.arg(project().join("examples/firmware")).arg(&file);
            let Ok(output) = compiler.output() else {
                skip("a C compiler", "install gcc or clang");
                return;
            };
            assert!(output.status.success(), "{}: {}", page.name, String::from_utf8_lossy(&output.stderr));
        }
    }
}
