//! Folder of real recordings beside the workspace.

use std::env;
use std::path::{Path, PathBuf};

use super::skip::skip;

/// Path of a recording in `PALPATE_DATA` or `../shared/data`, if the folder exists.
///
/// ```ignore
/// let Some(path) = data::recording("tactile-fsi/1d-water-1.5mm.csv") else { return };
/// ```
///
/// # Panics
/// Panics if the folder lacks the recording.
pub fn recording(name: &str) -> Option<PathBuf> {
    // From cargo's environment at run time: the build-time path is stale in a moved clone.
    let package = env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    let beside = || Path::new(&package).join("../../../shared/data");
    let folder = env::var_os("PALPATE_DATA").map_or_else(beside, PathBuf::from);
    if !folder.is_dir() {
        skip(
            "the folder of real recordings",
            "put it at ../shared/data beside the workspace, or name it in PALPATE_DATA",
        );
        return None;
    }
    let path = folder.join(name);
    assert!(path.is_file(), "no recording {name} in {}", folder.display());
    Some(path)
}
