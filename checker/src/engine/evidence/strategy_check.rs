//! From a strategy of the solver to the independent check, and from its outcome to words.

use crate::game::strategy::closed_loop;
use crate::game::strategy::{Decision, Selection, Start, Strategy, Under, Way};
use crate::game::{Forced, Player, Priorities};
use crate::ir::{Control, Network, Objective, Predicate};
use crate::network::Part;
use crate::network::symbolic::predicate;
use crate::search::StopReason;
use crate::verify::replay::{self, End, Moment, Run};
use crate::verify::strategy::{
    self, Aim, Claim, Constraint, Coverage, Decisions, Defect, Forcing, Origin, Owner, Step,
    Violation,
};
use crate::verify::timed::Timed;
use crate::verify::{self, Effort, GivenUp, Semantics, State, regions};
use crate::zones::{Bound, Federation, minimal};

use crate::engine::answer::Verification;
use crate::engine::format::text;
use crate::engine::limits::ended_text;
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Rules;
use crate::engine::query::time_clock;
use crate::engine::rejection::Rejection;
use crate::syntax::ast::QueryText;

/// Zones, or regions, that a check looks at before it gives up.
pub const MOST_PARTS: u64 = 2_000_000;

/// A strategy as it is checked.
#[derive(Clone, Copy, Debug)]
pub struct Played<'s> {
    /// Where play begins.
    pub start: &'s Start,
    /// What it decides: see [`decisions`].
    pub decisions: &'s [Decisions],
    /// The player who uses it.
    pub owner: Player,
    /// Which of the decisions that apply counts.
    pub selection: Selection,
    /// The time limit that it is for, if it is for one.
    pub time_limit: Option<i32>,
    /// The strategy under which the game is played, if it is under one.
    pub under: Option<&'s Under>,
}

impl<'s> Played<'s> {
    /// A strategy with these decisions.
    pub fn new(strategy: &'s Strategy, decisions: &'s [Decisions]) -> Played<'s> {
        Played {
            start: &strategy.start,
            decisions,
            owner: strategy.owner,
            selection: strategy.selection,
            time_limit: strategy.time_limit,
            under: strategy.under.as_deref(),
        }
    }
}

/// Checks that the owner of a strategy wins, in closed loop. The network must hold the code of the
/// query.
pub fn verify(
    network: &Network,
    control: &Control,
    played: Played<'_>,
    rules: Rules,
    effort: &mut Effort<'_>,
) -> Verification {
    let violated_at_once = |defect| {
        let violation = Violation {
            defect,
            states: vec![Semantics::new(network, 1).initial()?],
            steps: Vec::new(),
            ticks_per_unit: 1,
        };
        let outcome = strategy::Outcome::Violated(Box::new(violation), Coverage::default());
        Ok(outcome)
    };
    if !is_for(network, control, &played)? {
        return violated_at_once(Defect::OtherGame);
    }
    let start = match played.start {
        Start::Initial => Origin::Initial,
        Start::Anywhere => Origin::Anywhere,
        Start::After(way) => match follow(network, way, rules.priorities)? {
            Some((_, mut states)) => {
                let state = states.pop().expect("a run has a state");
                Origin::State(Timed {
                    state,
                    ticks_per_unit: way.ticks_per_unit,
                })
            }
            None => return violated_at_once(Defect::ImpossibleWay),
        },
    };
    let game = time_clock::game(network, control, played.time_limit);
    let mut claim = claim(&game.objective, played.owner, played.selection, rules);
    let allowed = played
        .under
        .map(|under| decisions(network, &under.strategy));
    if let (Some(under), Some(allowed)) = (played.under, &allowed) {
        claim.under = Some((allowed, under.strategy.selection == Selection::Any));
    }
    strategy::verify(&game.network, played.decisions, &claim, &start, effort)
}

impl LoadedModel {
    /// Checks in closed loop that decisions for a control query win, wherever they come from.
    pub fn verify_strategy(
        &mut self,
        text: &QueryText,
        strategy: Played<'_>,
        rules: Rules,
        effort: &mut Effort<'_>,
    ) -> Result<Verification, Rejection> {
        let (query, _) = self.compile(text.span)?;
        Ok(match query.kind.full_game() {
            Some(control) => verify(self.network(), control, strategy, rules, effort),
            None => Err(verify::Error::Unsupported("queries other than control")),
        })
    }
}

/// The run that a way is, with its states in ticks: on entry of each, and after the last wait;
/// `None` if it is not possible.
pub(crate) fn follow(
    network: &Network,
    way: &Way,
    priorities: Priorities,
) -> Result<Option<(Run, Vec<State>)>, verify::Error> {
    let steps = way.moves.iter().map(|(wait, parts)| replay::Step {
        wait: *wait,
        parts: parts.clone(),
    });
    let run = Run {
        ticks_per_unit: way.ticks_per_unit,
        steps: steps.collect(),
        end: End::After(way.wait),
        from: Moment { state: 0, wait: 0 },
    };
    let equal;
    let network = if network.features.priorities && priorities == Priorities::Ignored {
        equal = without_priorities(network);
        &equal
    } else {
        network
    };
    Ok(
        match replay::replay(network, &run, &replay::Claim::Possible)? {
            replay::Outcome::Replayed(states, _) => Some((run, states)),
            replay::Outcome::Violated(_) => None,
        },
    )
}

/// The network with all channels and processes of the same priority.
fn without_priorities(network: &Network) -> Network {
    let mut equal = network.clone();
    equal.features.priorities = false;
    equal.features.default_priority = 0;
    for channel in &mut equal.channels {
        channel.priority = 0;
    }
    for process in &mut equal.processes {
        process.priority = 0;
    }
    equal
}

/// Whether a strategy with this start and time limit answers the query, if it wins.
pub(crate) fn is_for(
    network: &Network,
    control: &Control,
    played: &Played<'_>,
) -> Result<bool, verify::Error> {
    let Played {
        owner,
        start,
        time_limit,
        ..
    } = *played;
    let has_start = match (control.cooperative, owner) {
        (false, _) => *start == Start::Initial,
        (true, Player::Controller) => *start != Start::Anywhere,
        (true, Player::Environment) => *start == Start::Anywhere,
    };
    Ok(has_start && is_for_time(network, control, owner, time_limit)?)
}

/// Whether a strategy that wins with a time limit answers the query: the controller is to need
/// no more time than the query leaves it, the environment to hold out for as long.
fn is_for_time(
    network: &Network,
    control: &Control,
    owner: Player,
    time_limit: Option<i32>,
) -> Result<bool, verify::Error> {
    let Some(bounds) = control.time_optimal else {
        return Ok(time_limit.is_none());
    };
    let semantics = Semantics::new(network, 1);
    let initial = semantics.initial()?;
    let longest = bounds.limit;
    let longest = longest.map(|longest| semantics.value(longest, &initial));
    Ok(match (owner, time_limit, longest.transpose()?) {
        (Player::Controller, Some(limit), longest) => {
            longest.is_none_or(|longest| limit <= longest)
        }
        (Player::Environment, Some(limit), Some(longest)) => limit >= longest,
        (Player::Environment, None, None) => true,
        _ => false,
    })
}

/// What is claimed of a strategy for an objective.
pub(crate) fn claim(
    objective: &Objective,
    owner: Player,
    selection: Selection,
    rules: Rules,
) -> Claim<'_> {
    let aim = match objective {
        Objective::Reach(_) | Objective::Until(..) => Aim::Reach,
        Objective::Safe(_) | Objective::WeakUntil(..) => Aim::Keep,
        Objective::Buchi(..) => Aim::Recur,
    };
    let (constant, has_differences) = constants(objective.predicates());
    Claim {
        owner: match owner {
            Player::Controller => Owner::Controller,
            Player::Environment => Owner::Environment,
        },
        is_permissive: selection == Selection::Any,
        aim,
        goal: objective.goal(),
        keep: objective.keep(),
        forcing: match rules.forced {
            Forced::Tiga => Forcing::Component,
            Forced::Product => Forcing::Network,
            Forced::Neutral => Forcing::Always,
        },
        under: None,
        has_priorities: rules.priorities == Priorities::Kept,
        constant,
        has_differences,
    }
}

pub(crate) fn constants<'p>(predicates: impl Iterator<Item = &'p Predicate>) -> (i64, bool) {
    let atoms: Vec<_> = predicates.flat_map(predicate::atoms).collect();
    let constant = atoms.iter().map(regions::greatest_constant).max();
    let has_differences = atoms
        .iter()
        .any(|atom| atom.left.first.0 != 0 && atom.right.first.0 != 0);
    (constant.unwrap_or(0), has_differences)
}

/// The decisions of a strategy by words, in the order of their ranks. There are none where play is
/// said to have ended, so that a state in which it has not is found.
pub fn decisions(network: &Network, strategy: &Strategy) -> Vec<Decisions> {
    let states = closed_loop::joined(network, strategy).into_iter();
    let states = states.map(|joined| {
        let all = |decisions: Vec<&Decision>| -> Vec<strategy::Decision> {
            let counting = decisions.into_iter().filter(|_| !joined.is_goal);
            counting.map(decision).collect()
        };
        Decisions {
            words: joined.words.to_vec(),
            decisions: all(joined.decisions),
            legs: all(joined.legs),
        }
    });
    states.collect()
}

fn decision(decision: &Decision) -> strategy::Decision {
    strategy::Decision {
        rank: decision.rank,
        zones: zones(&decision.zones),
        action: decision.action.clone(),
    }
}

fn zones(federation: &Federation) -> Vec<Vec<Constraint>> {
    let dimension = federation.dimension();
    let zones = federation.zones();
    zones.map(|zone| constraints(zone, dimension)).collect()
}

/// The fewest constraints that make a zone.
pub(super) fn constraints(zone: &[Bound], dimension: usize) -> Vec<Constraint> {
    let mut constraints = Vec::new();
    minimal::for_each_minimal(zone, dimension, |one| {
        constraints.push(Constraint {
            left: one.left,
            right: one.right,
            bound: one.bound.value(),
            strict: one.bound.is_strict(),
        });
    });
    constraints
}

/// What a check covered, or what is wrong, for the user: one line, then those of the run. `stop` is
/// what ended it, if that is known.
pub fn describe(
    network: &Network,
    verification: &Verification,
    stop: Option<StopReason>,
) -> Vec<String> {
    match verification {
        Ok(strategy::Outcome::Verified(coverage)) => vec![format!(
            "strategy verified: {} {}, {} moves of its own, {} of the opponent, {} ends that are won",
            coverage.parts,
            coverage.kind,
            coverage.own_moves,
            coverage.opponent_moves,
            coverage.goals
        )],
        Ok(strategy::Outcome::GivenUp(GivenUp::TooLarge, coverage)) => vec![format!(
            "strategy not verified: more than {} {}; the state limit (--states) sets another bound",
            coverage.parts, coverage.kind
        )],
        Ok(strategy::Outcome::GivenUp(GivenUp::Ended, coverage)) => vec![format!(
            "strategy not verified: it was found, and checking it was {} after {} {}",
            ended_text(stop.unwrap_or(StopReason::Interrupted)),
            coverage.parts,
            coverage.kind
        )],
        Ok(strategy::Outcome::Violated(violation, _)) => violation_lines(network, violation),
        Err(verify::Error::Unsupported(what)) => {
            vec![format!(
                "strategy not verified: {what} are not covered by the check"
            )]
        }
        Err(error) => vec![format!("strategy not verified: {error:?}")],
    }
}

fn violation_lines(network: &Network, violation: &Violation) -> Vec<String> {
    let defect = match violation.defect {
        Defect::NoDecision => "it has no decision here",
        Defect::ImpossibleAction => "its action is not possible here",
        Defect::Broken => "what must be kept does not hold here",
        Defect::GoalReached => "the goal of the controller holds here",
        Defect::Stuck => "it waits where time cannot pass and it may not",
        Defect::OtherGame => "it is for another start or time limit than the query",
        Defect::ImpossibleWay => "the way to where it begins is not possible",
        Defect::Recurring => "the goal of the controller comes again and again",
        Defect::Lost => "its owner does not win from here; the run that shows it is too long",
        Defect::Endless => "the run goes on for ever without what the strategy is for",
    };
    let mut lines = vec![format!("strategy violated: {defect}")];
    let mut clocks = violation.states.iter().map(|state| state.clocks.len());
    let is_timed = clocks.any(|clocks| clocks > network.clocks.len().max(1));
    let network = &*time_clock::with_limit(network, is_timed.then_some(0));
    for (index, state) in violation.states.iter().enumerate() {
        lines.push(format!(
            "  {}",
            text::state_line(network, state, violation.ticks_per_unit)
        ));
        match violation.steps.get(index) {
            Some(Step::Time) => lines.push("    time passes".to_owned()),
            Some(Step::Move(one)) => {
                let edges: Vec<String> = one
                    .parts
                    .iter()
                    .map(|part| part_text(network, *part))
                    .collect();
                lines.push(format!("    {}", edges.join(", ")));
            }
            None => {}
        }
    }
    lines
}

fn part_text(network: &Network, part: Part) -> String {
    let process = &network.processes[part.process as usize];
    let edge = &process.edges[part.edge as usize];
    let target = edge.branches[part.branch as usize].target;
    format!(
        "{}.{} → {}",
        process.name,
        process.locations[edge.source.0 as usize].name,
        process.locations[target.0 as usize].name
    )
}
