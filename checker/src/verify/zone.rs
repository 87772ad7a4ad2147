//! Convex sets of clock values, for checking certificates: plain and slow on purpose.
//!
//! A zone is a matrix of bounds on all differences. It shares nothing with the zones of the engine.
//! After every change it is closed by shortest paths: over the one bound that became tighter, or
//! over all.
//!
//! Invariant: the matrix is closed, or the zone is empty and marked so.

use crate::cancellation;
use crate::exec::EmittedAssignment;
use crate::ir::FixedConstraint;

/// `difference < value`, or `<=` if weak, as `2 value`, or `2 value + 1`: ordered from tight to
/// loose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Limit(i64);

/// No limit.
const NONE: Limit = Limit(i64::MAX);

const ZERO: Limit = Limit(1);

impl Limit {
    fn new(value: i64, is_strict: bool) -> Limit {
        Limit(2 * value + i64::from(!is_strict))
    }

    fn is_strict(self) -> bool {
        self.0 & 1 == 0
    }

    /// The same limit of a difference that is greater by a number.
    fn shifted(self, by: i64) -> Limit {
        if self == NONE {
            NONE
        } else {
            Limit(self.0 + 2 * by)
        }
    }

    fn weak(self) -> Limit {
        Limit(self.0 | 1)
    }

    fn strict(self) -> Limit {
        if self == NONE {
            NONE
        } else {
            Limit(self.0 & !1)
        }
    }
}

fn sum(one: Limit, other: Limit) -> Limit {
    if one == NONE || other == NONE {
        return NONE;
    }
    Limit(one.0 + other.0 - ((one.0 | other.0) & 1))
}

/// A comparison `x_left - x_right ≺ bound` of clocks by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Comparison {
    left: u16,
    right: u16,
    limit: Limit,
}

impl Comparison {
    pub(super) fn new(left: usize, right: usize, bound: i64, is_strict: bool) -> Comparison {
        Comparison {
            left: left as u16,
            right: right as u16,
            limit: Limit::new(bound, is_strict),
        }
    }

    pub(super) fn left(self) -> usize {
        self.left.into()
    }

    pub(super) fn right(self) -> usize {
        self.right.into()
    }

    pub(super) fn bound(self) -> i64 {
        self.limit.0 >> 1
    }

    pub(super) fn is_strict(self) -> bool {
        self.limit.is_strict()
    }

    /// The comparison that holds where this one fails.
    pub(super) fn negated(self) -> Comparison {
        Comparison::new(self.right(), self.left(), -self.bound(), !self.is_strict())
    }

    /// What it says before the assignments if it is to hold after them.
    pub(super) fn before(self, assignments: &[EmittedAssignment]) -> Comparison {
        let mut one = self;
        for assignment in assignments.iter().rev() {
            let (target, source) = (assignment.target.0 as u16, assignment.source.0 as u16);
            let value = i64::from(assignment.value);
            if one.left == target {
                (one.left, one.limit) = (source, one.limit.shifted(-value));
            }
            if one.right == target {
                (one.right, one.limit) = (source, one.limit.shifted(value));
            }
        }
        one
    }

    /// The comparison of what is true at all moments shortly after the values at hand.
    pub(super) fn just_after(self) -> Comparison {
        let limit = match (self.left, self.right) {
            (0, 0) => self.limit,
            (_, 0) => self.limit.strict(),
            (0, _) => self.limit.weak(),
            _ => self.limit,
        };
        Comparison { limit, ..self }
    }

    /// If it is an upper limit of a clock, the same with its end.
    pub(super) fn with_end(self) -> Comparison {
        match (self.left, self.right) {
            (0, _) | (_, 1..) => self,
            _ => Comparison {
                limit: self.limit.weak(),
                ..self
            },
        }
    }

    /// If it is an upper limit of a clock that is reached: that it is.
    pub(super) fn at_end(self) -> Option<Comparison> {
        let is_reached = self.left != 0 && self.right == 0 && !self.is_strict();
        is_reached.then(|| Comparison::new(0, self.left(), -self.bound(), false))
    }

    /// Whether it holds for clock values in ticks.
    pub(super) fn holds(self, clocks: &[i64], ticks_per_unit: i64) -> bool {
        let difference = clocks[self.left()] - clocks[self.right()];
        let bound = self.bound() * ticks_per_unit;
        difference < bound || (!self.is_strict() && difference == bound)
    }
}

impl From<&FixedConstraint> for Comparison {
    fn from(one: &FixedConstraint) -> Comparison {
        Comparison::new(
            one.left.0 as usize,
            one.right.0 as usize,
            one.bound.into(),
            one.strict,
        )
    }
}

/// Whether what a zone becomes while time passes is a zone when the clocks of `stopped` keep their
/// values: if none does, or if only one runs.
pub(super) fn is_exact(stopped: &[bool]) -> bool {
    let running = stopped.iter().skip(1).filter(|&&is_stopped| !is_stopped);
    !stopped.contains(&true) || running.count() <= 1
}

/// A convex set of clock values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Zone {
    clocks: usize,
    limits: Vec<Limit>,
    is_empty: bool,
}

impl Zone {
    /// All values from 0; the number of clocks includes the reference clock.
    pub(super) fn universe(clocks: usize) -> Zone {
        let mut zone = Zone {
            clocks,
            limits: vec![NONE; clocks * clocks],
            is_empty: false,
        };
        for clock in 0..clocks {
            *zone.at(clock, clock) = ZERO;
            *zone.at(0, clock) = ZERO;
        }
        zone
    }

    fn at(&mut self, left: usize, right: usize) -> &mut Limit {
        &mut self.limits[left * self.clocks + right]
    }

    fn get(&self, left: usize, right: usize) -> Limit {
        self.limits[left * self.clocks + right]
    }

    /// Whether it contains no values.
    pub(super) fn is_empty(&self) -> bool {
        self.is_empty
    }

    /// Tightens every bound to the least sum over a third clock.
    fn close(&mut self) {
        cancellation::work(self.clocks * self.clocks * self.clocks);
        for via in 0..self.clocks {
            for left in 0..self.clocks {
                for right in 0..self.clocks {
                    let detour = sum(self.get(left, via), self.get(via, right));
                    if detour < self.get(left, right) {
                        *self.at(left, right) = detour;
                    }
                }
            }
        }
        self.is_empty |= (0..self.clocks).any(|clock| self.get(clock, clock) < ZERO);
    }

    /// Tightens one bound of a closed zone, and every other one by the least sum that goes through
    /// it.
    fn tighten(&mut self, one: Comparison) {
        let (from, to) = (one.left(), one.right());
        if one.limit >= self.get(from, to) {
            return;
        }
        cancellation::work(self.clocks * self.clocks);
        if sum(one.limit, self.get(to, from)) < ZERO {
            self.is_empty = true;
            return;
        }
        *self.at(from, to) = one.limit;
        for left in 0..self.clocks {
            let start = sum(self.get(left, from), one.limit);
            if start == NONE {
                continue;
            }
            for right in 0..self.clocks {
                let detour = sum(start, self.get(to, right));
                if detour < self.get(left, right) {
                    *self.at(left, right) = detour;
                }
            }
        }
    }

    /// The part in which all comparisons hold, those of a clock with itself included.
    pub(super) fn within(&self, comparisons: impl IntoIterator<Item = Comparison>) -> Zone {
        let mut part = self.clone();
        part.constrain(comparisons);
        part
    }

    /// Leaves the part in which all comparisons hold.
    pub(super) fn constrain(&mut self, comparisons: impl IntoIterator<Item = Comparison>) {
        for one in comparisons {
            if self.is_empty {
                break;
            }
            self.tighten(one);
        }
    }

    /// Whether a comparison holds everywhere in it.
    pub(super) fn implies(&self, one: Comparison) -> bool {
        self.is_empty || self.get(one.left(), one.right()) <= one.limit
    }

    /// Whether a comparison holds nowhere in it.
    fn refutes(&self, one: Comparison) -> bool {
        self.is_empty || sum(one.limit, self.get(one.right(), one.left())) < ZERO
    }

    /// Whether no values in it satisfy all comparisons, which are a conjunction.
    pub(super) fn misses(&self, conjunction: &[Comparison]) -> bool {
        conjunction.iter().any(|&one| self.refutes(one))
            || self.within(conjunction.iter().copied()).is_empty
    }

    /// Whether all comparisons hold everywhere in it.
    pub(super) fn is_inside(&self, conjunction: &[Comparison]) -> bool {
        conjunction.iter().all(|&one| self.implies(one))
    }

    /// The bounds that say something, as comparisons; that no clock is below 0 is understood.
    pub(super) fn comparisons(&self) -> Vec<Comparison> {
        let mut found = Vec::new();
        for left in 0..self.clocks {
            for right in (0..self.clocks).filter(|&right| right != left) {
                let limit = self.get(left, right);
                if limit != NONE && (left != 0 || limit != ZERO) {
                    found.push(Comparison {
                        left: left as u16,
                        right: right as u16,
                        limit,
                    });
                }
            }
        }
        found
    }

    /// What both contain.
    pub(super) fn intersection(&self, other: &Zone) -> Zone {
        let mut both = self.within(other.comparisons());
        both.is_empty |= other.is_empty;
        both
    }

    /// What is left without the other zone: disjoint parts.
    pub(super) fn without(&self, other: &Zone) -> Vec<Zone> {
        if other.is_empty {
            return (!self.is_empty).then(|| self.clone()).into_iter().collect();
        }
        self.without_conjunction(&other.comparisons())
    }

    /// What is left without the values that satisfy all comparisons: disjoint parts.
    pub(super) fn without_conjunction(&self, conjunction: &[Comparison]) -> Vec<Zone> {
        if self.misses(conjunction) {
            return (!self.is_empty).then(|| self.clone()).into_iter().collect();
        }
        let mut parts = Vec::new();
        let mut rest = self.clone();
        for &one in conjunction {
            if !rest.implies(one) {
                parts.push(rest.within([one.negated()]));
                rest.tighten(one);
            }
        }
        parts
    }

    /// Whether the others together contain it.
    pub(super) fn is_covered(&self, others: &[Zone]) -> bool {
        if self.is_empty {
            return true;
        }
        let Some((first, others)) = others.split_first() else {
            return false;
        };
        self.without(first)
            .iter()
            .all(|part| part.is_covered(others))
    }

    /// The zone after time has passed, while the clocks of `stopped` keep their values. It is exact
    /// where [`is_exact`] says so, and otherwise the least zone that contains the result.
    pub(super) fn future(&self, stopped: &[bool]) -> Zone {
        let mut later = self.clone();
        for clock in (1..self.clocks).filter(|&clock| !stopped[clock]) {
            // Against what stands still, a clock that runs gets ever greater.
            for still in (0..self.clocks).filter(|&still| still == 0 || stopped[still]) {
                *later.at(clock, still) = NONE;
            }
        }
        later.close();
        later
    }

    /// What becomes it while time passes and the clocks of `stopped` keep their values; where
    /// [`is_exact`] says so.
    pub(super) fn past(&self, stopped: &[bool]) -> Zone {
        let mut before = self.clone();
        for clock in (1..self.clocks).filter(|&clock| !stopped[clock]) {
            *before.at(0, clock) = ZERO;
            for still in (1..self.clocks).filter(|&still| stopped[still]) {
                *before.at(still, clock) = NONE;
            }
        }
        before.close();
        before
    }

    /// What becomes it while time passes for all clocks.
    pub(super) fn earlier(&self) -> Zone {
        let mut before = self.clone();
        for clock in 1..self.clocks {
            // How far it can go back is limited by the others alone, which stay at least 0.
            let others = (1..self.clocks).map(|other| self.get(other, clock));
            *before.at(0, clock) = others.fold(ZERO, Limit::min);
        }
        before
    }

    /// The values from which every short enough wait leads into it.
    pub(super) fn just_after(&self) -> Vec<Comparison> {
        let comparisons = self.comparisons().into_iter();
        comparisons.map(Comparison::just_after).collect()
    }

    /// The values that a wait of any short length leads to from within it.
    pub(super) fn just_before(&self) -> Zone {
        let mut zone = self.clone();
        for clock in 1..self.clocks {
            *zone.at(clock, 0) = self.get(clock, 0).weak();
            *zone.at(0, clock) = self.get(0, clock).strict();
        }
        zone.close();
        zone
    }

    /// What it becomes by the assignments; what would make a clock negative is left out.
    pub(super) fn after(&self, assignments: &[EmittedAssignment]) -> Zone {
        let mut zone = self.clone();
        for one in assignments {
            let (target, source) = (one.target.0 as usize, one.source.0 as usize);
            let value = i64::from(one.value);
            // source + value >= 0
            zone.constrain([Comparison::new(0, source, value, false)]);
            if zone.is_empty {
                break;
            }
            let row: Vec<Limit> = (0..self.clocks)
                .map(|other| zone.get(source, other).shifted(value))
                .collect();
            let column: Vec<Limit> = (0..self.clocks)
                .map(|other| zone.get(other, source).shifted(-value))
                .collect();
            for other in (0..self.clocks).filter(|&other| other != target) {
                *zone.at(target, other) = row[other];
                *zone.at(other, target) = column[other];
            }
        }
        zone
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::ClockId;

    /// Ticks in a unit: short waits are one tick, and all values looked at are even.
    const UNIT: i64 = 4;

    /// A generator of numbers: the multiplicative one of Park and Miller.
    struct Numbers(u64);

    impl Numbers {
        fn below(&mut self, most: u64) -> u64 {
            self.0 = self.0 * 48_271 % 2_147_483_647;
            self.0 % most
        }

        fn comparison(&mut self) -> Comparison {
            let (left, right) = (self.below(3) as usize, self.below(3) as usize);
            let bound = self.below(7) as i64 - 3;
            Comparison::new(left, right, bound, self.below(2) == 0)
        }

        fn zone(&mut self) -> Zone {
            let count = self.below(4);
            Zone::universe(3).within((0..count).map(|_| self.comparison()))
        }
    }

    fn has(zone: &Zone, clocks: &[i64]) -> bool {
        let all = zone.comparisons();
        !zone.is_empty() && all.iter().all(|one| one.holds(clocks, UNIT))
    }

    /// Values of two clocks from 0 to 4 units, in half units.
    fn points() -> impl Iterator<Item = [i64; 3]> {
        (0..=8).flat_map(|x| (0..=8).map(move |y| [0, 2 * x, 2 * y]))
    }

    fn later(point: [i64; 3], ticks: i64) -> [i64; 3] {
        [point[0], point[1] + ticks, point[2] + ticks]
    }

    #[test]
    fn operations_do_with_zones_what_they_do_with_each_value() {
        let mut numbers = Numbers(1);
        for _ in 0..400 {
            let (zone, other) = (numbers.zone(), numbers.zone());
            if zone.is_empty() || other.is_empty() {
                continue;
            }
            let target = ClockId(1 + numbers.below(2) as u32);
            let assignment = EmittedAssignment {
                target,
                source: ClockId(numbers.below(3) as u32),
                value: numbers.below(4) as i32 - 1,
            };
            let rest = zone.without(&other);
            let earlier = zone.earlier();
            let before = zone.just_before();
            let after = zone.after(&[assignment]);
            let follows = zone.just_after();
            for point in points() {
                let is_inside = has(&zone, &point);
                let left = rest.iter().any(|part| has(part, &point));
                assert_eq!(left, is_inside && !has(&other, &point));
                let waits = (0..40).any(|ticks| has(&zone, &later(point, ticks)));
                assert_eq!(has(&earlier, &point), waits, "{zone:?} {point:?}");
                let soon = has(&zone, &later(point, 1));
                let says = follows.iter().all(|one| one.holds(&point, UNIT));
                assert_eq!(says, soon, "{zone:?} {point:?}");
                let was = point[1..].iter().all(|&value| value > 0);
                let was = was && has(&zone, &later(point, -1));
                assert_eq!(has(&before, &point), was, "{zone:?} {point:?}");
                let mut moved = point;
                let value =
                    point[assignment.source.0 as usize] + UNIT * i64::from(assignment.value);
                moved[target.0 as usize] = value;
                if is_inside && value >= 0 {
                    assert!(has(&after, &moved), "{zone:?} {assignment:?} {point:?}");
                }
            }
            // What the assignment leads to has been led to.
            for point in points().filter(|point| has(&after, point)) {
                let from = (0..=48).map(|value| {
                    let mut from = point;
                    from[target.0 as usize] = value;
                    from
                });
                let leads = |from: &[i64; 3]| {
                    let source = from[assignment.source.0 as usize];
                    let value = source + UNIT * i64::from(assignment.value);
                    has(&zone, from) && value == point[target.0 as usize]
                };
                assert!(
                    from.into_iter().any(|from| leads(&from)),
                    "{zone:?} {assignment:?}"
                );
            }
        }
    }
}
