//! Strategies as text, in the form that TIGA's command-line checker prints: for each discrete
//! state, where to wait and where to act.

use std::fmt::Write as _;

use crate::game::Player;
use crate::game::strategy::{Selection, Start, Strategy, Way};
use crate::ir::{Network, Part};
use crate::zones::{Federation, Zone};

use super::decision_table::{self, Rule};
use super::text;
use crate::engine::query::time_clock;

/// A strategy as text: the initial state, whose strategy it is, and a paragraph for each discrete
/// state about which it says something. Each line stands on its own; of a strategy that leaves a
/// choice, several may apply.
pub fn write(network: &Network, strategy: &Strategy) -> String {
    let network = &*time_clock::network_of(network, strategy);
    let mut text = format!(
        "Initial state:\n{}\n{}\n\n",
        text::words_line(network, &network.initial),
        initial_clocks(network)
    );
    if let Some(limit) = strategy.time_limit {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "Time limit: {} <= {limit}\n", time_clock::TIME);
    }
    match &strategy.start {
        Start::Initial => {}
        Start::Anywhere => text.push_str("Start: any state that can be reached\n\n"),
        Start::After(way) => {
            text.push_str("Start: after\n");
            text.push_str(&way_lines(network, way));
            text.push('\n');
        }
    }
    text.push_str(match (strategy.owner, strategy.selection) {
        (Player::Environment, _) => "Strategy of the environment:\n",
        (Player::Controller, Selection::First) => "Strategy to win:\n",
        (Player::Controller, Selection::Any) => "Strategy to avoid losing:\n",
    });
    for entry in decision_table::entries(network, strategy) {
        let state = text::words_line(network, entry.words);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "\nState: {state}");
        if entry.is_goal {
            text.push_str("Play has ended here.\n");
        }
        for rule in &entry.rules {
            text.push_str(&line(network, strategy.owner, rule));
        }
        for leg in &entry.legs {
            text.push_str(&leg_line(network, leg));
        }
    }
    text
}

/// The steps of a way, as lines.
pub(super) fn way_lines(network: &Network, way: &Way) -> String {
    let mut text = String::new();
    let wait = |ticks: i64| text::fraction(ticks, way.ticks_per_unit);
    for (ticks, parts) in &way.moves {
        let parts = edges(network, Player::Environment, parts);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "wait {}, take transition {parts}", wait(*ticks));
    }
    let _ = writeln!(text, "wait {}", wait(way.wait));
    text
}

/// What a rule says, as a line.
fn line(network: &Network, owner: Player, rule: &Rule) -> String {
    let zones = zones(network, &rule.zones);
    let Some(parts) = &rule.action else {
        return format!("While you are in\t{zones}, wait.\n");
    };
    let parts = edges(network, owner, parts);
    format!("When you are in {zones}, take transition {parts}\n")
}

/// The edges of a move of this player: the controller names its entry, and picks no leg.
pub(super) fn edges(network: &Network, owner: Player, parts: &[Part]) -> String {
    let parts = parts.iter().map(|&one| match owner {
        Player::Controller => text::entry_text(network, one),
        Player::Environment => text::part_text(network, one),
    });
    parts.collect::<Vec<_>>().join(" ")
}

/// Which leg the environment picks, as a line.
fn leg_line(network: &Network, leg: &Rule) -> String {
    let picked = leg.action.as_deref().unwrap_or_default();
    format!(
        "When the controller moves in {}, pick leg {}\n",
        zones(network, &leg.zones),
        edges(network, Player::Environment, picked)
    )
}

/// The zones, joined by "or"; one without constraints is "true".
fn zones(network: &Network, federation: &Federation) -> String {
    let zones = federation.zones().map(|bounds| {
        let zone = Zone::from_bounds(federation.dimension(), bounds);
        conjunction(&text::minimal_constraints(network, &zone))
    });
    zones.collect::<Vec<_>>().join(" || ")
}

fn conjunction(constraints: &[String]) -> String {
    if constraints.is_empty() {
        return "true".to_owned();
    }
    let constraints: Vec<String> = constraints.iter().map(|one| one.replace(' ', "")).collect();
    format!("({})", constraints.join(" && "))
}

/// The initial clock values.
fn initial_clocks(network: &Network) -> String {
    let clocks = network.clocks.iter().zip(&network.initial_clocks).skip(1);
    let clocks = clocks.map(|(clock, value)| format!("{}=={value}", clock.name));
    conjunction(&clocks.collect::<Vec<_>>())
}
