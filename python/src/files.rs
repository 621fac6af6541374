//! Atomic writing of files.

use std::path::Path;

use pyo3::prelude::*;

use crate::errors::{io_error, refused};

/// Writes a temporary file and renames it.
///
/// # Errors
/// `PalpateError` for a path that is not a file, and `OSError`.
pub fn write_whole(path: &Path, bytes: &[u8]) -> PyResult<()> {
    // A link stays, and its target is replaced.
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let mut name = target.file_name().map(ToOwned::to_owned).unwrap_or_default();
    if target.exists() && !target.is_file() {
        return Err(refused(format!("{} is not a file; no output was written", path.display())));
    }
    name.push(format!(".{}.part", std::process::id()));
    let temporary = target.with_file_name(name);
    let written = std::fs::write(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, &target));
    written.map_err(|error| {
        // A half-written file is of no use; the first error is reported.
        let _ = std::fs::remove_file(&temporary);
        io_error(&error, path)
    })
}
