//! States, moves and zones in the words of the model.
//!
//! The text of a trace follows the form that UPPAAL's command-line checker prints, so that scripts
//! written for that can read it.

use std::fmt::Write as _;

use crate::cancellation;
use crate::engine::evidence::witness::{Missing, Proof, Witness};
use crate::engine::loaded_model::LoadedModel;
use crate::ir::{Branch, EdgeId, EdgeLabels, Network, RunTimeErrorKind, Shape};
use crate::network::discrete::selects::{select_count, select_values};
use crate::network::{Failure, Part};
use crate::search::Trace;
use crate::search::liveness::ending::RunEnding;
use crate::verify::replay::{Defect, End, Run};
use crate::verify::{self, State};
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Zone, minimal};

/// Calls `visit` with the name and the value of every scalar part of every variable.
pub fn for_each_value(network: &Network, words: &[i32], mut visit: impl FnMut(&str, Value)) {
    for_each_place(network, |name, ValuePlace { shape, offset }| {
        visit(
            name,
            match shape {
                Shape::Double => {
                    let (low, high) = (words[offset] as u32, words[offset + 1] as u32);
                    Value::Double(f64::from_bits(u64::from(low) | u64::from(high) << 32))
                }
                _ => Value::Integer(words[offset]),
            },
        );
    });
}

/// Where a scalar part of a variable lies among the words.
#[derive(Clone, Copy, Debug)]
pub struct ValuePlace<'n> {
    /// Its shape: neither an array nor a struct.
    pub shape: &'n Shape,
    /// Its first word.
    pub offset: usize,
}

/// Calls `visit` with the name and the place of every scalar part of every variable.
pub fn for_each_place<'n>(network: &'n Network, mut visit: impl FnMut(&str, ValuePlace<'n>)) {
    for variable in &network.layout.variables {
        let offset = variable.offset as usize;
        visit_shape(&variable.shape, &variable.name, offset, &mut visit);
    }
}

/// A value of a variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// An integer, truth value or scalar.
    Integer(i32),
    /// A double.
    Double(f64),
}

/// What it takes to write the name of a place or a location, and what is there: see
/// [`cancellation::work`].
const UNITS_FOR_NAME: usize = 128;

/// Calls `visit` with the name and the place of every scalar part of a variable.
pub(super) fn visit_shape<'n>(
    shape: &'n Shape,
    name: &str,
    offset: usize,
    visit: &mut impl FnMut(&str, ValuePlace<'n>),
) {
    match shape {
        Shape::Integer { .. } | Shape::Bool | Shape::Scalar { .. } | Shape::Double => {
            cancellation::work(UNITS_FOR_NAME);
            visit(name, ValuePlace { shape, offset });
        }
        Shape::Array {
            part,
            length,
            first,
            ..
        } => {
            let size = part.words() as usize;
            for index in 0..*length {
                let name = format!("{name}[{}]", first + index as i32);
                visit_shape(part, &name, offset + index as usize * size, visit);
            }
        }
        Shape::Struct(fields) => {
            let mut offset = offset;
            for (field, shape) in fields {
                visit_shape(shape, &format!("{name}.{field}"), offset, visit);
                offset += shape.words() as usize;
            }
        }
    }
}

/// The name of the location that a process is in.
pub fn location_name<'n>(network: &'n Network, process: usize, words: &[i32]) -> &'n str {
    &network.processes[process].locations[words[process] as usize].name
}

/// The constraints of a zone that say something, as `x-y <= 3` and its kin; differences that follow
/// from bounds of the clocks alone are left out.
pub fn zone_constraints(network: &Network, zone: &Zone) -> Vec<String> {
    let mut constraints = Vec::new();
    let dimension = zone.dimension();
    for left in 0..dimension {
        for right in 0..dimension {
            let bound = zone.bound(left, right);
            let is_trivial =
                left == right || bound.is_infinite() || (left == 0 && bound >= Bound::LE_ZERO);
            let is_difference = left != 0 && right != 0;
            if is_trivial || (is_difference && zone.bound(left, 0) + zone.bound(0, right) <= bound)
            {
                continue;
            }
            let one = Constraint { left, right, bound };
            constraints.push(comparison(network, one, left == 0));
        }
    }
    constraints
}

/// A constraint as `x <= 3` or `x-y <= 3`, or with both sides exchanged, as `x >= -3`.
fn comparison(network: &Network, one: Constraint, is_swapped: bool) -> String {
    let relation = match (one.bound.is_strict(), is_swapped) {
        (false, false) => "<=",
        (true, false) => "<",
        (false, true) => ">=",
        (true, true) => ">",
    };
    compared(network, one, relation, is_swapped)
}

fn compared(network: &Network, one: Constraint, relation: &str, is_swapped: bool) -> String {
    let name = |clock: usize| network.clocks[clock].name.as_str();
    let (left, right, value) = if is_swapped {
        (one.right, one.left, -one.bound.value())
    } else {
        (one.left, one.right, one.bound.value())
    };
    match right {
        0 => format!("{} {relation} {value}", name(left)),
        _ => format!("{}-{} {relation} {value}", name(left), name(right)),
    }
}

/// The fewest constraints that make a zone: first the equalities, as `x == 3` and `x-y == 2`, then
/// the others, as `x <= 3` and `x-y >= 1`.
pub fn minimal_constraints(network: &Network, zone: &Zone) -> Vec<String> {
    let ties = |left: usize, right: usize| {
        zone.bound(left, right) + zone.bound(right, left) == Bound::LE_ZERO
    };
    // Differences are written so that they are not negative.
    let is_swapped = |one: Constraint| one.left == 0 || (one.right != 0 && one.bound.value() < 0);
    let mut texts = Vec::new();
    for left in 1..zone.dimension() {
        if let Some(right) = (0..left).find(|&right| ties(left, right)) {
            let bound = zone.bound(left, right);
            let one = Constraint { left, right, bound };
            texts.push(compared(network, one, "==", is_swapped(one)));
        }
    }
    minimal::for_each_minimal(zone.bounds(), zone.dimension(), |one| {
        if !ties(one.left, one.right) {
            texts.push(comparison(network, one, is_swapped(one)));
        }
    });
    texts
}

/// An edge as `P.a->P.b { guard, sync, update }`, with the select values.
pub fn part_text(network: &Network, part: Part) -> String {
    let edge = network.edge(part);
    let branch = &edge.branches[part.branch as usize];
    edge_text(
        network,
        part,
        &edge.labels,
        &selects(network, part),
        [branch],
    )
}

/// An edge with all the legs of its branch point, as `P.a->(P.b|P.c) { guard, sync, update }`. The
/// labels are those of the edge to the branch point.
pub fn entry_text(network: &Network, part: Part) -> String {
    let entry = entry(network, part);
    entry_text_with(network, part, entry.labels, &entry.selects)
}

/// What the edges of an entry share.
pub(super) struct EntryParts<'n> {
    /// The labels of the edge to the branch point, or of the whole edge.
    pub(super) labels: &'n EdgeLabels,
    /// The values of its select bindings.
    pub(super) selects: Vec<(&'n str, i32)>,
}

/// The entry of an edge.
pub(super) fn entry(network: &Network, part: Part) -> EntryParts<'_> {
    let edge = network.edge(part);
    let (labels, bindings) = match &edge.leg {
        Some(leg) => (&leg.entry, leg.bindings),
        None => (&edge.labels, edge.select.len()),
    };
    let mut selects = selects(network, part);
    selects.truncate(bindings);
    EntryParts { labels, selects }
}

/// An entry with these labels, and these select values behind them.
pub(super) fn entry_text_with(
    network: &Network,
    part: Part,
    labels: &EdgeLabels,
    shown: &[(&str, i32)],
) -> String {
    let process = &network.processes[part.process as usize];
    let edges = process.edges_of_entry(EdgeId(part.edge));
    let branches = edges.flat_map(|edge| &edge.branches);
    edge_text(network, part, labels, shown, branches)
}

/// An edge with these labels, these select values behind them, and these ends.
fn edge_text<'n>(
    network: &'n Network,
    part: Part,
    labels: &EdgeLabels,
    shown: &[(&str, i32)],
    branches: impl IntoIterator<Item = &'n Branch>,
) -> String {
    let process = &network.processes[part.process as usize];
    let edge = network.edge(part);
    let name = |location: u32| {
        format!(
            "{}.{}",
            process.name, process.locations[location as usize].name
        )
    };
    let mut targets: Vec<String> = Vec::new();
    for branch in branches {
        let target = name(branch.target.0);
        if !targets.contains(&target) {
            targets.push(target);
        }
    }
    let target = match &targets[..] {
        [target] => target.clone(),
        targets => format!("({})", targets.join("|")),
    };
    let EdgeLabels {
        guard,
        sync,
        update,
        ..
    } = labels;
    let or = |text: &str, default: &str| {
        if text.is_empty() {
            default.to_owned()
        } else {
            text.to_owned()
        }
    };
    let mut text = format!(
        "{}->{} {{ {}, {}, {} }}",
        name(edge.source.0),
        target,
        or(guard, "1"),
        or(sync, "tau"),
        or(update, "1")
    );
    for (name, value) in shown {
        // Writing to a string cannot fail.
        let _ = write!(text, " [{name}={value}]");
    }
    text
}

/// The select bindings of a part.
pub fn selects(network: &Network, part: Part) -> Vec<(&str, i32)> {
    let edge = network.edge(part);
    if select_count(edge) == 0 {
        return Vec::new();
    }
    let mut values = Vec::new();
    select_values(edge, part.select, &mut values);
    edge.select
        .iter()
        .map(|select| select.name.as_str())
        .zip(values)
        .collect()
}

/// A trace as text: each state in full, and the transitions between.
pub fn trace_text(network: &Network, trace: &Trace) -> String {
    let mut text = String::new();
    for (index, (words, zone)) in trace.states.iter().enumerate() {
        if index > 0 {
            text.push_str("\nTransitions:\n");
            for part in &trace.moves[index - 1] {
                let _ = writeln!(text, "  {}", part_text(network, *part));
            }
            text.push('\n');
        }
        cancellation::work(UNITS_FOR_NAME * network.processes.len());
        text.push_str("State:\n(");
        for process in 0..network.processes.len() {
            let _ = write!(
                text,
                " {}.{}",
                network.processes[process].name,
                location_name(network, process, words)
            );
        }
        text.push_str(" )\n");
        for_each_value(network, words, |name, value| {
            let _ = match value {
                Value::Integer(value) => write!(text, "{name}={value} "),
                Value::Double(value) => write!(text, "{name}={value:?} "),
            };
        });
        let _ = writeln!(text, "{}", zone_constraints(network, zone).join(" "));
    }
    text
}

/// The move that fails in the last state of a trace, below that trace.
pub fn failing_text(network: &Network, parts: &[Part]) -> String {
    let lines = parts
        .iter()
        .map(|part| format!("  {}\n", part_text(network, *part)));
    format!("\nFails in the transitions:\n{}", lines.collect::<String>())
}

/// Why a run never ends, as a line below its trace.
pub fn ending_text(ending: RunEnding) -> String {
    match ending {
        RunEnding::Loop(start) => {
            format!("\nThe last state leads back to state {start} (the first is 0).\n")
        }
        RunEnding::Waits => "\nTime passes for ever in the last state.\n".to_owned(),
        RunEnding::Stuck => "\nNothing is possible any more in the last state.\n".to_owned(),
    }
}

/// A number of ticks as an exact fraction of the unit of time.
pub fn fraction(ticks: i64, ticks_per_unit: i64) -> String {
    let (mut divisor, mut rest) = (ticks_per_unit, ticks.rem_euclid(ticks_per_unit));
    while rest != 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    match ticks_per_unit / divisor {
        1 => (ticks / divisor).to_string(),
        denominator => format!("{}/{denominator}", ticks / divisor),
    }
}

/// A run with exact times as text: each state in one line, what happens after how long below it.
pub fn run_text(network: &Network, run: &Run, states: &[State]) -> String {
    let unit = run.ticks_per_unit;
    let mut text = "\nRun:\n".to_owned();
    let entered = &states[..states.len().min(run.steps.len() + 1)];
    for (index, state) in entered.iter().enumerate() {
        let _ = writeln!(text, "{index}: {}", state_line(network, state, unit));
        if let Some(step) = run.steps.get(index) {
            if step.wait != 0 {
                let _ = writeln!(text, "  wait {}", fraction(step.wait, unit));
            }
            for part in &step.parts {
                let _ = writeln!(text, "  {}", part_text(network, *part));
            }
        }
    }
    if let (End::After(wait) | End::Waits(wait) | End::Stuck(wait), Some(end)) =
        (run.end, states.get(entered.len()))
    {
        let end = state_line(network, end, unit);
        let _ = writeln!(text, "  wait {}\n   {end}", fraction(wait, unit));
    }
    text + &match run.end {
        End::After(_) => String::new(),
        End::Loop(start) => {
            format!("  The same as state {start} from here on: the run goes round for ever.\n")
        }
        End::Waits(_) => "  Time passes for ever.\n".to_owned(),
        End::Stuck(_) => "  Nothing is possible any more.\n".to_owned(),
    }
}

/// A state with exact clock values in one line.
pub fn state_line(network: &Network, state: &State, ticks_per_unit: i64) -> String {
    let mut line = words_line(network, &state.words);
    for (clock, &value) in network.clocks.iter().zip(&state.clocks).skip(1) {
        let value = fraction(value, ticks_per_unit);
        let _ = write!(line, " {}={value}", clock.name);
    }
    line
}

/// Locations and variables in one line.
pub fn words_line(network: &Network, words: &[i32]) -> String {
    cancellation::work(UNITS_FOR_NAME * network.processes.len());
    let mut parts = vec!["(".to_owned()];
    for (index, process) in network.processes.iter().enumerate() {
        let location = location_name(network, index, words);
        parts.push(format!("{}.{location}", process.name));
    }
    parts.push(")".to_owned());
    for_each_value(network, words, |name, value| {
        parts.push(match value {
            Value::Integer(value) => format!("{name}={value}"),
            Value::Double(value) => format!("{name}={value:?}"),
        });
    });
    parts.join(" ")
}

/// A witness as text: the symbolic trace in UPPAAL's form, and the run with exact times.
pub fn witness_text(network: &Network, witness: &Witness) -> String {
    let title = witness.title.as_ref();
    let mut text = title.map_or_else(String::new, |title| format!("{title}:\n"));
    text += &trace_text(network, &witness.trace);
    if let Some(failing) = &witness.failing {
        text += &failing_text(network, failing);
    }
    text += &witness.ending.map_or_else(String::new, ending_text);
    match &witness.run {
        Some(Proof::Replayed(run, states, _)) => text += &run_text(network, run, states),
        Some(Proof::Missing(missing)) => {
            let _ = writeln!(text, "\nNo exact times: {}.", missing_text(*missing));
        }
        Some(Proof::Violated(..) | Proof::Impossible) | None => {}
    }
    text
}

/// Why there is no run with exact times.
pub fn missing_text(missing: Missing) -> String {
    match missing {
        Missing::Approximate => "the zones are too large, the moves may not be possible".to_owned(),
        Missing::Meta => "states that differ in meta variables alone count as the same, but other moves may be possible in them".to_owned(),
        Missing::TooHard => "too many ways to choose between".to_owned(),
        Missing::OpenLoop => "the loop was not found to close exactly".to_owned(),
        Missing::Stopped => "the search for them was stopped by a limit".to_owned(),
        Missing::Failed(_) => "the model fails on the way".to_owned(),
        Missing::NotCovered(verify::Error::Unsupported(what)) => {
            format!("the replay does not cover {what}")
        }
        Missing::NotCovered(_) => "the replay fails on the way".to_owned(),
    }
}

/// What went wrong with a state that has exact clock values.
pub fn error_text(model: &LoadedModel, error: verify::Error) -> String {
    match error {
        verify::Error::RunTime(error) => failure_text(model, Failure::RunTime(error)),
        verify::Error::InitialInvariant => failure_text(model, Failure::InitialInvariant),
        verify::Error::Unsupported(what) => format!("{what} are not supported here"),
    }
}

/// What the replay of a run covered, or what is wrong with it.
pub fn proof_lines(proof: &Proof) -> Vec<String> {
    let violated = |what: String| vec![format!("trace violated: {what}")];
    match proof {
        Proof::Replayed(_, _, coverage) => vec![format!(
            "trace replayed: {} states, {} moves, {} moments of waits",
            coverage.states, coverage.moves, coverage.moments
        )],
        Proof::Missing(missing) => {
            vec![format!("trace not replayed: {}", missing_text(*missing))]
        }
        Proof::Impossible => violated("its moves have no times".to_owned()),
        Proof::Violated(_, violation) => {
            let defect = defect_text(violation.defect);
            violated(format!("{defect} (state {})", violation.state))
        }
    }
}

fn defect_text(defect: Defect) -> &'static str {
    match defect {
        Defect::Malformed => "its end, its waits or its moments are not those of a run",
        Defect::NoTime => "time cannot pass here so long",
        Defect::NoMove => "the move is not possible here",
        Defect::NotReached => "what is to be reached does not hold at the end",
        Defect::NotOpen => "what is to be answered does not hold at the moment given",
        Defect::NotKept => "what must stay does not hold here",
        Defect::NoLoop => "the last state is not like the one that it leads back to",
        Defect::NotEndless => "time does not pass for ever here, or the run ends",
        Defect::NotStuck => "something is possible here",
        Defect::OtherValue => "the value is another one",
    }
}

/// What went wrong in the model, and where.
pub fn failure_text(model: &LoadedModel, failure: Failure) -> String {
    let network = model.network();
    match failure {
        Failure::RunTime(error) => {
            let (place, text) = model.place(network.sites[error.site.0 as usize].span);
            format!("{}, at {place}: {text}", run_time_error(error.kind))
        }
        Failure::ClockLimit(value) => {
            format!("a clock is set to or compared with {value}, beyond what zones can hold")
        }
        Failure::Rate { process, rate } => {
            let process = &network.processes[process as usize].name;
            format!("{process} gives a clock the rate {rate}; only 0 and 1 have a meaning here")
        }
        Failure::Moves(most) => {
            format!(
                "a state has more than {most} moves: too many receivers of a broadcast have a choice"
            )
        }
        Failure::Interrupted => "interrupted".to_owned(),
        Failure::ClockRange => crate::engine::limits::CLOCKS_GREW.to_owned(),
        Failure::InitialInvariant => "the initial state breaks an invariant".to_owned(),
    }
}

pub(crate) fn run_time_error(kind: RunTimeErrorKind) -> &'static str {
    match kind {
        RunTimeErrorKind::Overflow => "the result of integer arithmetic does not fit into 32 bits",
        RunTimeErrorKind::DivisionByZero => "division by zero",
        RunTimeErrorKind::ShiftDistance => "shift by a negative number of bits, or by more than 31",
        RunTimeErrorKind::NegativeExponent => "negative exponent",
        RunTimeErrorKind::OutOfRange => "value out of range",
        RunTimeErrorKind::IndexOutOfBounds => "array index out of bounds",
        RunTimeErrorKind::NotAnInteger => "the number does not fit into an integer",
        RunTimeErrorKind::Parameter(distribution) => distribution.failure(),
        RunTimeErrorKind::NoRoom => "too many instances of a dynamic template",
        RunTimeErrorKind::NotLoaded => "call of an external function whose library is not loaded",
        RunTimeErrorKind::ClockValue => {
            "negative value of a clock, or clock bound beyond the limits"
        }
        RunTimeErrorKind::AssertionFailed => "assertion failed",
        RunTimeErrorKind::StepLimit => "a function ran too long",
        RunTimeErrorKind::Interrupted => "interrupted",
    }
}
