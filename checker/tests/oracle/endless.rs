//! Runs through the regions that never end: how few moves they need, by trying all sequences of
//! moves.
//!
//! A run is given by its moves up to a loop and those of the loop, which must lead to the same
//! words again and again, whatever waits lie between.

use std::collections::{BTreeMap, BTreeSet};

use checker::verify::Part;

use crate::explicit::Graph;

/// What a sequence of moves leads to.
type Places = BTreeSet<usize>;

/// The regions of the way to a run, and once more those of the run itself, which stays in some of
/// them.
pub(crate) struct Endless<'g> {
    graph: &'g Graph,
    /// Where a run may begin; at the start only, if there are none.
    open: Option<&'g [bool]>,
    keep: &'g [bool],
}

impl<'g> Endless<'g> {
    pub(crate) fn new(graph: &'g Graph, open: Option<&'g [bool]>, keep: &'g [bool]) -> Endless<'g> {
        Endless { graph, open, keep }
    }

    fn count(&self) -> usize {
        self.graph.nodes.len()
    }

    /// All that waiting, and the run's beginning, add to some places.
    fn with_waits(&self, places: &Places) -> Places {
        let count = self.count();
        let mut all = Places::new();
        let mut open: Vec<usize> = places.iter().copied().collect();
        while let Some(place) = open.pop() {
            let (node, shift) = (place % count, place / count * count);
            if shift > 0 && !self.keep[node] || !all.insert(place) {
                continue;
            }
            open.extend(self.graph.nodes[node].later.map(|later| later + shift));
            if shift == 0 && self.open.is_some_and(|open| open[node]) {
                open.push(node + count);
            }
        }
        all
    }

    /// Where each move from some places leads, waits after it included.
    fn after_moves(&self, places: &Places) -> BTreeMap<&'g [Part], Places> {
        let mut after: BTreeMap<&[Part], Places> = BTreeMap::new();
        for place in places {
            let (node, shift) = (place % self.count(), place / self.count() * self.count());
            for step in &self.graph.nodes[node].steps {
                let targets = after.entry(&step.parts).or_default();
                targets.insert(step.target + shift);
            }
        }
        let all = after.into_iter();
        all.map(|(parts, places)| (parts, self.with_waits(&places)))
            .collect()
    }

    /// Whether the run can end in one of the places: in a region without a way on, or waiting for
    /// ever.
    fn ends_in(&self, places: &Places) -> bool {
        let count = self.count();
        let mut begun = places.iter().filter(|&&place| place >= count);
        begun.any(|place| {
            let here = place - count;
            let facts = &self.graph.nodes[here];
            let later = std::iter::successors(facts.later, |&node| self.graph.nodes[node].later);
            // Where clocks are compared, time that goes on for ever goes through several regions
            // again and again.
            let mut kept = later.take(count).take_while(|&node| self.keep[node]);
            facts.steps.is_empty() && facts.later.is_none() || kept.any(|node| node == here)
        })
    }

    fn words(&self, place: usize) -> &'g [i32] {
        &self.graph.nodes[place % self.count()].state.words
    }

    /// Whether the moves lead from some places to the same words again and again.
    fn repeats(&self, places: &Places, moves: &[&[Part]]) -> bool {
        let begun: Vec<usize> = places.range(self.count()..).copied().collect();
        let words: BTreeSet<&[i32]> = begun.iter().map(|&place| self.words(place)).collect();
        words.into_iter().any(|words| {
            let mut places: Places = begun.iter().copied().collect();
            let mut seen = BTreeSet::new();
            loop {
                places.retain(|&place| self.words(place) == words);
                if places.is_empty() {
                    return false;
                }
                if !seen.insert(places.clone()) {
                    return true;
                }
                for &parts in moves {
                    places = self.after_moves(&places).remove(parts).unwrap_or_default();
                }
            }
        })
    }

    /// The fewest moves of a run, those of its loop once; at most so many, and `None` if there are
    /// only longer ones.
    pub(crate) fn fewest_moves(&self, most: Option<usize>) -> Option<usize> {
        let start = if self.open.is_some() { 0 } else { self.count() };
        let first = self.with_waits(&Places::from([start]));
        let mut ways: Vec<(Vec<&[Part]>, Vec<Places>)> = vec![(Vec::new(), vec![first])];
        for length in 0..=most? {
            for (moves, places) in &ways {
                let ends = self.ends_in(&places[length]);
                let mut heads = 0..length;
                if ends || heads.any(|head| self.repeats(&places[head], &moves[head..])) {
                    return Some(length);
                }
            }
            let longer = ways.iter().flat_map(|(moves, places)| {
                let after = self.after_moves(&places[length]).into_iter();
                after
                    .filter(|(_, next)| !next.is_empty())
                    .map(move |(parts, next)| {
                        let moves = moves.iter().copied().chain([parts]);
                        let places = places.iter().cloned().chain([next]);
                        (moves.collect(), places.collect())
                    })
            });
            ways = longer.collect();
        }
        None
    }
}
