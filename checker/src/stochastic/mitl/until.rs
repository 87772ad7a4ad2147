//! `p U[a,b] q`: from what is known of `p` and `q`, in order, to what is known of the formula.
//!
//! It holds at a position x if there is a position y, x itself or a later one, whose distance in
//! time from x lies in [a,b], such that q holds at y and p at all positions from x to before y. A
//! truth that begins just behind a moment counts as that moment's: if q holds in an open interval
//! behind w, then p need only hold up to w. So `x <= 5 U x > 5` holds for a clock.
//!
//! Within a stretch in which p holds all the time, every part in which q holds is a *target*: it
//! makes the formula hold at the positions that have a position of the part at a distance in [a,b],
//! which lie between two cuts. Targets come in order, and so do their two cuts; so positions are
//! decided in order, and all that is kept is from where on they are undecided.
//!
//! Source of the logic: R. Alur, T. Feder, T. A. Henzinger, "The benefits of relaxing punctuality",
//! JACM 43 (1996). On stretches of truth instead of moments: O. Maler, D. Nickovic, "Monitoring
//! temporal properties of continuous signals", FORMATS 2004.

use super::signal::{Cut, Moment, Part, Parts};

/// The state of the operator.
#[derive(Clone, Debug)]
pub(super) struct Until {
    from: Moment,
    to: Moment,
    /// Up to here p and q were read.
    read: Cut,
    /// Up to here the formula is decided; before `read` only while p holds.
    decided: Cut,
}

impl Until {
    pub(super) fn new(from: f64, to: f64) -> Until {
        Until {
            from: Moment::new(from),
            to: Moment::new(to),
            read: Cut::START,
            decided: Cut::START,
        }
    }

    /// Reads what is known of both.
    pub(super) fn read(&mut self, keep: &mut Parts, goal: &mut Parts, result: &mut Parts) {
        while let (Some(keep), Some(goal)) = (keep.behind(self.read), goal.behind(self.read)) {
            let part = Part {
                end: keep.end.min(goal.end),
                holds: goal.holds,
            };
            if keep.holds {
                self.read_kept(part, result);
            } else {
                self.read_broken(part, result);
            }
            self.read = part.end;
        }
    }

    /// The run is over: what is undecided does not hold.
    pub(super) fn finish(&mut self, result: &mut Parts) {
        self.decide(self.read, false, result);
    }

    /// A part in which p holds.
    fn read_kept(&mut self, part: Part, result: &mut Parts) {
        if part.holds {
            let end = if self.from == Moment::ZERO {
                part.end
            } else {
                let moment = part.end.moment.earlier_by(self.from);
                if part.end.ends_at_moment() {
                    Cut::after(moment)
                } else {
                    Cut::before(moment)
                }
            };
            self.reached(self.earliest(self.read), end, result);
        }
        self.decide(self.earliest(part.end), false, result);
    }

    /// A part in which p does not hold: its first position can still be y.
    fn read_broken(&mut self, part: Part, result: &mut Parts) {
        let start = self.read;
        if part.holds {
            let end = if self.from == Moment::ZERO {
                start
            } else {
                Cut::after(start.moment.earlier_by(self.from))
            };
            self.reached(self.earliest(start), end.min(start), result);
        }
        self.decide(start, false, result);
        let holds_itself = part.holds && self.from == Moment::ZERO;
        self.decide(part.end, holds_itself, result);
    }

    /// Before this cut, all that begins at `start` is too far away.
    fn earliest(&self, start: Cut) -> Cut {
        let moment = start.moment.earlier_by(self.to);
        if start.starts_at_moment() {
            Cut::before(moment)
        } else {
            Cut::after(moment)
        }
    }

    /// The formula holds between these two cuts, and nothing that comes makes it hold before them.
    fn reached(&mut self, start: Cut, end: Cut, result: &mut Parts) {
        self.decide(start, false, result);
        self.decide(end, true, result);
    }

    fn decide(&mut self, end: Cut, holds: bool, result: &mut Parts) {
        if end > self.decided {
            result.push(end, holds);
            self.decided = end;
        }
    }
}
