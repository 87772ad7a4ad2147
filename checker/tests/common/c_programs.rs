//! Programs in C that are made of the games of the corpus.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::corpus;

/// The games of the corpus, each with one of its queries that begins like this.
pub(crate) fn games(beginning: &str) -> Vec<(PathBuf, String)> {
    let mut games = Vec::new();
    for path in corpus::files("games") {
        let text = fs::read_to_string(&path).expect("the model is there");
        let queries = corpus::queries(&text).into_iter();
        let wanted = queries.filter(|query| query.starts_with(beginning));
        games.extend(wanted.map(|query| (path.clone(), query)));
    }
    games
}

/// Does something with an empty folder of this name, which is gone afterwards.
pub(crate) fn in_folder(name: &str, work: impl FnOnce(&Path)) {
    let folder = std::env::temp_dir().join(format!("{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("the folder can be made");
    work(&folder);
    fs::remove_dir_all(&folder).expect("the folder can be removed");
}

/// Compiles a program in C99, about which the compiler must have nothing to say, into the folder.
pub(crate) fn compiled(folder: &Path, text: &str, name: &str) -> PathBuf {
    let (source, program) = (folder.join("program.c"), folder.join("program"));
    fs::write(&source, text).expect("the folder can be written");
    let output = Command::new("cc")
        .args([
            "-std=c99",
            "-pedantic",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-O1",
            "-o",
        ])
        .args([&program, &source])
        .output()
        .expect("there is a C compiler");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}:\n{said}\n{text}");
    program
}
