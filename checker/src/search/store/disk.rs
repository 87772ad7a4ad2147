//! What a search reads seldom, on disk: a file that only grows, and that is mapped into memory.
//!
//! The file lies in a folder of its own, and is locked as long as the search runs. The folder goes
//! when the search ends. If the process dies, the system takes the lock away: the next search that
//! is given the same place sees a folder whose file is not locked, and removes it.
//!
//! Pages of the file that were read lie in memory until [`Disk::make_room`] lets them go; the
//! system may keep them.
//!
//! Invariants:
//! * The file is written at its end only, and what was written is never changed.
//! * Extents begin at a multiple of [`PAGE_BYTES`].

use std::fs::{self, File, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use memmap2::{Mmap, MmapOptions};

/// How the names of the folders begin.
const PREFIX: &str = "ntagen-states-";

/// The name of the file.
const FILE: &str = "states";

/// The parts that the system maps.
const PAGE_BYTES: u64 = 4096;

/// States go to disk when they take more than this part of the memory that they may take.
const FULL: f64 = 0.95;

/// It is not worth writing less than this part of it.
const LEAST: f64 = 0.02;

/// Successive bytes on disk.
#[derive(Clone, Debug)]
pub(super) struct Extent {
    map: Arc<Mmap>,
    first: usize,
    bytes: usize,
}

impl Extent {
    #[inline]
    pub(super) fn bytes(&self) -> &[u8] {
        &self.map[self.first..self.first + self.bytes]
    }

    /// Lets go of the pages that were read of it, and of all that was written with it.
    pub(super) fn let_go(&self) {
        let_go(&self.map);
    }
}

/// What may be put on disk.
pub(in crate::search) trait Cold {
    /// The bytes of memory that [`Cold::spill`] gives back.
    fn cold_bytes(&self) -> usize;

    /// Puts what is likely to be read seldom on disk.
    ///
    /// # Errors
    /// It cannot be written; then it stays in memory.
    fn spill(&mut self, disk: &Disk) -> io::Result<()>;
}

/// A file for states that have no room in memory.
#[derive(Debug)]
pub struct Disk {
    folder: PathBuf,
    memory_bytes: u64,
    written: Mutex<Written>,
    /// What the process had mapped before.
    mapped_before: u64,
}

#[derive(Debug)]
struct Written {
    file: File,
    end: u64,
    maps: Vec<Arc<Mmap>>,
}

impl Disk {
    /// A file in a new folder in `place`, for states that may take so much memory; if it is not
    /// said, half of what is free. The place is made if it is missing; what a process that died has
    /// left there is removed.
    ///
    /// # Errors
    /// The place cannot be read or written, or the system does not say how much memory is free.
    pub fn new(place: &Path, memory_bytes: Option<u64>) -> io::Result<Disk> {
        let free = || free_bytes().map(|bytes| bytes / 2);
        let memory_bytes = memory_bytes.or_else(free).ok_or_else(|| {
            io::Error::other("the system does not say how much memory is free: give a limit")
        })?;
        fs::create_dir_all(place)?;
        for entry in fs::read_dir(place)? {
            remove_if_left(&entry?.path());
        }
        let (folder, file) = loop {
            let folder = new_folder(place)?;
            match File::create_new(folder.join(FILE)) {
                // Another process took the folder for one that was left.
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                file => break (folder, file?),
            }
        };
        file.try_lock()?;
        Ok(Disk {
            folder,
            memory_bytes,
            written: Mutex::new(Written {
                file,
                end: 0,
                maps: Vec::new(),
            }),
            mapped_before: mapped_bytes(),
        })
    }

    /// Makes room in memory for a search that takes so many bytes, and may take `growth` more
    /// before it asks again: lets go of what was read, and puts on disk what is cold.
    ///
    /// # Errors
    /// It cannot be written.
    pub(in crate::search) fn make_room(
        &self,
        bytes: u64,
        growth: usize,
        cold: &mut [&mut dyn Cold],
    ) -> io::Result<()> {
        let room = (FULL * self.memory_bytes as f64) as u64;
        let written = self.written();
        if !written.maps.is_empty() {
            let mapped = mapped_bytes().saturating_sub(self.mapped_before);
            if bytes + mapped > room {
                written.maps.iter().for_each(|map| let_go(map));
            }
        }
        drop(written);
        if bytes + growth as u64 <= room {
            return Ok(());
        }
        let cold_bytes: usize = cold.iter().map(|one| one.cold_bytes()).sum();
        if cold_bytes as f64 >= LEAST * self.memory_bytes as f64 {
            for one in cold {
                one.spill(self)?;
            }
            give_back();
        }
        Ok(())
    }

    /// Writes these parts one after the other.
    ///
    /// # Errors
    /// They cannot be written: the disk is full, for example.
    pub(super) fn write(&self, parts: &[&[u8]]) -> io::Result<Vec<Extent>> {
        let mut written = self.written();
        let Written { file, end, maps } = &mut *written;
        let first = end.next_multiple_of(PAGE_BYTES);
        file.seek(SeekFrom::Start(first))?;
        for part in parts {
            file.write_all(part)?;
        }
        let bytes = parts.iter().map(|part| part.len()).sum::<usize>();
        *end = first + bytes as u64;
        let map = Arc::new(map(file, first, bytes)?);
        maps.push(Arc::clone(&map));
        let mut first = 0;
        let extents = parts.iter().map(|part| {
            let bytes = part.len();
            first += bytes;
            Extent {
                map: Arc::clone(&map),
                first: first - bytes,
                bytes,
            }
        });
        Ok(extents.collect())
    }

    fn written(&self) -> MutexGuard<'_, Written> {
        self.written.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // Nobody waits for the answer to a removal that fails; the next search tries it again.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// A new folder for this process.
fn new_folder(place: &Path) -> io::Result<PathBuf> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = place.join(format!("{PREFIX}{}-{number}", process::id()));
        match fs::create_dir(&folder) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|()| folder),
        }
    }
}

/// Removes a folder of a process that has died.
fn remove_if_left(folder: &Path) {
    let name = folder.file_name().and_then(|name| name.to_str());
    if !name.is_some_and(|name| name.starts_with(PREFIX)) {
        return;
    }
    match File::options().write(true).open(folder.join(FILE)) {
        Ok(file) => {
            if !matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
                let _ = fs::remove_dir_all(folder);
            }
        }
        // It has no file: only an empty folder is removed.
        Err(_) => {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Maps a part of the file.
#[expect(unsafe_code, reason = "the map of a file may change with the file")]
fn map(file: &File, first: u64, bytes: usize) -> io::Result<Mmap> {
    // SAFETY: This process has the only lock of the file, and writes behind the map only. Whoever
    // changes a locked file of another program by hand makes its answers wrong in any case.
    let map = unsafe { MmapOptions::new().offset(first).len(bytes).map(file)? };
    #[cfg(unix)]
    map.advise(memmap2::Advice::Random)?;
    Ok(map)
}

/// Takes the pages of a map out of the memory of this process.
#[cfg(unix)]
#[expect(unsafe_code, reason = "other kinds of maps lose what was written")]
fn let_go(map: &Mmap) {
    // SAFETY: The map is one of a file, and cannot be written: its pages are read from there again.
    // Advice that the system does not take changes nothing.
    let _ = unsafe { map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) };
}

#[cfg(not(unix))]
fn let_go(_: &Mmap) {}

/// Gives memory that was freed back to the system: else it could only be used for blocks again.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(
    unsafe_code,
    reason = "the allocator is called past the standard library"
)]
fn give_back() {
    // SAFETY: It takes no pointers, and may be called at any time.
    unsafe { libc::malloc_trim(0) };
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn give_back() {}

/// The bytes of memory that new work may take, where the system says it.
fn free_bytes() -> Option<u64> {
    let all = fs::read_to_string("/proc/meminfo").ok()?;
    let line = all
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

/// The bytes in memory of the files that this process maps, where the system says it; else 0.
fn mapped_bytes() -> u64 {
    let pages = fs::read_to_string("/proc/self/statm").ok();
    let pages = pages.and_then(|line| line.split_whitespace().nth(2)?.parse::<u64>().ok());
    pages.unwrap_or(0) * PAGE_BYTES
}

/// A folder for a test, which does not exist.
#[cfg(test)]
pub(super) fn test_place(name: &str) -> PathBuf {
    let place = std::env::temp_dir().join(format!("ntagen-test-{name}-{}", process::id()));
    let _ = fs::remove_dir_all(&place);
    place
}

#[cfg(test)]
mod tests {
    use super::test_place as place;
    use super::*;

    #[test]
    fn what_is_written_comes_back_and_the_folder_goes() {
        let place = place("disk");
        let disk = Disk::new(&place, Some(1 << 20)).expect("there is room");
        let mut all = Vec::new();
        for count in 1..40_u8 {
            let parts = [vec![count; 100 * usize::from(count)], vec![!count]];
            let extents = disk.write(&[&parts[0], &parts[1]]).expect("there is room");
            all.extend(extents.into_iter().zip(parts));
            for (extent, _) in &all {
                Extent::let_go(extent);
            }
        }
        for (extent, part) in &all {
            assert_eq!(extent.bytes(), part);
        }
        assert_eq!(fs::read_dir(&place).expect("it was made").count(), 1);
        drop(disk);
        assert_eq!(fs::read_dir(&place).expect("it was made").count(), 0);
        fs::remove_dir(place).expect("it is empty");
    }

    #[test]
    fn only_what_nobody_uses_is_removed() {
        let place = place("left");
        let used = Disk::new(&place, Some(1 << 20)).expect("there is room");
        let left = place.join(format!("{PREFIX}1-0"));
        fs::create_dir(&left).expect("there is room");
        fs::write(left.join(FILE), "of a process that died").expect("there is room");
        fs::create_dir(place.join(format!("{PREFIX}1-1"))).expect("there is room");
        fs::write(place.join("states"), "of the user").expect("there is room");
        let other = Disk::new(&place, Some(1 << 20)).expect("there is room");
        assert!(!left.exists() && used.folder.exists() && other.folder.exists());
        assert_eq!(fs::read_dir(&place).expect("it was made").count(), 3);
        drop((used, other));
        fs::remove_dir_all(place).expect("it is ours");
    }
}
