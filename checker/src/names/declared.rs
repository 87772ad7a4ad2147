//! What is said of names.

use crate::diagnostics::Span;

/// All names of a model.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// What is declared, in the order of the text.
    pub symbols: Vec<Symbol>,
    /// Where it is used; declarations are not uses.
    pub uses: Vec<Use>,
    /// Those that may be used in the whole model, those that the language declares included.
    pub everywhere: Vec<usize>,
    /// Where others may be used, the inner places behind the outer ones.
    pub areas: Vec<Area>,
    /// The symbols of the areas, by [`Area::scope`].
    pub scopes: Vec<Vec<usize>>,
    /// The symbols that may follow a dot, by [`Symbol::members`].
    pub groups: Vec<Vec<usize>>,
}

/// What a name is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum SymbolKind {
    Constant,
    Variable,
    Clock,
    Channel,
    Type,
    Field,
    Function,
    Parameter,
    Template,
    Process,
    Location,
    /// A value of `select`, of a quantifier or of an iteration.
    Bound,
    Strategy,
}

/// A declared name.
#[derive(Clone, Debug)]
pub struct Symbol {
    /// The name.
    pub name: String,
    /// What it is.
    pub kind: SymbolKind,
    /// Where the bare name stands.
    pub span: Span,
    /// Its declaration, as written.
    pub detail: String,
    /// The comment above it or behind it, without its marks.
    pub comment: String,
    /// The group of what may follow it behind a dot.
    pub members: Option<usize>,
}

/// A place where a name is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// The bare name.
    pub span: Span,
    /// The symbol.
    pub symbol: usize,
}

/// A part of a text in which symbols may be used, beside those of the areas around it.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// Where.
    pub span: Span,
    /// The scope whose symbols they are.
    pub scope: usize,
}
