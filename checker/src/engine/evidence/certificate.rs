//! Certificates: how the states of one are found, written as a file, read and checked.
//!
//! A certificate has one JSON value a line. The first has `format` "ntagen-certificate", `version`
//! 1, the `query`, the names of the `processes`, of the scalar `variables` and of the `clocks`, and
//! the number of `states`. Each further line is a state: its `words` (the index of each process's
//! location, then the variables, doubles as two words of bits) and its `zones`. A zone is a list of
//! constraints that all hold, each `[left, right, bound, strict]`: clock left minus clock right is
//! at most bound, or less if strict is 1; clocks count from 1, and 0 stands for the number 0. What
//! it claims is in [`crate::verify::certificate`].

use std::ops::Range;

use serde_json::{Value as Json, json};

use crate::cancellation::{self, Cut, Room};
use crate::ir::{Network, Predicate, QueryKind};
use crate::network::{Failure, Symbolic};
use crate::search::limits::{Counters, Watch};
use crate::search::optimum::best_first::{BestFirst, Measure};
use crate::search::{Outcome, StopReason};
use crate::verify;
use crate::verify::certificate::{self, Defect, States};
use crate::verify::strategy::Constraint;

use super::checked::{Checked, Unreadable};
use super::strategy_check;
use crate::engine::answer::Certificate;
use crate::engine::format::json::written;
use crate::engine::format::json_reader::{integer, only};
use crate::engine::format::text;
use crate::engine::limits::{cut_as_interrupted, stop_text};

/// What a file with a certificate says that it is.
pub const FORMAT: &str = "ntagen-certificate";

/// The network with `meta` variables as ordinary ones: whether states that differ in them alone are
/// the same decides which of them a search meets, but not what it claims of those that it meets.
pub(crate) fn with_all_words(network: &Network) -> Network {
    let mut whole = network.clone();
    whole.layout.identity_words = whole.layout.words;
    whole
}

/// Why there is no certificate, and what stopped the search for it, if something did.
pub(crate) type NoCertificate = (&'static str, Option<StopReason>);

/// Searches again without short cuts for a state that satisfies the predicate, of which there is
/// none; what was reached. `symbolic` is about a network [`with_all_words`].
pub(crate) fn reached(
    symbolic: &mut Symbolic<'_>,
    avoided: &Predicate,
    before: Counters,
    watch: &mut dyn Watch,
) -> Result<Certificate, NoCertificate> {
    let dimension = symbolic.dimension();
    let variables = &symbolic.stepper.network().layout.variables;
    let has_meta = variables.iter().any(|variable| variable.meta);
    let mut search = BestFirst::new(symbolic, &avoided, Measure::Moves, before);
    match cut_as_interrupted(|| search.run(watch)) {
        Ok(Outcome::Exhausted) => {}
        Ok(Outcome::Found(_)) if has_meta => {
            let why = "a search for it, in which states that differ in meta variables alone are not the same, finds a state";
            return Err((why, None));
        }
        Ok(Outcome::Found(_)) => return Err(("a search without short cuts finds a state", None)),
        Ok(Outcome::Stopped(reason)) => return Err((stop_text(reason), Some(reason))),
        Err(Failure::Interrupted) => {
            let reason = watch.look(&search.counters());
            let reason = reason.unwrap_or(StopReason::Interrupted);
            return Err((stop_text(reason), Some(reason)));
        }
        Err(_) => return Err(("the model fails", None)),
    }
    let counters = search.counters();
    let certificate = cancellation::unless_cut(|| {
        let mut room = Room::default();
        let states = search.into_reached().into_iter().map(|(words, zones)| {
            let zones = zones.iter();
            let zones = zones.map(|zone| strategy_check::constraints(zone.bounds(), dimension));
            let zones: Vec<_> = zones.collect();
            // The zones that these are made of count still.
            let constraints = zones.iter().map(|zone| size_of_val(&**zone));
            room.take(size_of::<States>() + size_of_val(&*words) + constraints.sum::<usize>());
            States { words, zones }
        });
        Certificate {
            states: states.collect(),
        }
    });
    certificate.map_err(|Cut| {
        let reason = watch.look(&counters).unwrap_or(StopReason::Interrupted);
        ("gathering its states was stopped by a limit", Some(reason))
    })
}

impl Certificate {
    /// How many states it has.
    pub fn state_count(&self) -> usize {
        self.states.len()
    }

    /// The first line of the file.
    pub fn head(&self, network: &Network, query: &str) -> String {
        let header = json!({
            "format": FORMAT,
            "version": 1,
            "query": query,
            "processes": processes(network),
            "variables": variables(network),
            "clocks": clocks(network),
            "states": self.states.len(),
        });
        header.to_string() + "\n"
    }

    /// The lines of these states in the file. Those of all may be more than there is memory for.
    pub fn lines(&self, states: Range<usize>) -> String {
        let mut text = String::new();
        for state in &self.states[states] {
            let zones = state.zones.iter().map(|zone| {
                let constraints = zone.iter();
                let constraints = constraints
                    .map(|one| json!([one.left, one.right, one.bound, u8::from(one.strict)]));
                Json::Array(constraints.collect())
            });
            let line = json!({ "words": state.words, "zones": zones.collect::<Vec<_>>() });
            text.push_str(&written(&line));
            text.push('\n');
        }
        text
    }
}

fn processes(network: &Network) -> Vec<&str> {
    let processes = network.processes.iter();
    processes.map(|process| process.name.as_str()).collect()
}

fn variables(network: &Network) -> Vec<String> {
    let mut names = Vec::new();
    text::for_each_value(network, &network.initial, |name, _| {
        names.push(name.to_owned());
    });
    names
}

fn clocks(network: &Network) -> Vec<&str> {
    let clocks = network.clocks.iter().skip(1);
    clocks.map(|clock| clock.name.as_str()).collect()
}

/// Checks a certificate as read from its file.
pub(super) fn check_file(
    network: &Network,
    query: &QueryKind,
    header: &Json,
    text: &str,
) -> Result<Checked, Unreadable> {
    let avoided = match query {
        QueryKind::Reachable(goal) => goal.clone(),
        QueryKind::Invariantly(keep) => keep.negated(),
        _ => return Err("certificates are for E<> and A[] only".to_owned()),
    };
    if header["processes"] != json!(processes(network))
        || header["variables"] != json!(variables(network))
        || header["clocks"] != json!(clocks(network))
    {
        return Err("it belongs to a model with other processes, variables or clocks".to_owned());
    }
    let known = [
        "format",
        "version",
        "query",
        "processes",
        "variables",
        "clocks",
        "states",
    ];
    only(header, &known, "line 1")?;
    let mut states = Vec::new();
    for (index, line) in text.lines().enumerate().skip(1) {
        let at_line = |why: &str| format!("line {}: {why}", index + 1);
        let line: Json = serde_json::from_str(line).map_err(|error| at_line(&error.to_string()))?;
        only(&line, &["words", "zones"], &format!("line {}", index + 1))?;
        states.push(state_of(&line).ok_or_else(|| at_line("this is no state"))?);
    }
    if header["states"] != json!(states.len()) {
        return Err("it has another number of states than it says".to_owned());
    }
    Ok(verify(network, &states, &avoided))
}

/// Checks the states of a certificate.
pub fn verify(network: &Network, states: &[States], avoided: &Predicate) -> Checked {
    let (holds, lines) = match certificate::verify(network, states, avoided) {
        Ok(certificate::Outcome::Verified(coverage)) => {
            let line = format!(
                "certificate verified: {} words, {} zones, {} moves",
                coverage.words, coverage.zones, coverage.moves
            );
            (Some(true), vec![line])
        }
        Ok(certificate::Outcome::Violated(defect, words)) => {
            (Some(false), violation_lines(network, &defect, &words))
        }
        Err(verify::Error::Unsupported(what)) => {
            let line = format!("certificate not verified: {what} are not covered by the check");
            (None, vec![line])
        }
        Err(error) => (None, vec![format!("certificate not verified: {error:?}")]),
    };
    Checked { holds, lines }
}

fn violation_lines(network: &Network, defect: &Defect, words: &[i32]) -> Vec<String> {
    let what = match defect {
        Defect::NoInitialState => "the initial state is not in it",
        Defect::TwiceTheSame => "two of its states have the same words",
        Defect::Malformed => "a state does not fit the model",
        Defect::DelayLeaves => "time leads out of it",
        Defect::MoveLeaves(_) => "a move leads out of it",
        Defect::Met => "what it should avoid holds in it",
    };
    let mut lines = vec![format!("certificate violated: {what}")];
    if *defect != Defect::Malformed {
        lines.push(format!("  {}", text::words_line(network, words)));
    }
    if let Defect::MoveLeaves(parts) = defect {
        let texts = parts.iter().map(|&part| text::part_text(network, part));
        lines.extend(texts.map(|text| format!("    {text}")));
    }
    lines
}

fn state_of(line: &Json) -> Option<States> {
    let words = line["words"].as_array()?.iter().map(integer);
    let zones = line["zones"].as_array()?.iter().map(|zone| {
        let constraints = zone.as_array()?.iter().map(|one| {
            let [left, right, bound, strict] = one.as_array()?.as_slice() else {
                return None;
            };
            Some(Constraint {
                left: usize::try_from(integer(left)?).ok()?,
                right: usize::try_from(integer(right)?).ok()?,
                bound: integer(bound)?,
                strict: match strict.as_u64()? {
                    0 => false,
                    1 => true,
                    _ => return None,
                },
            })
        });
        constraints.collect::<Option<Vec<_>>>()
    });
    Some(States {
        words: words.collect::<Option<Vec<_>>>()?,
        zones: zones.collect::<Option<Vec<_>>>()?,
    })
}
