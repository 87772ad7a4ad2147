//! No circle of files: a file may not use one that uses it, directly or through others, so that a
//! reader can take the files of a room one after the other.
//!
//! Who uses whom is read off the paths in the code: `use` trees, and paths that begin with `crate`
//! or `super`. A name that a file only passes on (`pub use`) counts for the file that it comes
//! from. Tests beside a module are left out.

use std::collections::{BTreeMap, BTreeSet};

use crate::Source;

/// Files that pass on the same name, at most.
const MOST_STEPS: usize = 5;

type Name = Vec<String>;

fn name(text: &str) -> Name {
    text.split("::")
        .filter(|part| !part.is_empty())
        .map(str::to_owned)
        .collect()
}

/// A path of a `use` declaration, and the name that it gives to what it leads to.
struct Import {
    path: Name,
    alias: String,
}

/// The paths of a `use` tree.
fn imports(tree: &str) -> Vec<Import> {
    let tree = tree.trim();
    let Some((before, inner)) = tree.split_once('{') else {
        let (path, alias) = tree.split_once(" as ").unwrap_or((tree, ""));
        let path = name(path.trim());
        let alias = match alias.trim() {
            "" => path.last().cloned().unwrap_or_default(),
            alias => alias.to_owned(),
        };
        return vec![Import { path, alias }];
    };
    let inner = inner.trim_end().trim_end_matches('}');
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (index, letter) in inner.char_indices().chain([(inner.len(), ',')]) {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let branch = &inner[start..index];
                start = (index + 1).min(inner.len());
                if !branch.trim().is_empty() {
                    found.extend(imports(branch));
                }
            }
            _ => {}
        }
    }
    let prefix = name(before.trim());
    for import in &mut found {
        import.path.splice(0..0, prefix.iter().cloned());
    }
    found
}

fn is_part_of_name(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_' || letter == ':'
}

/// What the code of a file names.
#[derive(Default)]
struct Paths {
    used: Vec<Name>,
    passed_on: Vec<Import>,
}

fn paths(code: &str) -> Paths {
    let mut paths = Paths::default();
    let mut before = String::new();
    // Where something may be seen says nothing about what is used.
    let code = code.replace("(in crate::", "(in ");
    // Declarations end with a semicolon, and nothing else that begins with `use ` does.
    for statement in code.split(';') {
        let begin = statement
            .match_indices("use ")
            .map(|(place, _)| place)
            .find(|&place| !statement[..place].ends_with(is_part_of_name));
        let Some(begin) = begin else {
            before.push_str(statement);
            continue;
        };
        let lead = &statement[..begin];
        before.push_str(lead);
        let found = imports(&statement[begin + "use ".len()..]);
        paths.used.extend(found.iter().map(|one| one.path.clone()));
        let last_line = lead.lines().last().unwrap_or("");
        if last_line.trim_start().starts_with("pub") {
            paths.passed_on.extend(found);
        }
    }
    for word in before.split(|letter| !is_part_of_name(letter)) {
        if word.starts_with("crate::") || word.starts_with("super::") {
            paths.used.push(name(word));
        }
    }
    paths
}

/// All files with what they name.
struct Graph {
    files: BTreeMap<Name, Paths>,
    /// Names that a file passes on, and where they come from.
    passed_on: BTreeMap<Name, Name>,
}

impl Graph {
    fn new(sources: &[Source]) -> Graph {
        let mut graph = Graph {
            files: BTreeMap::new(),
            passed_on: BTreeMap::new(),
        };
        for source in sources {
            let code = source.code.split("\n#[cfg(test)]\nmod tests {").next();
            let file = name(&source.module.replace('/', "::"));
            graph.files.insert(file, paths(code.unwrap_or("")));
        }
        for (file, paths) in &graph.files {
            for import in &paths.passed_on {
                let target = graph.absolute(file, &import.path);
                if let Some(target) = target.filter(|target| graph.file(target).is_some()) {
                    let mut name = file.clone();
                    name.push(import.alias.clone());
                    graph.passed_on.insert(name, target);
                }
            }
        }
        graph
    }

    /// A path from the root; `None` if it leads out of the crate.
    fn absolute(&self, file: &Name, path: &[String]) -> Option<Name> {
        let (first, rest) = path.split_first()?;
        match first.as_str() {
            "crate" => Some(rest.to_vec()),
            "self" => Some([file, rest].concat()),
            "super" => {
                let up = path.iter().take_while(|part| *part == "super").count();
                let kept = file.len().saturating_sub(up);
                Some([&file[..kept], &path[up..]].concat())
            }
            _ => {
                let below = [file.as_slice(), &path[..1]].concat();
                let is_known = self.files.contains_key(&below);
                is_known.then(|| [file.as_slice(), path].concat())
            }
        }
    }

    /// The file that a name lies in.
    fn file(&self, name: &[String]) -> Option<Name> {
        let prefixes = (1..=name.len()).rev().map(|length| &name[..length]);
        prefixes
            .filter(|prefix| self.files.contains_key(*prefix))
            .map(<[String]>::to_vec)
            .next()
    }

    /// Where a name comes from that files may have passed on, each to the next one.
    fn origin(&self, mut name: Name) -> Name {
        // A module may pass on what has its own name, which would lead back for ever.
        for _ in 0..MOST_STEPS {
            let mut lengths = (1..=name.len()).rev();
            let passed_on =
                lengths.find_map(|length| Some((length, self.passed_on.get(&name[..length])?)));
            let Some((length, target)) = passed_on else {
                break;
            };
            name = [target, &name[length..]].concat();
        }
        name
    }

    /// By file: the files that it uses.
    fn edges(&self) -> Edges<'_> {
        let edges = self.files.iter().map(|(file, paths)| {
            let used = paths.used.iter();
            let used = used
                .filter_map(|path| self.absolute(file, path))
                .filter_map(|path| self.file(&self.origin(path)))
                .filter(|other| other != file);
            (file, used.collect())
        });
        edges.collect()
    }
}

type Edges<'n> = BTreeMap<&'n Name, BTreeSet<Name>>;

/// All files that a file uses, directly or through others.
fn used_by<'e>(file: &'e Name, edges: &'e Edges<'_>) -> BTreeSet<&'e Name> {
    let mut found = BTreeSet::new();
    let mut open = vec![file];
    while let Some(file) = open.pop() {
        open.extend(edges[file].iter().filter(|other| found.insert(*other)));
    }
    found
}

/// The sets of files that all use each other, directly or through others.
fn circles(edges: &Edges<'_>) -> BTreeSet<String> {
    let files = edges.keys();
    let reached: BTreeMap<&Name, BTreeSet<&Name>> =
        files.map(|file| (*file, used_by(file, edges))).collect();
    let circles = reached.iter().filter_map(|(file, others)| {
        let back = others
            .iter()
            .filter(|other| reached[**other].contains(file));
        let circle: Vec<String> = back.map(|name| name.join("/")).collect();
        (!circle.is_empty()).then(|| circle.join(" "))
    });
    circles.collect()
}

#[test]
fn no_file_uses_one_that_uses_it() {
    let graph = Graph::new(&crate::sources_of_the_crate());
    let edges = graph.edges();
    let found = circles(&edges);
    let files = found.iter().flat_map(|circle| circle.split(' '));
    let arrows = files.map(|file| {
        let used = edges[&name(&file.replace('/', "::"))].iter();
        let used: Vec<String> = used.map(|other| other.join("/")).collect();
        format!("{file} uses {}\n", used.join(", "))
    });
    assert!(
        found.is_empty(),
        "circles: {found:#?}\n{}",
        arrows.collect::<String>()
    );
}

#[test]
fn use_trees_are_read() {
    let used = |code: &str| {
        let used = paths(code).used.into_iter();
        used.map(|path| path.join("::")).collect::<Vec<_>>()
    };
    assert_eq!(
        used("use crate::a::{self, b::{C, D as E}, f::*};\npub(crate) use super::g;"),
        [
            "crate::a::self",
            "crate::a::b::C",
            "crate::a::b::D",
            "crate::a::f::*",
            "super::g"
        ]
    );
    assert_eq!(
        used("pub(in crate::d) fn f() -> crate::a::B { super::super::c::reuse (1); }"),
        ["crate::a::B", "super::super::c::reuse"]
    );
}
