//! The least mean cost until the end, between bounds, and a strategy that attains the upper one.
//!
//! Components of the graph are solved each behind all that they lead to. Where no state comes
//! again, one look at a state is enough; the others are in `cycles.rs`. A run must end: only
//! strategies count under which it does almost surely. States without one cost infinitely much.
//!
//! Invariants:
//! * `lower` and `upper` are bounds of the least cost, but for the rounding of sums.
//! * Whoever follows `policy` pays `upper` at most.
//!
//! Sources: S. Haddad, B. Monmege, "Interval iteration algorithm for MDPs and IMDPs", TCS 735
//! (2018); C. Baier et al., "Ensuring the reliability of your model checker: interval iteration for
//! Markov decision processes", CAV 2017.

use super::components::components;
use super::cycles;
use super::process::Process;
use super::solution::{Cyclic, Solution, Unsolved};
use crate::cancellation;

/// Bounds are to be this near to each other, as a part of the value.
const PRECISION: f64 = 1e-6;
/// In a component, as a part of its greatest value; and if that was not enough.
const PRECISIONS: [f64; 3] = [1e-8, 1e-11, 1e-13];

/// Finds the least mean cost of all nodes.
pub(super) fn solve(process: &Process) -> Result<Solution, Unsolved> {
    let nodes = process.nodes();
    let parts = components(nodes, &process.targets, |node| process.ways_of_node(node));
    let mut last = Err(Unsolved::Slow);
    for precision in PRECISIONS {
        let mut solution = Solution {
            lower: vec![f64::INFINITY; nodes],
            upper: vec![f64::INFINITY; nodes],
            policy: vec![u32::MAX; nodes],
            is_acyclic: true,
        };
        let mut places = Vec::new();
        for part in 0..parts.len() {
            cancellation::work(parts.nodes(part).len());
            match parts.nodes(part) {
                &[node] if !process.returns(node) => solution.look_at(process, node),
                nodes => {
                    if solution.is_acyclic {
                        solution.is_acyclic = false;
                        places = vec![u32::MAX; process.nodes()];
                    }
                    let solved = cycles::solve(Cyclic {
                        process,
                        nodes,
                        places: &mut places,
                        solution: &mut solution,
                        precision,
                    });
                    match solved {
                        Err(Unsolved::Slow) if last.is_ok() => return last,
                        solved => solved?,
                    }
                }
            }
        }
        let (lower, upper) = (solution.lower[0], solution.upper[0]);
        let is_near = !upper.is_finite() || upper - lower <= PRECISION * upper.abs();
        let is_last = solution.is_acyclic || is_near;
        last = Ok(solution);
        if is_last {
            break;
        }
    }
    last
}

impl Solution {
    /// Looks at a node that never comes again.
    fn look_at(&mut self, process: &Process, node: u32) {
        let place = node as usize;
        for choice in process.choices(node) {
            let lower = process.total(choice, &self.lower);
            let upper = process.total(choice, &self.upper);
            self.lower[place] = self.lower[place].min(lower);
            if upper < self.upper[place] {
                self.upper[place] = upper;
                self.policy[place] = choice as u32;
            }
        }
    }
}
