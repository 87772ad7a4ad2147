//! Shields as code: a function in C99 or Python that depends on nothing, over tables.
//!
//! Neighbouring cells that allow the same moves are one run, by the number behind its last cell.
//! The same shield gives the same text.

use std::fmt::Write as _;

use serde_json::json;

use super::learned_code::Language;
use super::strategy_c::{comment, quoted, table, wrapped};
use super::{learned_actions, shield_json};
use crate::cancellation;
use crate::ir::{Network, Seen};
use crate::shield::Shield;

/// What does not depend on the shield, in C.
const C_RUNTIME: &str = include_str!("shield_runtime.c");

/// What does not depend on the shield, in Python.
const PYTHON_RUNTIME: &str = include_str!("shield_python.txt");

/// What it takes to write a run of cells: see [`cancellation::work`].
const UNITS_FOR_RUN: usize = 64;

/// A shield for a query as code; names of C begin with `name`.
pub fn write(
    network: &Network,
    shield: &Shield,
    language: Language,
    name: &str,
    query: &str,
) -> String {
    let mut actions = learned_actions::texts(network, &shield.moves);
    actions.pop();
    let axes = shield.grid.axes.iter();
    let parts = Parts {
        shield,
        actions,
        axes: axes
            .map(|axis| match axis.feature.seen {
                Seen::Location(process) => {
                    let names = shield_json::locations(network, process);
                    let names = names.iter().enumerate();
                    let names = names.map(|(number, name)| format!("{number} {name}"));
                    let names: Vec<String> = names.collect();
                    format!("{}: {}", axis.feature.text, names.join(", "))
                }
                _ => axis.feature.text.clone(),
            })
            .collect(),
        query,
    };
    match language {
        Language::C => parts.c(name),
        Language::Python => parts.python(),
    }
}

struct Parts<'s> {
    shield: &'s Shield,
    actions: Vec<String>,
    axes: Vec<String>,
    query: &'s str,
}

impl Parts<'_> {
    /// What is said at the beginning, line by line; the function is called so.
    fn opening(&self, call: &str) -> Vec<String> {
        let mut lines = vec![
            String::from("A shield for"),
            format!("    {}", self.query),
            String::from("written by ntagen."),
            String::new(),
            format!("{call} are the actions that may be taken, of those that are enabled,"),
            String::from(
                "both as bits: the lowest bit is that of action 0. Outside the grid, and where it",
            ),
            String::from("allows none of the enabled actions, a shield says nothing: all remain."),
        ];
        for (list, texts) in [("values", &self.axes), ("actions", &self.actions)] {
            lines.push(String::new());
            lines.push(format!("{list}:"));
            let texts = texts.iter().enumerate();
            lines.extend(texts.map(|(number, text)| format!("    [{number}] {text}")));
        }
        lines
    }

    /// The runs of cells: the number of the cell behind each, and its set.
    fn runs(&self) -> (Vec<i64>, Vec<u64>) {
        let (mut end, mut ends, mut sets) = (0, Vec::new(), Vec::new());
        let runs = self.shield.allowed.chunk_by(|one, other| one == other);
        for run in runs {
            cancellation::work(UNITS_FOR_RUN);
            end += run.len() as i64;
            ends.push(end);
            sets.push(run[0]);
        }
        (ends, sets)
    }

    fn numbers(&self) -> [(&'static str, Vec<String>); 3] {
        let axes = || self.shield.grid.axes.iter();
        [
            ("lows", axes().map(|one| format!("{:?}", one.low)).collect()),
            (
                "widths",
                axes().map(|one| format!("{:?}", one.width())).collect(),
            ),
            ("counts", axes().map(|one| one.cells.to_string()).collect()),
        ]
    }

    fn c(&self, name: &str) -> String {
        let mut text = String::new();
        let call = format!("{name}_allowed(values, enabled)");
        for (number, line) in self.opening(&call).iter().enumerate() {
            let sign = if number == 0 { "/*" } else { " *" };
            let _ = writeln!(text, "{}", format!("{sign} {}", comment(line)).trim_end());
        }
        let (ends, sets) = self.runs();
        let _ = write!(
            text,
            " */\n#include <stddef.h>\n#include <stdint.h>\n\n\
             #define {name}_AXES {}\n#define {name}_ACTIONS {}\n#define {name}_RUNS {}\n\n\
             uint64_t {name}_allowed(const double values[], uint64_t enabled);\n\n\
             #ifndef {name}_WITHOUT_TEXTS\nconst char *const {name}_texts[] = {{\n",
            self.axes.len(),
            self.actions.len(),
            ends.len(),
        );
        for action in &self.actions {
            let _ = writeln!(text, "    {},", quoted(action));
        }
        text.push_str("};\n#endif\n\n");
        for (end, values) in self.numbers() {
            let _ = write!(text, "static const double {name}_{end}[] = {{");
            wrapped(&mut text, values.into_iter());
            text.push_str("};\n");
        }
        table(&mut text, &format!("{name}_ends"), ends.into_iter());
        let _ = write!(text, "static const uint64_t {name}_sets[] = {{");
        wrapped(&mut text, sets.iter().map(|set| format!("{set:#x}u")));
        text.push_str("};\n");
        text + &C_RUNTIME.replace("NAME", name)
    }

    fn python(&self) -> String {
        let mut text = String::new();
        for line in self.opening("allowed(values, enabled)") {
            let line = line.replace(['\n', '\r'], " ");
            let _ = writeln!(text, "{}", format!("# {line}").trim_end());
        }
        text.push_str("from bisect import bisect_right\n\nACTIONS = [\n");
        for action in &self.actions {
            let _ = writeln!(text, "    {},", json!(action));
        }
        text.push_str("]\n");
        let (ends, sets) = self.runs();
        let mut list = |name: &str, entries: &mut dyn Iterator<Item = String>| {
            let _ = write!(text, "_{name} = [");
            wrapped(&mut text, entries);
            text.push_str("]\n");
        };
        for (name, values) in self.numbers() {
            list(&name.to_uppercase(), &mut values.into_iter());
        }
        list("ENDS", &mut ends.iter().map(i64::to_string));
        list("SETS", &mut sets.iter().map(|set| format!("{set:#x}")));
        text + PYTHON_RUNTIME
    }
}
