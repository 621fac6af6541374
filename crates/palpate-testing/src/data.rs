//! The folder of real recordings, which lies beside the workspace and is not a part of it.

use std::env;
use std::path::{Path, PathBuf};

use super::skip::skip;

/// A recording by its path in the folder, such as `tactile-fsi/1d-water-1.5mm.csv`. The folder is the one that
/// `PALPATE_DATA` names, or `../shared/data` beside the workspace. `None`, said in one line, when the folder is not there;
/// a folder that lacks the recording is a failure, as its name is then wrong.
///
/// ```ignore
/// let Some(path) = data::recording("tactile-fsi/1d-water-1.5mm.csv") else { return };
/// ```
pub fn recording(name: &str) -> Option<PathBuf> {
    // From cargo's environment at run time: the path at build time is stale once a clone has moved.
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
