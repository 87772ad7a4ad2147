//! Binary trees of cuts `feature <= bound`, as lists of nodes; the first node is the root.

/// A node of a tree whose leaves hold a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Node<L> {
    /// A leaf.
    Leaf(L),
    /// Two parts.
    Cut {
        /// The feature that is compared.
        feature: u32,
        /// The number it is compared with.
        bound: f64,
        /// The node for values up to the bound.
        low: u32,
        /// The node for the others.
        high: u32,
    },
}

/// The leaf of a point.
pub(super) fn leaf<L: Copy>(tree: &[Node<L>], point: &[f64]) -> L {
    leaf_below(tree, &mut 0, point)
}

/// The leaf of a point that lies below a node, which is set to that of the leaf.
pub(super) fn leaf_below<L: Copy>(tree: &[Node<L>], node: &mut u32, point: &[f64]) -> L {
    loop {
        match tree[*node as usize] {
            Node::Leaf(leaf) => return leaf,
            Node::Cut {
                feature,
                bound,
                low,
                high,
            } => {
                let is_low = point[feature as usize] <= bound;
                *node = if is_low { low } else { high };
            }
        }
    }
}

/// The leaf of a point that moves with these rates, and in how long it is in another one; infinity
/// if never.
pub(super) fn leaf_and_exit<L: Copy>(tree: &[Node<L>], point: &[f64], rates: &[f64]) -> (L, f64) {
    let (mut node, mut exit) = (0, f64::INFINITY);
    loop {
        match tree[node as usize] {
            Node::Leaf(leaf) => return (leaf, exit),
            Node::Cut {
                feature,
                bound,
                low,
                high,
            } => {
                let (value, rate) = (point[feature as usize], rates[feature as usize]);
                let is_low = value <= bound;
                if rate != 0.0 && (rate > 0.0) == is_low {
                    exit = exit.min(beyond(bound, value, rate));
                }
                node = if is_low { low } else { high };
            }
        }
    }
}

/// Where a bound is crossed counts as crossed so much later, relative to the numbers at hand: a
/// decision must not depend on how a number was rounded.
const BEYOND: f64 = 1e-11;

/// In how long a value that changes at a rate is surely beyond a bound.
fn beyond(bound: f64, value: f64, rate: f64) -> f64 {
    let slack = BEYOND * bound.abs().max(value.abs()).max(1.0);
    ((bound - value) / rate).max(0.0) + slack / rate.abs()
}
