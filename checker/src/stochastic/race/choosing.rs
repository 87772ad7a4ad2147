//! The race where somebody decides for the controller: see [`crate::stochastic::control`].

use super::{Race, TOLERANCE};
use crate::ir::Urgency;
use crate::stochastic::advice::{Advice, View};
use crate::stochastic::control::{Chosen, Moment};
use crate::stochastic::failure::Failure;
use crate::stochastic::program::{Instance, Program};

impl Race<'_> {
    /// Lets the processes of the controller plan anew.
    pub(super) fn look_for_decisions(&mut self, program: &Program<'_>) {
        if self.control.is_none() {
            return;
        }
        for process in 0..self.locations.len() {
            if program
                .spot(process, self.locations[process])
                .is_controllable
            {
                self.make_stale(process as u32);
            }
        }
    }

    /// Whether an output is one of the controller's that somebody decides about.
    pub(super) fn is_decided(&self, instance: &Instance<'_>) -> bool {
        instance.edge.controllable && self.control.is_some()
    }

    /// Whether the controller lets others move where time cannot pass.
    pub(super) fn passes(&self, instance: &Instance<'_>) -> bool {
        instance.edge.controllable && self.control.as_ref().is_some_and(|one| one.passes)
    }

    /// Adds the times until `bound` for which a delay is drawn for an output of the controller;
    /// returns when it is asked about it without.
    pub(super) fn decided_windows(
        &mut self,
        program: &Program<'_>,
        instance: &Instance<'_>,
        bound: f64,
    ) -> Result<f64, Failure> {
        let Some((hold, draws)) = self
            .control
            .as_ref()
            .map(|one| (one.hold, one.is_drawing()))
        else {
            return Ok(f64::INFINITY);
        };
        let view = View::Drawn(self.longest_stay);
        let demanded = if self.is_advised(instance) {
            self.demanded(program, instance, bound)?
        } else {
            f64::INFINITY
        };
        let is_urgent = instance.may_be_urgent && self.is_urgent(instance)?;
        if draws && !is_urgent && hold == 0.0 {
            self.instance_windows(program, instance, bound, view, false)?;
            return Ok(demanded);
        }
        let first = self.instance_windows(program, instance, bound, view, true)?;
        if first > 0.0 && first.is_finite() && !draws {
            // Without a first moment one soon after the beginning is taken.
            let mask = self.output(program, instance, first, view)?;
            let soon = (super::advised::SOON * first.max(1.0)).min(mask.horizon / 2.0);
            let first = if mask.now { first } else { first + soon };
            return Ok(demanded.min(first));
        }
        // At the latest it is asked when it may stay no longer.
        let asked = if first.is_finite() {
            hold.min(bound)
        } else {
            first
        };
        Ok(demanded.min(asked))
    }

    /// Lets the controller decide, now that the delay of a process with a move of it is over: the
    /// move that it makes, or none if it waits.
    pub(super) fn decide(
        &mut self,
        program: &Program<'_>,
        winner: usize,
    ) -> Result<Option<u32>, Failure> {
        let (moves, others) = self.moves_of_controller(program, winner)?;
        let may_wait = self.may_wait(program, &moves, others)?;
        let (time, is_straight) = (self.time, !self.motion.is_flowing());
        let control = self.control.as_mut().expect("somebody decides");
        let mut state = self.machine.view_of_state();
        let allowed = self.fence.map(|fence| {
            let mut allowed = moves.clone();
            fence.keep_allowed(&state, &mut allowed);
            allowed
        });
        let moment = Moment {
            moves: allowed.as_deref().unwrap_or(&moves),
            may_wait,
            is_straight,
            time,
        };
        let chosen = control.chooser.choose(&mut state, moment)?;
        let chosen = match chosen {
            Chosen::Move(place) => Some(moment.moves[place]),
            Chosen::Wait(time) => {
                let is_moving = self.can_time_pass(program, &moves)?;
                let control = self.control.as_mut().expect("somebody decides");
                control.passes = !is_moving;
                control.hold = if control.is_drawing() {
                    f64::INFINITY
                } else {
                    time
                };
                None
            }
            Chosen::Draw => {
                control.draws = true;
                None
            }
        };
        if let Some(control) = &mut self.control {
            control.moves = moves;
        }
        let Some(entry) = chosen else {
            return Ok(None);
        };
        self.output_of(program, entry).map(Some)
    }

    /// Lets the controller make one of its moves that are enabled now, whoever decides.
    pub(in crate::stochastic) fn take_entry(
        &mut self,
        program: &Program<'_>,
        entry: u32,
    ) -> Result<(), Failure> {
        let chosen = self.output_of(program, entry)?;
        let process = program.instance(chosen).process as usize;
        self.make(program, process, chosen)
    }

    /// The output by which a move is made: of legs that are edges, one by weight.
    fn output_of(&mut self, program: &Program<'_>, entry: u32) -> Result<u32, Failure> {
        let process = program.instance(entry).process as usize;
        self.find_outputs(program, process)?;
        let legs = self.choices.iter().copied();
        let legs: Vec<u32> = legs
            .filter(|&one| program.instance(one).entry == entry)
            .collect();
        self.one_of(program, &legs)
    }

    /// The moves that the controller can make now, by their entries, and whether the environment
    /// can move, too: one of its processes whose delay is over.
    pub(in crate::stochastic) fn moves_of_controller(
        &mut self,
        program: &Program<'_>,
        winner: usize,
    ) -> Result<(Vec<u32>, bool), Failure> {
        let control = self.control.as_mut().expect("somebody decides");
        let mut moves = std::mem::take(&mut control.moves);
        moves.clear();
        let mut others = false;
        for process in 0..self.locations.len() {
            let spot = program.spot(process, self.locations[process]);
            let is_ready = process == winner
                || self.committed > 0
                || spot.urgency != Urgency::Normal
                || self.attempts[process] <= TOLERANCE
                || self.bounds[process] <= TOLERANCE;
            let is_asked = is_ready || spot.is_controllable;
            if !is_asked || spot.outputs.is_empty() || !self.find_outputs(program, process)? {
                continue;
            }
            for &choice in &self.choices {
                let instance = program.instance(choice);
                if !instance.edge.controllable {
                    others |= is_ready;
                } else if !moves.contains(&instance.entry) {
                    moves.push(instance.entry);
                }
            }
        }
        Ok((moves, others))
    }

    /// Whether the controller may wait.
    fn may_wait(
        &mut self,
        program: &Program<'_>,
        moves: &[u32],
        others: bool,
    ) -> Result<bool, Failure> {
        let is_allowed = self.advice.as_ref().is_none_or(Advice::waits);
        Ok(is_allowed && (others || self.can_time_pass(program, moves)?))
    }

    /// Whether time can pass while the controller makes none of these moves.
    pub(super) fn can_time_pass(
        &mut self,
        program: &Program<'_>,
        moves: &[u32],
    ) -> Result<bool, Failure> {
        if self.committed > 0 || self.bounds.iter().any(|&bound| bound <= TOLERANCE) {
            return Ok(false);
        }
        for &one in moves {
            let instance = program.instance(one);
            if instance.may_be_urgent && self.is_urgent(instance)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}
