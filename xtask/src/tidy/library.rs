//! The library takes its randomness, time and bytes as arguments: no clock, no files, no network, no terminal.

use super::Finding;
use super::project::{File, Project};
use super::rust_text::RustText;
use super::used_paths::{used_macros, used_paths};

/// Parts of the standard library that reach out of the process.
const OUTSIDE: [&[&str]; 9] = [
    &["std", "fs"],
    &["std", "net"],
    &["std", "process"],
    &["std", "env"],
    &["std", "time", "Instant"],
    &["std", "time", "SystemTime"],
    &["std", "io", "stdin"],
    &["std", "io", "stdout"],
    &["std", "io", "stderr"],
];

const PRINTING: [&str; 4] = ["print", "println", "eprint", "eprintln"];

const CRATES: [&str; 2] = ["crates/palpate/src/", "crates/palpate-core/src/"];

/// A use of the outside in `palpate` or `palpate-core`, but for tests.
pub fn findings(project: &Project) -> Vec<Finding> {
    let library = project
        .rust()
        .filter(|file| !file.is_test() && CRATES.iter().any(|folder| file.path.starts_with(folder)));
    library.flat_map(of_file).collect()
}

fn of_file(file: &File) -> Vec<Finding> {
    let code = RustText::of(&file.text()).code_without_tests();
    let paths = used_paths(&code).into_iter().filter(|path| reaches_out(&path.segments)).map(|path| {
        let message = format!("{} in the library: take it as an argument", path.segments.join("::"));
        Finding::failure(&file.path, path.line, message)
    });
    let printed = used_macros(&code).into_iter().filter(|(_, name)| PRINTING.contains(&name.as_str()));
    let printed = printed.map(|(line, name)| {
        Finding::failure(
            &file.path,
            line,
            format!("{name}! in the library: return it, and let the command print"),
        )
    });
    paths.chain(printed).collect()
}

/// The path names one of the parts, something in it, or a whole module from which the part can be reached.
fn reaches_out(segments: &[String]) -> bool {
    let segments: Vec<&str> =
        segments.iter().map(String::as_str).filter(|segment| *segment != "self").collect();
    let whole = |part: &[&str]| matches!(segments.as_slice(), ["std", module] | ["std", module, "*"] if part[1] == *module && *module != "io");
    OUTSIDE.iter().any(|part| segments.starts_with(part) || whole(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        findings(&Project::of(&[(path, text)])).into_iter().map(|finding| finding.line).collect()
    }

    #[test]
    fn clocks_files_and_prints_are_found() {
        let text = "use std::{fs, io::Write};\nlet t = std::time::Instant::now();\nprintln!(\"\");\nuse std::time;\nuse std::io::{self, stdout};";
        assert_eq!(lines("crates/palpate/src/rig.rs", text), [1, 2, 4, 5, 3]);
    }

    #[test]
    fn durations_readers_tests_and_the_command_are_clean() {
        let text = "use std::time::Duration;\nuse std::io::{self, Read};\n/// println!(\"\")\n#[cfg(test)]\nmod tests { use std::fs; }";
        assert!(lines("crates/palpate/src/rig.rs", text).is_empty());
        assert!(lines("crates/palpate/src/report/tests.rs", "use std::fs;").is_empty());
        assert!(lines("crates/palpate-cli/src/main.rs", "use std::fs;").is_empty());
    }
}
