//! A folder of its own for the programs of one run; gone when the run is.

use std::sync::atomic::{AtomicUsize, Ordering};

use tempfile::TempDir;

use super::programs::Job;
use crate::diagnostics::Failure;
use crate::program::Program;

/// A temporary folder.
pub(super) struct Scratch {
    folder: TempDir,
    next: AtomicUsize,
}

impl Scratch {
    /// Makes the folder.
    ///
    /// # Errors
    /// Exit code 5.
    pub(super) fn new() -> Result<Self, Failure> {
        let folder = TempDir::new().map_err(|e| Failure::io("make", &std::env::temp_dir(), &e))?;
        Ok(Self {
            folder,
            next: AtomicUsize::new(0),
        })
    }

    /// Writes `job` and reads it as any program is read, sub-programs inlined.
    ///
    /// # Errors
    /// Exit code 5, or that of [`Program::load`].
    pub(super) fn load(&self, job: &Job) -> Result<Program, Failure> {
        // Each job has a folder of its own: threads share names, A- and C-splines sub-programs.
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        let folder = self.folder.path().join(number.to_string());
        std::fs::create_dir_all(&folder).map_err(|e| Failure::io("make", &folder, &e))?;
        for file in job.subs.iter().chain([&job.main]) {
            let path = folder.join(&file.name);
            std::fs::write(&path, &file.text).map_err(|e| Failure::io("write", &path, &e))?;
        }
        Program::load(&folder.join(&job.main.name))
    }
}
