//! Where queries save and load strategies.
//!
//! A model comes from anybody, and its own queries name files. So a strategy is saved below the
//! current folder or one that the user allows, links followed, and over nothing but a strategy; one
//! is loaded from any plain file. A file is written completely or not at all, and an existing one
//! keeps its mode and, where that is allowed, its owner.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::engine::format::json_reader::MACHINE_FORMAT;
use crate::engine::format::{shield_json, strategy_json};

/// The largest file that is loaded.
const MOST_BYTES: u64 = 2 << 30;

/// How much of a file is looked at to see whether it is a strategy.
const LOOK_BYTES: u64 = 64 << 10;

/// Why a strategy is not saved or loaded: what is wrong, and what to do about it.
#[derive(Debug)]
pub(super) struct Refusal {
    pub message: String,
    pub help: String,
}

/// Saves the text of a strategy. It may lie below the current folder and the `allowed` folders.
pub(super) fn save(path: &Path, text: &str, allowed: &[PathBuf]) -> Result<(), Refusal> {
    let failed = |error: &io::Error| Refusal {
        message: format!("{} cannot be written: {error}", path.display()),
        help: String::from("choose another file"),
    };
    let place = followed(path).map_err(|error| failed(&error))?;
    let current = std::env::current_dir();
    let mut folders = allowed.iter().chain(current.as_ref()).map(fs::canonicalize);
    if !folders.any(|folder| folder.is_ok_and(|folder| place.starts_with(folder))) {
        let folder = place.parent().unwrap_or(&place);
        return Err(Refusal {
            message: format!(
                "{} cannot be written: it is not below the current folder",
                path.display()
            ),
            help: format!("allow it with --allow-write {}", folder.display()),
        });
    }
    match is_free(&place) {
        Ok(true) => {}
        Ok(false) => {
            return Err(Refusal {
                message: format!(
                    "{} cannot be written: it exists, and is no strategy",
                    path.display()
                ),
                help: String::from("remove it, or choose another file"),
            });
        }
        Err(error) => return Err(failed(&error)),
    }
    write_whole(&place, text).map_err(|error| failed(&error))
}

/// The bytes of a file with a strategy.
pub(super) fn load(path: &Path) -> Result<Vec<u8>, Refusal> {
    let refused = |why: &str| Refusal {
        message: format!("{} cannot be read: {why}", path.display()),
        help: String::from("relative paths start at the folder of the file that the query is in"),
    };
    // Looked at before it is opened: to open a pipe waits for a writer.
    let found = fs::metadata(path).map_err(|error| refused(&error.to_string()))?;
    if !found.is_file() {
        return Err(refused("it is no plain file"));
    }
    if found.len() > MOST_BYTES {
        return Err(refused("it is too large"));
    }
    fs::read(path).map_err(|error| refused(&error.to_string()))
}

/// The file that a path leads to, links followed; it need not be there, but its folder.
fn followed(path: &Path) -> io::Result<PathBuf> {
    if path
        .symlink_metadata()
        .is_ok_and(|found| found.is_symlink())
    {
        return fs::canonicalize(path);
    }
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let name = path.file_name().ok_or(io::ErrorKind::IsADirectory)?;
    Ok(fs::canonicalize(folder)?.join(name))
}

/// Whether nothing would be lost: there is no file, or an empty one, or a strategy.
fn is_free(place: &Path) -> io::Result<bool> {
    match fs::metadata(place) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(true),
        Err(error) => return Err(error),
        Ok(found) if !found.is_file() => return Ok(false),
        Ok(_) => {}
    }
    // A user who may not write the file may still be able to rename another file to it.
    OpenOptions::new().write(true).open(place)?;
    let mut start = Vec::new();
    File::open(place)?
        .take(LOOK_BYTES)
        .read_to_end(&mut start)?;
    Ok(start.is_empty() || is_strategy(&String::from_utf8_lossy(&start)))
}

/// Whether a file that begins so is a strategy: of ours, in all forms, or of UPPAAL's, learned
/// ones and those in zones.
fn is_strategy(start: &str) -> bool {
    let has = |name: &str| start.contains(&format!("\"{name}\""));
    if start.trim_start().starts_with('{') {
        let ours = [strategy_json::FORMAT, MACHINE_FORMAT, shield_json::FORMAT];
        let is_ours = has("format") && ours.iter().any(|format| has(format));
        return is_ours || (has("version") && has("type") && has("representation"));
    }
    start
        .lines()
        .any(|line| line.starts_with("State: (") || line.starts_with("Strategy to "))
}

/// Writes a file under another name in the same folder, and then renames it to its own name.
fn write_whole(place: &Path, text: &str) -> io::Result<()> {
    let old = fs::metadata(place).ok();
    let (part, mut file) = new_part(place, old.is_some())?;
    let written = keep_access(&file, old.as_ref())
        .and_then(|()| file.write_all(text.as_bytes()))
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::rename(&part, place));
    if written.is_err() {
        // What is left of it is of no use; that it cannot be removed says nothing new.
        let _ = fs::remove_file(&part);
    }
    written
}

/// A new file in the same folder. Nobody else may read it until it has the mode of the file that it
/// replaces.
fn new_part(place: &Path, is_replaced: bool) -> io::Result<(PathBuf, File)> {
    static PARTS: AtomicU64 = AtomicU64::new(0);
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, if is_replaced { 0o600 } else { 0o666 });
    #[cfg(not(unix))]
    let _ = is_replaced;
    loop {
        let number = PARTS.fetch_add(1, Ordering::Relaxed);
        let part = place.with_file_name(format!(".ntagen-{}-{number}.part", std::process::id()));
        match options.open(&part) {
            // A process with the same number was killed and left it there.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            opened => return opened.map(|file| (part, file)),
        }
    }
}

/// Gives a file the owner and the mode of the one whose place it takes.
fn keep_access(file: &File, old: Option<&fs::Metadata>) -> io::Result<()> {
    let Some(old) = old else {
        return Ok(());
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, fchown};
        // Only root may give files away.
        let _ = fchown(file, Some(old.uid()), Some(old.gid()));
    }
    file.set_permissions(old.permissions())
}
