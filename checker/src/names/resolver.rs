//! Scopes while a tree is walked: what is declared, what a name stands for, and how far a scope
//! reaches.

use rustc_hash::{FxHashMap, FxHashSet};

use super::declared::{Area, Names, Symbol, SymbolKind, Use};
use crate::diagnostics::{SourceMap, Span};
use crate::syntax::ast::Name;

/// What is known of a value: what may follow it behind a dot, and in how many brackets before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shape {
    /// The group of its members.
    pub(super) members: Option<usize>,
    /// How many dimensions are around them.
    pub(super) arrays: usize,
    /// What its type says that a variable of it is.
    pub(super) kind: Option<SymbolKind>,
}

/// How far a scope reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// As far as what was walked in it.
    Walked,
    /// To the brace that closes it.
    Braces,
    /// In pieces of XML over all of each piece, else to the brace that closes it.
    Pieces,
}

/// The scopes of the language and of the model's global declarations, which are never left.
const EVERYWHERE: usize = 2;

#[derive(Debug)]
struct Open {
    names: FxHashMap<String, usize>,
    symbols: Vec<usize>,
    /// What was walked in it, at most one span for each source.
    hulls: Vec<Span>,
    reach: Reach,
}

impl Open {
    fn new(reach: Reach) -> Open {
        Open {
            names: FxHashMap::default(),
            symbols: Vec::new(),
            hulls: Vec::new(),
            reach,
        }
    }
}

/// The walk.
pub(super) struct Resolver<'a> {
    pub(super) sources: &'a SourceMap,
    pub(super) names: Names,
    /// The shape of each symbol.
    pub(super) shapes: Vec<Shape>,
    /// The types that were walked, by their place: declarators of one declaration share theirs.
    pub(super) types: FxHashMap<Span, Shape>,
    open: Vec<Open>,
    used: FxHashSet<Span>,
}

impl<'a> Resolver<'a> {
    pub(super) fn new(sources: &'a SourceMap) -> Resolver<'a> {
        Resolver {
            sources,
            names: Names::default(),
            shapes: Vec::new(),
            types: FxHashMap::default(),
            open: vec![Open::new(Reach::Walked)],
            used: FxHashSet::default(),
        }
    }

    /// Begins a scope inside the others.
    pub(super) fn enter(&mut self, reach: Reach) {
        self.open.push(Open::new(reach));
    }

    /// Ends the innermost scope, and notes where its names may be used.
    pub(super) fn leave(&mut self) {
        let Some(Open {
            symbols,
            hulls,
            reach,
            ..
        }) = self.open.pop()
        else {
            return;
        };
        let scope = self.names.scopes.len();
        for hull in hulls {
            let span = self.reached(hull, reach);
            self.note(span);
            if !symbols.is_empty() {
                self.names.areas.push(Area { span, scope });
            }
        }
        self.names.scopes.push(symbols);
    }

    fn reached(&self, hull: Span, reach: Reach) -> Span {
        let source = self.sources.get(hull.source);
        let end = source.text.len() as u32;
        match reach {
            Reach::Walked => hull,
            Reach::Pieces if !source.place.is_empty() => Span {
                start: 0,
                end,
                ..hull
            },
            Reach::Braces | Reach::Pieces => {
                let behind = source.text.get(hull.end as usize..).unwrap_or("");
                let brace = behind.find('}').unwrap_or(behind.len()) as u32;
                Span {
                    end: end.min(hull.end + brace + 1),
                    ..hull
                }
            }
        }
    }

    /// Notes that something of the innermost scope stands here.
    pub(super) fn note(&mut self, span: Span) {
        let Some(scope) = self.open.last_mut() else {
            return;
        };
        match scope
            .hulls
            .iter_mut()
            .find(|hull| hull.source == span.source)
        {
            Some(hull) => *hull = hull.to(span),
            None => scope.hulls.push(span),
        }
    }

    /// Declares a name in the innermost scope; its declaration begins at `start`.
    pub(super) fn declare(
        &mut self,
        name: &Name,
        kind: SymbolKind,
        start: Span,
        detail: String,
        shape: Shape,
    ) -> usize {
        let symbol = self.add(name, kind, start, detail, shape);
        self.note(name.span);
        if let Some(scope) = self.open.last_mut() {
            // Of two with one name the first counts; the second is a mistake.
            scope.names.entry(name.text.clone()).or_insert(symbol);
            scope.symbols.push(symbol);
        }
        symbol
    }

    /// Adds a symbol that no scope has.
    pub(super) fn add(
        &mut self,
        name: &Name,
        kind: SymbolKind,
        start: Span,
        detail: String,
        shape: Shape,
    ) -> usize {
        self.names.symbols.push(Symbol {
            name: name.text.clone(),
            kind,
            span: name.span,
            detail,
            comment: self.comment_at(start.to(name.span)),
            members: shape.members,
        });
        self.shapes.push(shape);
        self.names.symbols.len() - 1
    }

    /// The symbols of the innermost scope as a group of members.
    pub(super) fn group_of_scope(&self) -> Vec<usize> {
        let scope = self.open.last();
        scope.map(|scope| scope.symbols.clone()).unwrap_or_default()
    }

    /// What a name stands for; this place is a use of it.
    pub(super) fn use_name(&mut self, text: &str, span: Span) -> Shape {
        self.note(span);
        let mut scopes = self.open.iter().rev();
        let found = scopes.find_map(|scope| scope.names.get(text));
        found
            .copied()
            .map(|symbol| self.used(symbol, span))
            .unwrap_or_default()
    }

    /// A use of what follows a dot.
    pub(super) fn use_member(&mut self, group: Option<usize>, name: &Name) -> Shape {
        self.note(name.span);
        let symbols = group.map(|group| &self.names.groups[group]);
        let found = symbols.and_then(|symbols| {
            let mut members = symbols.iter().copied();
            members.find(|&one| self.names.symbols[one].name == name.text)
        });
        found
            .map(|symbol| self.used(symbol, name.span))
            .unwrap_or_default()
    }

    fn used(&mut self, symbol: usize, span: Span) -> Shape {
        let is_written = self.sources.text(span) == self.names.symbols[symbol].name;
        if is_written && self.used.insert(span) {
            self.names.uses.push(Use { span, symbol });
        }
        self.shapes[symbol]
    }

    /// The symbols that were found; the scopes that are still open end here.
    pub(super) fn into_names(mut self) -> Names {
        while self.open.len() > EVERYWHERE {
            self.leave();
        }
        for scope in &mut self.open {
            let symbols = std::mem::take(&mut scope.symbols);
            self.names.everywhere.extend(symbols);
        }
        self.names.areas.reverse();
        self.names
    }

    /// The comment right above the line of a declaration, or else behind it on its line.
    fn comment_at(&self, declaration: Span) -> String {
        let text: &str = &self.sources.get(declaration.source).text;
        let (Some(before), Some(behind)) = (
            text.get(..declaration.start as usize),
            text.get(declaration.end as usize..),
        ) else {
            return String::new();
        };
        let above = comment_above(before);
        if above.is_empty() {
            let line = behind.lines().next().unwrap_or("");
            return line
                .split_once("//")
                .map_or("", |(_, comment)| comment)
                .trim()
                .to_owned();
        }
        above
    }
}

/// The comment that a text ends with, blanks aside, if its lines hold nothing else.
fn comment_above(before: &str) -> String {
    let line_start = before.rfind('\n').map_or(0, |end| end + 1);
    if !before[line_start..].trim().is_empty() {
        return String::new();
    }
    let above = before[..line_start].trim_end_matches([' ', '\t', '\r']);
    let Some(above) = above.strip_suffix('\n') else {
        return String::new();
    };
    if let Some(block) = above.trim_end().strip_suffix("*/") {
        let Some(start) = block.rfind("/*") else {
            return String::new();
        };
        let lines = block[start + 2..]
            .lines()
            .map(|line| line.trim().trim_start_matches('*').trim());
        return lines.collect::<Vec<_>>().join("\n").trim().to_owned();
    }
    let lines = above.lines().rev().map(str::trim);
    let mut found: Vec<&str> = lines
        .map_while(|line| line.strip_prefix("//"))
        .map(str::trim)
        .collect();
    found.reverse();
    found.join("\n")
}
