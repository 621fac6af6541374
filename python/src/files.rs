//! Files: written whole, under a temporary name first.

use std::path::Path;

use pyo3::prelude::*;

use crate::errors::{io_error, refused};

/// Writes a whole file, which takes its name when all of it is there.
///
/// # Errors
/// `PalpateError` for a path that is not a file, and `OSError`.
pub fn write_whole(path: &Path, bytes: &[u8]) -> PyResult<()> {
    // A link is followed: its target is what is meant.
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let mut name = target.file_name().map(ToOwned::to_owned).unwrap_or_default();
    if target.exists() && !target.is_file() {
        return Err(refused(format!("{} is not a file; no output was written", path.display())));
    }
    name.push(format!(".{}.part", std::process::id()));
    let temporary = target.with_file_name(name);
    let written = std::fs::write(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, &target));
    written.map_err(|error| {
        // A file that is half-written is of no use; the first error is reported.
        let _ = std::fs::remove_file(&temporary);
        io_error(&error, path)
    })
}
