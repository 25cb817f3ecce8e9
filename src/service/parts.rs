//! Rows of stored studies as Apache Parquet, in a folder of the team's own: a file for each chunk, which is whole or not there.
//!
//! A chunk's bytes follow from the study, its chunks' size and the chunk's number. So it does no harm that two workers write the same file, one of whom was
//! taken for dead, and what a dead one left behind is the beginning of what the next one writes.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use toothwave_study::Study;

use crate::beside::beside;

/// Where rows are kept.
#[derive(Debug, Clone)]
pub struct Parts {
    folder: PathBuf,
}

impl Parts {
    /// In this folder.
    ///
    /// # Errors
    /// Where it is none.
    pub fn new(folder: &Path) -> io::Result<Self> {
        let shown = folder.display();
        let is_folder =
            fs::metadata(folder).map_err(|error| io::Error::new(error.kind(), format!("{shown}: {error}")))?.is_dir();
        if is_folder {
            Ok(Self { folder: folder.to_owned() })
        } else {
            Err(io::Error::new(io::ErrorKind::NotADirectory, format!("{shown} is no folder")))
        }
    }

    /// Keeps the rows of a chunk, in the place of what stands there.
    ///
    /// # Errors
    /// Where the folder is not there, or takes no more.
    pub async fn keep(&self, study: &Study, chunk: u64, rows: Bytes) -> io::Result<()> {
        // A study that was forgotten and asked for again may have other chunks, of which none may stand among these.
        let folder = self.folder.join(format!("{}-by-{}", study.id(), study.chunk_variants()));
        // A folder elsewhere may never answer.
        beside(move || write(&folder, chunk, &rows)).await?
    }
}

fn write(folder: &Path, chunk: u64, rows: &[u8]) -> io::Result<()> {
    match fs::create_dir(folder) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    let whole = folder.join(format!("{chunk:010}.parquet"));
    // Readers of data sets pass over what begins with a dot.
    let begun = folder.join(format!(".{chunk:010}.begun"));
    // Not emptied first: another may be about to rename it.
    let mut file = OpenOptions::new().write(true).create(true).truncate(false).open(&begun)?;
    #[cfg(feature = "fault-injection")]
    crate::injected::half_a_part(chunk, &mut file, rows)?;
    file.write_all(rows)?;
    file.set_len(rows.len() as u64)?;
    // The database will say that the chunk is done: then its rows are there even after a power cut.
    file.sync_all()?;
    match fs::rename(&begun, &whole) {
        // The other one has.
        Err(error) if error.kind() == io::ErrorKind::NotFound && whole.exists() => Ok(()),
        Err(error) => Err(error),
        Ok(()) => File::open(folder)?.sync_all(),
    }
}
