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
