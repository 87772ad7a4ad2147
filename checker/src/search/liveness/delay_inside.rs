//! How a run stays inside a predicate in one state.
//!
//! Where the predicate holds only in a part of a zone, that part is cut out exactly
//! ([`crate::zones::future`]), so that a delay never crosses its outside. With stopped clocks a
//! delay may cross it. If two other clocks run, a wait that makes something possible later may also
//! count as being stuck. Every doubt counts as a run, so the answer that there is none is certain.

use crate::ir::Predicate;
use crate::network::{Extent, Failure, Moves, Symbolic};
use crate::zones::dbm::{self, Constraint};
use crate::zones::future::{self, Barriers};
use crate::zones::{Bound, ClockSet, Federation, Zone};

use super::ending::RunEnding;

/// The part of a state that a run inside the predicate can reach.
pub(super) struct Inside {
    /// Its zones before extrapolation; if a run can end in it, the zones in which it can.
    pub(super) zones: Vec<Zone>,
    /// Whether a run can end in it.
    pub(super) ending: Option<RunEnding>,
    /// Whether a doubt was counted as a run.
    pub(super) is_coarse: bool,
}

/// How a run enters a state.
#[derive(Clone, Copy, Debug)]
pub struct Entry<'z> {
    /// The zone before time passes.
    pub zone: &'z Zone,
    /// Whether time runs already, if the zone lies in an open part of a barrier.
    pub is_running: bool,
}

impl<'z> Entry<'z> {
    /// The entry by a move, or at the start.
    pub(super) fn at(zone: &'z Zone) -> Entry<'z> {
        Entry {
            zone,
            is_running: false,
        }
    }
}

/// Finds what runs inside a predicate can reach by delay.
#[derive(Debug)]
pub(super) struct Delays<'p> {
    keep: &'p Predicate,
    /// The moves of a state, and the words after one of them.
    moves: Moves,
    target: Vec<i32>,
}

impl<'p> Delays<'p> {
    /// For runs inside this predicate.
    pub(super) fn inside(keep: &'p Predicate) -> Delays<'p> {
        Delays {
            keep,
            moves: Moves::default(),
            target: Vec::new(),
        }
    }

    /// What a run can reach by delay from its entry into a state.
    pub(super) fn from(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        entry: Entry<'_>,
        invariant: &[Constraint],
    ) -> Result<Inside, Failure> {
        let keep = self.keep;
        let dimension = symbolic.dimension();
        let may_delay = symbolic.may_delay(words)?;
        let mut whole = entry.zone.clone();
        symbolic.delay(words, may_delay, invariant, whole.bounds_mut())?;
        let outside = match symbolic.extent(keep, words, whole.bounds())? {
            Extent::Nowhere => {
                return Ok(Inside {
                    zones: Vec::new(),
                    ending: None,
                    is_coarse: false,
                });
            }
            Extent::Everywhere if self.goes_on(symbolic, words, &whole, may_delay)? => {
                return Ok(Inside {
                    zones: vec![whole],
                    ending: None,
                    is_coarse: false,
                });
            }
            Extent::Everywhere => Federation::empty(dimension),
            Extent::Part(part) => Federation::of_zone(dimension, whole.bounds()).minus(&part),
        };
        let passage = Passage::new(symbolic, keep, words, whole, outside)?;
        let mut inside = passage.reached(entry.zone, entry.is_running);
        inside.reduce();
        let end = passage.end(symbolic, words, &inside)?;
        let (ending, part) = match end {
            Some((ending, part)) => (Some(ending), part),
            None => (None, inside),
        };
        Ok(Inside {
            zones: part.to_zones().collect(),
            ending,
            is_coarse: passage.is_coarse(),
        })
    }

    /// Why a run may end in a zone that no wait leaves, in all of which the predicate holds, and
    /// from which of its valuations.
    pub(super) fn end_in(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
        may_delay: bool,
    ) -> Result<Option<(RunEnding, Federation)>, Failure> {
        if self.goes_on(symbolic, words, zone, may_delay)? {
            return Ok(None);
        }
        let dimension = zone.dimension();
        let (inside, outside) = (
            Federation::of_zone(dimension, zone.bounds()),
            Federation::empty(dimension),
        );
        let passage = Passage::new(symbolic, self.keep, words, zone.clone(), outside)?;
        passage.end(symbolic, words, &inside)
    }

    /// Where in a zone the predicate holds.
    pub(super) fn extent(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Extent, Failure> {
        symbolic.extent(self.keep, words, zone)
    }

    /// Whether it is easy to see that no run ends in a state, in all of which the predicate holds:
    /// time is bounded, and one move is possible everywhere, or after a wait, or wherever an
    /// invariant stops time some move is. Most states are so.
    fn goes_on(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        whole: &Zone,
        may_delay: bool,
    ) -> Result<bool, Failure> {
        let stopped = symbolic.stopped(words)?;
        let (bounds, dimension) = (whole.bounds(), whole.dimension());
        let is_bounded = !may_delay || dbm::is_delay_bounded(bounds, dimension, &stopped);
        if symbolic.has_barriers() || !stopped.is_empty() || !is_bounded {
            return Ok(false);
        }
        symbolic.moves_within(words, bounds, &mut self.moves)?;
        self.target.resize(words.len(), 0);
        let mut ends: Option<Vec<Zone>> = None;
        for one in self.moves.iter() {
            let Some(effect) = symbolic.fire_within(one, words, bounds, &mut self.target)? else {
                continue;
            };
            if effect.keeps_all_of(whole) {
                return Ok(true);
            }
            if !may_delay {
                continue;
            }
            if let Some(mut part) = effect.guarded_part(whole) {
                part.down(&stopped);
                if whole.is_subset(&part) {
                    return Ok(true);
                }
            }
            if ends.is_none() {
                ends = Some(ends_of_time(symbolic, words, whole)?);
            }
            if let Some(ends) = &mut ends
                && !ends.is_empty()
            {
                ends.retain(|end| !effect.keeps_all_of(end));
                if ends.is_empty() {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }
}

/// The parts of a zone, which no wait leaves but all waits are bounded, in which an invariant lets
/// no more time pass. All waits lead into them; there are none if invariants do not say so.
fn ends_of_time(
    symbolic: &mut Symbolic<'_>,
    words: &mut [i32],
    whole: &Zone,
) -> Result<Vec<Zone>, Failure> {
    let mut ends = Vec::new();
    for Constraint { left, right, bound } in symbolic.invariant(words)?.unwrap_or_default() {
        if left == 0 || right != 0 {
            continue;
        }
        let Some(reached) = Bound::weak(-bound.value()).filter(|_| !bound.is_strict()) else {
            return Ok(Vec::new());
        };
        let mut end = whole.clone();
        if end.constrain(0, left, reached) {
            ends.push(end);
        }
    }
    Ok(ends)
}

/// The valuations of a state inside the predicate from which time can pass without limit, and those
/// from which no wait leads to a move or out of the predicate. Where clocks stand still, both sets
/// may be too small. `whole` is what the invariants allow.
pub(in crate::search) fn endings(
    symbolic: &mut Symbolic<'_>,
    keep: &Predicate,
    words: &mut [i32],
    whole: Zone,
) -> Result<(Federation, Federation), Failure> {
    let dimension = whole.dimension();
    let inside = symbolic.part(keep, words, &whole)?;
    let outside = Federation::of_zone(dimension, whole.bounds()).minus(&inside);
    let mut passage = Passage::new(symbolic, keep, words, whole, outside)?;
    passage.counts_doubts = false;
    let stuck = passage.stuck(symbolic, words, &inside)?;
    Ok((passage.waiting(&inside), stuck))
}

/// How a run inside a predicate passes through a state.
struct Passage {
    /// All that delay within the invariants reaches.
    whole: Zone,
    /// The part of it in which the predicate does not hold.
    outside: Federation,
    /// Where the result of a delay is searched, and where the predicate does not hold there. The
    /// set is the same one; but if a clock stands still while two others run, it is all that the
    /// invariants allow. A set whose comparisons never concern such clocks has an exact past there.
    frame: Zone,
    left: Federation,
    /// The part of it in which an urgent synchronisation or a restriction stops time.
    barriers: Barriers,
    may_delay: bool,
    stopped: ClockSet,
    /// Whether a doubt counts as staying; else as leaving.
    counts_doubts: bool,
}

impl Passage {
    fn new(
        symbolic: &mut Symbolic<'_>,
        keep: &Predicate,
        words: &mut [i32],
        whole: Zone,
        outside: Federation,
    ) -> Result<Passage, Failure> {
        let may_delay = symbolic.may_delay(words)?;
        let dimension = whole.dimension();
        let stopped = symbolic.stopped(words)?;
        let (mut frame, mut left) = (whole.clone(), outside.clone());
        if has_inexact_pasts(&stopped, dimension) {
            frame = Zone::universe(dimension);
            frame.constrain_all(&symbolic.invariant(words)?.unwrap_or_default());
            let inside = symbolic.part(keep, words, &frame)?;
            left = Federation::of_zone(dimension, frame.bounds()).minus(&inside);
        }
        Ok(Passage {
            barriers: if may_delay {
                symbolic.barriers(words, whole.bounds())?
            } else {
                Barriers::none(whole.dimension())
            },
            stopped,
            whole,
            outside,
            frame,
            left,
            may_delay,
            counts_doubts: true,
        })
    }

    /// The valuations from which time leads into a part of the frame. If that is not known, the
    /// result is the part alone if doubts count as staying, and otherwise a larger set.
    fn past(&self, part: &Federation) -> Federation {
        let dimension = part.dimension();
        let mut past = part.clone();
        if !self.counts_doubts || !has_inexact_pasts(&self.stopped, dimension) {
            past.down(&self.stopped);
            return past;
        }
        for zone in part.zones() {
            if is_straight(zone, dimension, &self.stopped) {
                let mut one = Federation::of_zone(dimension, zone);
                one.down(&self.stopped);
                past.unite(&one);
            }
        }
        past
    }

    /// What delay reaches inside the predicate.
    fn reached(&self, entry: &Zone, is_running: bool) -> Federation {
        let dimension = self.whole.dimension();
        let mut reached = Federation::of_zone(dimension, self.whole.bounds());
        if !self.may_delay || !self.stopped.is_empty() {
            reached.subtract(&self.outside);
        } else if !self.outside.is_empty() || !self.barriers.is_empty() {
            let from = Federation::of_zone(dimension, entry.bounds());
            reached = future::successors(&from, &self.outside, &self.barriers);
            if is_running {
                let on = future::successors_inside(&from, &self.outside, &self.barriers);
                reached.unite(&on);
            }
            reached.intersect_zone(self.whole.bounds());
        }
        reached
    }

    /// Whether the state is treated as if more runs stayed in it than really do.
    fn is_coarse(&self) -> bool {
        let is_crossed = !self.stopped.is_empty() && !self.outside.is_empty();
        self.may_delay && (is_crossed || has_inexact_pasts(&self.stopped, self.whole.dimension()))
    }

    /// Why a run may end in the reached part, and from which of its valuations.
    fn end(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        inside: &Federation,
    ) -> Result<Option<(RunEnding, Federation)>, Failure> {
        if inside.is_empty() {
            return Ok(None);
        }
        let waiting = self.waiting(inside);
        if !waiting.is_empty() {
            return Ok(Some((RunEnding::Waits, waiting)));
        }
        let stuck = self.stuck(symbolic, words, inside)?;
        Ok((!stuck.is_empty()).then_some((RunEnding::Stuck, stuck)))
    }

    /// The valuations of the reached part from which time can pass without limit.
    fn waiting(&self, inside: &Federation) -> Federation {
        let dimension = self.whole.dimension();
        let is_bounded = dbm::is_delay_bounded(self.whole.bounds(), dimension, &self.stopped);
        if !self.may_delay || is_bounded {
            return Federation::empty(dimension);
        }
        let mut waiting = inside.clone();
        let mut leaving = self.left.clone();
        leaving.unite(&self.barriers.stops);
        waiting.subtract(&self.past(&leaving));
        waiting
    }

    /// The valuations of the reached part from which no wait leads to a move or out of the
    /// predicate.
    fn stuck(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        inside: &Federation,
    ) -> Result<Federation, Failure> {
        let dimension = self.whole.dimension();
        let mut moves = Moves::default();
        symbolic.moves_within(words, self.whole.bounds(), &mut moves)?;
        let mut exits = self.left.clone();
        let mut target = words.to_vec();
        for one in moves.iter() {
            let whole = self.whole.bounds();
            if let Some(effect) = symbolic.fire_within(one, words, whole, &mut target)? {
                exits.unite(&effect.enabled_part(self.frame.bounds(), dimension));
                if inside.is_subset(&exits) {
                    return Ok(Federation::empty(dimension));
                }
            }
        }
        if self.may_delay && self.barriers.is_empty() {
            exits = self.past(&exits);
        } else if self.may_delay {
            exits = future::predecessors_within(&exits, &self.barriers);
        }
        let stuck = inside.clone().minus(&exits);
        Ok(stuck)
    }
}

/// Whether the past of a zone may be no zone: a clock stands still while two others run.
fn has_inexact_pasts(stopped: &ClockSet, dimension: usize) -> bool {
    !stopped.is_empty() && dimension - 1 > stopped.len() + 1
}

/// Whether the past of this zone is a zone: its bounds on differences between running and stopped
/// clocks follow from those on each clock.
fn is_straight(zone: &[Bound], dimension: usize, stopped: &ClockSet) -> bool {
    let implied = |left: usize, right: usize| {
        zone[left * dimension + right] >= zone[left * dimension] + zone[right]
    };
    let mut running = (1..dimension).filter(|&clock| !stopped.contains(clock));
    running.all(|runs| {
        let mut stands = stopped
            .iter()
            .filter(|&clock| clock > 0 && clock < dimension);
        stands.all(|stands| implied(runs, stands) && implied(stands, runs))
    })
}
