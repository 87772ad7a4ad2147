//! Which states of a component have a strategy that ends almost surely.
//!
//! Source: L. de Alfaro, "Formal verification of probabilistic systems", thesis (1997):
//! those that can reach the end by choices that never lead elsewhere, as often as that changes.

use super::process::Process;
use super::solution::Cyclic;
use crate::cancellation;

/// The nodes from which some strategy ends almost surely, in their order.
pub(super) fn ending(cyclic: &mut Cyclic<'_>, nodes: &[u32]) -> Vec<u32> {
    let (process, upper) = (cyclic.process, &cyclic.solution.upper);
    for (place, &node) in (0..).zip(nodes) {
        cyclic.places[node as usize] = place;
    }
    let places = &*cyclic.places;
    let before = Backwards::new(process, nodes, places);
    let mut inside = vec![true; nodes.len()];
    loop {
        let is_allowed = |choice: u32| {
            let mut outcomes = process.outcomes(choice as usize);
            outcomes.all(|(target, _)| match places[target as usize] {
                u32::MAX => upper[target as usize].is_finite(),
                place => inside[place as usize],
            })
        };
        let mut reached = vec![false; nodes.len()];
        let mut open: Vec<u32> = Vec::new();
        let mut reach = |&(from, choice): &(u32, u32), open: &mut Vec<u32>| {
            if inside[from as usize] && !reached[from as usize] && is_allowed(choice) {
                reached[from as usize] = true;
                open.push(from);
            }
        };
        for one in &before.leaving {
            reach(one, &mut open);
        }
        while let Some(to) = open.pop() {
            for one in before.of(to) {
                reach(one, &mut open);
            }
        }
        cancellation::work(nodes.len());
        if reached == inside {
            break;
        }
        inside = reached;
    }
    for &node in nodes {
        cyclic.places[node as usize] = u32::MAX;
    }
    let kept = nodes.iter().zip(inside).filter(|one| one.1);
    kept.map(|one| *one.0).collect()
}

/// The ways of a component, by where they lead: each as the place of the node and the choice.
struct Backwards {
    ends: Vec<u32>,
    ways: Vec<(u32, u32)>,
    /// Those that lead out of it.
    leaving: Vec<(u32, u32)>,
}

impl Backwards {
    fn new(process: &Process, nodes: &[u32], places: &[u32]) -> Backwards {
        let mut leaving = Vec::new();
        let mut ends = vec![0; nodes.len() + 1];
        for &node in nodes {
            for way in process.ways_of_node(node) {
                let place = places[process.targets[way] as usize];
                if place != u32::MAX {
                    ends[place as usize + 1] += 1;
                }
            }
        }
        for place in 0..nodes.len() {
            ends[place + 1] += ends[place];
        }
        let mut ways = vec![(0, 0); ends[nodes.len()] as usize];
        let mut next = ends.clone();
        for (from, &node) in (0..).zip(nodes) {
            for choice in process.choices(node) {
                for (target, _) in process.outcomes(choice) {
                    let way = (from, choice as u32);
                    match places[target as usize] {
                        u32::MAX => leaving.push(way),
                        place => {
                            ways[next[place as usize] as usize] = way;
                            next[place as usize] += 1;
                        }
                    }
                }
            }
        }
        Backwards {
            ends,
            ways,
            leaving,
        }
    }

    /// Those that lead to the node with this place.
    fn of(&self, place: u32) -> &[(u32, u32)] {
        let place = place as usize;
        &self.ways[self.ends[place] as usize..self.ends[place + 1] as usize]
    }
}
