//! Learned strategies as code: a function in C99 or Python that depends on nothing, over tables.
//!
//! All trees are in three tables, node by node: the part for low values stands right behind its
//! node, that for high values at the place which is given; at a leaf this place is 0. The same
//! strategy gives the same text.

use std::fmt::Write as _;

use serde_json::json;

use crate::cancellation;
use crate::ir::{Network, Seen};
use crate::learning::{LearnedStrategy, Node, values};

use super::strategy_c::{comment, quoted, starts, table, wrapped};
use super::{learned_actions, learned_json};

/// What does not depend on the strategy, in C.
const C_RUNTIME: &str = include_str!("learned_runtime.c");

/// What does not depend on the strategy, in Python.
const PYTHON_RUNTIME: &str = include_str!("learned_python.txt");

/// What it takes to write a node: see [`cancellation::work`].
const UNITS_FOR_NODE: usize = 128;

/// The languages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// C99.
    C,
    /// Python 3.
    Python,
}

/// A strategy for a query as code; names of C begin with `name`.
pub fn write(
    network: &Network,
    strategy: &LearnedStrategy,
    language: Language,
    name: &str,
    query: &str,
) -> String {
    let parts = Parts {
        network,
        strategy,
        nodes: Nodes::of(strategy),
        actions: learned_actions::texts(network, &strategy.moves),
        query,
    };
    match language {
        Language::C => parts.c(name),
        Language::Python => parts.python(),
    }
}

/// The nodes of all trees.
#[derive(Default)]
struct Nodes {
    features: Vec<i64>,
    numbers: Vec<f64>,
    highs: Vec<i64>,
    /// The first node of each tree.
    roots: Vec<i64>,
}

impl Nodes {
    fn of(strategy: &LearnedStrategy) -> Nodes {
        let mut nodes = Nodes::default();
        let regressors = strategy.regressors.iter();
        for one in regressors.flat_map(|one| &one.appraisals) {
            cancellation::work(UNITS_FOR_NODE * one.tree.len());
            nodes.roots.push(nodes.numbers.len() as i64);
            nodes.add(&one.tree, 0);
        }
        nodes
    }

    fn add(&mut self, tree: &[Node<f64>], node: u32) {
        let place = self.numbers.len();
        let (feature, number, parts) = match tree[node as usize] {
            Node::Leaf(worth) => (0, worth, None),
            Node::Cut {
                feature,
                bound,
                low,
                high,
            } => (feature, bound, Some((low, high))),
        };
        self.features.push(feature.into());
        self.numbers.push(number);
        self.highs.push(0);
        if let Some((low, high)) = parts {
            self.add(tree, low);
            self.highs[place] = self.numbers.len() as i64;
            self.add(tree, high);
        }
    }
}

struct Parts<'s> {
    network: &'s Network,
    strategy: &'s LearnedStrategy,
    nodes: Nodes,
    actions: Vec<String>,
    query: &'s str,
}

impl Parts<'_> {
    /// What is said at the beginning, line by line; the function is called so.
    fn opening(&self, call: &str) -> Vec<String> {
        let texts = learned_json::texts(&self.strategy.observation);
        let discrete = self.with_locations(&texts.discrete);
        let mut lines = vec![
            String::from("A learned strategy for"),
            format!("    {}", self.query),
            String::from("written by ntagen."),
            String::new(),
            format!("{call} is the number of the action to take: of those that are enabled"),
            String::from(
                "the one that is worth most, and of several best ones the first. It is -1 where learning has",
            ),
            String::from(
                "not seen these discrete values, or has tried none of the enabled actions; any will do then.",
            ),
            String::from(
                "Ask at each event, and again while time passes: an action is taken as soon as it is decided.",
            ),
        ];
        let lists = [
            ("discrete", &discrete),
            ("continuous", &texts.continuous),
            (
                "enabled (is the action possible now?), and the numbers of actions",
                &self.actions,
            ),
        ];
        for (list, texts) in lists {
            lines.push(String::new());
            lines.push(format!("{list}:"));
            if texts.is_empty() {
                lines.push(String::from("    (nothing)"));
            }
            for (number, text) in texts.iter().enumerate() {
                lines.push(format!("    [{number}] {text}"));
            }
        }
        lines
    }

    /// The texts of what is seen exactly; of a location with the numbers of all.
    fn with_locations(&self, texts: &[String]) -> Vec<String> {
        let features = self.strategy.observation.discrete.iter();
        let texts = features
            .zip(texts)
            .map(|(feature, text)| match feature.seen {
                Seen::Location(process) => {
                    let process = &self.network.processes[process.0 as usize];
                    let names = process.locations.iter().enumerate();
                    let names = names.map(|(number, one)| format!("{number} {}", one.name));
                    format!("{text}: {}", names.collect::<Vec<_>>().join(", "))
                }
                _ => text.clone(),
            });
        texts.collect()
    }

    /// The exact values of each regressor.
    fn keys(&self) -> impl Iterator<Item = Vec<f64>> {
        let regressors = self.strategy.regressors.iter();
        regressors.map(|one| values(&self.strategy.observation, &one.key))
    }

    fn actions_tried(&self) -> impl Iterator<Item = i64> {
        let regressors = self.strategy.regressors.iter();
        let tried = regressors.flat_map(|one| &one.appraisals);
        tried.map(|one| one.action.into())
    }

    fn c(&self, name: &str) -> String {
        let call = format!("{name}_decide(discrete, continuous, enabled)");
        let mut text = String::new();
        for (number, line) in self.opening(&call).iter().enumerate() {
            let sign = if number == 0 { "/*" } else { " *" };
            let _ = writeln!(text, "{}", format!("{sign} {}", comment(line)).trim_end());
        }
        let observation = &self.strategy.observation;
        let _ = write!(
            text,
            " */\n#include <stddef.h>\n#include <stdint.h>\n\n\
             #define {name}_DISCRETE {}\n#define {name}_CONTINUOUS {}\n#define {name}_ACTIONS {}\n\
             #define {name}_KEYS {}\n#define {name}_SIGN {}\n\n\
             int {name}_decide(const double discrete[], const double continuous[], const unsigned char enabled[]);\n\n",
            observation.discrete.len(),
            observation.continuous.len(),
            self.actions.len(),
            self.strategy.regressors.len(),
            self.sign(),
        );
        let _ = writeln!(
            text,
            "#ifndef {name}_WITHOUT_TEXTS\nconst char *const {name}_texts[] = {{"
        );
        for action in &self.actions {
            let _ = writeln!(text, "    {},", quoted(action));
        }
        text.push_str("};\n#endif\n\n");
        let lengths = self.strategy.regressors.iter();
        let lengths = lengths.map(|one| one.appraisals.len());
        let keys = self.keys().flatten();
        doubles(&mut text, &format!("{name}_keys"), keys);
        let mut integers = |end: &str, values: &mut dyn Iterator<Item = i64>| {
            table(&mut text, &format!("{name}_{end}"), values);
        };
        integers("starts", &mut starts(lengths));
        integers("actions", &mut self.actions_tried());
        let nodes = &self.nodes;
        integers("roots", &mut nodes.roots.iter().copied());
        integers("features", &mut nodes.features.iter().copied());
        integers("highs", &mut nodes.highs.iter().copied());
        doubles(
            &mut text,
            &format!("{name}_numbers"),
            nodes.numbers.iter().copied(),
        );
        text + &C_RUNTIME.replace("NAME", name)
    }

    fn python(&self) -> String {
        let mut text = String::new();
        for line in self.opening("decide(discrete, continuous, enabled)") {
            let line = line.replace(['\n', '\r'], " ");
            let _ = writeln!(text, "{}", format!("# {line}").trim_end());
        }
        let texts = learned_json::texts(&self.strategy.observation);
        let lists = [
            ("DISCRETE", &texts.discrete),
            ("CONTINUOUS", &texts.continuous),
            ("ACTIONS", &self.actions),
        ];
        text.push('\n');
        for (name, texts) in lists {
            let _ = writeln!(text, "{name} = [");
            for one in texts {
                let _ = writeln!(text, "    {},", json!(one));
            }
            text.push_str("]\n");
        }
        let _ = writeln!(text, "\n_SIGN = {}", self.sign());
        let mut roots = self.nodes.roots.iter();
        text.push_str("_KNOWN = {\n");
        for (key, regressor) in self.keys().zip(&self.strategy.regressors) {
            text.push_str("    (");
            for value in key {
                let _ = write!(text, "{value:?},");
            }
            text.push_str("): (");
            for (one, root) in regressor.appraisals.iter().zip(&mut roots) {
                let _ = write!(text, "({},{root}),", one.action);
            }
            text.push_str("),\n");
        }
        text.push_str("}\n");
        let nodes = &self.nodes;
        let mut list = |name: &str, entries: &mut dyn Iterator<Item = String>| {
            let _ = write!(text, "{name} = [");
            wrapped(&mut text, entries);
            text.push_str("]\n");
        };
        list("_FEATURES", &mut nodes.features.iter().map(i64::to_string));
        list("_HIGHS", &mut nodes.highs.iter().map(i64::to_string));
        let numbers = nodes.numbers.iter();
        list("_NUMBERS", &mut numbers.map(|number| format!("{number:?}")));
        text + PYTHON_RUNTIME
    }

    fn sign(&self) -> i32 {
        if self.strategy.is_greatest { -1 } else { 1 }
    }
}

/// A table of doubles.
fn doubles(text: &mut String, name: &str, values: impl Iterator<Item = f64>) {
    let values: Vec<String> = values.map(|value| format!("{value:?}")).collect();
    let _ = write!(text, "static const double {name}[] = {{");
    // C has no tables without entries.
    let none = [String::from("0")];
    let values = if values.is_empty() {
        &none[..]
    } else {
        &values
    };
    wrapped(text, values.iter().cloned());
    text.push_str("};\n");
}
