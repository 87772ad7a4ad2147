//! What may happen in a discrete state, by clock values: the moves of the controller, where it may
//! wait, and where time passes.

use crate::game::strategy::closed_loop::ClosedLoop;
use crate::ir::{ProcessId, Urgency};
use crate::network::{
    Allowed, Failure, MoveRef, Moves, Part, Restriction as _, Symbolic, entry_of, is_same_entry,
};
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, ClockSet, Federation, Zone, instants};

/// What may happen in a discrete state.
pub(super) struct Scene {
    /// All valuations that satisfy the invariants.
    pub(super) whole: Federation,
    /// The moves of the controller by what it chooses: the edge of the sender.
    pub(super) entries: Vec<Entry>,
    /// Where it may let time pass, or leave it to others to move.
    pub(super) may_wait: Federation,
    /// Where it may do so for sure. Elsewhere this depends on whether the delay of somebody else is
    /// over.
    pub(super) surely: Federation,
}

/// What the controller chooses.
pub(super) struct Entry {
    /// The edge of the sender, as strategies name it.
    pub(super) part: Part,
    /// The moves, each with the part in which it is possible.
    pub(super) moves: Vec<(Vec<Part>, Federation)>,
    /// Where one of them is possible.
    pub(super) region: Federation,
}

impl Scene {
    /// What may happen in the state with these words, within a strategy; `None` if the invariants
    /// never hold, or the controller has no moves.
    pub(super) fn new(
        symbolic: &mut Symbolic<'_>,
        under: Option<&ClosedLoop>,
        words: &mut [i32],
    ) -> Result<Option<Scene>, Failure> {
        let dimension = symbolic.dimension();
        let Some(invariant) = symbolic.invariant(words)? else {
            return Ok(None);
        };
        let hull = Zone::of_constraints(dimension, &invariant);
        if hull.is_empty() {
            return Ok(None);
        }
        let mut moves = Moves::default();
        symbolic.moves(words, &mut moves)?;
        let is_own = |one: &MoveRef<'_>| {
            let sender = &one.parts[0];
            let process = &symbolic.stepper.network().processes[sender.process as usize];
            process.edges[sender.edge as usize].controllable
        };
        let is_own: Vec<bool> = moves.iter().map(|one| is_own(&one)).collect();
        if !is_own.contains(&true) {
            return Ok(None);
        }
        let whole = Federation::of_zone(dimension, hull.bounds());
        let allowed = under.and_then(|under| under.allowed(words));
        let mut gathered = Gathered {
            entries: Vec::new(),
            others: Federation::empty(dimension),
            ready: Federation::empty(dimension),
        };
        for (one, is_own) in moves.iter().zip(is_own) {
            let region = region(symbolic, one, words, &hull)?;
            if region.is_empty() {
                continue;
            }
            if is_own {
                gathered.add_own(symbolic, one, region, allowed.as_deref());
            } else {
                gathered.add_other(symbolic, one, &region, words, &invariant);
            }
        }
        let mut still = if symbolic.may_delay(words)? {
            whole
                .clone()
                .minus(&instants::before(&whole, &ClockSet::EMPTY))
        } else {
            whole.clone()
        };
        if symbolic.has_guarded_urgency() {
            still.unite(&symbolic.urgent_part(words, hull.bounds())?);
        }
        let passes = whole.clone().minus(&still);
        let waits = |others: &Federation| {
            let mut waits = passes.clone();
            waits.unite(others);
            match &allowed {
                Some(allowed) => waits.minus(&allowed.barriers.stops),
                None => waits,
            }
        };
        let (may_wait, surely) = (waits(&gathered.others), waits(&gathered.ready));
        Ok(Some(Scene {
            whole,
            entries: gathered.entries,
            may_wait,
            surely,
        }))
    }
}

/// The moves of a state until now.
struct Gathered {
    entries: Vec<Entry>,
    /// Where others can move.
    others: Federation,
    /// Where the delay of one of them is over.
    ready: Federation,
}

impl Gathered {
    fn add_own(
        &mut self,
        symbolic: &Symbolic<'_>,
        one: MoveRef<'_>,
        mut region: Federation,
        allowed: Option<&Allowed>,
    ) {
        let network = symbolic.stepper.network();
        if let Some(allowed) = allowed.filter(|_| one.controllable) {
            region.subtract(allowed.forbidden(network, &one));
        }
        let part = entry_of(network, &one.parts[..1])[0];
        let known = self.entries.iter().position(|entry| entry.part == part);
        let place = known.unwrap_or_else(|| {
            self.entries.push(Entry {
                part,
                moves: Vec::new(),
                region: Federation::empty(region.dimension()),
            });
            self.entries.len() - 1
        });
        let entry = &mut self.entries[place];
        entry.region.unite(&region);
        let mut known = entry.moves.iter_mut();
        match known.find(|known| is_same_entry(network, &known.0, one.parts)) {
            Some(known) => _ = known.1.unite(&region),
            None => entry.moves.push((one.parts.to_vec(), region)),
        }
    }

    /// Adds a move of somebody else. The delay of a process is over where it cannot stay.
    fn add_other(
        &mut self,
        symbolic: &Symbolic<'_>,
        one: MoveRef<'_>,
        region: &Federation,
        words: &[i32],
        invariant: &[Constraint],
    ) {
        self.others.unite(region);
        let process = ProcessId(one.parts[0].process);
        let network = symbolic.stepper.network();
        let location =
            &network.processes[process.0 as usize].locations[words[process.0 as usize] as usize];
        let is_ready = symbolic.stepper.is_committed(words)
            || location.urgency != Urgency::Normal
            || symbolic.stepper.is_urgent_move(one);
        if is_ready {
            self.ready.unite(region);
            return;
        }
        for atom in &location.invariant.atoms {
            let (clock, bound) = (atom.left.first.0 as usize, Bound::weak(atom.high));
            let is_end =
                |one: &&Constraint| one.left == clock && one.right == 0 && Some(one.bound) == bound;
            if atom.right.has_clock() || atom.left.count != 1 || atom.low != atom.high {
                continue;
            }
            if let Some(end) = invariant.iter().find(is_end) {
                let mut part = region.clone();
                part.constrain_all(&[Constraint {
                    left: 0,
                    right: clock,
                    bound: Bound::weak(-end.bound.value()).expect("it is as small"),
                }]);
                self.ready.unite(&part);
            }
        }
    }
}

/// Where a move is possible, the invariants of its target included. An update that fails says
/// nothing of where: a search that takes the move finds the failure.
fn region(
    symbolic: &mut Symbolic<'_>,
    one: MoveRef<'_>,
    words: &[i32],
    hull: &Zone,
) -> Result<Federation, Failure> {
    let dimension = symbolic.dimension();
    let mut target = words.to_vec();
    match symbolic.fire_within(one, words, hull.bounds(), &mut target) {
        Ok(Some(effect)) => Ok(effect.enabled_part(hull.bounds(), dimension)),
        Ok(None) => Ok(Federation::empty(dimension)),
        Err(Failure::RunTime(_)) => symbolic.guarded_part(one, hull.bounds()),
        Err(failure) => Err(failure),
    }
}
