//! How chains are followed along their trails ([`super::chain_cache`]).

use crate::network::{Failure, FixedMove, MoveListId, Moves};
use crate::zones::Zone;

use super::chain_cache::{ChainCache, Ending, MOST_BYTES, Onward, Root, Trail, TrailId};
use super::clock_programs::ProgramStep;
use super::expansion::{delay_after, push_step};
use super::graph::Graph;
use super::node::{LONGEST_CHAIN, Origin};

impl Graph<'_, '_> {
    /// Follows a move of a node along its trail, if there is one, and adds the edge. Returns false,
    /// with the words as they were, if the chain must be followed move by move from its start.
    pub(super) fn follow_trail(
        &mut self,
        root: Root,
        moves: &Moves,
        origin: Origin,
        target: &mut Vec<i32>,
    ) -> Result<bool, Failure> {
        let mut trails = std::mem::take(&mut self.trails);
        let result = self.follow_trail_in(&mut trails, root, moves, origin, target);
        self.trails = trails;
        result
    }

    fn follow_trail_in(
        &mut self,
        trails: &mut ChainCache,
        Root(first): Root,
        moves: &Moves,
        origin: Origin,
        target: &mut Vec<i32>,
    ) -> Result<bool, Failure> {
        let position = (first + origin.ordinal) as usize;
        if matches!(trails.first[position], Onward::Unknown) {
            trails.first[position] = self.first_onward(trails, moves, origin, target)?;
        }
        let mut at = match trails.first[position] {
            Onward::Unknown | Onward::Varies => return Ok(false),
            Onward::Ends => return Ok(true),
            Onward::To(trail) => trail,
        };
        self.symbolic
            .stepper
            .take(&trails.points[at as usize].last, target)?;
        loop {
            match self.onward(trails, at, target)? {
                Onward::To(next) => {
                    let one = &trails.points[next as usize].last;
                    self.symbolic.stepper.take(one, target)?;
                    self.explored += 1;
                    at = next;
                }
                Onward::Ends => break,
                Onward::Unknown | Onward::Varies => {
                    let trail = &trails.points[at as usize];
                    self.steps.clone_from(&trail.steps);
                    let zone = trail.zone.clone();
                    let (length, may_delay) = (trail.length, trail.may_delay);
                    self.continue_chain(origin, target, zone, length, may_delay)?;
                    return Ok(true);
                }
            }
        }
        self.end_trail(&mut trails.points[at as usize], target, origin)?;
        Ok(true)
    }

    /// The result of a move of a node.
    fn first_onward(
        &mut self,
        trails: &mut ChainCache,
        moves: &Moves,
        origin: Origin,
        words: &[i32],
    ) -> Result<Onward, Failure> {
        let one = moves.get(origin.ordinal as usize);
        let zone = self.zone(origin.node);
        if !self.symbolic.is_enabled(one, zone)? {
            return Ok(Onward::Ends);
        }
        let Some(last) = self.symbolic.stepper.fix(one, words) else {
            return Ok(Onward::Varies);
        };
        let mut zone = Zone::from_bounds(self.dimension(), zone);
        if !last.effect.enter(&mut zone) {
            return Ok(Onward::Varies);
        }
        let mut steps = Vec::new();
        push_step(&mut steps, false, &last.effect);
        self.add_trail(trails, words, last, zone, steps, 1)
    }

    /// How a chain continues from the end of a trail, in a state with these words.
    fn onward(
        &mut self,
        trails: &mut ChainCache,
        at: TrailId,
        words: &mut [i32],
    ) -> Result<Onward, Failure> {
        let is_objective_fixed = trails.is_objective_fixed;
        let trail = &mut trails.points[at as usize];
        if trail.is_end || !(is_objective_fixed || self.is_open(words, &trail.zone)?) {
            return Ok(Onward::Ends);
        }
        let stepper = &mut self.symbolic.stepper;
        trail.vector = trail.vector.or_else(|| stepper.vector(words));
        let Some(vector) = trail.vector else {
            return Ok(Onward::Varies);
        };
        let Some(list) = stepper.move_list(vector, words)? else {
            return Ok(Onward::Varies);
        };
        if let Some(&(_, onward)) = trail.onward.iter().find(|known| known.0 == list) {
            return Ok(onward);
        }
        let onward = self.new_onward(trails, at, list, words)?;
        if !matches!(onward, Onward::Unknown) {
            trails.points[at as usize].onward.push((list, onward));
        }
        Ok(onward)
    }

    /// Like [`Graph::onward`], if the result of the list of moves is not known.
    fn new_onward(
        &mut self,
        trails: &mut ChainCache,
        at: TrailId,
        list: MoveListId,
        words: &[i32],
    ) -> Result<Onward, Failure> {
        let trail = &trails.points[at as usize];
        let moves = self.symbolic.stepper.listed(list);
        if moves.len() != 1 {
            return Ok(Onward::Ends);
        }
        let one = moves.get(0);
        if (trail.may_delay && !one.controllable)
            || !self.symbolic.is_enabled(one, trail.zone.bounds())?
        {
            return Ok(Onward::Ends);
        }
        if trails.bytes > MOST_BYTES {
            return Ok(Onward::Unknown);
        }
        let Some(last) = self.symbolic.stepper.fix(one, words) else {
            return Ok(Onward::Varies);
        };
        let mut zone = trail.zone.clone();
        if !last.effect.is_trivial() && !last.effect.enter(&mut zone) {
            return Ok(Onward::Varies);
        }
        let mut steps = trail.steps.clone();
        push_step(&mut steps, trail.may_delay, &last.effect);
        let length = trail.length + 1;
        self.add_trail(trails, words, last, zone, steps, length)
    }

    /// Adds the trail that ends with `last`, taken in a state with these words, and enters `zone`.
    fn add_trail(
        &mut self,
        trails: &mut ChainCache,
        words: &[i32],
        last: FixedMove,
        mut zone: Zone,
        steps: Vec<ProgramStep>,
        length: u32,
    ) -> Result<Onward, Failure> {
        let mut target = words.to_vec();
        last.enter_locations(&mut target);
        let may_delay = delay_after(self.symbolic, &mut target, &steps, self.latest, &mut zone)?;
        let is_end = length as usize == LONGEST_CHAIN
            || (may_delay && !self.chains_delays)
            || self.symbolic.is_almost_out_of_range(zone.bounds())
            || (trails.is_objective_fixed && !self.is_open(&mut target, &zone)?);
        Ok(trails.add(Trail {
            last,
            vector: None,
            zone,
            may_delay,
            length,
            steps,
            is_end,
            onward: Vec::new(),
            ending: None,
        }))
    }

    /// Adds the edge of a chain that ends at the end of a trail.
    fn end_trail(
        &mut self,
        trail: &mut Trail,
        words: &mut [i32],
        origin: Origin,
    ) -> Result<(), Failure> {
        if trail.ending.is_none() {
            let mut zone = trail.zone.clone();
            self.symbolic.extrapolate(words, zone.bounds_mut());
            trail.ending = Some(Ending {
                id: self.zones.intern(zone.bounds()),
                program: self.programs.intern(&trail.steps),
                totality: None,
                zone,
            });
        }
        let Some(ending) = &mut trail.ending else {
            return Ok(());
        };
        self.add_edge(words, ending, origin, trail.length)
    }
}
