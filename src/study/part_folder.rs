//! A folder with one file for each part: the checkpoint of a process, or the output of the jobs of a cluster.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process;

/// Suffix of the names of part files.
const SUFFIX: &str = ".parquet";

/// A folder of the parts of one study.
#[derive(Debug)]
pub struct PartFolder {
    path: PathBuf,
}

impl PartFolder {
    /// Opens the folder at this path, and creates it if it does not exist.
    pub fn create(path: &Path) -> io::Result<Self> {
        fs::create_dir_all(path)?;
        Self::open(path)
    }

    /// Opens the folder at this path.
    pub fn open(path: &Path) -> io::Result<Self> {
        fs::read_dir(path)?;
        Ok(Self { path: path.to_owned() })
    }

    /// Returns the chunks that have a part in the folder.
    pub fn chunks(&self) -> io::Result<BTreeSet<u64>> {
        let mut chunks = BTreeSet::new();
        for entry in fs::read_dir(&self.path)? {
            let name = entry?.file_name();
            chunks.extend(name.to_str().and_then(|name| name.strip_suffix(SUFFIX)?.parse::<u64>().ok()));
        }
        Ok(chunks)
    }

    /// Returns the path of a chunk's file. Sorted names are in the order of chunks, so that tools which read the whole
    /// folder get the rows in order.
    pub fn file(&self, chunk: u64) -> PathBuf {
        self.path.join(format!("{chunk:010}{SUFFIX}"))
    }

    /// Reads the bytes of a part.
    pub fn read(&self, chunk: u64) -> io::Result<Vec<u8>> {
        fs::read(self.file(chunk))
    }

    /// Writes a part atomically: after a crash its file is complete or absent.
    pub fn write(&self, chunk: u64, bytes: &[u8]) -> io::Result<()> {
        let (mut file, temporary) = self.temporary(chunk)?;
        let written = file
            .write_all(bytes)
            .and_then(|()| file.sync_all())
            .and_then(|()| fs::rename(&temporary, self.file(chunk)))
            .and_then(|()| File::open(&self.path)?.sync_all());
        if written.is_err() {
            // The file may have been renamed already.
            let _ = fs::remove_file(&temporary);
        }
        written
    }

    /// Creates a temporary file, whose name is not that of a part. Jobs on several machines may write the same chunk at
    /// once.
    fn temporary(&self, chunk: u64) -> io::Result<(File, PathBuf)> {
        let mut attempt = 0_u64;
        loop {
            let path = self.path.join(format!(".{chunk:010}-{}-{attempt}.tmp", process::id()));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((file, path)),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => attempt += 1,
                Err(error) => return Err(error),
            }
        }
    }
}
