//! Nothing in the project names a place on somebody's machine, or a package registry's host.

use super::Finding;
use super::project::{File, Project};

/// Beginnings of paths that only one machine has.
const PATHS: [&str; 4] = ["/work/", "/root/", "/home/", "/farm/"];

const HOSTS: [&str; 7] = [
    "static.crates.io",
    "index.crates.io",
    "registry.npmjs.org",
    "pypi.org",
    "files.pythonhosted.org",
    "deb.debian.org",
    "proxy.golang.org",
];

/// Files that package managers write, which name the registries they use.
const LOCKS: [&str; 3] = ["Cargo.lock", "package-lock.json", "uv.lock"];

/// A machine's path in any file, and a registry's host outside lock files.
pub fn findings(project: &Project) -> Vec<Finding> {
    project.files.iter().filter(|file| !file.is_a_rule()).flat_map(of_file).collect()
}

fn of_file(file: &File) -> Vec<Finding> {
    let is_lock = LOCKS.iter().any(|name| file.path.rsplit('/').next() == Some(name));
    let mut found = Vec::new();
    for (number, line) in file.text().lines().enumerate() {
        let mut add = |message: String| found.push(Finding::failure(&file.path, number + 1, message));
        for path in PATHS.into_iter().filter(|path| names_path(line, path)) {
            add(format!("{path}… is a path of one machine: make it relative, or an argument"));
        }
        for host in HOSTS.into_iter().filter(|host| !is_lock && line.contains(host)) {
            add(format!("{host} is a registry's host: name the package instead"));
        }
    }
    found
}

/// The path stands at the head of a word, as against inside a longer path or an address, and goes on after its slash.
fn names_path(line: &str, path: &str) -> bool {
    line.match_indices(path).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = line[at + path.len()..].chars().next();
        !before.is_some_and(|it| it.is_alphanumeric() || "._-/}*".contains(it))
            && (path != "/home/" || after.is_some_and(char::is_alphanumeric))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        findings(&Project::of(&[(path, text)])).into_iter().map(|finding| finding.line).collect()
    }

    #[test]
    fn machine_paths_and_hosts_are_found() {
        let text = "see /work/main\ncd \"/root/x\"\n(/home/jane/x)\nfine\n/farm/a\nhttps://pypi.org/simple";
        assert_eq!(lines("docs/a.md", text), [1, 2, 3, 5, 6]);
    }

    #[test]
    fn relative_paths_addresses_locks_and_the_rules_are_clean() {
        assert!(
            lines("docs/a.md", "docs/work/a ../root/b example.org/home/jane /home/$USER /workshop/")
                .is_empty()
        );
        assert!(lines("fuzz/Cargo.lock", "https://index.crates.io").is_empty());
        assert!(lines("xtask/src/tidy/places.rs", "/work/").is_empty());
    }
}
