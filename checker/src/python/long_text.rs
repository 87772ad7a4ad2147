//! Texts that may be long: Python takes them in pieces, so that they are in memory once.

use pyo3::prelude::*;

/// The bytes of a piece, about.
const PIECE_BYTES: usize = 1 << 20;

/// A text that was written by the engine.
#[pyclass(frozen, module = "ntagen._checker")]
pub(super) struct LongText {
    text: String,
}

impl LongText {
    pub(super) fn new(text: String) -> LongText {
        LongText { text }
    }
}

#[pymethods]
impl LongText {
    fn __str__(&self) -> &str {
        &self.text
    }

    /// The piece with this number; `None` behind the last one.
    fn piece(&self, index: usize) -> Option<&str> {
        let ends_at = |index: usize| {
            let end = index.saturating_mul(PIECE_BYTES).min(self.text.len());
            self.text.floor_char_boundary(end)
        };
        let piece = &self.text[ends_at(index)..ends_at(index.saturating_add(1))];
        (!piece.is_empty()).then_some(piece)
    }
}
