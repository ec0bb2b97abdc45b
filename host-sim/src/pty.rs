//! A pseudo-terminal that looks like the serial port of a controller.
//!
//! Comes in: bytes for the client. Goes out: bytes from the client. The slave side is put in raw mode and
//! kept open, so that clients may come and go without the master seeing a hang-up.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{symlink, FileTypeExt};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{poll, PollFd, PollFlags, Timespec};
use rustix::fs::{fcntl_setfl, OFlags};
use rustix::pty::{grantpt, openpt, ptsname, unlockpt, OpenptFlags};
use rustix::termios::{ioctl_tiocnxcl, tcgetattr, tcsetattr, OptionalActions};

/// Master side of a pseudo-terminal with its slave held open.
#[derive(Debug)]
pub struct PseudoTerminal {
    master: OwnedFd,
    slave: OwnedFd,
    path: PathBuf,
}

impl PseudoTerminal {
    /// Opens a new pair; no echo, no line editing, no translation of any byte.
    ///
    /// # Errors
    /// What the operating system refuses, for instance because no pseudo-terminal is left.
    pub fn open() -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let name = ptsname(&master, Vec::new())?;
        let path = PathBuf::from(OsStr::from_bytes(name.as_bytes()));
        let slave = rustix::fs::open(
            &path,
            OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC,
            rustix::fs::Mode::empty(),
        )?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings)?;
        fcntl_setfl(&master, OFlags::NONBLOCK)?;
        Ok(Self {
            master,
            slave,
            path,
        })
    }

    /// Device a client opens, for instance `/dev/pts/3`.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Takes what the client has written, at most `buffer.len()` bytes; 0 if nothing is there.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn read(&self, buffer: &mut [u8]) -> io::Result<usize> {
        nothing_is_zero(rustix::io::read(&self.master, buffer))
    }

    /// Gives bytes to the client; returns how many were taken, 0 if its buffer is full.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn write(&self, bytes: &[u8]) -> io::Result<usize> {
        nothing_is_zero(rustix::io::write(&self.master, bytes))
    }

    /// Sleeps until the client has written something or `time` is over.
    ///
    /// # Errors
    /// What the operating system reports; a signal ends the sleep without error.
    pub fn wait(&self, time: Duration) -> io::Result<()> {
        let mut fds = [PollFd::from_borrowed_fd(self.master.as_fd(), PollFlags::IN)];
        let limit = Timespec {
            tv_sec: i64::try_from(time.as_secs()).unwrap_or(i64::MAX),
            tv_nsec: time.subsec_nanos().into(),
        };
        match poll(&mut fds, Some(&limit)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Lifts exclusive use that a killed client left on the terminal.
    ///
    /// A real port loses that flag at the last close; here the slave never closes. Failure changes nothing.
    pub fn release_exclusive(&self) {
        let _ = ioctl_tiocnxcl(&self.slave);
    }
}

/// Turns "would block" and "interrupted" into zero bytes.
fn nothing_is_zero(result: rustix::io::Result<usize>) -> io::Result<usize> {
    match result {
        Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => Ok(0),
        other => other.map_err(Into::into),
    }
}

/// A symbolic link to a device, removed when dropped.
#[derive(Debug)]
pub struct Link {
    path: PathBuf,
    target: PathBuf,
}

impl Link {
    /// Makes `path` point at `target`. A link that is already there and leads to a terminal or to nothing is
    /// taken over (the last run may have been killed); anything else is left alone.
    ///
    /// # Errors
    /// `AlreadyExists` if something else is in the way, or what the operating system refuses.
    pub fn new(path: &Path, target: &Path) -> io::Result<Self> {
        let stale = fs::symlink_metadata(path).is_ok_and(|meta| meta.file_type().is_symlink())
            && fs::metadata(path).map_or(true, |meta| meta.file_type().is_char_device());
        if stale {
            fs::remove_file(path)?;
        }
        symlink(target, path)?;
        Ok(Self {
            path: path.to_owned(),
            target: target.to_owned(),
        })
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // Another run may have taken the name over; its link is not ours to remove.
        if fs::read_link(&self.path).is_ok_and(|target| target == self.target) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};

    use super::*;

    fn client(path: &Path) -> fs::File {
        fs::OpenOptions::new()
            .read(true)
            .write(true)
            .open(path)
            .unwrap()
    }

    fn read_some(terminal: &PseudoTerminal) -> Vec<u8> {
        let mut buffer = [0; 64];
        for _ in 0..100 {
            let n = terminal.read(&mut buffer).unwrap();
            if n > 0 {
                return buffer[..n].to_vec();
            }
            terminal.wait(Duration::from_millis(10)).unwrap();
        }
        Vec::new()
    }

    #[test]
    fn every_byte_passes_unchanged_both_ways() {
        let terminal = PseudoTerminal::open().unwrap();
        let mut client = client(terminal.path());
        let all: Vec<u8> = (0..=255).collect();
        for part in all.chunks(64) {
            client.write_all(part).unwrap();
            assert_eq!(read_some(&terminal), part);
            assert_eq!(terminal.write(part).unwrap(), part.len());
            let mut back = [0; 64];
            client.read_exact(&mut back).unwrap();
            assert_eq!(back, part);
        }
    }

    #[test]
    fn a_client_may_leave_and_another_come() {
        let terminal = PseudoTerminal::open().unwrap();
        for _ in 0..3 {
            let mut client = client(terminal.path());
            client.write_all(b"?").unwrap();
            drop(client);
            assert_eq!(read_some(&terminal), b"?");
            assert_eq!(terminal.read(&mut [0; 8]).unwrap(), 0);
        }
    }

    #[test]
    fn a_link_goes_with_its_owner_and_spares_files() {
        let folder = std::env::temp_dir().join(format!("pentaspline-link-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("port");
        let terminal = PseudoTerminal::open().unwrap();
        let link = Link::new(&path, terminal.path()).unwrap();
        assert_eq!(fs::read_link(&path).unwrap(), terminal.path());
        drop(link);
        assert!(fs::symlink_metadata(&path).is_err());
        symlink("/nowhere/at/all", &path).unwrap();
        drop(Link::new(&path, terminal.path()).unwrap());
        fs::write(&path, "keep").unwrap();
        assert_eq!(
            Link::new(&path, terminal.path()).unwrap_err().kind(),
            io::ErrorKind::AlreadyExists
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), "keep");
        fs::remove_dir_all(&folder).unwrap();
    }
}
