//! Files of evidence are checked against the model, whatever they hold: a certificate, traces, a
//! strategy or a machine.

use serde_json::Value as Json;

use crate::game::strategy::Strategy;
use crate::ir::{Control, Network, QueryKind};
use crate::verify::Effort;

use super::checked::{Checked, Unreadable};
use super::strategy_check::{self, Played};
use super::{certificate, trace_file};
use crate::engine::format::json_reader::MACHINE_FORMAT;
use crate::engine::format::{json, learned_json, machine_json, shield_json, strategy_json};
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Rules;
use crate::engine::query::partial_observation;
use crate::engine::rejection::Rejection;

/// Which files are evidence.
const HINT: &str = "hint: expected is a file that `ntagen check` or `ntagen play` wrote for this model, of version 1 of a format: ntagen-certificate (--certificate FILE), ntagen-trace (--trace FILE.json, --log FILE), ntagen-strategy or ntagen-machine (--strategy FILE.json)";

impl LoadedModel {
    /// Checks a certificate, a trace or a strategy that was written for this model, independently
    /// of how it was found. `rules` are those for forced moves and priorities that a strategy was
    /// made for.
    pub fn verify_evidence(
        &mut self,
        path: &str,
        text: &str,
        rules: Rules,
    ) -> Result<Checked, Rejection> {
        self.expect_symbolic()?;
        let unreadable =
            |why: Unreadable| Rejection::without_place(format!("error: {path}: {why}\n{HINT}"));
        let header = text.lines().next().unwrap_or_default();
        let header: Json = serde_json::from_str(header)
            .or_else(|_| serde_json::from_str(text))
            .map_err(|error| unreadable(format!("it is no JSON: {error}")))?;
        if learned_json::is_one(&header) {
            let why = "it is a learned strategy, of which only random runs say what it is worth";
            return Err(unreadable(why.to_owned()));
        }
        if shield_json::is_one(&header) {
            let why = "it is a shield, which samples have shown and nothing proves";
            return Err(unreadable(why.to_owned()));
        }
        let kind = header["format"].as_str().unwrap_or_default().to_owned();
        if header["version"] != 1
            || ![
                certificate::FORMAT,
                json::TRACE_FORMAT,
                strategy_json::FORMAT,
                MACHINE_FORMAT,
            ]
            .contains(&kind.as_str())
        {
            let shown =
                |name: &str| -> String { header[name].to_string().chars().take(40).collect() };
            return Err(unreadable(format!(
                "its \"format\" is {} and its \"version\" {}",
                shown("format"),
                shown("version")
            )));
        }
        let query = header["query"].as_str().unwrap_or_default();
        let query_text = self.add_query(query);
        let (compiled, _) = self.compile(query_text.span)?;
        let network = self.network();
        let checked = match kind.as_str() {
            certificate::FORMAT => certificate::check_file(network, &compiled.kind, &header, text),
            json::TRACE_FORMAT => trace_file::check_file(network, &compiled.kind, &header),
            MACHINE_FORMAT => check_machine(network, &compiled.kind, &header, rules),
            _ => strategy_json::read_parsed(network, &header)
                .map_err(|mismatch| mismatch.to_string())
                .and_then(|(_, strategy)| {
                    check_strategy(network, &compiled.kind, &strategy, rules)
                }),
        };
        checked.map_err(unreadable)
    }
}

/// Checks in closed loop that the owner of a strategy wins.
fn check_strategy(
    network: &Network,
    query: &QueryKind,
    strategy: &Strategy,
    rules: Rules,
) -> Result<Checked, Unreadable> {
    let Some(control) = query.full_game() else {
        return Err("the query of a strategy over states begins with control:".to_owned());
    };
    let decisions = strategy_check::decisions(network, strategy);
    let played = Played::new(strategy, &decisions);
    let effort = &mut Effort::up_to(strategy_check::MOST_PARTS);
    let result = strategy_check::verify(network, control, played, rules, effort);
    Ok(Checked::of_strategy(network, &result).without("states that play by it does not come to"))
}

/// Checks a machine as read from its file.
fn check_machine(
    network: &Network,
    query: &QueryKind,
    file: &Json,
    rules: Rules,
) -> Result<Checked, Unreadable> {
    let QueryKind::Control(Control {
        objective,
        observations: Some(observations),
        ..
    }) = query
    else {
        return Err("the query of a machine has observations".to_owned());
    };
    let machine = machine_json::read(network, file, observations.len())
        .map_err(|mismatch| mismatch.to_string())?;
    let effort = &mut Effort::up_to(strategy_check::MOST_PARTS);
    let result =
        partial_observation::verify(network, objective, observations, &machine, rules, effort);
    Ok(Checked::of_strategy(network, &result)
        .without("what its states say of where play may be and what is seen there"))
}
