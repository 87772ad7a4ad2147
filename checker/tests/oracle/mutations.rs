//! Strategies that were made wrong on purpose must be caught.
//!
//! The game is the running example of the TIGA manual (section 3), for which every decision matters.

use checker::engine::{LoadedModel, verification};
use checker::syntax::ast::QueryText;
use checker::verify::strategy::{Decision, Decisions, Defect, Outcome};

use crate::compare;

const QUERY: &str = "control: A<> P.goal";

const GAME: &str = "
process P() {
  clock x;
  state L0 { x <= 2 }, L1, L2, L3, L4, goal;
  init L0;
  trans L0 -> L1 { guard x <= 1; },
        L0 -u-> L2 { guard x < 1; assign x = 0; },
        L0 -u-> L4 { guard x > 1; },
        L1 -> goal { guard x >= 2; },
        L1 -u-> L2 { guard x < 1; },
        L2 -> L3 { },
        L3 -> L1 { guard x <= 1; };
}
system P;
";

fn solved() -> (LoadedModel, QueryText, Vec<Decisions>) {
    let mut model = compare::load(GAME);
    let query = model.add_query(QUERY);
    let options = checker::engine::Options {
        strategy: true,
        ..compare::options()
    };
    let answer = model.check(&query, &options).expect("the query is right");
    let strategy = answer.evidence.strategy.expect("the game is won");
    let decisions = verification::decisions(model.network(), &strategy);
    (model, query, decisions)
}

/// The defect of the strategy after `mutate`, which is given the decisions of a location.
fn check_defect(location: i32, mutate: impl Fn(&mut Vec<Decision>)) -> Option<Defect> {
    let (mut model, query, mut strategy) = solved();
    let state = strategy.iter_mut().find(|state| state.words[0] == location);
    mutate(&mut state.expect("play gets there").decisions);
    let verification = model
        .verify_strategy(&query, &strategy, checker::game::Forced::Tiga, 10_000)
        .expect("the query is right");
    match verification.expect("the model can be checked") {
        Outcome::Verified(_) => None,
        Outcome::Violated(violation, _) => {
            assert_eq!(violation.states.len(), violation.steps.len() + 1);
            Some(violation.defect)
        }
        Outcome::TooLarge(_) => panic!("the game is small"),
    }
}

fn acts(decisions: &mut [Decision]) -> &mut Decision {
    let mut decisions = decisions.iter_mut();
    let found = decisions.find(|decision| decision.action.is_some());
    found.expect("the strategy acts here")
}

#[test]
fn strategy_as_it_is_passes() {
    assert_eq!(check_defect(0, |_| {}), None);
}

#[test]
fn waiting_instead_of_acting_is_caught() {
    let wait = |decisions: &mut Vec<Decision>| acts(decisions).action = None;
    assert_eq!(check_defect(0, wait), Some(Defect::NoDecision));
    assert_eq!(check_defect(1, wait), Some(Defect::Endless));
}

#[test]
fn action_of_another_edge_is_caught() {
    let other = |decisions: &mut Vec<Decision>| {
        let action = acts(decisions).action.as_mut().expect("it acts");
        action[0].edge = 2;
    };
    assert_eq!(check_defect(0, other), Some(Defect::ImpossibleAction));
}

#[test]
fn widened_zone_of_an_action_is_caught() {
    let widen = |decisions: &mut Vec<Decision>| {
        let mut action = acts(decisions).clone();
        action.zones = vec![Vec::new()];
        decisions.insert(0, action);
    };
    assert_eq!(check_defect(1, widen), Some(Defect::ImpossibleAction));
}

#[test]
fn widened_zone_of_waiting_is_caught() {
    let widen = |decisions: &mut Vec<Decision>| {
        decisions.insert(
            0,
            Decision {
                zones: vec![Vec::new()],
                action: None,
            },
        );
    };
    assert_eq!(check_defect(1, widen), Some(Defect::Endless));
}

#[test]
fn missing_decision_is_caught() {
    assert_eq!(check_defect(1, Vec::clear), Some(Defect::NoDecision));
}
