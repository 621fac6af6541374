//! What a command leaves behind: files that appear whole or not at all, and lines on stdout.

use crate::failure::{Complaint, Failure};
use palpate_report::ReportFile;
use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Complains at once, before any work, when a file could not be written later.
pub fn check_writable(path: &Path) -> Result<(), Failure> {
    let folder = folder_of(path);
    if path.is_dir() {
        return Err(Complaint::new(format!("cannot write {}: it is a folder", path.display())).into());
    }
    if !folder.is_dir() {
        let complaint = format!("cannot write {}: there is no folder {}", path.display(), folder.display());
        return Err(Complaint::new(complaint).into());
    }
    Ok(())
}

/// Writes a file under a temporary name and renames it, so that nobody ever sees half of it.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    check_writable(path)?;
    let write = || -> std::io::Result<()> {
        let mut file = tempfile::Builder::new().prefix(".palpate-").tempfile_in(folder_of(path))?;
        file.write_all(bytes)?;
        make_readable(file.as_file())?;
        file.persist(path)?;
        Ok(())
    };
    write().map_err(|error| cannot("write", path, &error))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Temporary files begin private to their owner; results are for whoever may read the folder.
fn make_readable(file: &std::fs::File) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.set_permissions(std::fs::Permissions::from_mode(0o644))?;
    }
    #[cfg(not(unix))]
    let _ = file;
    Ok(())
}

/// Makes a folder, with those above it.
pub fn make_folder(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path).map_err(|error| cannot("make the folder", path, &error))
}

/// Writes the files of a report into a folder, which is made where it is not there yet; with the feature `png`, also a copy of every
/// figure as PNG.
pub fn write_report(folder: &Path, files: Vec<ReportFile>) -> Result<(), Failure> {
    #[cfg(feature = "png")]
    let files = palpate_report::with_png_copies(files).map_err(Complaint::new)?;
    make_folder(folder)?;
    for file in files {
        write_file(&folder.join(&file.name), &file.bytes)?;
    }
    Ok(())
}

/// The complaint that a path cannot be used.
pub fn cannot(what: &str, path: &Path, error: &std::io::Error) -> Failure {
    Complaint::new(format!("cannot {what} {}: {error}", path.display())).into()
}

/// Prints a line on stdout.
pub fn say(line: impl Display) -> Result<(), Failure> {
    print(&mut std::io::stdout().lock(), format!("{line}\n").as_bytes())
}

/// Prints a value as JSON on stdout.
pub fn say_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    say(to_json(value)?)
}

/// A value as JSON text.
pub fn to_json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(|error| Complaint::new(error).into())
}

/// Writes to stdout or whatever stands for it; a reader that has gone is no error of ours.
pub fn print(out: &mut impl Write, bytes: &[u8]) -> Result<(), Failure> {
    out.write_all(bytes).map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::NobodyReads,
        _ => Complaint::new(format!("cannot write to the output: {error}")).into(),
    })
}
