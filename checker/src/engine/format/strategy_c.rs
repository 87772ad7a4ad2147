//! Strategies as compact controllers: a file in C99 that depends on nothing, for running a strategy
//! elsewhere.
//!
//! The file has two functions: what the strategy does in a state, and whether it allows an action
//! there (see the comment at its beginning). The rest is tables. A discrete state is packed into a
//! key, with only as many bits as the values of its words need. The keys are sorted, and each has a
//! row of rules. A rule is a zone and an action. Equal rows, zones and constraints are stored once.
//! If the first rule that applies counts, zones are enlarged by what earlier rules decide.
//!
//! The same strategy gives the same text.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::hash::Hash;

use crate::game::Player;
use crate::game::strategy::{Selection, Start, Strategy};
use crate::ir::Network;
use crate::network::Part;
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Federation, minimal};

use super::decision_table::{self, Rule, StateRules};
use super::{strategy_text, text};
use crate::engine::query::time_clock;

/// What does not depend on the strategy.
const RUNTIME: &str = include_str!("controller_runtime.c");

/// Why there is no controller.
const STOPWATCHES: &str = "there is no controller for a model with stopwatches: how long to wait depends on when clocks stand still";

/// A strategy for a query as the text of a C file.
///
/// # Errors
/// The reason why there is no controller.
pub fn write(network: &Network, strategy: &Strategy, query: &str) -> Result<String, &'static str> {
    if network.features.stopwatches {
        return Err(STOPWATCHES);
    }
    let network = &*time_clock::network_of(network, strategy);
    let tables = Tables::new(network, strategy);
    let mut text = opening(network, strategy, query, &tables);
    tables.write(network, &mut text);
    text.push_str(RUNTIME);
    Ok(text)
}

/// Things that are there once, by their number.
struct Pool<T> {
    numbers: HashMap<T, usize>,
    all: Vec<T>,
}

impl<T: Clone + Eq + Hash> Pool<T> {
    fn new() -> Pool<T> {
        Pool {
            numbers: HashMap::new(),
            all: Vec::new(),
        }
    }

    /// The number of a thing, a new one if it was not there.
    fn number(&mut self, thing: T) -> usize {
        if let Some(&number) = self.numbers.get(&thing) {
            return number;
        }
        self.numbers.insert(thing.clone(), self.all.len());
        self.all.push(thing);
        self.all.len() - 1
    }
}

/// The values that a word takes.
#[derive(Clone, Copy)]
struct Span {
    low: i32,
    high: i32,
}

impl Span {
    fn range(self) -> u32 {
        self.high.wrapping_sub(self.low) as u32
    }

    fn width(self) -> usize {
        (u32::BITS - self.range().leading_zeros()) as usize
    }
}

/// What is done in a discrete state.
#[derive(Clone, Default, PartialEq, Eq, Hash)]
struct Row {
    /// Rules by the numbers of their zones and actions; action 0 is to wait.
    rules: Vec<(usize, usize)>,
    /// How many of them are the owner's own; behind them are the legs that are picked.
    own: usize,
}

struct Tables {
    owner: Player,
    is_permissive: bool,
    spans: Vec<Span>,
    /// The packed states with the numbers of their rows, ascending by key.
    states: Vec<(Vec<u32>, usize)>,
    /// The first row stands for the end of play.
    rows: Pool<Row>,
    /// Zones as lists of constraints.
    zones: Pool<Vec<usize>>,
    constraints: Pool<Constraint>,
    actions: Pool<Vec<Part>>,
}

impl Tables {
    fn new(network: &Network, strategy: &Strategy) -> Tables {
        let words = network.layout.identity_words as usize;
        let entries = decision_table::entries(network, strategy);
        let spans = (0..words).map(|word| {
            let values = entries.iter().map(|entry| entry.words[word]);
            Span {
                low: values.clone().min().unwrap_or(0),
                high: values.max().unwrap_or(0),
            }
        });
        let mut tables = Tables {
            owner: strategy.owner,
            is_permissive: strategy.selection == Selection::Any,
            spans: spans.collect(),
            states: Vec::new(),
            rows: Pool::new(),
            zones: Pool::new(),
            constraints: Pool::new(),
            actions: Pool::new(),
        };
        tables.rows.number(Row::default());
        for entry in entries {
            let key = tables.key(entry.words);
            let row = tables.row(entry);
            tables.states.push((key, row));
        }
        tables.states.sort_unstable();
        tables
    }

    fn key_bits(&self) -> usize {
        self.spans.iter().map(|span| span.width()).sum()
    }

    fn key(&self, words: &[i32]) -> Vec<u32> {
        let mut key = vec![0; self.key_bits().div_ceil(32).max(1)];
        let mut bit = 0;
        for (span, &word) in self.spans.iter().zip(words) {
            let value = word.wrapping_sub(span.low) as u32;
            for done in 0..span.width() {
                key[bit / 32] |= (value >> done & 1) << (bit % 32);
                bit += 1;
            }
        }
        key
    }

    /// The number of the row of an entry.
    fn row(&mut self, entry: StateRules<'_>) -> usize {
        if entry.is_goal {
            return 0;
        }
        let mut row = Row::default();
        let mut decided: Option<Federation> = None;
        for mut rule in entry.rules {
            let own = rule.zones.clone();
            if let Some(decided) = decided.as_ref().filter(|_| !self.is_permissive) {
                decision_table::simplify_within(&mut rule.zones, decided);
            }
            self.add(rule, &mut row);
            match &mut decided {
                Some(decided) => _ = decided.unite(&own),
                None => decided = Some(own),
            }
        }
        row.own = row.rules.len();
        for leg in entry.legs {
            self.add(leg, &mut row);
        }
        self.rows.number(row)
    }

    /// Adds a rule to a row, once for each of its zones.
    fn add(&mut self, rule: Rule, row: &mut Row) {
        let action = rule
            .action
            .map_or(0, |parts| 1 + self.actions.number(parts));
        for bounds in rule.zones.zones() {
            row.rules
                .push((self.zone(bounds, rule.zones.dimension()), action));
        }
    }

    fn zone(&mut self, bounds: &[Bound], dimension: usize) -> usize {
        let mut zone = Vec::new();
        minimal::for_each_minimal(bounds, dimension, |one| {
            zone.push(self.constraints.number(one));
        });
        self.zones.number(zone)
    }

    fn write(&self, network: &Network, text: &mut String) {
        self.write_actions(network, text);
        let spans = || self.spans.iter();
        array(text, "lows", spans().map(|span| span.low.into()));
        array(text, "ranges", spans().map(|span| span.range().into()));
        array(text, "widths", spans().map(|span| span.width() as i64));

        let constraints = || self.constraints.all.iter();
        array(text, "left", constraints().map(|one| one.left as i64));
        array(text, "right", constraints().map(|one| one.right as i64));
        let bounds = || constraints().map(|one| one.bound);
        array(text, "bounds", bounds().map(|bound| bound.value().into()));
        array(
            text,
            "strict",
            bounds().map(|bound| bound.is_strict().into()),
        );

        let zones = || self.zones.all.iter();
        array(text, "zones", starts(zones().map(Vec::len)));
        let constraints = zones().flatten();
        array(text, "constraints", constraints.map(|&one| one as i64));

        let rows = || self.rows.all.iter();
        array(
            text,
            "row_starts",
            starts(rows().map(|row| row.rules.len())),
        );
        if self.has_legs() {
            array(text, "row_owns", rows().map(|row| row.own as i64));
        }
        let rules = || rows().flat_map(|row| &row.rules);
        array(text, "rule_zones", rules().map(|rule| rule.0 as i64));
        array(text, "rule_actions", rules().map(|rule| rule.1 as i64));

        let rows = self.states.iter().map(|state| state.1 as i64);
        array(text, "rows", rows);
        self.write_keys(text);
    }

    /// Whether the strategy picks legs of moves of the controller.
    fn has_legs(&self) -> bool {
        self.rows.all.iter().any(|row| row.own < row.rules.len())
    }

    /// The texts of the actions, which a program may leave out.
    fn write_actions(&self, network: &Network, text: &mut String) {
        let count = self.actions.all.len();
        let _ = writeln!(text, "#define CONTROLLER_ACTIONS {count}\n");
        let all = self.actions.all.iter();
        texts(
            text,
            all.map(|parts| strategy_text::edges(network, self.owner, parts)),
        );
    }

    fn write_keys(&self, text: &mut String) {
        let bits = self.key_bits();
        let kind = [8, 16, 32]
            .into_iter()
            .find(|&kind| bits <= kind)
            .unwrap_or(32);
        let keys = bits.div_ceil(32).max(1);
        let _ = write!(
            text,
            "\ntypedef uint{kind}_t controller_key;\n#define CONTROLLER_KEY_BITS {kind}\n#define CONTROLLER_KEYS {keys}\n\
             #define CONTROLLER_STATES {}\n\nstatic const controller_key controller_keys[][CONTROLLER_KEYS] = {{",
            self.states.len()
        );
        let keys = self.states.iter().map(|(key, _)| {
            let key: Vec<String> = key.iter().map(u32::to_string).collect();
            format!("{{{}}}", key.join(","))
        });
        wrapped(text, keys);
        text.push_str("};\n\n");
    }
}

/// The comment that the file begins with, and its interface.
fn opening(network: &Network, strategy: &Strategy, query: &str, tables: &Tables) -> String {
    let owner = match strategy.owner {
        Player::Controller => "the controller",
        Player::Environment => "the environment",
    };
    let which = match strategy.selection {
        Selection::First => "in each state it does one thing",
        Selection::Any => "it allows all that is safe; controller_decide waits as long as that is",
    };
    let mut text = format!(
        "/* A strategy of {owner} for\n *     {}\n * ({which}), written by ntagen.\n *\n",
        comment(query)
    );
    match &strategy.start {
        Start::Initial => {}
        Start::Anywhere => text.push_str(" * It begins in any state that can be reached.\n *\n"),
        Start::After(way) => {
            text.push_str(" * It begins after these steps of both players:\n");
            for line in strategy_text::way_lines(network, way).lines() {
                let _ = writeln!(text, " *     {}", comment(line));
            }
            text.push_str(" *\n");
        }
    }
    text.push_str(
        " * controller_decide(state, clocks) says what to do: an action, by its number (controller_texts has its edges), or\n\
         \x20*   CONTROLLER_WAIT  to make no move: for the time `wait` (for ever if that is negative), and at the moment itself\n\
         \x20*                    too unless `is_open`; ask again then, and whenever the state has changed\n\
         \x20*   CONTROLLER_OVER  play has ended here\n\
         \x20*   CONTROLLER_NONE  the strategy says nothing: play does not come here\n\
         \x20* controller_allows(state, clocks, action) says whether an action, or CONTROLLER_WAIT, is allowed.\n\
         \x20*\n"
    );
    if tables.has_legs() {
        text.push_str(
            " * Behind branch points of edges that the controller takes, the environment picks the leg: an action that is one of these is\n\
             \x20* allowed where it is picked, and never decided.\n *\n",
        );
    }
    text.push_str(
        "\
         \x20* Times are of the type CONTROLLER_TIME, a signed number; CONTROLLER_UNIT of them are one unit of time of the model.\n\
         \x20* Define both before including this file to count ticks in integers.\n *\n",
    );
    text.push_str(" * clocks:\n");
    for (index, clock) in network.clocks.iter().skip(1).enumerate() {
        let what = if clock.name == time_clock::TIME {
            ": the time since the start"
        } else {
            ""
        };
        let _ = writeln!(text, " *   [{index}] {}{what}", comment(&clock.name));
    }
    text.push_str(" * state:\n");
    for (index, process) in network.processes.iter().enumerate() {
        let names = process.locations.iter().enumerate();
        let names = names.map(|(id, location)| format!("{id} {}", location.name));
        let names = names.collect::<Vec<_>>().join(", ");
        let _ = writeln!(
            text,
            " *   [{index}] {}: {}",
            comment(&process.name),
            comment(&names)
        );
    }
    let words = tables.spans.len();
    text::for_each_place(network, |name, place| {
        if place.offset < words {
            let _ = writeln!(
                text,
                " *   [{}] {}{}",
                place.offset,
                comment(name),
                match place.shape {
                    crate::ir::Shape::Double =>
                        ": the low 32 bits of the double, and the high ones behind them",
                    _ => "",
                }
            );
        }
    });
    text + &interface(network, tables)
}

/// What the file declares.
fn interface(network: &Network, tables: &Tables) -> String {
    format!(
        " */\n\
         #include <stddef.h>\n\
         #include <stdint.h>\n\n\
         #ifndef CONTROLLER_TIME\n\
         #define CONTROLLER_TIME double\n\
         #endif\n\
         #ifndef CONTROLLER_UNIT\n\
         #define CONTROLLER_UNIT 1\n\
         #endif\n\
         #define CONTROLLER_WAIT (-1)\n\
         #define CONTROLLER_OVER (-2)\n\
         #define CONTROLLER_NONE (-3)\n\
         #define CONTROLLER_STATE_WORDS {}\n\
         #define CONTROLLER_CLOCKS {}\n\
         #define CONTROLLER_IS_PERMISSIVE {}\n\
         #define CONTROLLER_HAS_LEGS {}\n\
         #define CONTROLLER_GOAL_ROW 0\n\n\
         typedef CONTROLLER_TIME controller_time;\n\n\
         typedef struct {{\n\
         \x20   int action;\n\
         \x20   controller_time wait;\n\
         \x20   int is_open;\n\
         }} controller_decision;\n\n\
         controller_decision controller_decide(const int32_t *state, const controller_time *clocks);\n\
         int controller_allows(const int32_t *state, const controller_time *clocks, int action);\n\n",
        tables.spans.len(),
        network.clocks.len().saturating_sub(1),
        i32::from(tables.is_permissive),
        i32::from(tables.has_legs()),
    )
}

/// Text that stays inside a comment.
pub(super) fn comment(text: &str) -> String {
    text.replace("*/", "* /")
        .replace("/*", "/ *")
        .replace(['\n', '\r'], " ")
}

/// Text as a C string. Question marks are escaped, so that none is read as part of a trigraph.
pub(super) fn quoted(text: &str) -> String {
    let mut quoted = "\"".to_owned();
    for byte in text.bytes() {
        match byte {
            b'"' | b'\\' | b'?' => quoted.extend(['\\', byte as char]),
            b' '..=b'~' => quoted.push(byte as char),
            _ => _ = write!(quoted, "\\{byte:03o}"),
        }
    }
    quoted + "\""
}

/// Where each of the lists begins if they are put together, and the end of the last.
pub(super) fn starts(lengths: impl Iterator<Item = usize>) -> impl Iterator<Item = i64> {
    let ends = lengths.scan(0, |end, length| {
        *end += length as i64;
        Some(*end)
    });
    std::iter::once(0).chain(ends)
}

/// The texts of the actions, which a program may leave out.
pub(super) fn texts(text: &mut String, actions: impl Iterator<Item = String>) {
    text.push_str("#ifndef CONTROLLER_WITHOUT_TEXTS\nconst char *const controller_texts[] = {\n");
    let before = text.len();
    for action in actions {
        let _ = writeln!(text, "    {},", quoted(&action));
    }
    if text.len() == before {
        text.push_str("    0,\n");
    }
    text.push_str("};\n#endif\n\n");
}

/// A table of the smallest type that holds its values.
pub(super) fn array(text: &mut String, name: &str, values: impl Iterator<Item = i64>) {
    table(text, &format!("controller_{name}"), values);
}

/// The same under another name.
pub(super) fn table(text: &mut String, name: &str, values: impl Iterator<Item = i64>) {
    let values: Vec<i64> = values.collect();
    let low = values.iter().copied().min().unwrap_or(0);
    let high = values.iter().copied().max().unwrap_or(0);
    let kind = match (low, high) {
        (0.., ..=0xff) => "uint8_t",
        (0.., ..=0xffff) => "uint16_t",
        (0.., _) => "uint32_t",
        (-0x80.., ..=0x7f) => "int8_t",
        (-0x8000.., ..=0x7fff) => "int16_t",
        _ => "int32_t",
    };
    let _ = write!(text, "static const {kind} {name}[] = {{");
    let values = if values.is_empty() { vec![0] } else { values };
    wrapped(
        text,
        values.iter().map(|value| match *value {
            // The least number of 32 bits cannot be written as one.
            value if value == i64::from(i32::MIN) => "-2147483647 - 1".to_owned(),
            value if value > i64::from(i32::MAX) => format!("{value}u"),
            value => value.to_string(),
        }),
    );
    text.push_str("};\n");
}

/// Columns of a line of a table.
const COLUMNS: usize = 120;

/// Writes entries separated by commas, on several lines if they are many.
pub(super) fn wrapped(text: &mut String, entries: impl Iterator<Item = String>) {
    let mut line = String::new();
    let mut is_first = true;
    for entry in entries {
        if !std::mem::take(&mut is_first) {
            line.push(',');
        }
        if line.len() + entry.len() >= COLUMNS {
            text.push_str(&line);
            text.push('\n');
            line.clear();
        }
        line.push_str(&entry);
    }
    text.push_str(&line);
}
