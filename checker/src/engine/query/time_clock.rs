//! The clock that measures time: for traces, and for games that must be won within a time.
//!
//! Nothing sets it, and no model can name it. It is the last clock of a network that has it. A game
//! that must be won within a limit is an ordinary game of such a network, whose predicates compare
//! the clock with the limit.

use std::borrow::Cow;

use crate::game::strategy::Strategy;
use crate::ir::{
    Block, Clock, ClockChoice, ClockId, ClockPredicate, Control, Function, FunctionId, Instruction,
    IntegerOperator, Network, Objective, Predicate, Register, RegisterType, SiteId, Terminator,
};

/// The name of the clock; no name of a model has such a character.
pub const TIME: &str = "#time";

/// The network with the clock, and its index.
pub(super) fn with_time(network: &Network) -> (Network, usize) {
    let mut timed = network.clone();
    while timed.clocks.len() < network.clocks.len().max(1) + 1 {
        timed.clocks.push(Clock {
            name: TIME.to_owned(),
            owner: None,
            hybrid: false,
            coordinates: Vec::new(),
        });
    }
    timed.initial_clocks.resize(timed.clocks.len(), 0);
    let clock = timed.clocks.len() - 1;
    (timed, clock)
}

/// The network of a strategy: with the clock if the strategy uses it.
pub fn network_of<'n>(network: &'n Network, strategy: &Strategy) -> Cow<'n, Network> {
    with_limit(network, strategy.time_limit)
}

/// The network, with the clock if there is a limit.
pub(crate) fn with_limit(network: &Network, limit: Option<i32>) -> Cow<'_, Network> {
    match limit {
        None => Cow::Borrowed(network),
        Some(_) => Cow::Owned(with_time(network).0),
    }
}

/// A game with its network.
pub(crate) struct LimitedGame<'n> {
    pub(crate) network: Cow<'n, Network>,
    pub(crate) objective: Cow<'n, Objective>,
}

/// The game of a query, within a limit if there is one. What must be left of it wherever the goal
/// does not hold yet counts as 0 if it is negative.
pub(crate) fn game<'n>(
    network: &'n Network,
    control: &'n Control,
    limit: Option<i32>,
) -> LimitedGame<'n> {
    let objective = &control.objective;
    let rest = control.time_optimal.and_then(|bounds| bounds.rest);
    let Some(limit) = limit else {
        return LimitedGame {
            network: Cow::Borrowed(network),
            objective: Cow::Borrowed(objective),
        };
    };
    let (mut network, clock) = with_time(network);
    let goal = objective.goal();
    let goal = goal.expect("games for other objectives within a time were refused");
    let mut until = |rest: Option<FunctionId>| {
        network.functions.push(limit_less(limit, rest));
        Predicate::Clock(ClockPredicate {
            left: ClockChoice::Fixed(ClockId(clock as u32)),
            right: ClockChoice::Fixed(ClockId(0)),
            strict: false,
            bound: FunctionId(network.functions.len() as u32 - 1),
            // No clock is below 0, so that lesser bounds are all the same.
            range: (if rest.is_some() { 0 } else { limit }, limit),
        })
    };
    let goal = Predicate::And(vec![goal.clone(), until(None)]);
    let kept = objective.keep().into_iter().cloned().chain([until(rest)]);
    let objective = Objective::Until(Predicate::And(kept.collect()), goal);
    LimitedGame {
        network: Cow::Owned(network),
        objective: Cow::Owned(objective),
    }
}

/// A function that returns the limit, less the positive part of what another one returns.
fn limit_less(limit: i32, rest: Option<FunctionId>) -> Function {
    let [value, left, none, positive] = [0, 1, 2, 3].map(Register);
    let mut instructions = vec![Instruction::Integer {
        target: value,
        value: limit,
    }];
    if let Some(rest) = rest {
        // Neither operation overflows: the limit is at least -1.
        let operation = |operator, target, left, right| Instruction::Arithmetic {
            operator,
            target,
            left,
            right,
            site: SiteId(0),
        };
        instructions.extend([
            Instruction::Call {
                target: Some(left),
                function: rest,
                arguments: Vec::new(),
            },
            Instruction::Integer {
                target: none,
                value: 0,
            },
            operation(IntegerOperator::Maximum, positive, left, none),
            operation(IntegerOperator::Subtract, value, value, positive),
        ]);
    }
    Function {
        name: "time limit".to_owned(),
        registers: vec![RegisterType::Integer; 4],
        parameters: 0,
        frame_words: 0,
        result: Some(RegisterType::Integer),
        blocks: vec![Block {
            instructions,
            terminator: Terminator::Return(Some(value)),
        }],
    }
}
