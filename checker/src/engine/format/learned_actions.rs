//! Texts of the actions of learned strategies: the moves of the controller, as
//! `P.a->P.b { guard, sync, update }`, and `WAIT`.
//!
//! Values of `select` bindings stand in the labels in the place of their names. Where a label has a
//! quantifier, or no label has the name, the values stand behind, as `[i=3]`. Where edges have the
//! same text, their numbers stand behind. So each action has a text of its own, and the same model
//! gives the same texts.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::text::{self, EntryParts};
use crate::ir::{EdgeLabels, Network, Part};

/// The text of the action to wait.
pub const WAIT: &str = "WAIT";

/// The texts of the moves, and behind them that of waiting.
pub fn texts(network: &Network, moves: &[Part]) -> Vec<String> {
    let mut texts: Vec<String> = moves.iter().map(|&one| of_move(network, one)).collect();
    let mut counts: HashMap<String, usize> = HashMap::new();
    for text in &texts {
        *counts.entry(text.clone()).or_default() += 1;
    }
    for (text, part) in texts.iter_mut().zip(moves) {
        if counts[text.as_str()] > 1 {
            // Writing to a string cannot fail.
            let _ = write!(text, " [edge={}]", part.edge);
        }
    }
    texts.push(WAIT.to_owned());
    texts
}

fn of_move(network: &Network, part: Part) -> String {
    let EntryParts { labels, selects } = text::entry(network, part);
    let mut filled = [&labels.guard, &labels.sync, &labels.update].map(Clone::clone);
    let mut shown = Vec::new();
    for (name, value) in selects {
        let mut is_there = false;
        for label in &mut filled {
            if !has_quantifier(label) {
                let (text, is_here) = substituted(label, name, value);
                *label = text;
                is_there |= is_here;
            }
        }
        if !is_there {
            shown.push((name, value));
        }
    }
    let [guard, sync, update] = filled;
    let labels = EdgeLabels {
        select: String::new(),
        guard,
        sync,
        update,
    };
    text::entry_text_with(network, part, &labels, &shown)
}

fn has_quantifier(label: &str) -> bool {
    let mut words = tokens(label);
    words.any(|word| matches!(word, "forall" | "exists" | "sum"))
}

/// A label with a value in the place of a name, and whether the name was there. Fields of structs
/// are other names.
fn substituted(label: &str, name: &str, value: i32) -> (String, bool) {
    let (mut text, mut is_there, mut is_field) = (String::new(), false, false);
    for token in tokens(label) {
        if token == name && !is_field {
            text.push_str(&value.to_string());
            is_there = true;
        } else {
            text.push_str(token);
        }
        is_field = token == ".";
    }
    (text, is_there)
}

/// Names, numbers, runs of blanks, and single other characters.
fn tokens(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let is_word = |sign: char| sign.is_alphanumeric() || sign == '_';
        let end = if first.is_ascii_digit() {
            rest.find(|sign| !is_word(sign) && sign != '.')
        } else if is_word(first) {
            rest.find(|sign| !is_word(sign))
        } else if first.is_whitespace() {
            rest.find(|sign: char| !sign.is_whitespace())
        } else {
            Some(first.len_utf8())
        };
        let (token, after) = rest.split_at(end.unwrap_or(rest.len()));
        rest = after;
        Some(token)
    })
}

/// A text without blanks.
pub fn without_blanks(text: &str) -> String {
    text.split_whitespace().collect()
}

/// The same for all spellings of a text: without blanks and brackets, with `=` for `:=` and `1` for
/// `true`.
fn plain(text: &str) -> String {
    let words = tokens(text).filter(|token| !token.trim().is_empty());
    let words = words.map(|token| match token {
        "true" => "1",
        "false" => "0",
        "and" => "&&",
        "or" => "||",
        "not" => "!",
        "(" | ")" => "",
        other => other,
    });
    words.collect::<String>().replace(":=", "=")
}

/// Where a move begins and ends.
fn ends(text: &str) -> String {
    let (ends, _) = text.split_once('{').unwrap_or((text, ""));
    without_blanks(ends)
}

/// Why a text is none of the actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unmatched {
    /// There is none like it.
    Unknown,
    /// It may be several.
    Ambiguous,
}

/// Finds actions by texts that may be spelt in another way.
pub struct Finder {
    exact: HashMap<String, Vec<u32>>,
    plain: HashMap<String, Vec<u32>>,
    ends: HashMap<String, Vec<u32>>,
    /// How many of the texts that are looked for have the same ends.
    asked: HashMap<String, usize>,
}

impl Finder {
    /// The actions have these texts; these others are looked for.
    pub fn new<'t>(texts: &[String], asked: impl Iterator<Item = &'t str>) -> Finder {
        let by = |form: fn(&str) -> String| {
            let mut found: HashMap<String, Vec<u32>> = HashMap::new();
            for (number, text) in (0..).zip(texts) {
                found.entry(form(text)).or_default().push(number);
            }
            found
        };
        let mut finder = Finder {
            exact: by(without_blanks),
            plain: by(plain),
            ends: by(ends),
            asked: HashMap::new(),
        };
        for text in asked {
            *finder.asked.entry(ends(text)).or_default() += 1;
        }
        finder
    }

    /// The action with a text: the same up to blanks, or in another spelling, or the only one with
    /// these ends.
    ///
    /// # Errors
    /// There is none, or more than one.
    pub fn find(&self, text: &str) -> Result<u32, Unmatched> {
        let found = self.exact.get(&without_blanks(text));
        if let Some(numbers) = found.or_else(|| self.plain.get(&plain(text))) {
            return match numbers[..] {
                [number] => Ok(number),
                _ => Err(Unmatched::Ambiguous),
            };
        }
        let ends = ends(text);
        match self.ends.get(&ends).map(Vec::as_slice) {
            Some([number]) if self.asked.get(&ends) == Some(&1) => Ok(*number),
            Some(_) => Err(Unmatched::Ambiguous),
            None => Err(Unmatched::Unknown),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_take_the_places_of_names() {
        let filled = |label, name| substituted(label, name, 3).0;
        assert_eq!(filled("i < 4 && ii > 1", "i"), "3 < 4 && ii > 1");
        assert_eq!(filled("a.i = i, x1 = 1e3", "i"), "a.i = 3, x1 = 1e3");
        assert!(!substituted("set(j)", "i", 3).1);
        assert!(has_quantifier("forall (i : int[0,1]) a[i]"));
    }

    #[test]
    fn other_spellings_are_found_where_they_are_clear() {
        let texts = [
            "P.a->P.b { 1, tau, x = 0 }",
            "P.a->P.c { k > 1, tau, y = 1 }",
            "P.c->P.a { 1, tau, y = 1 }",
            "P.c->P.a { 1, tau, y = 2 }",
        ];
        let texts = texts.map(String::from);
        let asked = [
            "P.a->P.b{true,tau,x:=0}",
            "P.a->P.c { P.k > 1, tau, P.y := 1 }",
            "P.c->P.a { 1, tau, y := 2 }",
            "P.c->P.a { 1, tau, z := 2 }",
            "P.c->P.d { 1, tau, z := 2 }",
        ];
        let finder = Finder::new(&texts, asked.into_iter());
        let found = asked.map(|text| finder.find(text));
        let (several, none) = (Err(Unmatched::Ambiguous), Err(Unmatched::Unknown));
        assert_eq!(found, [Ok(0), Ok(1), Ok(3), several, none]);
    }
}
