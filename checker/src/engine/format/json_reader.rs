//! Reading JSON files: each part is known with its place, so that a message can say where in the
//! file something is wrong. What a file shows for information is compared with the facts.

use std::fmt;

use serde_json::{Map, Value as Json};

/// Why a file is no strategy for the model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// Where in the JSON, such as `states[3].decisions[0].zones[1]`; empty for the whole.
    pub place: String,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: Option<&'static str>,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.place.is_empty() {
            write!(f, "at {}: ", self.place)?;
        }
        f.write_str(&self.message)
    }
}

/// What a file with a strategy over observations says that it is.
pub const MACHINE_FORMAT: &str = "ntagen-machine";

/// How to fix a file that is not of the format.
pub(super) const SEE_FORMAT: &str = "docs/strategy.md describes the format";

/// How to get a file of the format.
pub(super) const WRITE_ONE: &str =
    "`ntagen check --strategy FILE.json` writes such a file; docs/strategy.md describes the format";

/// A part of the file with its place.
pub(crate) struct At<'j>(pub(crate) &'j Json, pub(super) String);

impl<'j> At<'j> {
    /// The whole file.
    pub(crate) fn whole(file: &'j Json) -> At<'j> {
        At(file, String::new())
    }

    pub(super) fn wrong(&self, message: impl Into<String>, help: &'static str) -> Mismatch {
        Mismatch {
            place: self.1.clone(),
            message: message.into(),
            help: Some(help),
        }
    }

    pub(crate) fn field(&self, name: &str) -> Result<At<'j>, Mismatch> {
        let place = if self.1.is_empty() {
            name.to_owned()
        } else {
            format!("{}.{name}", self.1)
        };
        match self.0.get(name) {
            Some(value) => Ok(At(value, place)),
            None => Err(self.wrong(format!("\"{name}\" is missing"), SEE_FORMAT)),
        }
    }

    /// Refuses fields that are none of these.
    pub(super) fn only(&self, known: &[&str]) -> Result<(), Mismatch> {
        match only(self.0, known, "the format") {
            Ok(()) => Ok(()),
            Err(message) => Err(self.wrong(message, SEE_FORMAT)),
        }
    }

    pub(super) fn typed<T>(
        &self,
        name: &str,
        what: &str,
        read: impl Fn(&'j Json) -> Option<T>,
    ) -> Result<T, Mismatch> {
        let field = self.field(name)?;
        read(field.0).ok_or_else(|| field.wrong(format!("this is no {what}"), SEE_FORMAT))
    }

    pub(super) fn text(&self, name: &str) -> Result<String, Mismatch> {
        self.typed(name, "text", |value| value.as_str().map(str::to_owned))
    }

    pub(super) fn map(&self, name: &str) -> Result<&'j Map<String, Json>, Mismatch> {
        self.typed(name, "object", Json::as_object)
    }

    pub(crate) fn index(&self, name: &str) -> Result<u32, Mismatch> {
        self.typed(name, "index", |value| {
            value.as_u64().and_then(|index| u32::try_from(index).ok())
        })
    }

    pub(crate) fn list(&self, name: &str) -> Result<Vec<At<'j>>, Mismatch> {
        self.field(name)?.entries()
    }

    pub(super) fn entries(&self) -> Result<Vec<At<'j>>, Mismatch> {
        let Some(entries) = self.0.as_array() else {
            return Err(self.wrong("this is no list", SEE_FORMAT));
        };
        let entries = entries.iter().enumerate();
        Ok(entries
            .map(|(index, one)| At(one, format!("{}[{index}]", self.1)))
            .collect())
    }
}

/// What is wrong with what a file shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Difference {
    /// It has a name that the format or the model does not have.
    Unknown(String),
    /// It shows something that is not so.
    False(String),
}

impl From<Mismatch> for Difference {
    fn from(mismatch: Mismatch) -> Difference {
        Difference::Unknown(mismatch.to_string())
    }
}

/// Refuses fields of an object that are none of these.
pub(crate) fn only(object: &Json, known: &[&str], place: &str) -> Result<(), String> {
    let mut fields = object.as_object().into_iter().flat_map(|map| map.keys());
    match fields.find(|name| !known.contains(&name.as_str())) {
        Some(name) => Err(format!("{place}: there is no field \"{name}\" here")),
        None => Ok(()),
    }
}

/// Compares what is shown with what is so. What is not shown is not missed.
pub(crate) fn compare(shown: &Json, right: &Json, place: &str) -> Result<(), Difference> {
    match (shown, right) {
        (Json::Object(shown), Json::Object(right)) => {
            for (name, value) in shown {
                let Some(right) = right.get(name) else {
                    let text = format!("{place}: the model has no \"{name}\" here");
                    return Err(Difference::Unknown(text));
                };
                compare(value, right, &format!("{place}.{name}"))?;
            }
            Ok(())
        }
        (Json::Array(shown), Json::Array(right)) if shown.len() == right.len() => {
            let both = shown.iter().zip(right).enumerate();
            for (index, (shown, right)) in both {
                compare(shown, right, &format!("{place}[{index}]"))?;
            }
            Ok(())
        }
        (Json::Array(shown), Json::Array(right)) => Err(Difference::False(format!(
            "{place} has {} entries, and should have {}",
            shown.len(),
            right.len()
        ))),
        _ if shown == right => Ok(()),
        _ => Err(Difference::False(format!(
            "{place} is {shown}, and should be {right}"
        ))),
    }
}

/// A number of 32 bits.
pub(crate) fn integer(value: &Json) -> Option<i32> {
    i32::try_from(value.as_i64()?).ok()
}
