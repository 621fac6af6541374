//! Files and folders that a command may write. Data is not overwritten by mistake, and files appear
//! complete.

use crate::failure::{Failure, UserError};
use palpate_files::{self as whole_file, folder_of};
use palpate_report::ReportFile;
use std::fs::{self, Metadata};
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

/// Results of a study; the study is finished once the file exists.
pub const RESULTS_JSON: &str = "results.json";
pub const NETWORKS_CSV: &str = "networks.csv";
pub const EVALUATIONS_CSV: &str = "evaluations.csv";
/// Facts of a study's shard; the shard is finished once the file exists.
pub const SHARD_JSON: &str = "shard.json";
pub const REPORT_HTML: &str = "report.html";
pub const OF_A_STUDY: [&str; 4] = [RESULTS_JSON, SHARD_JSON, NETWORKS_CSV, EVALUATIONS_CSV];

/// Files that a command reads, or that its output is redirected to, and must not overwrite.
#[derive(Clone, Debug)]
pub struct Inputs(Vec<(&'static str, Identity)>);

impl Inputs {
    /// Identifies the files at these paths; `-` is stdin. Paths without a file are omitted.
    pub fn new<'a>(paths: impl IntoIterator<Item = &'a Path>) -> Self {
        let read =
            paths.into_iter().filter_map(Identity::look_up).map(|file| ("this command reads it", file));
        let streams = [
            ("/dev/stdin", "this command reads it, as stdin"),
            ("/dev/stdout", "this command's stdout goes there"),
            ("/dev/stderr", "this command's stderr goes there"),
        ];
        let streams =
            streams.into_iter().filter_map(|(path, why)| Some((why, Identity::look_up(path.as_ref())?)));
        Self(read.chain(streams).collect())
    }

    fn reason_to_keep(&self, path: &Path) -> Option<&'static str> {
        let file = Identity::look_up(path)?;
        self.0.iter().find(|(_, kept)| kept.is_same(&file)).map(|(why, _)| *why)
    }
}

/// Identity of a file under any name: the path without links, and the inode, which hard links
/// share.
#[derive(Clone, Debug)]
struct Identity {
    path: PathBuf,
    inode: Option<(u64, u64)>,
}

impl Identity {
    fn look_up(path: &Path) -> Option<Self> {
        let there = fs::metadata(path).ok().filter(Metadata::is_file)?;
        Some(Self { path: fs::canonicalize(path).ok()?, inode: inode(&there) })
    }

    fn is_same(&self, other: &Self) -> bool {
        self.path == other.path || (self.inode.is_some() && self.inode == other.inode)
    }
}

#[cfg(unix)]
fn inode(there: &Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((there.dev(), there.ino()))
}

#[cfg(not(unix))]
fn inode(_: &Metadata) -> Option<(u64, u64)> {
    None
}

#[derive(Clone, Debug)]
pub struct Target {
    path: PathBuf,
    inputs: Inputs,
}

impl Target {
    /// Fails before any work if the file must not or cannot be written.
    pub fn new(path: &Path, inputs: &Inputs) -> Result<Self, Failure> {
        let target = Self { path: path.to_owned(), inputs: inputs.clone() };
        let place = target.place()?;
        if let Some(name) = result_beside(&place) {
            let message = format!(
                "cannot write {}: it is a result of the study with {name} in the same folder",
                path.display()
            );
            return Err(UserError::new(message).help("name another file").into());
        }
        check_takes_files(folder_of(&place)).map_err(|error| cannot("write", path, &error))?;
        Ok(target)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a temporary file and renames it, so that readers see complete files only. Links and
    /// the mode of a replaced file are kept.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        self.place()?;
        whole_file::write(&self.path, bytes).map_err(|error| cannot("write", &self.path, &error))
    }

    fn place(&self) -> Result<PathBuf, Failure> {
        let refused = |why: &str| UserError::new(format!("cannot write {}: {why}", self.path.display()));
        if self.path == Path::new("-") {
            let user_error = refused("stdout is reserved for the output of the command");
            return Err(user_error.help("name a file; a file named `-` is `./-`").into());
        }
        if self.path.file_name().is_none() && !self.path.is_dir() {
            return Err(refused("it names no file").into());
        }
        let place = match fs::metadata(&self.path) {
            Ok(there) => {
                if let Some(why) = reason_against(&there) {
                    return Err(refused(why).help("name another file").into());
                }
                if let Some(why) = self.inputs.reason_to_keep(&self.path) {
                    return Err(refused(why).help("name another file").into());
                }
                fs::canonicalize(&self.path)
            }
            Err(error) if error.kind() == ErrorKind::NotFound => whole_file::place(&self.path),
            Err(error) => Err(error),
        };
        let place = place.map_err(|error| cannot("write", &self.path, &error))?;
        let folder = folder_of(&place);
        match folder.is_dir() {
            true => Ok(place),
            false => Err(refused(&format!("folder {} does not exist", folder.display())).into()),
        }
    }
}

/// Returns another file of the study to which the file at `place` belongs.
fn result_beside(place: &Path) -> Option<&'static str> {
    let name = place.file_name()?.to_str().filter(|name| is_of_a_report(name) && place.exists())?;
    OF_A_STUDY.into_iter().find(|other| *other != name && place.with_file_name(other).exists())
}

/// Returns why an entry of a folder must not be replaced; `None` for a regular file.
fn reason_against(there: &Metadata) -> Option<&'static str> {
    match there.file_type() {
        kind if kind.is_dir() => Some("it is a folder"),
        kind if !kind.is_file() => Some(what_it_is(there)),
        _ if there.permissions().readonly() => Some("it is write-protected"),
        _ => None,
    }
}

#[cfg(unix)]
fn what_it_is(there: &Metadata) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match there.file_type() {
        kind if kind.is_fifo() => "it is a pipe (FIFO), not a file",
        kind if kind.is_socket() => "it is a socket, not a file",
        _ => "it is a device, not a file",
    }
}

#[cfg(not(unix))]
fn what_it_is(_: &Metadata) -> &'static str {
    "it is not a regular file"
}

#[derive(Clone, Debug)]
pub struct TargetFolder {
    path: PathBuf,
    inputs: Inputs,
}

impl TargetFolder {
    /// Prepares a folder for a report, and refuses one with results of a study.
    pub fn for_report(path: &Path, inputs: &Inputs) -> Result<Self, Failure> {
        let folder = Self::for_study(path, inputs)?;
        match OF_A_STUDY.into_iter().find(|name| path.join(name).exists()) {
            None => Ok(folder),
            Some(name) => {
                let found = path.join(name);
                let message =
                    format!("cannot write a report into {}: a study's {name} is there", path.display());
                let help = format!("name another folder, or remove {}", found.display());
                Err(UserError::new(message).help(help).into())
            }
        }
    }

    pub fn for_study(path: &Path, inputs: &Inputs) -> Result<Self, Failure> {
        let folder = Self { path: path.to_owned(), inputs: inputs.clone() };
        let refused = |error: &Error| cannot("write into the folder", path, error);
        let nearest =
            path.ancestors().find(|above| above.exists()).filter(|above| !above.as_os_str().is_empty());
        let nearest = nearest.unwrap_or(Path::new("."));
        if !nearest.is_dir() {
            return Err(refused(&Error::other(format!("{} is not a folder", nearest.display()))));
        }
        check_takes_files(nearest).map_err(|error| refused(&error))?;
        if path.is_dir() {
            let entries = fs::read_dir(path).map_err(|error| refused(&error))?;
            let names = entries.flatten().map(|entry| entry.file_name());
            for name in names.filter(|name| name.to_str().is_some_and(is_of_a_report)) {
                folder.target(name.as_ref()).place()?;
            }
        }
        Ok(folder)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn make(&self) -> Result<(), Failure> {
        fs::create_dir_all(&self.path).map_err(|error| cannot("make the folder", &self.path, &error))
    }

    pub fn remove(&self, name: &str) -> Result<(), Failure> {
        let path = self.path.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(cannot("remove", &path, &error)),
            _ => Ok(()),
        }
    }

    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        self.make()?;
        self.target(name.as_ref()).write(bytes)
    }

    /// Writes the files of a report; with the feature `png`, also a PNG of every figure.
    pub fn write_report(&self, files: Vec<ReportFile>) -> Result<(), Failure> {
        #[cfg(feature = "png")]
        let files = palpate_report::with_png_copies(files).map_err(UserError::new)?;
        files.into_iter().try_for_each(|file| self.write(&file.name, &file.bytes))
    }

    fn target(&self, name: &Path) -> Target {
        Target { path: self.path.join(name), inputs: self.inputs.clone() }
    }
}

fn is_of_a_report(name: &str) -> bool {
    let tables = ["errors.csv", "trials.csv", "limit.csv"];
    let is_figure = name.starts_with("figure-") && [".svg", ".png"].iter().any(|end| name.ends_with(end));
    is_figure || name == REPORT_HTML || OF_A_STUDY.contains(&name) || tables.contains(&name)
}

/// Fails if a folder does not accept files, so that the error precedes hours of work.
fn check_takes_files(folder: &Path) -> std::io::Result<()> {
    whole_file::temporary(folder).map(drop)
}

pub fn cannot(what: &str, path: &Path, error: &Error) -> Failure {
    UserError::new(format!("cannot {what} {}: {error}", path.display())).into()
}
