//! The pages of the diagnostics: what a code means, an example of the mistake, how to fix it, the
//! example fixed.
//!
//! A page is Markdown. Its examples are fenced, and the word behind the opening fence says what
//! they are: a language (`xta`, `xml`; `query` for one query, `q` for a file of queries) and then
//! `wrong`, `right`, or `model` for the model that queries are about. In a wrong example `\xE9`
//! stands for the byte of this number. Tests load every example.

use crate::diagnostics::Code;
use crate::{semantics, syntax};

use crate::engine::codes;

/// Every code with its page, in the order of the rooms and their numbers.
pub fn explanations() -> impl Iterator<Item = (Code, &'static str)> {
    let rooms = [
        (syntax::codes::ALL, syntax::codes::PAGES),
        (semantics::codes::ALL, semantics::codes::PAGES),
        (codes::ALL, codes::PAGES),
    ];
    rooms
        .into_iter()
        .flat_map(|(codes, pages)| codes.iter().copied().zip(pages.iter().copied()))
}

/// What an example is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The model that the queries of the page are about.
    Model,
    /// It has the mistake.
    Wrong,
    /// It is fixed.
    Right,
}

/// An example of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Example {
    /// `xta`, `xml`, `query` or `q`.
    pub language: &'static str,
    /// What it is.
    pub role: Role,
    /// The text between the fences.
    pub text: &'static str,
}

/// The examples of a page, in order.
pub fn examples(page: &'static str) -> Vec<Example> {
    // Outside and inside of fences alternate.
    let blocks = page.split("```").skip(1).step_by(2);
    let examples = blocks.filter_map(|block| {
        let (heading, text) = block.split_once('\n')?;
        let (language, role) = heading.split_once(' ')?;
        let role = match role {
            "model" => Role::Model,
            "wrong" => Role::Wrong,
            "right" => Role::Right,
            _ => return None,
        };
        let text = text.strip_suffix('\n').unwrap_or(text);
        Some(Example {
            language,
            role,
            text,
        })
    });
    examples.collect()
}
