//! Games with a goal that must recur: `A[] (p && A<> q)`.
//!
//! The controller wins a play if p always holds, and after every instant there is one at which q
//! holds. A play that ends is won if q holds at its end. What the controller wins is the greatest X
//! such that from every valuation in X it can get, within p, into q, and can continue from there
//! without leaving X:
//!
//! ```text
//! leave  = Pred_t(not X ∪ Pre_u(not X) ∪ held, ⋃ Pre_c(X), less Pre_u(not X))
//!          (what the controller cannot keep from leaving X)
//! target = p ∩ q, less leave
//! X      = from where the controller can force play into the target, within p
//!          (see [`crate::game::solver`])
//! ```
//!
//! The graph is explored before. X begins with what the controller wins of the game in which it
//! must only keep p, and shrinks until it stays the same; otherwise X would lose what breaks p
//! round by round. The strategy of the last round, with the goals at its start, is a strategy for
//! the whole: see [`crate::game::strategy::attractor`]. If X begins with everything, what each
//! round takes away shows how the environment wins there: see [`crate::game::strategy::co_buchi`].
//! A second solution does this, once it is known that the environment wins.
//!
//! Source: L. de Alfaro, M. Faella, T. Henzinger, R. Majumdar, M. Stoelinga, "The Element of
//! Surprise in Timed Games", CONCUR 2003 (nested fixpoints over timed predecessors).

use crate::network::Failure;
use crate::search::limits::Watch;
use crate::zones::Federation;

use crate::game::Player;
use crate::game::Solution;
use crate::game::backward::winning_sets::Win;
use crate::game::backward::winning_sets::wins_bytes;
use crate::game::forward::node::Standing;
use crate::game::solver::Solver;

/// Nodes between two checks of the limits.
const NODES_BETWEEN_LOOKS: u32 = 64;

/// Solves the game of a new solver with the controller as its seeker. The goal of its graph must be
/// p ∩ q, and p what is kept. If the controller wins, the strategy can be read from the solver. If
/// the players cooperate, it is enough that the controller wins from somewhere. If `rounds` is
/// wanted and the controller does not win, it becomes the sets X for each node, the first one
/// first.
pub fn solve(
    solver: &mut Solver<'_, '_, '_>,
    is_cooperative: bool,
    rounds: Option<&mut Vec<Vec<Win>>>,
    watch: &mut dyn Watch,
) -> Result<Solution, Failure> {
    solver.continue_after_goal(is_cooperative);
    if let Some(reason) = solver.explore(watch)? {
        return Ok(Solution::Stopped(reason));
    }
    if let Some(reason) = solver.compute_breaking(watch)? {
        return Ok(Solution::Stopped(reason));
    }
    let nodes = 0..solver.graph.nodes.len() as u32;
    let safe: Vec<Win> = nodes.clone().map(|node| solver.won.lost(node)).collect();
    solver.seeker = Player::Controller;
    let answer = shrink(solver, safe, is_cooperative, None, watch)?;
    match rounds {
        Some(rounds) if answer == Solution::Won(Player::Environment) => {
            let unbroken = nodes.map(|node| unbroken(solver, node)).collect();
            shrink(solver, unbroken, is_cooperative, Some(rounds), watch)
        }
        _ => Ok(answer),
    }
}

/// Lets X begin with what is kept, and shrink until it stays the same or the winner is known.
fn shrink(
    solver: &mut Solver<'_, '_, '_>,
    mut kept: Vec<Win>,
    is_cooperative: bool,
    mut rounds: Option<&mut Vec<Vec<Win>>>,
    watch: &mut dyn Watch,
) -> Result<Solution, Failure> {
    let mut rounds_bytes = 0;
    loop {
        let mut targets = Vec::with_capacity(kept.len());
        for node in 0..kept.len() as u32 {
            targets.push(target(solver, node, &kept)?);
            if node.is_multiple_of(NODES_BETWEEN_LOOKS)
                && let Some(reason) = solver.look(watch)
            {
                return Ok(Solution::Stopped(reason));
            }
        }
        let kept_bytes = wins_bytes(&kept);
        if let Some(rounds) = &mut rounds {
            rounds.push(kept.clone());
            rounds_bytes += kept_bytes;
        }
        solver.aside_bytes = wins_bytes(&targets) + kept_bytes + rounds_bytes;
        solver.restart(targets);
        if let Some(reason) = solver.sweep(watch)? {
            return Ok(Solution::Stopped(reason));
        }
        if !is_cooperative && !solver.is_won() {
            if let Some(rounds) = rounds {
                rounds.push(solver.won.win.clone());
            }
            return Ok(Solution::Won(Player::Environment));
        }
        let mut has_shrunk = false;
        for (node, old) in kept.iter_mut().enumerate() {
            if !has_shrunk {
                let node = node as u32;
                has_shrunk = !is_within(solver, node, old, &solver.won.win[node as usize]);
            }
            old.clone_from(&solver.won.win[node]);
        }
        if !has_shrunk {
            let is_won = if is_cooperative {
                solver.has_won_somewhere()
            } else {
                solver.is_won()
            };
            return Ok(Solution::Won(if is_won {
                Player::Controller
            } else {
                Player::Environment
            }));
        }
        if let Some(reason) = solver.look(watch) {
            return Ok(Solution::Stopped(reason));
        }
    }
}

/// The part of a node in which what must be kept holds.
fn unbroken(solver: &Solver<'_, '_, '_>, node: u32) -> Win {
    match solver.graph.nodes[node as usize].standing {
        Standing::Broken | Standing::Dead => Win::Nothing,
        Standing::Open | Standing::Goal => Win::Everything,
        Standing::Mixed => Win::of(solver.whole(node).minus(&solver.broken(node))),
    }
}

fn is_within(solver: &Solver<'_, '_, '_>, node: u32, one: &Win, other: &Win) -> bool {
    match (one, other) {
        (Win::Nothing, _) | (_, Win::Everything) => true,
        (_, Win::Nothing) => false,
        _ => {
            let other = solver.federation_of(node, other);
            solver.federation_of(node, one).is_subset(&other)
        }
    }
}

/// The part of a node in which the goal holds, and from which the controller can continue without
/// leaving what is kept.
fn target(solver: &mut Solver<'_, '_, '_>, node: u32, kept: &[Win]) -> Result<Win, Failure> {
    let mut goal = match solver.graph.nodes[node as usize].standing {
        Standing::Open | Standing::Broken | Standing::Dead => return Ok(Win::Nothing),
        Standing::Goal => solver.whole(node),
        Standing::Mixed => match solver.graph.parts(node) {
            Some(parts) => parts.goal.clone(),
            None => return Ok(Win::Nothing),
        },
    };
    goal.subtract(&leave(solver, node, kept)?);
    if goal.includes_zone(solver.graph.zone(node)) {
        return Ok(Win::Everything);
    }
    Ok(Win::of(goal))
}

/// The part of a node from which the controller cannot prevent play from leaving what is kept.
pub(in crate::game) fn leave(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
    kept: &[Win],
) -> Result<Federation, Failure> {
    let mut out = solver
        .whole(node)
        .minus(&solver.federation_of(node, &kept[node as usize]));
    let mut back = Federation::empty(solver.graph.dimension());
    for edge in solver.graph.edges_from(node) {
        let kept = &kept[edge.target as usize];
        if edge.is_leg {
            continue;
        }
        if edge.controllable {
            back.unite(&solver.before(edge, kept));
        } else {
            out.unite(&solver.missing(edge, kept, None));
        }
    }
    for legs in solver.graph.branch_points.of(node) {
        let legs = solver.targets_of(legs, kept);
        back.unite(&solver.before_all(legs));
    }
    back.subtract(&out);
    let situation = solver.situation(node)?;
    let held = solver.forced_controller(node, &situation).minus(&back);
    out.unite(&held);
    Ok(solver.safe_past(node, out, &back, &situation))
}
