//! The cycles of a graph of blocks or functions.

/// Where the edges end that close a cycle, in a depth-first walk over a graph with this number of
/// nodes; in the order of the walk.
pub(super) fn cycle_heads(nodes: usize, successors: impl Fn(usize) -> Vec<usize>) -> Vec<usize> {
    #[derive(Clone, Copy, PartialEq)]
    enum Visit {
        New,
        Open,
        Done,
    }
    let mut visits = vec![Visit::New; nodes];
    let mut heads = Vec::new();
    for root in 0..nodes {
        if visits[root] != Visit::New {
            continue;
        }
        visits[root] = Visit::Open;
        let mut path = vec![(root, successors(root).into_iter())];
        while let Some((node, pending)) = path.last_mut() {
            let Some(next) = pending.next() else {
                visits[*node] = Visit::Done;
                path.pop();
                continue;
            };
            match visits[next] {
                Visit::Open => heads.push(next),
                Visit::New => {
                    visits[next] = Visit::Open;
                    path.push((next, successors(next).into_iter()));
                }
                Visit::Done => {}
            }
        }
    }
    heads
}
