//! What a strategy says in a state with exact clock values, and while time passes from there.
//!
//! Between two moves every clock is linear in time, so time runs through each zone of a decision
//! for one *span*. In a span of a move the controller may take it, in one of a wait it may wait;
//! of a strategy whose first decision counts, the first span that contains a moment does. Where
//! there are decisions but no wait, the strategy *demands* a move: time must not pass this moment.
//! If a stretch of time in which it demands one has no first moment, one soon after its beginning
//! is taken.
//!
//! Ends of spans that are as near as conditions of the model count as equal (see
//! `semantics/lower/horizons.rs`) are equal here too, so that a guard and the zone that the solver
//! computed from it agree.

use super::machine::Mask;
use super::restriction::{Case, Entry, Limit, Restriction, UnderChoice};
use crate::game::strategy::Selection;

/// Numbers that differ by less than this part, and less than this, are equal.
const TOLERANCE: f64 = 1e-12;

/// So many tolerances after the beginning of a stretch without a first moment lies the one that is
/// taken for it: few, so that a loop of such moves is still taken for Zeno's.
const SOON: f64 = 5.0;

/// Where a span begins or ends, counted from now.
#[derive(Clone, Copy, Debug)]
struct End {
    at: f64,
    is_open: bool,
    tolerance: f64,
}

impl End {
    fn is_near(&self, at: f64) -> bool {
        (self.at - at).abs() <= self.tolerance
    }
}

/// For how long time runs inside a zone of a decision.
#[derive(Clone, Copy, Debug)]
struct Span {
    /// The index of the move; `None` to wait.
    action: Option<u32>,
    first: End,
    last: End,
}

impl Span {
    /// Whether a moment lies in it, or, `behind` it, the open interval that begins there.
    fn contains(&self, at: f64, behind: bool) -> bool {
        let End {
            at: first,
            is_open,
            tolerance,
        } = self.first;
        let has_begun = if is_open && !behind {
            at > first + tolerance
        } else {
            at >= first - tolerance
        };
        let End {
            at: last,
            is_open,
            tolerance,
        } = self.last;
        has_begun
            && if is_open || behind {
                at < last - tolerance
            } else {
                at <= last + tolerance
            }
    }
}

/// Which moves are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum View {
    /// Those that the model has, whatever the strategy says.
    Model,
    /// Those that a delay is drawn for: before the strategy demands a move, and not after this
    /// time.
    Drawn(f64),
    /// Those that the strategy allows.
    Allowed,
}

/// An edge that can receive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ready {
    pub(super) entry: Entry,
    pub(super) controllable: bool,
    /// When it can.
    pub(super) mask: Mask,
}

/// What the strategy says at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Said {
    /// Whether it decides anything.
    decides: bool,
    waits: bool,
    /// Whether it allows the moves that are meant.
    acts: bool,
}

/// What a strategy says from a state on.
#[derive(Debug)]
pub(super) struct Advice<'a> {
    restriction: &'a Restriction,
    /// What it says of the discrete state.
    cases: &'a [Case],
    spans: Vec<Span>,
    /// The values and rates of the clocks, the constant 0 first.
    clocks: Vec<(f64, f64)>,
    demand: f64,
    /// Whether a move is made now that the strategy does not demand, since nobody else can move.
    is_hurried: bool,
}

impl<'a> Advice<'a> {
    pub(super) fn new(restriction: &'a Restriction) -> Advice<'a> {
        Advice {
            restriction,
            cases: &[],
            spans: Vec::new(),
            clocks: Vec::new(),
            demand: f64::INFINITY,
            is_hurried: false,
        }
    }

    /// Looks at a state; `clock` gives the value and the rate of the clock at these words.
    pub(super) fn look(&mut self, words: &[i32], clock: impl Fn(u32) -> (f64, f64), time: f64) {
        self.cases = self.restriction.cases(words);
        self.look_again(clock, time);
    }

    /// Looks at a state behind which time alone has passed.
    pub(super) fn look_again(&mut self, clock: impl Fn(u32) -> (f64, f64), time: f64) {
        self.spans.clear();
        self.demand = f64::INFINITY;
        self.is_hurried = false;
        if self.cases.is_empty() {
            return;
        }
        let restriction = self.restriction;
        self.clocks.clear();
        self.clocks.push((0.0, 0.0));
        let clocks = restriction.correspondence.clocks.iter();
        self.clocks.extend(clocks.map(|&offset| clock(offset)));
        if restriction.has_time {
            self.clocks.push((time, 1.0));
        }
        for case in self.cases {
            if let Some((first, last)) = span(restriction.limits(case), &self.clocks) {
                let action = case.action;
                self.spans.push(Span {
                    action,
                    first,
                    last,
                });
            }
        }
        self.demand = self.first_demand();
    }

    /// Whether the strategy has something to say about the state or those behind it.
    pub(super) fn has_decisions(&self) -> bool {
        !self.spans.is_empty()
    }

    /// The time after which it demands a move; infinity if it does not.
    pub(super) fn demand(&self) -> f64 {
        self.demand
    }

    /// Whether the controller moves as soon as it is allowed to.
    pub(super) fn is_eager(&self) -> bool {
        self.restriction.choice == UnderChoice::Eager && self.has_decisions()
    }

    /// Whether a process of the controller weighs its moves against waiting now.
    pub(super) fn may_wait(&self) -> bool {
        self.restriction.choice == UnderChoice::Race && self.said(0.0, false, |_| false).waits
    }

    /// Whether it allows the controller to wait now.
    pub(super) fn waits(&self) -> bool {
        let said = self.said(0.0, false, |_| false);
        !said.decides || said.waits
    }

    /// Lets the controller make moves that are allowed, but not demanded. Returns whether that
    /// makes a difference.
    pub(super) fn hurry(&mut self) -> bool {
        let is_lazy = self.restriction.choice == UnderChoice::Lazy && self.has_decisions();
        is_lazy && !std::mem::replace(&mut self.is_hurried, true)
    }

    /// When a controllable move without receivers, or with one, is allowed.
    pub(super) fn allows(&self, movers: &[Entry], ahead: f64, view: View) -> Mask {
        self.allows_any(ahead, view, |action, _| action == movers)
    }

    /// When a controllable sender of a broadcast and those who can receive make a move that is
    /// allowed, or one of the environment. The strategy may name moves by the sender alone.
    pub(super) fn allows_broadcast(
        &self,
        sender: Entry,
        is_alone: bool,
        receivers: &[Ready],
        ahead: f64,
        view: View,
    ) -> Mask {
        let is_ready = |one: &Ready, behind| {
            if behind {
                one.mask.behind
            } else {
                one.mask.now
            }
        };
        let is_possible = |action: &[Entry], behind: bool| {
            let [first, others @ ..] = action else {
                return false;
            };
            if is_alone {
                return *first == sender;
            }
            let mut ready = receivers.iter().filter(|one| is_ready(one, behind));
            let takes_part = |one: &Ready| others.contains(&one.entry);
            let has_part = |one: &Ready| {
                others
                    .iter()
                    .any(|other| other.process == one.entry.process)
            };
            *first == sender
                && ready.clone().all(has_part)
                && ready.by_ref().filter(|one| takes_part(one)).count() == others.len()
        };
        let mut mask = self.allows_any(ahead, view, is_possible);
        for one in receivers {
            mask.horizon = mask.horizon.min(one.mask.horizon);
            if !one.controllable {
                mask.now |= one.mask.now;
                mask.behind |= one.mask.behind;
            }
        }
        mask
    }

    /// Whether a move of these participants, all controllable, is allowed now.
    pub(super) fn allows_now(&self, movers: &[Entry]) -> bool {
        self.allows(movers, 0.0, View::Allowed).now
    }

    fn allows_any(
        &self,
        ahead: f64,
        view: View,
        is_meant: impl Fn(&[Entry], bool) -> bool,
    ) -> Mask {
        if !self.has_decisions() || view == View::Model {
            return Mask::constant(true);
        }
        let is_allowed = |behind: bool| {
            let said = self.said(ahead, behind, |action| {
                is_meant(self.restriction.action(action), behind)
            });
            let is_lazy = self.restriction.choice == UnderChoice::Lazy && !self.is_hurried;
            !said.decides || said.acts && !(is_lazy && said.waits)
        };
        let mut horizon = self.next_end(ahead) - ahead;
        let (mut is_open, mut is_over) = (true, false);
        if let View::Drawn(most) = view {
            let tolerance = TOLERANCE * ahead.max(1.0);
            is_over = ahead >= self.demand - tolerance || ahead > most + tolerance;
            is_open = ahead < most - tolerance;
            if is_over || !is_open {
                horizon = f64::INFINITY;
            } else {
                horizon = horizon.min(self.demand - ahead).min(most - ahead);
            }
        }
        Mask {
            now: !is_over && is_allowed(false),
            behind: !is_over && is_open && is_allowed(true),
            horizon,
        }
    }

    /// What the strategy says at a moment, or just behind it.
    fn said(&self, at: f64, behind: bool, is_meant: impl Fn(u32) -> bool) -> Said {
        let mut said = Said::default();
        for span in self.spans.iter().filter(|one| one.contains(at, behind)) {
            said.decides = true;
            match span.action {
                None => said.waits = true,
                Some(action) => said.acts |= is_meant(action),
            }
            if self.restriction.selection == Selection::First {
                break;
            }
        }
        said
    }

    /// The first end of a span after this time.
    fn next_end(&self, at: f64) -> f64 {
        let ends = self.spans.iter().flat_map(|span| [span.first, span.last]);
        ends.filter(|end| end.at > at + end.tolerance)
            .fold(f64::INFINITY, |least, end| least.min(end.at))
    }

    /// The first moment at which there are decisions, and none of them is to wait.
    fn first_demand(&self) -> f64 {
        let demands = |at, behind| {
            let said = self.said(at, behind, |_| false);
            said.decides && !said.waits
        };
        let mut at = 0.0;
        loop {
            if demands(at, false) {
                return at;
            }
            let next = self.next_end(at);
            if demands(at, true) {
                let ends = self.spans.iter().flat_map(|span| [span.first, span.last]);
                let tolerance = ends
                    .filter(|end| end.is_near(at))
                    .fold(TOLERANCE, |most, end| most.max(end.tolerance));
                let soon = at + (SOON * tolerance).min((next - at) / 2.0);
                if demands(soon, false) {
                    return soon;
                }
            }
            if next.is_infinite() {
                return next;
            }
            at = next;
        }
    }
}

/// For how long all comparisons hold from now on: from when until when; `None` if they never do.
fn span(limits: &[Limit], clocks: &[(f64, f64)]) -> Option<(End, End)> {
    let end = |at| End {
        at,
        is_open: false,
        tolerance: TOLERANCE,
    };
    let (mut first, mut last) = (end(f64::NEG_INFINITY), end(f64::INFINITY));
    for limit in limits {
        let (left, right) = (clocks[limit.left as usize], clocks[limit.right as usize]);
        let (gap, slope) = (left.0 - right.0, left.1 - right.1);
        let tolerance = TOLERANCE * limit.bound.abs().max(1.0);
        if slope == 0.0 {
            let holds = if limit.strict {
                gap < limit.bound - tolerance
            } else {
                gap <= limit.bound + tolerance
            };
            if !holds {
                return None;
            }
            continue;
        }
        let met = End {
            at: (limit.bound - gap) / slope,
            is_open: limit.strict,
            tolerance: tolerance / slope.abs(),
        };
        let tightest = if slope > 0.0 { &mut last } else { &mut first };
        if met.is_near(tightest.at) {
            tightest.is_open |= met.is_open;
        } else if (met.at < tightest.at) == (slope > 0.0) {
            *tightest = met;
        }
    }
    let tolerance = first.tolerance.max(last.tolerance);
    let is_empty = if first.is_open || last.is_open {
        first.at >= last.at - tolerance
    } else {
        first.at > last.at + tolerance
    };
    let is_past = last.at < -last.tolerance || last.is_open && last.is_near(0.0);
    (!is_empty && !is_past).then_some((first, last))
}
