//! The files of `tests/corpus`, which the tests in Rust and in Python share.

use std::fs;
use std::path::{Path, PathBuf};

/// A folder of the corpus.
pub(crate) fn folder(name: &str) -> PathBuf {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/corpus");
    corpus.join(name)
}

/// The files of a folder of the corpus and of all folders in it, sorted.
pub(crate) fn files(name: &str) -> Vec<PathBuf> {
    let files = files_below(&folder(name));
    assert!(!files.is_empty(), "the corpus has no {name}");
    files
}

/// The files of the whole corpus, and those of the folders that an environment variable names,
/// separated by colons.
pub(crate) fn files_and_more(variable: &str) -> Vec<PathBuf> {
    let mut all = files("");
    let more = std::env::var(variable).unwrap_or_default();
    for folder in more.split(':').filter(|folder| !folder.is_empty()) {
        all.extend(files_below(Path::new(folder)));
    }
    all
}

/// The files of any folder and of all folders in it, sorted.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder can be listed");
    let entries = entries.map(|entry| entry.expect("the folder can be listed").path());
    let mut paths: Vec<PathBuf> = entries.collect();
    paths.sort();
    let files = paths.into_iter().flat_map(|path| {
        if path.is_dir() {
            files_below(&path)
        } else {
            vec![path]
        }
    });
    files.collect()
}

/// The queries that a model of the corpus names in its comments.
pub(crate) fn queries(text: &str) -> Vec<String> {
    let queries = text
        .lines()
        .filter_map(|line| line.strip_prefix("// query: "));
    queries.map(str::to_owned).collect()
}
