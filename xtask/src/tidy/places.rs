//! Rule: files name only paths of every machine, and intended hosts.

use super::Finding;
use super::project::{File, Project};

/// First folders of paths on every Unix machine, of the live server's requests and of ROS topics.
const EVERYWHERE: [&str; 6] = ["api", "dev", "etc", "palpate", "proc", "usr"];

/// Hosts for readers, of formats or licences, and of public recordings.
const HOSTS: [&str; 9] = [
    "127.0.0.1",
    "creativecommons.org",
    "doi.org",
    "example.org",
    "github.com",
    "raw.githubusercontent.com",
    "schemas.openxmlformats.org",
    "www.apache.org",
    "www.w3.org",
];

/// Files of package managers, which name registries.
const LOCKS: [&str; 3] = ["Cargo.lock", "package-lock.json", "uv.lock"];

pub fn findings(project: &Project) -> Vec<Finding> {
    project.files.iter().filter(|file| !file.is_a_rule()).flat_map(of_file).collect()
}

fn of_file(file: &File) -> Vec<Finding> {
    let name = file.path.rsplit('/').next().unwrap_or_default();
    let (is_lock, holds_patterns) = (LOCKS.contains(&name), name == ".gitignore");
    let mut found = Vec::new();
    for (number, line) in file.text().lines().enumerate() {
        let mut add = |message: String| found.push(Finding::new(&file.path, number + 1, message));
        for path in own_paths(line).filter(|_| !holds_patterns) {
            add(format!("/{path}/… is a path of one machine: make it relative, or an argument"));
        }
        for host in hosts(line).filter(|host| !is_lock && !HOSTS.contains(host)) {
            add(format!("{host} is not a host that the project names: name the package or the DOI instead"));
        }
    }
    found
}

/// First folders of other absolute paths.
fn own_paths(line: &str) -> impl Iterator<Item = &str> {
    line.match_indices('/').filter_map(|(at, _)| {
        let before = line[..at].chars().next_back();
        let begins_a_word = before.is_none_or(|it| it.is_whitespace() || "\"'`(=:".contains(it));
        let (folder, rest) = line[at + 1..].split_once('/')?;
        let names_a_folder = !folder.is_empty()
            && folder.chars().all(|it| it.is_ascii_alphanumeric() || it == '_')
            && rest.starts_with(|it: char| it.is_ascii_alphanumeric());
        (begins_a_word && names_a_folder && !EVERYWHERE.contains(&folder)).then_some(folder)
    })
}

fn hosts(line: &str) -> impl Iterator<Item = &str> {
    let after = line
        .match_indices("://")
        .filter(|(at, _)| line[..*at].ends_with("http") || line[..*at].ends_with("https"));
    after.filter_map(|(at, mark)| {
        let host = line[at + mark.len()..]
            .split(|it: char| !(it.is_ascii_alphanumeric() || ".-".contains(it)))
            .next()?;
        let host = host.trim_end_matches('.');
        host.contains('.').then_some(host)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        findings(&Project::from_files(&[(path, text)])).into_iter().map(|finding| finding.line).collect()
    }

    #[test]
    fn machine_paths_and_hosts_are_found() {
        let text =
            "see /srv/main\ncd \"/mine/x\"\n(/home/jane/x)\nfine\n/data/a\nhttps://packages.example/simple";
        assert_eq!(lines("docs/a.md", text), [1, 2, 3, 5, 6]);
    }

    #[test]
    fn relative_paths_addresses_locks_and_the_rules_are_clean() {
        let text =
            "docs/sub/a ../root/b example.org/home/jane /home/$USER /usr/bin/env https://doi.org/10.1/2";
        assert!(lines("docs/a.md", text).is_empty());
        assert!(lines("fuzz/Cargo.lock", "https://packages.example").is_empty());
        assert!(lines(".gitignore", "/fuzz/target").is_empty());
        assert!(lines("xtask/src/tidy/places.rs", "/srv/a").is_empty());
    }
}
