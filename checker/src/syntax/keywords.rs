//! The reserved words of the three dialects: models, models in the old syntax, queries.
//!
//! Source: the language reference ("reserved keywords") and utap's table that says where each word
//! is reserved. Where we differ: names of built-in functions are not reserved, a declaration hides
//! them (with a warning), because models older than UPPAAL 4.1.20 use them as names.

use crate::builtins::{self, Builtin};

/// The languages that share the expression grammar.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dialect {
    /// Declarations and labels of UPPAAL 4 and 5.
    New,
    /// The syntax of the `.ta` files of UPPAAL 3.
    Old,
    /// Properties.
    Query,
}

const OLD: u8 = 1;
const NEW: u8 = 2;
const QUERY: u8 = 4;

/// The dialects that reserve `word`, as a set of bits.
fn reserved_in(word: &str) -> u8 {
    match word {
        "const" | "guard" | "sync" | "assign" | "probability" | "process" | "state"
        | "branchpoint" | "init" | "trans" | "urgent" | "commit" | "broadcast" | "priority"
        | "bool" | "double" | "chan" | "clock" | "void" => OLD | NEW,
        "system" | "true" | "false" | "and" | "or" | "not" | "imply" | "int" | "scalar"
        | "location" => OLD | NEW | QUERY,
        "select" | "for" | "while" | "do" | "if" | "else" | "default" | "return" | "typedef"
        | "struct" | "import" | "meta" | "before_update" | "after_update" | "progress"
        | "gantt" | "assert" | "IO" | "string" | "hybrid" | "dynamic" | "spawn" | "exit"
        | "query" => NEW,
        "forall" | "exists" | "sum" | "xor" => NEW | QUERY,
        "deadlock" | "control" | "control_t" | "minE" | "maxE" | "minPr" | "maxPr"
        | "loadStrategy" | "saveStrategy" | "under" | "imitate" | "strategy" | "simulate"
        | "sat" | "Pmax" | "Pr" | "numOf" | "foreach" => QUERY,
        _ => 0,
    }
}

/// Whether `word` cannot be a name in this dialect.
pub(super) fn is_reserved(word: &str, dialect: Dialect) -> bool {
    let dialect = match dialect {
        Dialect::Old => OLD,
        Dialect::New => NEW,
        Dialect::Query => QUERY,
    };
    reserved_in(word) & dialect != 0
}

/// Whether `word` is the name of a function that UPPAAL 5 defines.
pub(super) fn is_built_in_function(word: &str) -> bool {
    !matches!(builtins::named(word), None | Some(Builtin::OldRandom))
}
