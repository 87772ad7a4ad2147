//! The check of files with traces: it replays their runs, and compares everything else that they
//! show with the replay.

use serde_json::Value as Json;

use crate::ir::{Network, Objective, Predicate, QueryKind};
use crate::network::discrete::selects::select_combination;
use crate::verify::replay::{Claim, End, Moment, Run, Shown, Step};
use crate::verify::{self, Part};

use super::checked::{Checked, Unreadable};
use super::shown_states;
use super::witness::{Missing, Proof};
use crate::engine::format::json_reader::{Difference, integer, only};
use crate::engine::format::text;
use crate::engine::query::time_clock;

/// Replays the runs of a file with traces.
pub(super) fn check_file(
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
        only(header, &[&HEADER[..], &["traces"]].concat(), "the file")?;
        traces.iter().collect()
    } else {
        vec![header]
    };
    let mut checked = Checked {
        holds: Some(true),
        lines: Vec::new(),
    };
    for trace in traces {
        only(trace, &[&HEADER[..], &TRACE[..]].concat(), "a trace")?;
        only(
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
        let holds = proof.holds().map(|holds| holds && difference.is_ok());
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

/// Replays a run that must show what its file says about the query, and compares everything else
/// that the file shows about it.
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
            first = keep.negated();
            Claim::Reaches(&first)
        }
        QueryKind::PotentiallyAlways(keep) => Claim::Stays(&always, keep),
        QueryKind::Eventually(goal) => {
            first = goal.negated();
            Claim::Stays(&always, &first)
        }
        QueryKind::LeadsTo(cause, effect) => {
            second = effect.negated();
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
        QueryKind::Control(_) if trace["priorities"] == "ignore" && network.features.priorities => {
            let what = verify::Error::Unsupported("plays that ignore the priorities of the model");
            return Ok((Proof::Missing(Missing::NotCovered(what)), Ok(Vec::new())));
        }
        QueryKind::Control(control) if trace["kind"] == "play" => {
            let limit = trace["time_limit"].as_i64();
            let limit = limit.map(|limit| i32::try_from(limit).unwrap_or(i32::MAX));
            game = time_clock::game(network, control, limit);
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
                    first = keep.negated();
                    Claim::Reaches(&first)
                }
                _ => return Err("nobody can have won so".to_owned()),
            }
        }
        _ => return Err("a control query has no trace but that of a play".to_owned()),
    };
    let proof = Proof::of(network, run, &claim);
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

/// An edge of a run. What else the file shows of it is compared after the replay, where something
/// wrong is a verdict; in a strategy it is a reason to refuse the file, which
/// [`crate::engine::format::strategy_json::NetworkReader::part`] does.
fn part_of(network: &Network, part: &Json) -> Option<Part> {
    let name = part["process"].as_str()?;
    let process = network.processes.iter().position(|one| one.name == name)?;
    let number = |key: &str| u32::try_from(part[key].as_u64()?).ok();
    let (edge, branch) = (number("edge")?, number("branch")?);
    let definition = network.processes[process].edges.get(edge as usize)?;
    definition.branches.get(branch as usize)?;
    Some(Part {
        process: process as u32,
        edge,
        branch,
        select: select_combination(definition, |name| integer(&part["select"][name]))?,
    })
}
