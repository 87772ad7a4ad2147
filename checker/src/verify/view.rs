//! What is known to be won of a zone, from what is known of the pieces of a place.

use std::borrow::Cow;

use super::place::{Conjunction, Kind, Piece, Place, Rest, just_after};
use super::symbolic::{within_all, without_conjunctions};
use super::zone::{Comparison, Zone};

/// When a state is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moment {
    Now,
    /// At all moments shortly after.
    JustAfter,
}

/// Which rest counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Round {
    Inner,
    Outer,
}

/// The pieces of a place, at a moment and in a round.
pub(super) struct View<'v, 'a> {
    known: &'v Place<'a>,
    is_permissive: bool,
    moment: Moment,
    round: Round,
}

impl<'v, 'a> View<'v, 'a> {
    pub(super) fn new(
        known: &'v Place<'a>,
        is_permissive: bool,
        moment: Moment,
        round: Round,
    ) -> View<'v, 'a> {
        View {
            known,
            is_permissive,
            moment,
            round,
        }
    }

    /// The pieces in which play is over: they come first.
    fn over(&self) -> impl Iterator<Item = &'v Piece> + use<'v, 'a> {
        let pieces = self.known.pieces.iter();
        pieces.take_while(|piece| piece.kind == Kind::Over)
    }

    fn decided(&self) -> impl Iterator<Item = &'v Piece> + use<'v, 'a> {
        let pieces = self.known.pieces.iter();
        pieces.skip_while(|piece| piece.kind == Kind::Over)
    }

    fn rest<'p>(&self, piece: &'p Piece) -> &'p Rest {
        match self.round {
            Round::Inner => &piece.rest,
            Round::Outer => &piece.outer,
        }
    }

    fn at_moment<'c>(&self, conjunction: &'c [Comparison]) -> Cow<'c, [Comparison]> {
        match self.moment {
            Moment::Now => Cow::Borrowed(conjunction),
            Moment::JustAfter => Cow::Owned(just_after(conjunction).into_vec()),
        }
    }

    fn parts_at_moment(&self, parts: &[Zone]) -> Vec<Conjunction> {
        let parts = parts.iter();
        parts
            .map(|part| self.at_moment(&part.comparisons()).into())
            .collect()
    }

    /// What of a zone is not known to be won.
    pub(super) fn refused(&self, zone: Zone) -> Vec<Zone> {
        if self.contains(&zone) {
            return Vec::new();
        }
        let mut left = vec![zone];
        let mut refused = self.ended(&mut left);
        if self.is_permissive {
            for piece in self.decided() {
                refused.extend(self.rest_in(piece, &left));
            }
            for piece in self.decided() {
                left = self.outside(piece, left);
            }
        } else {
            for piece in self.decided() {
                refused.extend(self.rest_in(piece, &left));
                left = self.outside(piece, left);
            }
        }
        refused.extend(left);
        refused
    }

    /// What of a zone of the piece with this index is not known to be won for what other pieces
    /// say: those before it, or all if each decision counts.
    pub(super) fn refused_by_others(&self, index: usize, zone: Zone) -> Vec<Zone> {
        let mut left = vec![zone];
        let mut refused = self.ended(&mut left);
        for (other, piece) in self.known.pieces.iter().enumerate() {
            if piece.kind == Kind::Over || other == index {
                continue;
            }
            if self.is_permissive {
                refused.extend(self.rest_in(piece, &left));
            } else if other < index {
                refused.extend(self.rest_in(piece, &left));
                left = self.outside(piece, left);
            }
        }
        refused
    }

    /// Where play is over in zones, and lost; leaves where it is not over.
    fn ended(&self, zones: &mut Vec<Zone>) -> Vec<Zone> {
        let mut lost = Vec::new();
        for piece in self.over() {
            lost.extend(self.rest_in(piece, zones));
            *zones = self.outside(piece, std::mem::take(zones));
        }
        lost
    }

    /// What of a zone is known to be won.
    pub(super) fn granted(&self, zone: Zone) -> Vec<Zone> {
        let mut left = vec![zone];
        let mut granted = Vec::new();
        for piece in self.over() {
            granted.extend(self.granted_in(piece, &left));
            left = self.outside(piece, left);
        }
        if self.is_permissive {
            for piece in self.decided() {
                left = self.without_rest(piece, left);
            }
        }
        for piece in self.decided() {
            if left.is_empty() {
                break;
            }
            left = self.without_rest(piece, left);
            granted.extend(self.inside(piece, &left));
        }
        granted
    }

    /// Whether a zone is quickly seen to be won as a whole.
    fn contains(&self, zone: &Zone) -> bool {
        let mut is_inside = false;
        for piece in &self.known.pieces {
            let touches = |one: &Conjunction| !zone.misses(&self.at_moment(one));
            let meets_rest = match self.rest(piece) {
                Rest::Nothing => false,
                Rest::Everything => piece.zones.iter().any(touches),
                Rest::Parts(parts) => self.parts_at_moment(parts).iter().any(touches),
            };
            if meets_rest {
                return false;
            }
            let mut zones = piece.zones.iter();
            if !is_inside && zones.any(|one| zone.is_inside(&self.at_moment(one))) {
                if piece.kind == Kind::Over || !self.is_permissive {
                    return true;
                }
                is_inside = true;
            }
        }
        is_inside
    }

    fn inside(&self, piece: &Piece, zones: &[Zone]) -> Vec<Zone> {
        let conjunctions = piece.zones.iter();
        conjunctions
            .flat_map(|one| within_all(zones, &self.at_moment(one)))
            .collect()
    }

    fn outside(&self, piece: &Piece, zones: Vec<Zone>) -> Vec<Zone> {
        without_conjunctions(zones, piece.zones.iter().map(|one| self.at_moment(one)))
    }

    fn rest_in(&self, piece: &Piece, zones: &[Zone]) -> Vec<Zone> {
        match self.rest(piece) {
            Rest::Nothing => Vec::new(),
            Rest::Everything => self.inside(piece, zones),
            Rest::Parts(parts) => {
                let parts = self.parts_at_moment(parts).into_iter();
                parts.flat_map(|part| within_all(zones, &part)).collect()
            }
        }
    }

    fn without_rest(&self, piece: &Piece, zones: Vec<Zone>) -> Vec<Zone> {
        match self.rest(piece) {
            Rest::Nothing => zones,
            Rest::Everything => self.outside(piece, zones),
            Rest::Parts(parts) => without_conjunctions(zones, self.parts_at_moment(parts)),
        }
    }

    fn granted_in(&self, piece: &Piece, zones: &[Zone]) -> Vec<Zone> {
        self.without_rest(piece, self.inside(piece, zones))
    }
}
