//! Why a model or query is not accepted.

use crate::diagnostics::{Diagnostic, SourceMap};

/// A model or query that is not accepted: what is wrong, rendered for the user.
#[derive(Clone, Debug)]
pub struct Rejection {
    /// The diagnostics with their sources.
    pub diagnostics: Vec<Diagnostic>,
    /// One text for each diagnostic.
    pub rendered: Vec<String>,
}

impl Rejection {
    pub(crate) fn new(diagnostics: Vec<Diagnostic>, sources: &SourceMap) -> Rejection {
        let rendered = diagnostics
            .iter()
            .map(|diagnostic| diagnostic.render(sources))
            .collect();
        Rejection {
            diagnostics,
            rendered,
        }
    }

    /// A rejection of something that has no place in the model or in a query.
    pub(crate) fn without_place(text: String) -> Rejection {
        Rejection {
            diagnostics: Vec::new(),
            rendered: vec![text],
        }
    }
}
