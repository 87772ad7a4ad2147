//! Which state has a value that was found: the search behind the traces of `sup`, `inf` and
//! `bounds`.

use crate::ir::{ClockAtom, ClockId, Measure, Predicate};
use crate::network::{Failure, Symbolic};
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Federation, Zone};

use crate::search::reachability::goal::{Goal, SharedGoal, Target};

/// A value of a measure that some state has, or that states approach.
#[derive(Clone, Copy, Debug)]
pub struct Taking<'q> {
    /// The states that count.
    pub predicate: &'q Predicate,
    /// What is measured.
    pub measure: &'q Measure,
    /// The value.
    pub value: i32,
    /// Whether it is the greatest.
    pub is_greatest: bool,
    /// Whether some state has it; otherwise the search looks for one that differs by less than 1.
    pub is_reached: bool,
}

impl Taking<'_> {
    /// The comparisons that a search must keep.
    pub fn atoms(&self) -> Vec<ClockAtom> {
        let Measure::Clock(choice) = *self.measure else {
            return Vec::new();
        };
        let (clock, reference) = (choice.clocks(), ClockId(0).into());
        let (low, high) = (self.value.saturating_sub(1), self.value.saturating_add(1));
        vec![
            ClockAtom::weak(clock, reference, low, high),
            ClockAtom::weak(reference, clock, -high, -low),
        ]
    }

    /// The constraints on clocks for this value in a state with these words; `None` if no valuation
    /// has the value.
    pub fn constraints(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
    ) -> Result<Option<Vec<Constraint>>, Failure> {
        let choice = match *self.measure {
            Measure::Integer(function) => {
                let value = symbolic.stepper.evaluate(function, words)?;
                return Ok((value == self.value).then(Vec::new));
            }
            Measure::Clock(choice) => choice,
        };
        let clock = symbolic.chosen_clock(choice, words)?.0 as usize;
        let (low, high, bound): (i32, i32, fn(i32) -> Option<Bound>) =
            match (self.is_reached, self.is_greatest) {
                (true, _) => (self.value, self.value, Bound::weak),
                (false, true) => (self.value - 1, self.value, Bound::strict),
                (false, false) => (self.value, self.value + 1, Bound::strict),
            };
        let limit = |value| bound(value).ok_or(Failure::ClockLimit(value));
        Ok(Some(vec![
            Constraint {
                left: clock,
                right: 0,
                bound: limit(high)?,
            },
            Constraint {
                left: 0,
                right: clock,
                bound: limit(-low)?,
            },
        ]))
    }
}

impl Goal for Taking<'_> {
    fn confirms(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure> {
        Ok(!self.part(symbolic, words, zone)?.is_empty())
    }
}

impl Target for Taking<'_> {
    fn part(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<Federation, Failure> {
        let Some(constraints) = self.constraints(symbolic, words)? else {
            return Ok(Federation::empty(zone.dimension()));
        };
        let mut part = self.predicate.part(symbolic, words, zone)?;
        part.constrain_all(&constraints);
        Ok(part)
    }
}

impl SharedGoal for Taking<'_> {
    fn fork(&self) -> Self {
        *self
    }

    fn join(&mut self, _: Self) {}
}
