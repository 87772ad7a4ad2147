//! The successors of a stored state, and of all committed states below it.
//!
//! States with a committed location are explored where they are found. They are stored only if they
//! have a choice, so that successive choices do not multiply. The others are links of a chain; the
//! latest of them are remembered ([`RecentStates`]) and not explored again. Chains that are not
//! short ([`LONGEST_CHAIN`], [`MOST_AT_ONCE`]) are stored after all, so that loops of them end.
//!
//! The [`Sink`] decides where states are stored and when they are explored.

use crate::ir::Urgency;
use crate::network::{Agenda, Failure, KeptZone, KnownZone, Moves, StubbornSets, Symbolic};
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Zone};

use super::canonical::Representative;
use super::goal::{Goal, Look, Visited};
use super::recent::RecentStates;
use crate::search::limits::{Counters, StopReason, Watch};
use crate::search::outcome::Step;
use crate::search::store::packed_zones::Kept;
use crate::search::store::passed_list::PassedList;

/// The greatest number of committed states in a chain that are explored without waiting.
const LONGEST_CHAIN: usize = 64;

/// The greatest number of committed states below one stored state that are explored without
/// waiting.
const MOST_AT_ONCE: u64 = 4096;

/// Takes the states that exploration reaches, with the stored form of their zones (see
/// [`Symbolic::to_stored`]). Paths begin at the state that is being explored.
pub(super) trait Sink {
    /// Stores a state and puts it on the worklist, unless a stored one contains it. Returns whether
    /// it is known to wait now.
    fn add_waiting(&mut self, words: &[i32], zone: Kept<'_>, way: &[Step]) -> bool;

    /// Stores a committed state that has a choice. Returns whether it must be explored at once; it
    /// need not if a stored state contains it.
    fn add_choice(&mut self, words: &[i32], zone: Kept<'_>, way: &[Step]) -> bool;

    /// The states that are stored here.
    fn passed(&mut self) -> &mut PassedList;
}

/// What exploration needs in addition to its own buffers.
pub(super) struct Scene<'x, 'a, S> {
    pub(super) symbolic: &'x mut Symbolic<'a>,
    pub(super) goal: &'x mut dyn Goal,
    pub(super) watch: &'x mut dyn Watch,
    /// The counters when the exploration of the stored state began.
    pub(super) counters: Counters,
    pub(super) sink: &'x mut S,
}

impl<S> Scene<'_, '_, S> {
    /// Asks the goal about a state.
    fn look(&mut self, words: &mut [i32], zone: &Zone) -> Result<Look, Failure> {
        self.goal.look(Visited {
            symbolic: self.symbolic,
            words,
            zone,
            counters: self.counters,
            watch: self.watch,
        })
    }
}

/// The result of exploring a stored state.
pub(super) enum Visit {
    /// It is complete.
    Done,
    /// It stopped as far as was allowed, and can continue.
    Paused,
    /// It reached a state that the search looks for.
    Found,
    /// It reached a limit.
    Stopped(StopReason),
}

/// The result of a move.
enum Taken {
    /// Nothing remains to do: it is impossible, stored, or covered.
    Nothing,
    /// The goal was found in the target.
    Found,
    /// A limit came first.
    Stopped(StopReason),
    /// The target is committed and is explored at once.
    Down,
}

/// A state on the stack of unstored ones.
#[derive(Debug)]
struct Frame {
    words: Vec<i32>,
    zone: Zone,
    /// The number by which moves from the zone can be looked up.
    known: Option<KnownZone>,
    moves: Moves,
    /// The order in which moves are taken, and whether all are.
    agenda: Agenda,
    /// The place of the next move in it.
    next: usize,
}

/// Explores one stored state after the other.
#[derive(Debug)]
pub(super) struct Explorer {
    /// The latest committed states.
    recent: RecentStates,
    keeps_recent: bool,
    frames: Vec<Frame>,
    /// The current frame.
    depth: usize,
    /// The moves from the stored state to the current state.
    way: Vec<Step>,
    entries: Vec<Zone>,
    /// The stored form of a zone that is still needed.
    stored: Vec<Bound>,
    /// What is stored instead of a state, if some states may be exchanged for others.
    representative: Representative,
    /// Whether some location is committed.
    has_committed: bool,
    /// Finds moves that are enough.
    stubborn: Option<StubbornSets>,
    /// Whether the current move is possible in the whole zone and leads to states that are still to
    /// be explored.
    leads_on: bool,
    explored: u64,
    /// The value of `explored` when the exploration of the stored state began.
    explored_before: u64,
}

impl Explorer {
    pub(super) fn new(symbolic: &mut Symbolic<'_>, goal: &dyn Goal) -> Explorer {
        symbolic.need_entered(goal.depends_on_zones());
        let network = symbolic.stepper.network();
        let order = symbolic.order().cloned();
        Explorer {
            stubborn: order.map(|order| StubbornSets::new(network, order)),
            leads_on: false,
            recent: RecentStates::new(),
            keeps_recent: symbolic.tuning().recent_states,
            frames: Vec::new(),
            depth: 0,
            way: Vec::new(),
            entries: Vec::new(),
            stored: Vec::new(),
            representative: Representative::default(),
            has_committed: network.processes.iter().any(|process| {
                let mut locations = process.locations.iter();
                locations.any(|location| location.urgency == Urgency::Committed)
            }),
            explored: 0,
            explored_before: 0,
        }
    }

    /// States whose successors were computed.
    pub(super) fn explored(&self) -> u64 {
        self.explored
    }

    /// The bytes that remembered states and the current states take.
    pub(super) fn bytes(&self) -> usize {
        let frames = self.frames.iter().map(Frame::bytes);
        let entries = self.entries.iter().map(|zone| size_of_val(zone.bounds()));
        let stored = size_of_val(&*self.stored);
        self.recent.bytes() + frames.chain(entries).sum::<usize>() + stored
    }

    /// The moves from the stored state to the current state.
    pub(super) fn way(&self) -> &[Step] {
        &self.way
    }

    /// Begins with a stored state, which `load` writes over another one.
    pub(super) fn begin(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        load: impl FnOnce(&mut [i32], &mut [Bound]),
    ) -> Result<(), Failure> {
        self.way.clear();
        self.explored_before = self.explored;
        self.depth = 0;
        if self.frames.is_empty() {
            self.frames.push(new_frame(symbolic));
        }
        let frame = &mut self.frames[0];
        load(&mut frame.words, frame.zone.bounds_mut());
        frame.known = None;
        symbolic.from_stored(&frame.words, frame.zone.bounds_mut());
        self.explored += 1;
        open(symbolic, &mut self.stubborn, frame)
    }

    /// Continues the exploration that has begun, until this many moves are used up.
    pub(super) fn explore<S: Sink>(
        &mut self,
        scene: &mut Scene<'_, '_, S>,
        moves: &mut u64,
    ) -> Result<Visit, Failure> {
        let mut frames = std::mem::take(&mut self.frames);
        let result = self.explore_frames(&mut frames, scene, moves);
        self.frames = frames;
        result
    }

    fn explore_frames<S: Sink>(
        &mut self,
        frames: &mut Vec<Frame>,
        scene: &mut Scene<'_, '_, S>,
        moves: &mut u64,
    ) -> Result<Visit, Failure> {
        let mut depth = self.depth;
        while *moves > 0 {
            *moves -= 1;
            if frames[depth].is_done() {
                if let Some(stubborn) = &mut self.stubborn {
                    stubborn.count(&frames[depth].agenda);
                }
                if depth == 0 {
                    return Ok(Visit::Done);
                }
                depth -= 1;
                self.way.pop();
                continue;
            }
            if frames.len() == depth + 1 {
                frames.push(new_frame(scene.symbolic));
            }
            let (above, below) = frames.split_at_mut(depth + 1);
            match self.take_next(scene, &mut above[depth], &mut below[0], depth)? {
                Taken::Nothing => self.close(&mut above[depth]),
                Taken::Found => return Ok(Visit::Found),
                Taken::Stopped(reason) => return Ok(Visit::Stopped(reason)),
                Taken::Down => {
                    let frame = &mut frames[depth + 1];
                    self.explored += 1;
                    open(scene.symbolic, &mut self.stubborn, frame)?;
                    if self.is_link_or_new(scene, frame) {
                        self.close(&mut frames[depth]);
                        depth += 1;
                    } else {
                        self.way.pop();
                    }
                }
            }
        }
        self.depth = depth;
        Ok(Visit::Paused)
    }

    /// Leaves out the moves that do not belong to the stubborn set, if the current move makes that
    /// enough.
    fn close(&mut self, frame: &mut Frame) {
        if self.leads_on {
            self.leads_on = false;
            frame.agenda.close();
        }
    }

    /// Stores a committed state that has a choice; returns false if it must not be explored here.
    fn is_link_or_new<S: Sink>(&mut self, scene: &mut Scene<'_, '_, S>, frame: &Frame) -> bool {
        if frame.moves.len() < 2 {
            return true;
        }
        let mut zone = std::mem::take(&mut self.stored);
        zone.clear();
        zone.extend_from_slice(frame.zone.bounds());
        let is_new = self.store(scene, &frame.words, &mut zone, S::add_choice);
        self.stored = zone;
        self.explored -= u64::from(!is_new);
        is_new
    }

    /// Takes the next move of `source`; a committed target is left in `target` to be explored at
    /// once.
    fn take_next<S: Sink>(
        &mut self,
        scene: &mut Scene<'_, '_, S>,
        source: &mut Frame,
        target: &mut Frame,
        depth: usize,
    ) -> Result<Taken, Failure> {
        let one = source.moves.get(source.agenda.index(source.next));
        let may_lead_on = source.agenda.is_open(source.next);
        source.next += 1;
        self.leads_on = false;
        let symbolic = &mut *scene.symbolic;
        if !may_lead_on && symbolic.stays_whole(one, source.zone.bounds()) {
            if !symbolic.may_satisfy(one, source.zone.bounds())? {
                return Ok(Taken::Nothing);
            }
            let Frame { words, zone, .. } = target;
            words.copy_from_slice(&source.words);
            let zone = zone.bounds_mut();
            let kept = if let Some(known) = source.known.filter(|&one| symbolic.is_known(one)) {
                let from = source.zone.bounds();
                let Some(kept) = symbolic.enter_known(one, words, known, from, zone)? else {
                    return Ok(Taken::Nothing);
                };
                Some(kept)
            } else {
                zone.copy_from_slice(source.zone.bounds());
                if !symbolic.take(one, words, zone)? {
                    return Ok(Taken::Nothing);
                }
                symbolic.forget(words);
                symbolic.pass_time(words, zone)?;
                None
            };
            self.way.push(one.rank);
            return self.enter_whole(scene, target, kept, depth);
        }
        let zone = source.zone.bounds();
        let Some(effect) = symbolic.fire_within(one, &source.words, zone, &mut target.words)?
        else {
            return Ok(Taken::Nothing);
        };
        let mut entries = std::mem::take(&mut self.entries);
        effect.entry_zones(zone, symbolic.dimension(), &mut entries);
        if may_lead_on && effect.keeps_all_of(&source.zone) {
            let stubborn = self.stubborn.as_ref();
            if stubborn.is_some_and(|stubborn| stubborn.is_passing(one.parts)) {
                source.agenda.close();
            } else {
                self.leads_on = true;
            }
        }
        self.way.push(one.rank);
        target.known = None;
        let taken = self.enter(scene, &effect.invariant, &mut entries, target, depth);
        self.entries = entries;
        taken
    }

    /// Evaluates the target of a move, whose words and zone with time passed are in `target`, and
    /// stores it or leaves it there.
    fn enter_whole<S: Sink>(
        &mut self,
        scene: &mut Scene<'_, '_, S>,
        target: &mut Frame,
        kept: Option<KeptZone>,
        depth: usize,
    ) -> Result<Taken, Failure> {
        let Frame {
            words, zone, known, ..
        } = target;
        let taken = match scene.look(words, zone)? {
            Look::Found => return Ok(Taken::Found),
            Look::Stopped(reason) => Taken::Stopped(reason),
            Look::Continue => {
                let descends = self.descends(scene.symbolic, words, depth);
                let symbolic = &mut *scene.symbolic;
                let is_reduced = symbolic.keeps_reduced();
                *known = None;
                // The goal may have looked up so many zones that the cache was cleared.
                match kept.filter(|&one| symbolic.is_kept(one)) {
                    Some(kept) if !descends && symbolic.symmetry().is_none() => {
                        let (matrix, limits) = symbolic.kept(kept);
                        let zone = Kept {
                            matrix,
                            limits,
                            known: Some(kept),
                        };
                        scene.sink.add_waiting(words, zone, &self.way);
                        self.way.pop();
                        return Ok(Taken::Nothing);
                    }
                    Some(kept) if !is_reduced => {
                        zone.bounds_mut().copy_from_slice(symbolic.kept(kept).0);
                        *known = symbolic.known_kept(kept);
                    }
                    _ if descends || !is_reduced => symbolic.extrapolate(words, zone.bounds_mut()),
                    _ => {}
                }
                if descends {
                    return Ok(self.descend(scene.sink, words, zone.bounds()));
                }
                self.store(scene, words, zone.bounds_mut(), S::add_waiting);
                Taken::Nothing
            }
        };
        self.way.pop();
        Ok(taken)
    }

    /// Like [`Explorer::enter_whole`], for the zones on entry before time passes; there may be
    /// several.
    fn enter<S: Sink>(
        &mut self,
        scene: &mut Scene<'_, '_, S>,
        invariant: &[Constraint],
        entries: &mut Vec<Zone>,
        target: &mut Frame,
        depth: usize,
    ) -> Result<Taken, Failure> {
        scene.symbolic.forget(&mut target.words);
        scene
            .symbolic
            .let_time_pass(&mut target.words, invariant, entries)?;
        for entry in &*entries {
            match scene.look(&mut target.words, entry)? {
                Look::Continue => {}
                Look::Found => return Ok(Taken::Found),
                Look::Stopped(reason) => return Ok(Taken::Stopped(reason)),
            }
        }
        scene.symbolic.extrapolate_all(&target.words, entries);
        if let [entry] = entries.as_slice()
            && self.descends(scene.symbolic, &target.words, depth)
        {
            target.zone.bounds_mut().copy_from_slice(entry.bounds());
            return Ok(self.descend(scene.sink, &target.words, entry.bounds()));
        }
        for entry in entries {
            let waits = self.store(scene, &target.words, entry.bounds_mut(), S::add_waiting);
            self.leads_on &= waits;
        }
        self.way.pop();
        Ok(Taken::Nothing)
    }

    /// Gives a state, or the state that stands for it, to the sink. The zone is overwritten. It
    /// must have been extrapolated unless it is stored reduced. It must also have been extrapolated
    /// if states may be exchanged, so that it is the same for as many of them as possible.
    fn store<S: Sink>(
        &mut self,
        scene: &mut Scene<'_, '_, S>,
        words: &[i32],
        zone: &mut [Bound],
        add: impl FnOnce(&mut S, &[i32], Kept<'_>, &[Step]) -> bool,
    ) -> bool {
        let (words, zone, way) = match scene.symbolic.symmetry() {
            None => (words, zone, &*self.way),
            Some(symmetry) => {
                let representative = &mut self.representative;
                representative.of(symmetry, words, zone, &self.way)
            }
        };
        let limits = scene.symbolic.to_stored(words, zone);
        let zone = Kept {
            matrix: zone,
            limits,
            known: None,
        };
        add(scene.sink, words, zone, way)
    }

    /// Whether a state must be explored at once and not stored.
    fn descends(&self, symbolic: &Symbolic<'_>, words: &[i32], depth: usize) -> bool {
        self.has_committed
            && depth < LONGEST_CHAIN
            && self.explored - self.explored_before < MOST_AT_ONCE
            && symbolic.stepper.is_committed(words)
    }

    /// Moves down to a committed state, unless it was explored lately.
    fn descend<S: Sink>(&mut self, sink: &mut S, words: &[i32], zone: &[Bound]) -> Taken {
        let passed = sink.passed();
        let stored = passed.len();
        if self.keeps_recent && self.recent.enter(passed.pack(words), zone, stored) {
            self.leads_on = false;
            self.way.pop();
            return Taken::Nothing;
        }
        Taken::Down
    }
}

/// Enters the initial states.
pub(super) fn start<S: Sink>(scene: &mut Scene<'_, '_, S>) -> Result<Look, Failure> {
    let (mut words, zone, invariant) = scene.symbolic.start()?;
    let mut zones = vec![zone];
    scene
        .symbolic
        .let_time_pass(&mut words, &invariant, &mut zones)?;
    for zone in &zones {
        let look = scene.look(&mut words, zone)?;
        if look != Look::Continue {
            return Ok(look);
        }
    }
    scene.symbolic.extrapolate_all(&words, &mut zones);
    for mut zone in zones {
        let limits = scene.symbolic.to_stored(&words, zone.bounds_mut());
        let zone = Kept {
            matrix: zone.bounds(),
            limits,
            known: None,
        };
        scene.sink.add_waiting(&words, zone, &[]);
    }
    Ok(Look::Continue)
}

fn new_frame(symbolic: &Symbolic<'_>) -> Frame {
    Frame {
        words: symbolic.stepper.network().initial.clone(),
        zone: Zone::zero(symbolic.dimension()),
        known: None,
        moves: Moves::default(),
        agenda: Agenda::default(),
        next: 0,
    }
}

/// Finds the moves of a state, and which of them come first.
fn open(
    symbolic: &mut Symbolic<'_>,
    stubborn: &mut Option<StubbornSets>,
    frame: &mut Frame,
) -> Result<(), Failure> {
    frame.next = 0;
    let Frame {
        words,
        zone,
        known,
        moves,
        agenda,
        ..
    } = frame;
    if known.is_none() {
        *known = symbolic.know(zone.bounds());
    }
    symbolic.moves_within(words, zone.bounds(), moves)?;
    if let Some(stubborn) = stubborn {
        stubborn.choose(&mut symbolic.stepper, words, zone, moves, agenda)?;
    }
    Ok(())
}

impl Frame {
    fn bytes(&self) -> usize {
        size_of_val(self.zone.bounds()) + size_of_val(&*self.words) + self.moves.heap_bytes()
    }

    /// Whether all moves that must be taken were taken.
    fn is_done(&self) -> bool {
        self.next >= self.agenda.end(self.moves.len())
    }
}
