use palpate_files as whole_file;
use std::io::{ErrorKind, Result};
use std::path::{Path, PathBuf};

/// File of alarms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlarmFile(PathBuf);

impl AlarmFile {
    /// `strip.alarms.toml` for a locator or rig `strip.json`.
    pub fn for_path(path: &Path) -> Self {
        Self(path.with_extension("alarms.toml"))
    }

    /// `alarms.toml` in a folder.
    pub fn in_folder(folder: &Path) -> Self {
        Self(folder.join("alarms.toml"))
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Reads the text; empty without a file.
    ///
    /// # Errors
    /// Unreadable file or text.
    pub fn read(&self) -> Result<String> {
        match std::fs::read_to_string(&self.0) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(String::new()),
            text => text,
        }
    }

    /// Writes the file, or removes it without rules.
    ///
    /// # Errors
    /// Unwritable file.
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
        let file = AlarmFile::for_path(&folder.path().join("strip.locator.json"));
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
