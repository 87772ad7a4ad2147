//! The rules of `ARCHITECTURE.md`, read off the sources.

use std::fs;
use std::path::{Path, PathBuf};

/// The rooms in reading order: each may use those before it.
const ROOMS: [&str; 15] = [
    "cancellation",
    "diagnostics",
    "tuning",
    "syntax",
    "ir",
    "exec",
    "semantics",
    "zones",
    "analysis",
    "network",
    "search",
    "game",
    "verify",
    "engine",
    "python",
];

/// Pairs that the order would allow and the design does not: (room, room that it must not use).
const APART: [(&str, &str); 19] = [
    ("ir", "syntax"),
    ("exec", "syntax"),
    ("zones", "ir"),
    ("zones", "exec"),
    ("zones", "semantics"),
    ("analysis", "semantics"),
    ("analysis", "syntax"),
    ("network", "semantics"),
    ("network", "syntax"),
    ("search", "semantics"),
    ("game", "semantics"),
    ("game", "syntax"),
    ("verify", "syntax"),
    ("verify", "semantics"),
    ("verify", "zones"),
    ("verify", "analysis"),
    ("verify", "network"),
    ("verify", "search"),
    ("verify", "game"),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the sources are there") {
        let path = entry.expect("the sources can be listed").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Every source file with its room and its text without comments.
fn files() -> Vec<(PathBuf, String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    sources(&root, &mut paths);
    paths.sort();
    let files = paths.into_iter().map(|path| {
        let first = path
            .strip_prefix(&root)
            .ok()
            .and_then(|path| path.components().next())
            .expect("every source lies below the root");
        let room = first
            .as_os_str()
            .to_string_lossy()
            .trim_end_matches(".rs")
            .to_owned();
        let text = fs::read_to_string(&path).expect("the sources are text");
        let code: Vec<&str> = text
            .lines()
            .map(|line| line.split("//").next().unwrap_or(""))
            .collect();
        (path, room, code.join("\n"))
    });
    files.collect()
}

fn used_rooms(code: &str) -> Vec<&'static str> {
    ROOMS
        .into_iter()
        .filter(|room| code.contains(&format!("crate::{room}")))
        .collect()
}

#[test]
fn rooms_use_only_rooms_before_them() {
    let place = |room: &str| ROOMS.iter().position(|one| *one == room);
    let mut violations = Vec::new();
    for (path, room, code) in files() {
        let Some(own) = place(&room) else { continue };
        for used in used_rooms(&code) {
            let is_apart = APART.contains(&(room.as_str(), used));
            if place(used).is_some_and(|other| other > own) || is_apart {
                violations.push(format!("{} uses {used}", path.display()));
            }
        }
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

#[test]
fn every_source_file_belongs_to_a_room() {
    let strays: Vec<_> = files()
        .into_iter()
        .filter(|(_, room, _)| room != "lib" && !ROOMS.contains(&room.as_str()))
        .map(|(path, ..)| path)
        .collect();
    assert!(strays.is_empty(), "{strays:?}");
}

#[test]
fn unsafe_stands_only_in_the_compiler() {
    for (path, room, code) in files() {
        let has_unsafe =
            code.contains("unsafe {") || code.contains("unsafe fn") || code.contains("unsafe impl");
        let is_allowed = room == "exec" && path.components().any(|part| part.as_os_str() == "jit");
        assert!(
            !has_unsafe || is_allowed,
            "{} has unsafe code",
            path.display()
        );
    }
}

#[test]
fn python_is_named_in_one_file() {
    for (path, room, code) in files() {
        assert!(
            !code.contains("pyo3") || room == "python",
            "{} names PyO3",
            path.display()
        );
    }
}

#[test]
fn nothing_prints_or_exits() {
    for (path, _, code) in files() {
        for word in ["println!", "eprintln!", "print!(", "process::exit"] {
            assert!(!code.contains(word), "{} has {word}", path.display());
        }
    }
}

#[test]
fn comments_keep_to_100_columns() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for folder in ["src", "tests", "benches"] {
        sources(&root.join(folder), &mut paths);
    }
    for path in paths {
        let text = fs::read_to_string(&path).expect("the sources are text");
        for (line, words) in text.lines().enumerate() {
            let is_long = words.trim_start().starts_with("//") && words.chars().count() > 100;
            assert!(!is_long, "{}:{} is long", path.display(), line + 1);
        }
    }
}
