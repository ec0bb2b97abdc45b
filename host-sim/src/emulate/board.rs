//! The emulator as a child process, its two serial ports as byte streams.
//!
//! Goes in: the image and bytes for a port. Comes out: bytes of a port. The child and the folder with its
//! sockets are gone when the [`Board`] is dropped.

use std::fs::{self, File};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use super::error::EmulateError;

/// Name under which the emulator is looked for in `PATH`.
const EMULATOR: &str = "qemu-system-arm";
/// Time for the child to connect to its sockets.
const CONNECT: Duration = Duration::from_secs(20);
/// A running emulated board.
#[derive(Debug)]
pub struct Board {
    child: Child,
    folder: TempDir,
    program: Port,
    trace: Port,
}

/// One serial port.
#[derive(Debug)]
struct Port {
    stream: UnixStream,
    /// Bytes the socket would not take yet.
    waiting: Vec<u8>,
}

/// Which serial port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// USART1: program and answers.
    Program,
    /// USART2: trace.
    Trace,
}

/// A folder for sockets, whose address has room for 107 bytes.
fn short_folder() -> std::io::Result<TempDir> {
    let base = std::env::temp_dir();
    TempDir::new_in(if base.as_os_str().len() > 60 {
        Path::new("/tmp")
    } else {
        &base
    })
}

impl Drop for Board {
    fn drop(&mut self) {
        // Both fail only if the child has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Board {
    /// Starts `image` at 2^`shift` ns per instruction and waits until the emulator has opened both ports. Virtual time
    /// counts instructions only, so it does not depend on the speed of the host.
    ///
    /// # Errors
    /// [`EmulateError::NoImage`], [`EmulateError::NoEmulator`], [`EmulateError::Exited`], or what the system says.
    pub fn start(image: &Path, shift: u8) -> Result<Self, EmulateError> {
        if !image.is_file() {
            return Err(EmulateError::NoImage(image.to_owned()));
        }
        let folder = short_folder()?;
        let path = |name: &str| folder.path().join(name);
        let listen = |name: &str| -> Result<UnixListener, EmulateError> {
            let listener = UnixListener::bind(path(name))?;
            listener.set_nonblocking(true)?;
            Ok(listener)
        };
        let (program, trace) = (listen("program")?, listen("trace")?);
        let socket = |name: &str| format!("socket,id={name},path={}", path(name).display());
        let mut child = Command::new(EMULATOR)
            .args([
                "-M",
                "netduinoplus2",
                "-nodefaults",
                "-display",
                "none",
                "-monitor",
                "none",
            ])
            .args(["-icount", &format!("shift={shift},sleep=off")])
            .args(["-chardev", &socket("program"), "-serial", "chardev:program"])
            .args(["-chardev", &socket("trace"), "-serial", "chardev:trace"])
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(path("stderr"))?)
            .spawn()
            .map_err(|e| match e.kind() {
                ErrorKind::NotFound => EmulateError::NoEmulator,
                _ => e.into(),
            })?;
        let ports = accept(&program, &mut child, &folder)
            .and_then(|p| Ok((p, accept(&trace, &mut child, &folder)?)));
        match ports {
            Ok((program, trace)) => Ok(Self {
                child,
                folder,
                program,
                trace,
            }),
            Err(error) => {
                // It may have ended already.
                let _ = child.kill();
                let _ = child.wait();
                Err(error)
            }
        }
    }

    fn port(&mut self, line: Line) -> &mut Port {
        match line {
            Line::Program => &mut self.program,
            Line::Trace => &mut self.trace,
        }
    }

    /// Sends `bytes`; what the socket does not take now goes with the next call.
    ///
    /// # Errors
    /// [`EmulateError::Exited`] if the emulator has ended, or what the system says.
    pub fn send(&mut self, line: Line, bytes: &[u8]) -> Result<(), EmulateError> {
        let port = self.port(line);
        port.waiting.extend_from_slice(bytes);
        while !port.waiting.is_empty() {
            match port.stream.write(&port.waiting) {
                Ok(len) => drop(port.waiting.drain(..len)),
                Err(e) if e.kind() == ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(self.lost(e)),
            }
        }
        Ok(())
    }

    /// Appends everything that has arrived to `into`; returns how many bytes that is. Does not wait.
    ///
    /// # Errors
    /// [`EmulateError::Exited`] if the emulator has ended, or what the system says.
    pub fn receive(&mut self, line: Line, into: &mut Vec<u8>) -> Result<usize, EmulateError> {
        let mut total = 0;
        let mut chunk = [0; 1 << 16];
        loop {
            match self.port(line).stream.read(&mut chunk) {
                Ok(0) => return Err(self.lost(ErrorKind::UnexpectedEof.into())),
                Ok(len) => {
                    into.extend_from_slice(&chunk[..len]);
                    total += len;
                }
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Ok(total),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(self.lost(e)),
            }
        }
    }

    /// The error for a port that failed: that of the child if it has ended.
    fn lost(&mut self, error: std::io::Error) -> EmulateError {
        // A child that has just closed its ports takes a moment to end.
        for _ in 0..50 {
            if let Some(exited) = exited(&mut self.child, &self.folder) {
                return exited;
            }
            thread::sleep(Duration::from_millis(10));
        }
        error.into()
    }
}

/// The error for a child that has ended, or `None` while it runs.
fn exited(child: &mut Child, folder: &TempDir) -> Option<EmulateError> {
    let status = child.try_wait().ok()??;
    let stderr = fs::read(folder.path().join("stderr")).unwrap_or_default();
    let text = String::from_utf8_lossy(&stderr);
    Some(EmulateError::Exited {
        stderr: format!("{status} {text}"),
    })
}

fn accept(
    listener: &UnixListener,
    child: &mut Child,
    folder: &TempDir,
) -> Result<Port, EmulateError> {
    let start = Instant::now();
    loop {
        match listener.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(true)?;
                return Ok(Port {
                    stream,
                    waiting: Vec::new(),
                });
            }
            Err(e) if e.kind() == ErrorKind::WouldBlock => {}
            Err(e) => return Err(e.into()),
        }
        if let Some(error) = exited(child, folder) {
            return Err(error);
        }
        if start.elapsed() > CONNECT {
            return Err(EmulateError::NoAnswer(CONNECT));
        }
        thread::sleep(Duration::from_millis(2));
    }
}
