//! Files and folders that a command may write: overwriting of data is refused with a reason, and files appear complete.

use crate::failure::{Complaint, Failure};
use palpate_files::{self as whole_file, folder_of};
use palpate_report::ReportFile;
use std::fs::{self, Metadata};
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

/// Results of a study; the study is finished once the file exists.
pub const RESULTS_JSON: &str = "results.json";
/// Fits of a study, with its networks.
pub const NETWORKS_CSV: &str = "networks.csv";
/// Located contacts of a study's fits other than networks.
pub const EVALUATIONS_CSV: &str = "evaluations.csv";
/// Facts of a study's shard; the shard is finished once the file exists.
pub const SHARD_JSON: &str = "shard.json";
/// Page of a report.
pub const REPORT_HTML: &str = "report.html";
/// Files that mark a folder as a study's.
pub const OF_A_STUDY: [&str; 4] = [RESULTS_JSON, SHARD_JSON, NETWORKS_CSV, EVALUATIONS_CSV];

/// The files that a command reads, and those that its own output goes to. The command must not overwrite them.
#[derive(Clone, Debug)]
pub struct Inputs(Vec<(&'static str, Identity)>);

impl Inputs {
    /// The files at these paths; `-` is stdin. A path without a file is left to its reader.
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

/// Identity of a file under any name: the path without links, and the inode, which hard links share.
#[derive(Clone, Debug)]
struct Identity {
    path: PathBuf,
    inode: Option<(u64, u64)>,
}

impl Identity {
    /// Identity of a regular file; `None` for anything else.
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

/// A file that may be written.
#[derive(Clone, Debug)]
pub struct Target {
    path: PathBuf,
    inputs: Inputs,
}

impl Target {
    /// Complains at once, before any work, if the file must not or cannot be written.
    pub fn new(path: &Path, inputs: &Inputs) -> Result<Self, Failure> {
        let target = Self { path: path.to_owned(), inputs: inputs.clone() };
        let place = target.place()?;
        if let Some(name) = result_beside(&place) {
            let complaint = format!(
                "cannot write {}: it is a result of the study whose {name} is beside it",
                path.display()
            );
            return Err(Complaint::new(complaint).help("name another file").into());
        }
        check_takes_files(folder_of(&place)).map_err(|error| cannot("write", path, &error))?;
        Ok(target)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the file under a temporary name and renames it, so that it is never seen incomplete. A link stays, and its target is
    /// written; a replaced file keeps its mode.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        self.place()?;
        whole_file::write(&self.path, bytes).map_err(|error| cannot("write", &self.path, &error))
    }

    /// The file to write, with all links followed.
    fn place(&self) -> Result<PathBuf, Failure> {
        let refused = |why: &str| Complaint::new(format!("cannot write {}: {why}", self.path.display()));
        if self.path == Path::new("-") {
            let complaint = refused("stdout is for what the command says");
            return Err(complaint.help("name a file; one that is called so is `./-`").into());
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
            false => Err(refused(&format!("there is no folder {}", folder.display())).into()),
        }
    }
}

/// Another file of the study to which the file at `place` belongs, if both exist.
fn result_beside(place: &Path) -> Option<&'static str> {
    let name = place.file_name()?.to_str().filter(|name| is_of_a_report(name) && place.exists())?;
    OF_A_STUDY.into_iter().find(|other| *other != name && place.with_file_name(other).exists())
}

/// The reason why no command may replace an entry of a folder by a file; `None` for a regular file.
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
        kind if kind.is_fifo() => "it is a pipe (FIFO), and no file",
        kind if kind.is_socket() => "it is a socket, and no file",
        _ => "it is a device, and no file",
    }
}

#[cfg(not(unix))]
fn what_it_is(_: &Metadata) -> &'static str {
    "it is no regular file"
}

/// A folder that takes a report, with all files that belong to it.
#[derive(Clone, Debug)]
pub struct TargetFolder {
    path: PathBuf,
    inputs: Inputs,
}

impl TargetFolder {
    /// A folder for the report of a command; a folder with the results of a study is refused.
    pub fn for_report(path: &Path, inputs: &Inputs) -> Result<Self, Failure> {
        let folder = Self::for_study(path, inputs)?;
        match OF_A_STUDY.into_iter().find(|name| path.join(name).exists()) {
            None => Ok(folder),
            Some(name) => {
                let found = path.join(name);
                let complaint =
                    format!("cannot write a report into {}: a study's {name} is there", path.display());
                let help = format!("name another folder, or take {} away", found.display());
                Err(Complaint::new(complaint).help(help).into())
            }
        }
    }

    /// A folder for a study, which has its own rules for earlier results.
    pub fn for_study(path: &Path, inputs: &Inputs) -> Result<Self, Failure> {
        let folder = Self { path: path.to_owned(), inputs: inputs.clone() };
        let refused = |error: &Error| cannot("write into the folder", path, error);
        let nearest =
            path.ancestors().find(|above| above.exists()).filter(|above| !above.as_os_str().is_empty());
        let nearest = nearest.unwrap_or(Path::new("."));
        if !nearest.is_dir() {
            return Err(refused(&Error::other(format!("{} is no folder", nearest.display()))));
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

    /// Makes the folder and its parents if they are missing.
    pub fn make(&self) -> Result<(), Failure> {
        fs::create_dir_all(&self.path).map_err(|error| cannot("make the folder", &self.path, &error))
    }

    /// Removes a file if it exists.
    pub fn remove(&self, name: &str) -> Result<(), Failure> {
        let path = self.path.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(cannot("remove", &path, &error)),
            _ => Ok(()),
        }
    }

    /// Writes one file of the report.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        self.make()?;
        self.target(name.as_ref()).write(bytes)
    }

    /// Writes the files of a report; with the feature `png`, also a copy of every figure as PNG.
    pub fn write_report(&self, files: Vec<ReportFile>) -> Result<(), Failure> {
        #[cfg(feature = "png")]
        let files = palpate_report::with_png_copies(files).map_err(Complaint::new)?;
        files.into_iter().try_for_each(|file| self.write(&file.name, &file.bytes))
    }

    fn target(&self, name: &Path) -> Target {
        Target { path: self.path.join(name), inputs: self.inputs.clone() }
    }
}

/// True for names of a report's files.
fn is_of_a_report(name: &str) -> bool {
    let tables = ["errors.csv", "trials.csv", "limit.csv"];
    let is_figure = name.starts_with("figure-") && [".svg", ".png"].iter().any(|end| name.ends_with(end));
    is_figure || name == REPORT_HTML || OF_A_STUDY.contains(&name) || tables.contains(&name)
}

/// An error if a folder does not accept files: it is better reported before an hour of work than after it.
fn check_takes_files(folder: &Path) -> std::io::Result<()> {
    whole_file::temporary(folder).map(drop)
}

/// The complaint that a path cannot be used.
pub fn cannot(what: &str, path: &Path, error: &Error) -> Failure {
    Complaint::new(format!("cannot {what} {}: {error}", path.display())).into()
}
