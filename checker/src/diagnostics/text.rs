//! Texts that share their bytes: a file is in memory once, however many pieces of it are sources.

use std::fmt;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// A piece of a text that others may have pieces of, too.
#[derive(Clone)]
pub struct Text {
    owner: Arc<dyn AsRef<str> + Send + Sync>,
    range: Range<usize>,
}

impl Text {
    /// The whole of a text that somebody else keeps.
    pub fn shared(owner: Arc<dyn AsRef<str> + Send + Sync>) -> Text {
        let range = 0..(*owner).as_ref().len();
        Text { owner, range }
    }

    /// A piece of it, which keeps all of it in memory; empty if there is no such piece.
    #[must_use]
    pub fn piece(&self, range: Range<usize>) -> Text {
        if self.get(range.clone()).is_none() {
            return Text::default();
        }
        Text {
            owner: Arc::clone(&self.owner),
            range: self.range.start + range.start..self.range.start + range.end,
        }
    }
}

impl Deref for Text {
    type Target = str;

    fn deref(&self) -> &str {
        &(*self.owner).as_ref()[self.range.clone()]
    }
}

impl From<String> for Text {
    fn from(text: String) -> Text {
        Text::shared(Arc::new(text))
    }
}

impl From<&str> for Text {
    fn from(text: &str) -> Text {
        Text::from(text.to_owned())
    }
}

impl Default for Text {
    fn default() -> Text {
        Text::from(String::new())
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&**self, f)
    }
}
