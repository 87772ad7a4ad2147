//! Strategies as text, line by line: `tests/corpus/games`, where the lines `// strategy: …` below a
//! query are the text of the winner's strategy, from the line on that says whose it is. Each
//! discrete state is a paragraph; their order says nothing.
//!
//! The running example of the TIGA manual must come out as the manual prints it (section 3, figure
//! 8).

use std::fs;
use std::path::{Path, PathBuf};

use checker::engine::format::strategy_text;

use crate::corpus;
use crate::solved::solved;

fn game(name: &str) -> PathBuf {
    corpus::folder("games").join(name)
}

/// The text of the winner's strategy.
fn text_of(path: &Path, query: &str) -> String {
    let (model, answer) = solved(path, query).expect("the query is right");
    let strategy = answer.evidence.strategy.expect("there is a strategy");
    strategy_text::write(model.network(), &strategy)
}

/// The paragraphs of a text, sorted, without the initial state.
fn paragraphs<'l>(lines: impl Iterator<Item = &'l str>) -> Vec<String> {
    let lines = lines.skip_while(|line| !line.starts_with("Strategy "));
    let mut paragraphs: Vec<String> = Vec::new();
    for line in lines.filter(|line| !line.is_empty()) {
        match paragraphs.last_mut() {
            Some(last) if !line.starts_with("State: ") => {
                last.push('\n');
                last.push_str(line);
            }
            _ => paragraphs.push(line.to_owned()),
        }
    }
    paragraphs.sort();
    paragraphs
}

/// Compares the strategies of a file with its lines; returns how many there were.
fn check_file(path: &Path) -> usize {
    let file = fs::read_to_string(path).expect("the model is there");
    let mut expected: Vec<(&str, Vec<&str>)> = Vec::new();
    for line in file.lines() {
        if let Some(query) = line.strip_prefix("// query: ") {
            expected.push((query, Vec::new()));
        }
        if let (Some(line), Some((_, lines))) =
            (line.strip_prefix("// strategy: "), expected.last_mut())
        {
            lines.push(line);
        }
    }
    expected.retain(|(_, lines)| !lines.is_empty());
    for (query, lines) in &expected {
        let text = text_of(path, query);
        let (got, wanted) = (paragraphs(text.lines()), paragraphs(lines.iter().copied()));
        assert_eq!(got, wanted, "{}: {query}:\n{text}", path.display());
    }
    expected.len()
}

#[test]
fn strategies_of_the_corpus_read_as_expected() {
    let files = corpus::files("games");
    let count: usize = files.iter().map(|path| check_file(path)).sum();
    assert!(count >= 30, "only {count} strategies have expected lines");
}

#[test]
fn text_begins_with_the_initial_state() {
    let text = text_of(&game("manual_example.xta"), "control: A<> P.goal");
    let lines: Vec<&str> = text.lines().take(5).collect();
    assert_eq!(
        lines,
        [
            "Initial state:",
            "( P.L0 )",
            "(P.x==0)",
            "",
            "Strategy to win:"
        ]
    );
}

#[test]
fn differences_are_written_with_the_larger_clock_first() {
    let path = game("difference_that_grows.xta");
    let text = text_of(&path, "control: A<> P.G");
    assert!(text.contains("(P.x-P.y==3 && P.x<4)"), "{text}");
}
