//! Completion scripts and manual pages.

use crate::support::command::{complained, run, said};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Words that complete verbs and options, in every script.
const WORDS: [&str; 4] = ["simulated-board", "completions", "memory-limit", "unknown-force"];

fn script(shell: &str) -> String {
    said(&run(Path::new("."), &["completions", shell]))
}

/// Output of a program, if this machine has it.
fn output_of(program: &str, arguments: &[&str]) -> Option<std::process::Output> {
    Command::new(program).args(arguments).output().ok()
}

#[test]
fn scripts_complete_verbs_and_options() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = script(shell);
        for word in WORDS {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let complaint = complained(&run(Path::new("."), &["completions", "tcsh"]), 2);
    assert!(complaint.contains("bash, elvish, fish, powershell, zsh"), "{complaint}");
}

#[test]
fn bash_completes_a_verb_and_an_option() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("palpate.bash");
    fs::write(&path, script("bash")).unwrap();
    let complete = |words: &str, count: usize| {
        let line = format!(
            "source {}; COMP_WORDS=({words}); COMP_CWORD={count}; _palpate palpate \"${{COMP_WORDS[{count}]}}\" x; echo \"${{COMPREPLY[*]}}\"",
            path.display()
        );
        let output = output_of("bash", &["-c", &line])?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Some(String::from_utf8(output.stdout).unwrap())
    };
    let Some(verbs) = complete("palpate loc", 1) else { return println!("skipped: no bash") };
    assert_eq!(verbs.trim(), "locate");
    assert_eq!(complete("palpate limit --unk", 2).unwrap().trim(), "--unknown-force");
}

#[test]
fn every_verb_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let told = said(&run(folder.path(), &["man", "-o", "man1"]));
    let mut names: Vec<String> = fs::read_dir(folder.path().join("man1"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    insta::assert_snapshot!(names.join("\n"));
    assert_eq!(told, format!("{} manual pages: man1\n", names.len()));
    for name in &names {
        let page = fs::read_to_string(folder.path().join("man1").join(name)).unwrap();
        let title = name.trim_end_matches(".1");
        assert!(page.contains(&format!(".TH {title} 1")), "{name}");
        assert!(page.contains("Examples:"), "{name}");
        let path = folder.path().join("man1").join(name);
        if let Some(checked) =
            output_of("man", &["--warnings", "-E", "UTF-8", "-l", "-Tutf8", path.to_str().unwrap()])
        {
            let warnings = String::from_utf8_lossy(&checked.stderr);
            assert!(checked.status.success() && warnings.is_empty(), "{name}: {warnings}");
        }
    }
}
