//! `cargo xtask rig-keys`: docs/reference/rig-keys.md from the types of rig and study files.
//!
//! Keys are fields of structs, words are variants of enums; their doc comments are the
//! explanations.

mod page;
mod source;

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

const PAGE: &str = "docs/reference/rig-keys.md";

pub fn run(root: &Path) -> Result<bool> {
    let page = page::page(root)?;
    fs::write(root.join(PAGE), page).with_context(|| format!("cannot write {PAGE}"))?;
    println!("wrote {PAGE}");
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn root() -> &'static Path {
        Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
    }

    #[test]
    fn the_page_is_that_of_the_types() {
        let written = fs::read_to_string(root().join(PAGE)).unwrap();
        let page = page::page(root()).unwrap();
        assert!(written == page, "{PAGE} is stale: run `cargo xtask rig-keys`");
    }

    #[test]
    fn every_key_is_explained_on_the_page() {
        let types = source::Types::read(root()).unwrap();
        let page = page::page(root()).unwrap();
        let mut keys = 0;
        for item in types.of_rig() {
            for field in item.fields() {
                assert!(!field.docs.is_empty(), "{}: `{}` has no doc comment", item.name, field.name);
                let (key, (meaning, _)) = (page::key(field), page::split_default(&field.docs));
                let explains =
                    |line: &str| line.starts_with(&format!("| `{key}` |")) && line.contains(&meaning);
                assert!(page.lines().any(explains), "{}: `{key}`", item.name);
                keys += 1;
            }
        }
        assert!(keys > 100, "{keys} keys");
        // The name of an unresolved type would be in the cell.
        let value = |line: &str| line.split(" | ").nth(1).unwrap_or_default().to_owned();
        let unknown = page.lines().find(|line| value(line).starts_with(char::is_uppercase));
        assert_eq!(unknown, None);
    }
}
