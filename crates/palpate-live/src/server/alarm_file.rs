//! The file that stores alarms between runs of the server.

use palpate_files as whole_file;
use std::io::{ErrorKind, Result};
use std::path::{Path, PathBuf};

/// File with the alarms that browsers set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlarmFile(PathBuf);

impl AlarmFile {
    /// The file beside a locator or a rig: `strip.alarms.toml` beside `strip.json`.
    pub fn beside(path: &Path) -> Self {
        Self(path.with_extension("alarms.toml"))
    }

    /// The file in a folder of recordings: `alarms.toml`.
    pub fn in_folder(folder: &Path) -> Self {
        Self(folder.join("alarms.toml"))
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// The text of the file; empty if the file does not exist.
    ///
    /// # Errors
    /// The file cannot be read, or is not text.
    pub fn read(&self) -> Result<String> {
        match std::fs::read_to_string(&self.0) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(String::new()),
            text => text,
        }
    }

    /// Writes the whole file; removes it for a text without rules.
    ///
    /// # Errors
    /// The folder does not accept the file, or the file cannot be removed.
    pub fn write(&self, text: &str) -> Result<()> {
        if text.trim().is_empty() {
            return match std::fs::remove_file(&self.0) {
                Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
                _ => Ok(()),
            };
        }
        if let Some(folder) = self.0.parent() {
            std::fs::create_dir_all(folder)?;
        }
        whole_file::write(&self.0, text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_written_read_and_removed_with_the_last_rule() {
        let folder = tempfile::tempdir().unwrap();
        let file = AlarmFile::beside(&folder.path().join("strip.locator.json"));
        assert_eq!(file.path(), folder.path().join("strip.locator.alarms.toml"));
        assert_eq!(file.read().unwrap(), "");
        file.write("# mine\n").unwrap();
        assert_eq!(file.read().unwrap(), "# mine\n");
        file.write(" \n").unwrap();
        assert!(!file.path().exists());
        file.write("").unwrap();
        let file = AlarmFile::in_folder(&folder.path().join("new"));
        file.write("# mine\n").unwrap();
        assert_eq!(std::fs::read_dir(folder.path().join("new")).unwrap().count(), 1);
    }
}
