//! The cells into which the trees of some actions cut the clock values of a discrete state.
//!
//! In random runs a clock that is at a cut is below it by the letter of the tree, and above it as
//! soon as any time has passed; and the last bit of a sum of delays may put it on either side. So a
//! move is allowed at a cut by the cells of both sides, and time may pass there where it may behind
//! the cut.

use super::sight::Measured;
use crate::learning::tree::Node;
use crate::zones::{Bound, Federation, Zone};

/// A cell.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// For each continuous feature that is a clock: between which cuts it lies.
    ranges: Vec<(Option<i32>, Option<i32>)>,
    /// What each tree says.
    pub(super) values: Vec<f64>,
}

/// The cells of these trees in a discrete state, whose values in intervals are `point`.
pub(super) fn cells(trees: &[&[Node<f64>]], measured: &[Measured], point: &[f64]) -> Vec<Cell> {
    let mut cells = vec![Cell {
        ranges: vec![(None, None); measured.len()],
        values: Vec::with_capacity(trees.len()),
    }];
    for &nodes in trees {
        let tree = Tree {
            nodes,
            measured,
            point,
        };
        let mut parts = Vec::with_capacity(cells.len());
        for cell in cells {
            tree.cut(0, cell, &mut parts);
        }
        cells = parts;
    }
    cells
}

struct Tree<'t> {
    nodes: &'t [Node<f64>],
    measured: &'t [Measured],
    point: &'t [f64],
}

impl Tree<'_> {
    /// Adds the parts into which the tree from this node cuts a cell.
    fn cut(&self, node: u32, mut cell: Cell, parts: &mut Vec<Cell>) {
        match self.nodes[node as usize] {
            Node::Leaf(value) => {
                cell.values.push(value);
                parts.push(cell);
            }
            Node::Cut {
                feature,
                bound,
                low,
                high,
            } => {
                let feature = feature as usize;
                if !matches!(self.measured[feature], Measured::Clock(_)) {
                    let is_low = self.point[feature] <= bound;
                    self.cut(if is_low { low } else { high }, cell, parts);
                    return;
                }
                let at = bound as i32;
                let (first, last) = cell.ranges[feature];
                if last.is_some_and(|last| last <= at) {
                    self.cut(low, cell, parts);
                } else if first.is_some_and(|first| first >= at) {
                    self.cut(high, cell, parts);
                } else {
                    let mut other = cell.clone();
                    cell.ranges[feature].1 = Some(at);
                    other.ranges[feature].0 = Some(at);
                    self.cut(low, cell, parts);
                    self.cut(high, other, parts);
                }
            }
        }
    }
}

impl Cell {
    /// The part of a set that lies in the cell, with the cuts at its upper end or without.
    pub(super) fn part(
        &self,
        whole: &Federation,
        measured: &[Measured],
        is_closed: bool,
    ) -> Federation {
        let mut zone = Zone::universe(whole.dimension());
        for (measured, range) in measured.iter().zip(&self.ranges) {
            let Measured::Clock(clock) = *measured else {
                continue;
            };
            let low = range.0.map(|low| (0, clock, Bound::weak(-low)));
            let end = if is_closed {
                Bound::weak
            } else {
                Bound::strict
            };
            let high = range.1.map(|high| (clock, 0, end(high)));
            for (left, right, bound) in low.into_iter().chain(high) {
                let bound = bound.expect("cuts are bounds that zones have");
                if !zone.constrain(left, right, bound) {
                    return Federation::empty(whole.dimension());
                }
            }
        }
        let mut part = whole.clone();
        part.intersect_zone(zone.bounds());
        part
    }
}
