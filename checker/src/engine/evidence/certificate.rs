//! Certificates as files, and the check of files with evidence.
//!
//! A certificate has one JSON value a line. The first has `format` "ntagen-certificate", `version`
//! 1, the `query`, the names of the `processes`, of the scalar `variables` and of the `clocks`, and
//! the number of `states`. Each further line is a state: its `words` (the index of each process's
//! location, then the variables, doubles as two words of bits) and its `zones`. A zone is a list of
//! constraints that all hold, each `[left, right, bound, strict]`: clock left minus clock right is
//! at most bound, or less if strict is 1; clocks count from 1, and 0 stands for the number 0. What
//! it claims is in [`crate::verify::certificate`].

use serde_json::{Value as Json, json};

use crate::cancellation::{self, Cut};
use crate::game::strategy::attractor::Strategy;
use crate::game::{Forced, Priorities};
use crate::ir::{Network, Objective, Predicate, QueryKind};
use crate::network::{Failure, Symbolic};
use crate::search::Outcome;
use crate::search::StopReason;
use crate::search::limits::{Counters, Watch};
use crate::search::optimum::best_first::{BestFirst, Measure};
use crate::verify::certificate::{self, Defect, States};
use crate::verify::replay::{self, Claim, End, Moment, Run, Shown, Step};
use crate::verify::strategy::{Constraint, Outcome as StrategyOutcome};
use crate::verify::{self, Effort, Part};

use super::shown_states::{self, Difference};
use super::strategy_check::{self, Asked, Played, Verification};
use super::timed_run::{Missing, Proof};
use crate::engine::format::text;
use crate::engine::format::{json, machine_json, strategy_json};
use crate::engine::limits::cut_as_interrupted;
use crate::engine::query::partial_observation;
use crate::engine::{LoadedModel, Rejection};

/// What a file with a certificate says that it is.
pub const FORMAT: &str = "ntagen-certificate";

/// States that contain all reachable ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Certificate {
    /// The states, by words.
    pub states: Vec<States>,
}

/// What becomes of a search in zones whose bounds are too great.
pub(in crate::engine) const CLOCKS_GREW: &str =
    "differences of clocks grow beyond what zones can hold: no abstraction keeps them small here";

/// Why a search was stopped.
pub(in crate::engine) fn stop_text(reason: StopReason) -> &'static str {
    match reason {
        StopReason::States => "the search for it was stopped by the limit of states",
        StopReason::Memory => "the search for it was stopped by the limit of memory",
        StopReason::Time => "the search for it was stopped by the limit of time",
        StopReason::Interrupted => "the search for it was interrupted",
        StopReason::Clocks => CLOCKS_GREW,
    }
}

/// Bytes of a certificate between two looks at the memory that it takes.
const BYTES_BETWEEN_LOOKS: usize = 1 << 20;

/// The network with `meta` variables as ordinary ones: whether states that differ in them alone are
/// the same decides which of them a search meets, but not what it claims of those that it meets.
pub(in crate::engine) fn with_all_words(network: &Network) -> Network {
    let mut whole = network.clone();
    whole.layout.identity_words = whole.layout.words;
    whole
}

/// Searches again without short cuts for a state that satisfies the predicate, of which there is
/// none; what was reached. `symbolic` is about a network [`with_all_words`].
pub(in crate::engine) fn reached(
    symbolic: &mut Symbolic<'_>,
    avoided: &Predicate,
    before: Counters,
    watch: &mut dyn Watch,
) -> Result<Certificate, String> {
    let dimension = symbolic.dimension();
    let variables = &symbolic.stepper.network().layout.variables;
    let has_meta = variables.iter().any(|variable| variable.meta);
    let mut search = BestFirst::new(symbolic, &avoided, Measure::Moves, before);
    match cut_as_interrupted(|| search.run(watch)) {
        Ok(Outcome::Exhausted) => {}
        Ok(Outcome::Found(_)) if has_meta => {
            let why = "a search for it, in which states that differ in meta variables alone are not the same, finds a state";
            return Err(why.to_owned());
        }
        Ok(Outcome::Found(_)) => return Err("a search without short cuts finds a state".to_owned()),
        Ok(Outcome::Stopped(reason)) => return Err(stop_text(reason).to_owned()),
        Err(Failure::Interrupted) => {
            let reason = watch.look(&search.counters());
            return Err(stop_text(reason.unwrap_or(StopReason::Interrupted)).to_owned());
        }
        Err(_) => return Err("the model fails".to_owned()),
    }
    let mut bytes = 0;
    let states = search.into_reached().into_iter().map(|(words, zones)| {
        let zones = zones.iter();
        let zones = zones.map(|zone| strategy_check::constraints(zone.bounds(), dimension));
        let zones: Vec<_> = zones.collect();
        // The zones that these are made of count still.
        let constraints = zones.iter().map(|zone| size_of_val(&**zone));
        let before = bytes;
        bytes += size_of::<States>() + size_of_val(&*words) + constraints.sum::<usize>();
        if bytes / BYTES_BETWEEN_LOOKS > before / BYTES_BETWEEN_LOOKS {
            cancellation::ask_for(bytes);
        }
        States { words, zones }
    });
    let certificate = cancellation::unless_cut(|| Certificate {
        states: states.collect(),
    });
    certificate.map_err(|Cut| "writing it was stopped by a limit".to_owned())
}

impl Certificate {
    /// How many zones it has.
    pub fn zone_count(&self) -> usize {
        self.states.iter().map(|state| state.zones.len()).sum()
    }

    /// The certificate as a file.
    pub fn text(&self, network: &Network, query: &str) -> String {
        let header = json!({
            "format": FORMAT,
            "version": 1,
            "query": query,
            "processes": processes(network),
            "variables": variables(network),
            "clocks": clocks(network),
            "states": self.states.len(),
        });
        let mut text = header.to_string();
        for state in &self.states {
            let zones = state.zones.iter().map(|zone| {
                let constraints = zone.iter();
                let constraints = constraints
                    .map(|one| json!([one.left, one.right, one.bound, u8::from(one.strict)]));
                Json::Array(constraints.collect())
            });
            let line = json!({ "words": state.words, "zones": zones.collect::<Vec<_>>() });
            text.push('\n');
            text.push_str(&line.to_string());
        }
        text.push('\n');
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

/// What the check of a file came to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checked {
    /// Whether what the file claims is right; `None` if the check does not cover it.
    pub holds: Option<bool>,
    /// What was looked at, or what is wrong, line by line.
    pub lines: Vec<String>,
}

impl Checked {
    /// What the check of a strategy came to.
    pub(in crate::engine) fn of_strategy(network: &Network, result: &Verification) -> Checked {
        Checked {
            holds: match result {
                Ok(StrategyOutcome::Verified(_)) => Some(true),
                Ok(StrategyOutcome::Violated(..)) => Some(false),
                Ok(StrategyOutcome::GivenUp(..)) | Err(_) => None,
            },
            lines: strategy_check::describe(network, result),
        }
    }

    /// The same; where the file holds, with a line that says what of it was not checked.
    #[must_use]
    pub(in crate::engine) fn without(mut self, unchecked: &str) -> Checked {
        if self.holds == Some(true) {
            self.lines.push(format!("  not checked: {unchecked}"));
        }
        self
    }
}

/// Why a file is not read.
pub(in crate::engine) type Unreadable = String;

/// What a file of evidence is.
const HINT: &str = "hint: it must come from `ntagen check` for this model: with --certificate FILE, --trace FILE.json or --strategy FILE.json; or from `ntagen play` with --log FILE";

impl LoadedModel {
    /// Checks a certificate, a trace or a strategy that was written for this model, independently
    /// of how it was found. `rules` are those for forced moves and priorities that a strategy was
    /// made for.
    pub fn verify_evidence(
        &mut self,
        path: &str,
        text: &str,
        rules: (Forced, Priorities),
    ) -> Result<Checked, Rejection> {
        let unreadable = |why: Unreadable| Rejection {
            diagnostics: Vec::new(),
            rendered: vec![format!("error: {path}: {why}\n{HINT}")],
        };
        let header = text.lines().next().unwrap_or_default();
        let header: Json = serde_json::from_str(header)
            .or_else(|_| serde_json::from_str(text))
            .map_err(|error| unreadable(format!("it is no JSON: {error}")))?;
        let kind = header["format"].as_str().unwrap_or_default().to_owned();
        if header["version"] != 1
            || ![
                FORMAT,
                json::TRACE_FORMAT,
                strategy_json::FORMAT,
                machine_json::FORMAT,
            ]
            .contains(&kind.as_str())
        {
            return Err(unreadable(
                "it is neither a certificate nor a trace nor a strategy nor a machine of version 1"
                    .to_owned(),
            ));
        }
        let query = header["query"].as_str().unwrap_or_default();
        let query_text = self.add_query(query);
        let (compiled, _) = self.compile(query_text.span)?;
        let network = self.network();
        let checked = match kind.as_str() {
            FORMAT => check_certificate(network, &compiled.kind, &header, text),
            json::TRACE_FORMAT => check_traces(network, &compiled.kind, &header),
            machine_json::FORMAT => {
                partial_observation::check_file(network, &compiled.kind, &header, rules)
            }
            _ => strategy_json::read(network, text.as_bytes())
                .map_err(|mismatch| format!("at {}: {}", mismatch.place, mismatch.message))
                .and_then(|(_, strategy)| {
                    check_strategy(network, &compiled.kind, &strategy, rules)
                }),
        };
        checked.map_err(unreadable)
    }
}

fn negation(predicate: &Predicate) -> Predicate {
    Predicate::Not(Box::new(predicate.clone()))
}

/// Checks in closed loop that the owner of a strategy wins.
fn check_strategy(
    network: &Network,
    query: &QueryKind,
    strategy: &Strategy,
    rules: (Forced, Priorities),
) -> Result<Checked, Unreadable> {
    let Some(asked) = Asked::of(query) else {
        return Err("the query of a strategy over states begins with control:".to_owned());
    };
    let decisions = strategy_check::decisions(network, strategy);
    let played = Played::new(strategy, &decisions);
    let effort = &mut Effort::up_to(strategy_check::MOST_REGIONS);
    let result = strategy_check::verify(network, asked, played, rules, effort);
    Ok(Checked::of_strategy(network, &result).without("states that play by it does not come to"))
}

/// Checks a certificate as read from its file.
fn check_certificate(
    network: &Network,
    query: &QueryKind,
    header: &Json,
    text: &str,
) -> Result<Checked, Unreadable> {
    let avoided = match query {
        QueryKind::Reachable(goal) => goal.clone(),
        QueryKind::Invariantly(keep) => negation(keep),
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
    shown_states::only(header, &known, "line 1")?;
    let mut states = Vec::new();
    for (index, line) in text.lines().enumerate().skip(1) {
        let at_line = |why: &str| format!("line {}: {why}", index + 1);
        let line: Json = serde_json::from_str(line).map_err(|error| at_line(&error.to_string()))?;
        shown_states::only(&line, &["words", "zones"], &format!("line {}", index + 1))?;
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
        let parts = parts.iter();
        let texts = parts.map(|&part| text::part_text(network, part.into()));
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

fn integer(value: &Json) -> Option<i32> {
    i32::try_from(value.as_i64()?).ok()
}

/// Replays the runs of a file with traces.
fn check_traces(
    network: &Network,
    query: &QueryKind,
    header: &Json,
) -> Result<Checked, Unreadable> {
    const HEADER: [&str; 3] = ["format", "version", "query"];
    const TRACE: [&str; 11] = [
        "title",
        "kind",
        "value",
        "states",
        "transitions",
        "failing",
        "ending",
        "run",
        "winner",
        "priorities",
        "time_limit",
    ];
    let traces = if let Some(traces) = header["traces"].as_array() {
        shown_states::only(header, &[&HEADER[..], &["traces"]].concat(), "the file")?;
        traces.iter().collect()
    } else {
        vec![header]
    };
    let mut checked = Checked {
        holds: Some(true),
        lines: Vec::new(),
    };
    for trace in traces {
        shown_states::only(trace, &[&HEADER[..], &TRACE[..]].concat(), "a trace")?;
        shown_states::only(
            &trace["value"],
            &["item", "value", "greatest", "reached"],
            "value",
        )?;
        if trace["run"].is_null() {
            checked.holds = checked.holds.filter(|holds| !holds);
            checked
                .lines
                .push("trace not replayed: it has no exact times".to_owned());
            continue;
        }
        let run = run_of(network, &trace["run"])
            .ok_or("the run in it does not fit the model".to_owned())?;
        let (proof, difference) = replay_of(network, query, trace, run)?;
        let holds = match &proof {
            Proof::Replayed(..) => Some(difference.is_ok()),
            Proof::Violated(..) | Proof::Impossible => Some(false),
            Proof::Missing(_) => None,
        };
        checked.holds = match (checked.holds, holds) {
            (Some(false), _) | (_, Some(false)) => Some(false),
            (Some(true), Some(true)) => Some(true),
            _ => None,
        };
        checked.lines.extend(text::proof_lines(&proof));
        match difference {
            Ok(unchecked) if !unchecked.is_empty() => {
                let unchecked = unchecked.join("; ");
                checked.lines.push(format!("  not checked: {unchecked}"));
            }
            Ok(_) => {}
            Err(text) => checked.lines.push(format!("trace violated: {text}")),
        }
    }
    Ok(checked)
}

/// What of a trace is not checked, or what it shows that is not so.
type Agreement = Result<Vec<&'static str>, String>;

/// Replays a run that is to show what its file says of the query, and compares it with all that is
/// shown beside it.
fn replay_of(
    network: &Network,
    query: &QueryKind,
    trace: &Json,
    run: Run,
) -> Result<(Proof, Agreement), Unreadable> {
    let always = Predicate::Constant(true);
    let (first, second, game);
    let mut network = network;
    let claim = match query {
        _ if trace["kind"] == "failure" => Claim::Possible,
        QueryKind::Reachable(goal) => Claim::Reaches(goal),
        QueryKind::Invariantly(keep) => {
            first = negation(keep);
            Claim::Reaches(&first)
        }
        QueryKind::PotentiallyAlways(keep) => Claim::Stays(&always, keep),
        QueryKind::Eventually(goal) => {
            first = negation(goal);
            Claim::Stays(&always, &first)
        }
        QueryKind::LeadsTo(cause, effect) => {
            second = negation(effect);
            first = Predicate::And(vec![cause.clone(), second.clone()]);
            Claim::Stays(&first, &second)
        }
        QueryKind::Extremum {
            predicate, items, ..
        } => {
            let value = &trace["value"];
            let item = value["item"]
                .as_u64()
                .and_then(|item| items.get(item as usize));
            let shown = value["value"].as_i64().map(|number| Shown {
                value: number,
                is_greatest: value["greatest"] == true,
                is_reached: value["reached"] == true,
            });
            let (Some((measure, _)), Some(shown)) = (item, shown) else {
                return Err("it does not say which value a trace shows".to_owned());
            };
            Claim::Takes(predicate, measure, shown)
        }
        QueryKind::Control { .. }
            if trace["priorities"] == "ignore" && network.features.priorities =>
        {
            let what = verify::Error::Unsupported("plays that ignore the priorities of the model");
            return Ok((Proof::Missing(Missing::NotCovered(what)), Ok(Vec::new())));
        }
        QueryKind::Control { .. } if trace["kind"] == "play" => {
            let limit = trace["time_limit"].as_i64();
            let limit = limit.map(|limit| i32::try_from(limit).unwrap_or(i32::MAX));
            let asked = Asked::of(query).expect("it is a control query");
            game = asked.game(network, limit);
            network = &game.network;
            match (trace["winner"].as_str(), &*game.objective) {
                (None, _) => Claim::Possible,
                (
                    Some("controller"),
                    Objective::Reach(goal)
                    | Objective::Until(_, goal)
                    | Objective::WeakUntil(_, goal),
                ) => Claim::Reaches(goal),
                (
                    Some("environment"),
                    Objective::Safe(keep)
                    | Objective::Until(keep, _)
                    | Objective::WeakUntil(keep, _)
                    | Objective::Buchi(keep, _),
                ) => {
                    first = negation(keep);
                    Claim::Reaches(&first)
                }
                _ => return Err("nobody can have won so".to_owned()),
            }
        }
        _ => return Err("a control query has no trace but that of a play".to_owned()),
    };
    let proof = match replay::replay(network, &run, &claim) {
        Ok(replay::Outcome::Replayed(states, coverage)) => Proof::Replayed(run, states, coverage),
        Ok(replay::Outcome::Violated(violation)) => Proof::Violated(run, violation),
        Err(error) => Proof::Missing(Missing::NotCovered(error)),
    };
    let agreement = match &proof {
        Proof::Replayed(run, states, _) => {
            match shown_states::compare_trace(network, trace, run, states) {
                Ok(unchecked) => Ok(unchecked),
                Err(Difference::False(text)) => Err(text),
                Err(Difference::Unknown(text)) => return Err(text),
            }
        }
        _ => Ok(Vec::new()),
    };
    Ok((proof, agreement))
}

/// A run as it stands in a file; `None` if it is none of this network.
fn run_of(network: &Network, run: &Json) -> Option<Run> {
    let steps = run["steps"].as_array()?.iter().map(|step| {
        let parts = step["edges"].as_array()?.iter();
        Some(Step {
            wait: step["wait"].as_i64()?,
            parts: parts
                .map(|part| part_of(network, part))
                .collect::<Option<Vec<_>>>()?,
        })
    });
    let (end, from) = (&run["end"], &run["from"]);
    let index = |value: &Json| usize::try_from(value.as_u64()?).ok();
    Some(Run {
        ticks_per_unit: run["ticks_per_unit"].as_i64()?,
        steps: steps.collect::<Option<Vec<_>>>()?,
        end: match end["kind"].as_str()? {
            "after" => End::After(end["wait"].as_i64()?),
            "loop" => End::Loop(index(&end["state"])?),
            "waits" => End::Waits(end["wait"].as_i64()?),
            "stuck" => End::Stuck(end["wait"].as_i64()?),
            _ => return None,
        },
        from: Moment {
            state: index(&from["state"])?,
            wait: from["wait"].as_i64()?,
        },
    })
}

fn part_of(network: &Network, part: &Json) -> Option<Part> {
    let name = part["process"].as_str()?;
    let process = network.processes.iter().position(|one| one.name == name)?;
    let number = |key: &str| u32::try_from(part[key].as_u64()?).ok();
    let (edge, branch) = (number("edge")?, number("branch")?);
    let definition = network.processes[process].edges.get(edge as usize)?;
    definition.branches.get(branch as usize)?;
    let mut select = 0;
    for binding in &definition.select {
        let value = integer(&part["select"][&binding.name])?;
        if !(binding.low..=binding.high).contains(&value) {
            return None;
        }
        let size = i64::from(binding.high) - i64::from(binding.low) + 1;
        select = select * size + i64::from(value) - i64::from(binding.low);
    }
    Some(Part {
        process: process as u32,
        edge,
        branch,
        select: u32::try_from(select).ok()?,
    })
}
