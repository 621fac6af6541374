//! Pseudo-terminal as serial port.

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;
use std::fs::File;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

pub struct Pty {
    /// Non-blocking end of the board.
    pub master: File,
    /// Kept open, so that the pair outlives its readers.
    slave: OwnedFd,
    link: Option<PathBuf>,
}

impl Pty {
    pub fn open(link: Option<PathBuf>) -> std::io::Result<Self> {
        let (master, slave) = pair()?;
        let own = Self { master, slave, link };
        own.create_link()?;
        Ok(own)
    }

    /// Replaces the pair, which hangs up the readers.
    pub fn reopen(&mut self) -> std::io::Result<()> {
        let (master, slave) = pair()?;
        (self.master, self.slave) = (master, slave);
        self.create_link()
    }

    pub fn name(&self) -> String {
        match &self.link {
            Some(link) => link.display().to_string(),
            None => ttyname(&self.slave).map_or_else(|_| "pty".to_owned(), |path| path.display().to_string()),
        }
    }

    /// Replaces a link, but no other file.
    fn create_link(&self) -> std::io::Result<()> {
        let Some(link) = &self.link else { return Ok(()) };
        if is_link(link) {
            std::fs::remove_file(link)?;
        }
        std::os::unix::fs::symlink(ttyname(&self.slave)?, link)
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = self.link.as_ref().filter(|link| is_link(link)) {
            let _ = std::fs::remove_file(link);
        }
    }
}

fn is_link(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_ok_and(|found| found.file_type().is_symlink())
}

fn pair() -> std::io::Result<(File, OwnedFd)> {
    let pair = openpty(None, None)?;
    let mut attributes = tcgetattr(&pair.slave)?;
    cfmakeraw(&mut attributes);
    tcsetattr(&pair.slave, SetArg::TCSANOW, &attributes)?;
    let flags = OFlag::from_bits_retain(fcntl(&pair.master, FcntlArg::F_GETFL)?);
    fcntl(&pair.master, FcntlArg::F_SETFL(flags | OFlag::O_NONBLOCK))?;
    Ok((pair.master.into(), pair.slave))
}
