//! Where the names of a model are declared, where they are used and where they may be used: what an
//! editor asks. Nothing is typed or computed; names are found by the rules of scopes alone, so a
//! text with mistakes has answers, too.
//!
//! Invariants:
//! * A use and a declaration have the spans of the bare names, in the text as written.
//! * A name that is not known is no use: what is wrong with it, `semantics` says.
//!
//! Source: the scopes of `semantics/scope.rs`; the tests hold both against each other.

mod declared;
mod queries;
mod resolver;
mod walk;

pub use declared::{Area, Names, Symbol, SymbolKind, Use};

use crate::diagnostics::SourceMap;
use crate::syntax::ast;
use resolver::{Reach, Resolver};

/// The names of a model and of queries about it, which are asked in this order.
pub fn names_of(
    document: &ast::Document,
    prelude: &[ast::Declaration],
    queries: &[ast::Query],
    sources: &SourceMap,
) -> Names {
    let mut resolver = Resolver::new(sources);
    resolver.declarations(prelude);
    resolver.enter(Reach::Walked);
    resolver.document(document);
    for query in queries {
        resolver.query(query);
    }
    resolver.into_names()
}
