//! The rules of `ARCHITECTURE.md`, read off the sources.

mod circles;

use std::fs;
use std::path::{Path, PathBuf};

/// The rooms in reading order: each may use those before it.
const ROOMS: [&str; 20] = [
    "cancellation",
    "diagnostics",
    "tuning",
    "builtins",
    "syntax",
    "names",
    "ir",
    "exec",
    "semantics",
    "zones",
    "analysis",
    "network",
    "search",
    "game",
    "stochastic",
    "learning",
    "shield",
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

/// A file of the crate.
struct Source {
    path: PathBuf,
    /// The parts of its module path, as in `network/discrete/stepper`.
    module: String,
    room: String,
    /// Its text without comments.
    code: String,
}

/// Every source file of the crate.
fn sources_of_the_crate() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    sources(&root, &mut paths);
    paths.sort();
    let files = paths.into_iter().map(|path| {
        let below = path.strip_prefix(&root).expect("it lies below the root");
        let parts: Vec<_> = below
            .with_extension("")
            .iter()
            .map(|part| part.to_string_lossy().into_owned())
            .filter(|part| part != "mod")
            .collect();
        let text = fs::read_to_string(&path).expect("the sources are text");
        let code: Vec<&str> = text
            .lines()
            .map(|line| line.split("//").next().unwrap_or(""))
            .collect();
        Source {
            room: parts[0].clone(),
            module: parts.join("/"),
            code: code.join("\n"),
            path,
        }
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
    for Source {
        path, room, code, ..
    } in sources_of_the_crate()
    {
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
    let strays: Vec<_> = sources_of_the_crate()
        .into_iter()
        .filter(|one| one.room != "lib" && !ROOMS.contains(&one.room.as_str()))
        .map(|one| one.path)
        .collect();
    assert!(strays.is_empty(), "{strays:?}");
}

#[test]
fn unsafe_stands_only_in_the_compiler_and_where_files_are_mapped() {
    for Source {
        path, room, code, ..
    } in sources_of_the_crate()
    {
        let has_unsafe =
            code.contains("unsafe {") || code.contains("unsafe fn") || code.contains("unsafe impl");
        let is_compiler = room == "exec" && path.components().any(|part| part.as_os_str() == "jit");
        let is_allowed = is_compiler || path.ends_with("search/store/disk.rs");
        assert!(
            !has_unsafe || is_allowed,
            "{} has unsafe code",
            path.display()
        );
    }
}

#[test]
fn python_is_named_in_one_file() {
    for Source {
        path, room, code, ..
    } in sources_of_the_crate()
    {
        assert!(
            !code.contains("pyo3") || room == "python",
            "{} names PyO3",
            path.display()
        );
    }
}

#[test]
fn nothing_prints_or_exits() {
    for Source { path, code, .. } in sources_of_the_crate() {
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
