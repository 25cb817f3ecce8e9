//! Gives the build its id: a hash of all sources, of what they are built with, and of the target. Two builds with one id give the same bytes.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

fn main() -> io::Result<()> {
    // As it runs, not as it was compiled: checkouts that share a folder of builds share this program.
    let manifest = env::var("CARGO_MANIFEST_DIR").map_err(io::Error::other)?;
    let root = Path::new(&manifest).join("../..");
    // Not src/python: no answer follows from it, and builds put their files there.
    let names = ["Cargo.lock", "Cargo.toml", "examples", "src/calculation", "src/service", "src/solver", "src/study"];
    let sources = names.map(|name| root.join(name));
    let mut files = Vec::new();
    for source in &sources {
        println!("cargo:rerun-if-changed={}", source.display());
        collect(source, &mut files)?;
    }
    files.sort();
    let mut hasher = blake3::Hasher::new();
    for file in &files {
        // Where the tree stands is none of it.
        let name = file.strip_prefix(&root).unwrap_or(file);
        hasher
            .update(name.as_os_str().as_encoded_bytes())
            .update(b"\0")
            .update(blake3::hash(&fs::read(file)?).as_bytes());
    }
    for (name, value) in ["TARGET", "CARGO_CFG_TARGET_FEATURE"].map(|name| (name, env::var(name))) {
        hasher.update(name.as_bytes()).update(b"=").update(value.unwrap_or_default().as_bytes()).update(b"\0");
    }
    println!("cargo:rustc-env=TOOTHWAVE_BUILD={}", &hasher.finalize().to_hex()[..16]);
    Ok(())
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            collect(&entry?.path(), files)?;
        }
    } else {
        files.push(path.to_owned());
    }
    Ok(())
}
