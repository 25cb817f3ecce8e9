//! A folder with a file for each part: a checkpoint of one process, or what many jobs of a cluster computed.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process;

/// Ends the names of parts.
const SUFFIX: &str = ".parquet";

/// A folder of the parts of one study.
#[derive(Debug)]
pub struct PartFolder {
    path: PathBuf,
}

impl PartFolder {
    /// The folder at this path, which is made if it is not there.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn create(path: &Path) -> io::Result<Self> {
        fs::create_dir_all(path)?;
        Self::open(path)
    }

    /// The folder at this path.
    ///
    /// # Errors
    /// If it is no folder.
    pub fn open(path: &Path) -> io::Result<Self> {
        fs::read_dir(path)?;
        Ok(Self { path: path.to_owned() })
    }

    /// The chunks that have a part here.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn chunks(&self) -> io::Result<BTreeSet<u64>> {
        let mut chunks = BTreeSet::new();
        for entry in fs::read_dir(&self.path)? {
            let name = entry?.file_name();
            chunks.extend(name.to_str().and_then(|name| name.strip_suffix(SUFFIX)?.parse::<u64>().ok()));
        }
        Ok(chunks)
    }

    /// The file of a chunk. Names sort by chunks, so that tools which read the whole folder find the rows in their order.
    pub fn file(&self, chunk: u64) -> PathBuf {
        self.path.join(format!("{chunk:010}{SUFFIX}"))
    }

    /// The bytes of a part.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn read(&self, chunk: u64) -> io::Result<Vec<u8>> {
        fs::read(self.file(chunk))
    }

    /// Writes a part so that its file is whole or not there, even if the machine stops meanwhile.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write(&self, chunk: u64, bytes: &[u8]) -> io::Result<()> {
        let (mut file, temporary) = self.temporary(chunk)?;
        let written = file
            .write_all(bytes)
            .and_then(|()| file.sync_all())
            .and_then(|()| fs::rename(&temporary, self.file(chunk)))
            .and_then(|()| File::open(&self.path)?.sync_all());
        if written.is_err() {
            // It may be gone already.
            let _ = fs::remove_file(&temporary);
        }
        written
    }

    /// A new file with a name that no reader takes for a part. Jobs on several machines may write the same chunk at once.
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
