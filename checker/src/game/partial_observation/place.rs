//! Discrete states with everything that does not depend on the path to them: observations, goal,
//! moves, and where time stops.
//!
//! All federations are parts of what the invariants allow. A move is evaluated when a zone first
//! meets its guards, so that no update runs that cannot happen.

use std::cell::OnceCell;
use std::rc::Rc;

use rustc_hash::FxHashMap;

use crate::network::{ClockEffect, Failure, Moves, Symbolic};
use crate::zones::{Federation, Zone};

use super::knowledge::Observation;
use super::machine::{Action, Question};
use crate::game::backward::forced_moves::stops;

/// A discrete state.
pub(super) struct Place {
    pub(super) words: Box<[i32]>,
    /// What the invariants allow.
    pub(super) zone: Zone,
    /// Whether locations and urgent channels allow time to pass.
    pub(super) delays: bool,
    /// Each observation, and where it holds.
    pub(super) cells: Vec<(Observation, Federation)>,
    /// Where the goal holds.
    pub(super) goal: Federation,
    /// Where neither the goal holds nor what must be kept.
    pub(super) broken: Federation,
    /// Where time cannot pass, and the process that stops it (`None`: an urgent channel).
    pub(super) stops: Vec<(Option<u32>, Federation)>,
    moves: Moves,
    /// For each move: the action that allows it; `None` if it is the environment's.
    pub(super) actions: Vec<Option<Action>>,
    taken: Vec<OnceCell<Option<Taken>>>,
}

/// What a move does.
pub(super) struct Taken {
    /// The words that it leads to.
    pub(super) words: Box<[i32]>,
    /// What it does to clocks.
    pub(super) effect: ClockEffect,
    /// Where it is possible.
    pub(super) enabled: Federation,
}

/// The discrete states that are known until now.
#[derive(Default)]
pub(super) struct Places {
    known: FxHashMap<Box<[i32]>, Rc<Place>>,
    bytes: usize,
}

impl Places {
    /// The approximate number of bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The discrete state with these words. They must satisfy the invariants for some clock values.
    pub(super) fn at(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        question: &Question<'_>,
        words: &[i32],
    ) -> Result<Rc<Place>, Failure> {
        if let Some(place) = self.known.get(words) {
            return Ok(Rc::clone(place));
        }
        let place = Rc::new(Place::new(symbolic, question, words)?);
        let dimension = symbolic.dimension();
        let federations = place.cells.len() + place.stops.len() + 2;
        let parts = 16 * words.len() + 8 * federations * dimension * dimension;
        self.bytes += 256 + parts + place.actions.len() * (128 + 4 * words.len());
        self.known.insert(words.into(), Rc::clone(&place));
        Ok(place)
    }
}

impl Place {
    fn new(
        symbolic: &mut Symbolic<'_>,
        question: &Question<'_>,
        words: &[i32],
    ) -> Result<Place, Failure> {
        let dimension = symbolic.dimension();
        let mut scratch = words.to_vec();
        let invariant = symbolic.invariant(&mut scratch)?.unwrap_or_default();
        let zone = Zone::of_constraints(dimension, &invariant);
        let goal = match question.goal {
            Some(goal) => symbolic.part(goal, &mut scratch, &zone)?,
            None => Federation::empty(dimension),
        };
        let mut broken = Federation::empty(dimension);
        if let Some(keep) = question.keep {
            broken.push(zone.bounds());
            broken.subtract(&symbolic.part(keep, &mut scratch, &zone)?);
            broken.subtract(&goal);
        }
        let mut cells = vec![(Vec::new(), Federation::of_zone(dimension, zone.bounds()))];
        for predicate in question.observations {
            let holds = symbolic.part(predicate, &mut scratch, &zone)?;
            cells = cells
                .into_iter()
                .flat_map(|(values, part)| halves(&values, part, &holds))
                .filter(|(_, part)| !part.is_empty())
                .collect();
        }
        let mut moves = Moves::default();
        symbolic.remembered_moves(&mut scratch, &mut moves)?;
        let delays = symbolic.may_delay_with(&mut scratch, &moves)?;
        let whole = Federation::of_zone(dimension, zone.bounds());
        let stops = stops(symbolic, &mut scratch, zone.bounds(), &whole, delays)?;
        let cells = cells
            .into_iter()
            .map(|(values, part)| (values.into(), part));
        Ok(Place {
            words: words.into(),
            delays,
            cells: cells.collect(),
            goal,
            broken,
            stops,
            actions: moves
                .iter()
                .map(|one| Action::of(symbolic.stepper.network(), one))
                .collect(),
            taken: moves.iter().map(|_| OnceCell::new()).collect(),
            moves,
            zone,
        })
    }

    /// Where this observation holds.
    pub(super) fn cell(&self, observation: &Observation) -> Option<&Federation> {
        let cell = self.cells.iter().find(|(one, _)| one == observation);
        cell.map(|(_, part)| part)
    }

    /// The effect of a move. None if its guards allow nothing of these zones, or if it is not
    /// possible for another reason.
    pub(super) fn taken(
        &self,
        symbolic: &mut Symbolic<'_>,
        index: usize,
        from: &Federation,
    ) -> Result<Option<&Taken>, Failure> {
        if let Some(known) = self.taken[index].get() {
            return Ok(known.as_ref());
        }
        let one = self.moves.get(index);
        let mut is_near = false;
        for zone in from.zones() {
            is_near = is_near || symbolic.is_enabled(one, zone)?;
        }
        if !is_near {
            return Ok(None);
        }
        let mut words = self.words.clone();
        let mut effect = ClockEffect::default();
        let taken = symbolic
            .fire_into(one, &mut words, &mut effect)?
            .then(|| Taken {
                enabled: effect.enabled_part(self.zone.bounds(), symbolic.dimension()),
                words,
                effect,
            });
        Ok(self.taken[index].get_or_init(|| taken).as_ref())
    }

    /// The processes that take part in a move.
    pub(super) fn takes_part(&self, index: usize, process: u32) -> bool {
        let parts = self.moves.get(index).parts;
        parts.iter().any(|part| part.process == process)
    }
}

/// The part of a cell in which another predicate does not hold, and the part in which it holds.
fn halves(values: &[bool], part: Federation, holds: &Federation) -> [(Vec<bool>, Federation); 2] {
    let inside = part.intersection(holds);
    let with = |value: bool| values.iter().copied().chain([value]).collect();
    [(with(false), part.minus(holds)), (with(true), inside)]
}
