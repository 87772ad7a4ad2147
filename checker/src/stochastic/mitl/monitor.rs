//! Decides a formula along a run: conditions come in order, and each operator passes on what is
//! known of it as soon as it is known.
//!
//! Invariant: a node stands behind its operands in `nodes`, so one pass over them brings all up to
//! date.

use std::collections::VecDeque;

use super::signal::{Cut, Part, Parts};
use super::until::Until;
use crate::ir::Temporal;

/// An operator with the numbers of its operands.
#[derive(Clone, Debug)]
enum Node {
    True,
    Atom(usize),
    Not(usize),
    And(usize, usize),
    Next(usize, Next),
    Until(usize, usize, Until),
}

/// What is known of `X f`: it holds all through a state if f holds just behind the move that ends
/// it.
#[derive(Clone, Debug, Default)]
struct Next {
    /// The moves behind which f is not known yet.
    moves: VecDeque<Cut>,
}

/// Decides a formula along one run.
#[derive(Clone, Debug)]
pub(super) struct Monitor {
    nodes: Vec<Node>,
    /// Of each node what holds; what is used by others has gone.
    parts: Vec<Parts>,
    /// Up to where each node passed on what is known.
    passed: Vec<Cut>,
    atom_count: usize,
    /// Up to where conditions are known.
    known: Cut,
}

impl Monitor {
    pub(super) fn new(root: &Temporal, atom_count: usize) -> Monitor {
        let mut nodes = Vec::new();
        add(root, &mut nodes);
        Monitor {
            parts: vec![Parts::default(); nodes.len()],
            passed: vec![Cut::START; nodes.len()],
            nodes,
            atom_count,
            known: Cut::START,
        }
    }

    /// Says which conditions hold from where they were known to this cut.
    pub(super) fn conditions(&mut self, end: Cut, holds: &[bool]) {
        debug_assert_eq!(holds.len(), self.atom_count, "each condition is known");
        if end <= self.known {
            return;
        }
        self.known = end;
        for (node, parts) in self.nodes.iter().zip(&mut self.parts) {
            match node {
                Node::Atom(atom) => parts.push(end, holds[*atom]),
                Node::True => parts.push(end, true),
                _ => {}
            }
        }
    }

    /// Says that there is a move where conditions are known to.
    pub(super) fn moves(&mut self) {
        for node in &mut self.nodes {
            if let Node::Next(_, next) = node {
                next.moves.push_back(self.known);
            }
        }
    }

    /// Whether the formula holds for the run, if that is decided.
    pub(super) fn decided(&mut self) -> Option<bool> {
        self.pass_on(false);
        self.parts
            .last_mut()?
            .behind(Cut::START)
            .map(|part| part.holds)
    }

    /// The run is over: whether the formula holds.
    pub(super) fn finish(&mut self) -> bool {
        self.pass_on(true);
        let root = self
            .parts
            .last_mut()
            .and_then(|root| root.behind(Cut::START));
        root.is_some_and(|part| part.holds)
    }

    fn pass_on(&mut self, is_over: bool) {
        for index in 0..self.nodes.len() {
            let (operands, rest) = self.parts.split_at_mut(index);
            let result = &mut rest[0];
            let passed = &mut self.passed[index];
            match &mut self.nodes[index] {
                Node::True | Node::Atom(_) => {}
                Node::Not(inner) => {
                    while let Some(part) = operands[*inner].behind(*passed) {
                        result.push(part.end, !part.holds);
                        *passed = part.end;
                    }
                }
                Node::And(left, right) => {
                    while let Some(part) = both(
                        operands[*left].behind(*passed),
                        operands[*right].behind(*passed),
                    ) {
                        result.push(part.end, part.holds);
                        *passed = part.end;
                    }
                }
                Node::Next(inner, next) => {
                    while let Some(&end) = next.moves.front() {
                        let Some(part) = operands[*inner].behind(end) else {
                            break;
                        };
                        next.moves.pop_front();
                        result.push(end, part.holds);
                    }
                    if is_over {
                        result.push(self.known, false);
                    }
                }
                Node::Until(keep, goal, until) => {
                    let (keep, goal) = two(operands, *keep, *goal);
                    until.read(keep, goal, result);
                    if is_over {
                        until.finish(result);
                    }
                }
            }
        }
    }
}

/// What is known of `f && g`: it does not hold as long as one does not, known or not the other.
fn both(left: Option<Part>, right: Option<Part>) -> Option<Part> {
    match (left, right) {
        (Some(left), Some(right)) => {
            let (sooner, later) = if left.end <= right.end {
                (left, right)
            } else {
                (right, left)
            };
            Some(if later.holds { sooner } else { later })
        }
        (Some(one), None) | (None, Some(one)) => (!one.holds).then_some(one),
        (None, None) => None,
    }
}

/// Two operands: an operator has two of its own, since formulas are trees.
fn two(operands: &mut [Parts], first: usize, second: usize) -> (&mut Parts, &mut Parts) {
    debug_assert!(first < second, "operands are added from left to right");
    let (front, back) = operands.split_at_mut(second);
    (&mut front[first], &mut back[0])
}

/// Adds a formula behind its parts, and returns its number.
fn add(formula: &Temporal, nodes: &mut Vec<Node>) -> usize {
    let node = match formula {
        Temporal::True => Node::True,
        Temporal::Atom(atom) => Node::Atom(*atom),
        Temporal::Not(inner) => Node::Not(add(inner, nodes)),
        Temporal::And(left, right) => Node::And(add(left, nodes), add(right, nodes)),
        Temporal::Next(inner) => Node::Next(add(inner, nodes), Next::default()),
        Temporal::Until {
            interval,
            keep,
            goal,
        } => Node::Until(
            add(keep, nodes),
            add(goal, nodes),
            Until::new(interval.0, interval.1),
        ),
    };
    nodes.push(node);
    nodes.len() - 1
}
