//! docs/reference/commands.md is the help of every command. `cargo xtask cli-reference` writes it.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::support::command::run;

/// The page, from the project's root.
const PAGE: &str = "docs/reference/commands.md";

/// With this environment variable the test writes the page in place of comparing it.
const WRITE: &str = "PALPATE_WRITE_REFERENCE";

const HEAD: &str = "# Commands

`palpate VERB --help` prints these texts. [Behaviour of the command line](command-line.md) describes outputs, streams and exit codes, which all verbs share.

`cargo xtask cli-reference` writes this page from the help of every command; a test compares the two.
";

#[test]
fn the_page_of_commands_is_the_help_of_every_command() {
    let mut page = HEAD.to_owned();
    describe(&[], &mut page);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(PAGE);
    if std::env::var_os(WRITE).is_some() {
        fs::write(&path, page).unwrap();
        return;
    }
    let written = fs::read_to_string(&path).unwrap();
    assert!(written == page, "{PAGE} is stale: run `cargo xtask cli-reference`");
    // A help that could not be read would leave a short page.
    for row in ["## palpate fit", "## palpate design sensors", "| `--memory-limit <SIZE>` |", "| `<RIG>` |"] {
        assert!(page.contains(row), "{row}");
    }
}

/// Appends a command and its subcommands.
fn describe(command: &[String], page: &mut String) {
    let help = Help::of(command);
    if !command.is_empty() {
        let name = format!("palpate {}", command.join(" "));
        let _ = write!(page, "\n## {name}\n\n{}\n", escaped(&help.about));
        let _ = write!(page, "\n```text\n{}\n```\n", help.usage);
    }
    for (title, entries) in &help.sections {
        if title == "Commands" {
            continue;
        }
        let rows: Vec<_> = entries.iter().filter(|(term, _)| !is_common(term)).collect();
        if rows.is_empty() {
            continue;
        }
        let _ = write!(page, "\n| {} | meaning |\n|---|---|\n", title.to_lowercase().trim_end_matches('s'));
        for (term, meaning) in rows {
            let _ = writeln!(page, "| `{}` | {} |", term.replace('|', "\\|"), cell(meaning));
        }
    }
    for (verb, _) in
        help.sections.iter().find(|(title, _)| title == "Commands").map_or(&[][..], |found| &found.1)
    {
        if verb != "help" {
            describe(&[command, std::slice::from_ref(verb)].concat(), page);
        }
    }
}

fn is_common(term: &str) -> bool {
    ["-h, --help", "-V, --version"].contains(&term)
}

/// The help of a command: description, usage, and terms with their meanings by section.
struct Help {
    about: String,
    usage: String,
    sections: Vec<(String, Vec<(String, String)>)>,
}

impl Help {
    fn of(command: &[String]) -> Self {
        let arguments: Vec<&str> = command.iter().map(String::as_str).chain(["--help"]).collect();
        let output = run(Path::new("."), &arguments);
        assert!(output.status.success(), "{arguments:?}");
        Self::read(&String::from_utf8(output.stdout).unwrap())
    }

    fn read(text: &str) -> Self {
        let (about, rest) = text.split_once("Usage: ").expect("a help has a usage");
        let (usage, rest) = rest.split_once('\n').unwrap_or((rest, ""));
        let mut sections: Vec<(String, Vec<(String, String)>)> = Vec::new();
        for line in rest.lines().filter(|line| !line.trim().is_empty()) {
            if let Some(title) = line.strip_suffix(':').filter(|title| !title.starts_with(' ')) {
                sections.push((title.to_owned(), Vec::new()));
                continue;
            }
            let Some((_, entries)) = sections.last_mut() else { continue };
            let indent = line.len() - line.trim_start().len();
            let line = line.trim();
            match entries.last_mut() {
                Some((_, meaning)) if indent > 6 => {
                    meaning.push(' ');
                    meaning.push_str(line);
                }
                _ => {
                    let (term, meaning) = line.split_once("  ").unwrap_or((line, ""));
                    entries.push((term.to_owned(), meaning.trim().to_owned()));
                }
            }
        }
        Self { about: about.trim().to_owned(), usage: usage.trim().to_owned(), sections }
    }
}

/// Text of a cell of a table.
fn cell(text: &str) -> String {
    escaped(text.trim()).replace('|', "\\|")
}

/// Text that Markdown leaves as it is, outside of code.
fn escaped(text: &str) -> String {
    let parts = text.split('`').enumerate().map(|(i, part)| {
        if i % 2 == 1 {
            part.to_owned()
        } else {
            part.replace('<', "&lt;").replace('*', "\\*").replace('[', "\\[")
        }
    });
    parts.collect::<Vec<_>>().join("`")
}

#[test]
fn a_help_is_read_in_both_of_its_forms() {
    let help = Help::read(
        "About `x`.\n\nUsage: palpate x [OPTIONS]\n\nArguments:\n  <RIG>  The rig\n\nOptions:\n  -o, --out <A|B>\n          Where\n          to write\n",
    );
    let sections: BTreeMap<_, _> = help.sections.into_iter().collect();
    assert_eq!((help.about.as_str(), help.usage.as_str()), ("About `x`.", "palpate x [OPTIONS]"));
    assert_eq!(sections["Arguments"], [("<RIG>".to_owned(), "The rig".to_owned())]);
    assert_eq!(sections["Options"], [("-o, --out <A|B>".to_owned(), " Where to write".to_owned())]);
    assert_eq!(cell(" a < [b] `c|<d>` "), "a &lt; \\[b] `c\\|<d>`");
}
