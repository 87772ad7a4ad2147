//! One bound on a difference of two clocks: `< c`, `<= c`, or none.
//!
//! Encoding: `2 * c - 1` for `<= c`, `2 * c - 2` for `< c`, `i32::MAX` for none, so that all
//! constants from -(2^30 - 1) to 2^30 - 1 have one. The tighter of two bounds has the lesser
//! encoding: `< c` is below `<= c`, both are below every bound with a greater constant, and all are
//! below infinity.
//!
//! The bound on `x - z` that follows from those on `x - y` and `y - z` is their sum: it adds the
//! constants, and is weak only if both bounds are weak. In the encoding, for a fixed first bound
//! `a`, `a + b = (a & !1) + 2 + (b & (a | !1))`. So the rest of a row costs one `and` and one `add`
//! per entry, and no branch.
//!
//! Range: constants of a model lie within ±[`Bound::MAX_VALUE`], and those of most models within
//! ±[`Bound::NARROW_VALUE`]. An operation on a zone adds the bounds along a path. Where single
//! clocks are compared with constants, a path has at most two bounds of the zone and two new ones.
//! Where clocks are compared with each other, it may visit all clocks. With constants of most
//! models the sum fits into an `i32` as long as no bound of the zone exceeds
//! [`Bound::most_in_zone`]. Extrapolated zones keep within it. Code that lets bounds grow without
//! extrapolation calls [`super::dbm::is_in_range`] once per step, and stops or uses another
//! abstraction if the answer is no. Once there is a greater constant, sums are formed in 64 bits,
//! see [`super::wide`].

use std::fmt;
use std::ops::Add;

use super::wide;

/// A bound on a difference of clocks: `< c`, `<= c` or none. A smaller bound is tighter.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct Bound(pub(super) i32);

impl Bound {
    /// No bound.
    pub const INFINITY: Bound = Bound(i32::MAX);
    /// `<= 0`, the bound of a clock against itself.
    pub const LE_ZERO: Bound = Bound(-1);
    /// `< 0`, which no clock satisfies against itself.
    pub const LT_ZERO: Bound = Bound(-2);
    /// The greatest constant, and the negative of the least one, that a model may write.
    pub const MAX_VALUE: i32 = (1 << 30) - 1;
    /// The greatest constant, and the negative of the least one, with which sums of bounds need no
    /// more than 32 bits.
    pub const NARROW_VALUE: i32 = wide::NARROW;
    /// The greatest constant that a search may compare clocks of its own with, given the greatest
    /// constant of the model: sums need no more bits than without it.
    pub const fn reach(greatest: i32) -> i32 {
        const NARROW: i32 = (Bound::NARROW_VALUE + 1) / 2;
        if greatest > NARROW {
            Bound::MAX_VALUE
        } else {
            NARROW
        }
    }

    /// The loosest bound that there is.
    pub(super) const LOOSEST: Bound = Bound::le(Bound::MAX_VALUE);
    /// The tightest bound that there is.
    pub(super) const TIGHTEST: Bound = Bound::lt(-Bound::MAX_VALUE);

    /// The greatest constant, and the negative of the least one, that a zone of this dimension may
    /// have so that no sum in 32 bits leaves the range of the encoding. `has_differences` says
    /// whether the model compares clocks with each other.
    pub const fn most_in_zone(dimension: usize, has_differences: bool) -> i32 {
        const MOST: usize = 2 * (Bound::NARROW_VALUE as usize + 1);
        let shared = (1 << 30) / (dimension + 1);
        if has_differences && shared < MOST {
            shared as i32
        } else {
            MOST as i32
        }
    }

    /// The bound `< value`; none if the value lies beyond [`Bound::MAX_VALUE`].
    pub fn strict(value: i32) -> Option<Bound> {
        Bound::is_allowed(value).then(|| {
            wide::admit(value);
            Bound::lt(value)
        })
    }

    /// The bound `<= value`; none if the value lies beyond [`Bound::MAX_VALUE`].
    pub fn weak(value: i32) -> Option<Bound> {
        Bound::is_allowed(value).then(|| {
            wide::admit(value);
            Bound::le(value)
        })
    }

    /// The bound `< value`; the value must be allowed.
    pub(super) const fn lt(value: i32) -> Bound {
        Bound(2 * value - 2)
    }

    /// The bound `<= value`; the value must be allowed.
    pub(super) const fn le(value: i32) -> Bound {
        Bound(2 * value - 1)
    }

    /// Whether a model may use this constant.
    pub const fn is_allowed(value: i32) -> bool {
        -Bound::MAX_VALUE <= value && value <= Bound::MAX_VALUE
    }

    /// The constant; meaningless for infinity.
    #[inline]
    pub const fn value(self) -> i32 {
        (self.0 >> 1) + 1
    }

    /// Whether the constant itself is excluded. Infinity counts as weak.
    #[inline]
    pub const fn is_strict(self) -> bool {
        self.0 & 1 == 0
    }

    /// Whether this is no bound at all.
    #[inline]
    pub const fn is_infinite(self) -> bool {
        self.0 == i32::MAX
    }

    /// Whether this is a bound.
    #[inline]
    pub const fn is_finite(self) -> bool {
        self.0 != i32::MAX
    }

    /// The bound of the complement, read from the other clock: `x - y <= c` fails where `y - x <
    /// -c` holds.
    ///
    /// Infinity has no complement; the result for it is meaningless.
    #[must_use]
    #[inline]
    pub const fn negated(self) -> Bound {
        Bound((-3_i32).saturating_sub(self.0))
    }

    /// The encoding, for storing and hashing.
    pub const fn raw(self) -> i32 {
        self.0
    }

    /// The bound with this encoding.
    pub const fn from_raw(raw: i32) -> Bound {
        Bound(raw)
    }

    /// The same bound with `<`, if it is finite.
    pub(super) fn made_strict(self) -> Bound {
        if self.is_finite() {
            Bound(self.0 & !1)
        } else {
            self
        }
    }

    /// The same bound with `<=`. Infinity stays what it is.
    pub(super) fn made_weak(self) -> Bound {
        Bound(self.0 | 1)
    }

    /// This bound moved by a constant; infinity stays.
    #[must_use]
    pub fn shifted(self, value: i32) -> Bound {
        if self.is_infinite() {
            self
        } else {
            Bound::fitted(i64::from(self.0) + 2 * i64::from(value))
        }
    }

    /// The encoded sum of two finite bounds.
    #[inline]
    pub(super) const fn wide_sum(self, other: Bound) -> i64 {
        (self.0 & !1) as i64 + 2 + (other.0 & (self.0 | !1)) as i64
    }

    /// The bound with this encoding; the nearest looser or the tightest one if there is none.
    #[inline]
    const fn nearest(encoded: i64) -> Bound {
        if encoded > Bound::LOOSEST.0 as i64 {
            Bound::INFINITY
        } else if encoded < Bound::TIGHTEST.0 as i64 {
            Bound::TIGHTEST
        } else {
            Bound(encoded as i32)
        }
    }

    /// The same; it is noted if there is none.
    #[inline]
    pub(super) fn fitted(encoded: i64) -> Bound {
        if encoded > i64::from(Bound::LOOSEST.0) || encoded < i64::from(Bound::TIGHTEST.0) {
            wide::note();
        }
        Bound::nearest(encoded)
    }

    /// The sum of two bounds; it is noted if there is no such bound.
    #[inline]
    pub(super) fn noted_sum(self, other: Bound) -> Bound {
        if self.is_infinite() || other.is_infinite() {
            Bound::INFINITY
        } else {
            Bound::fitted(self.wide_sum(other))
        }
    }

    /// The sum of two bounds without a branch. Each must be infinite or far from the ends of the
    /// range; then the result is the same as that of `+`.
    #[inline]
    pub(super) const fn plus(self, other: Bound) -> Bound {
        let sum = (self.0 & !1)
            .wrapping_add(2)
            .wrapping_add(other.0 & (self.0 | !1));
        let is_infinite = -((self.0 == i32::MAX) as i32) | -((other.0 == i32::MAX) as i32);
        Bound(sum & !is_infinite | i32::MAX & is_infinite)
    }

    /// The lesser of two bounds, as `min` gives it. It uses a mask, because some vector units have
    /// no minimum.
    #[inline]
    pub(super) const fn lesser(self, other: Bound) -> Bound {
        let is_less = -((other.0 < self.0) as i32);
        Bound(self.0 ^ ((self.0 ^ other.0) & is_less))
    }

    /// The lesser of `current` and `via + rest`; `via` must be finite.
    ///
    /// Both conditions make one mask: vector units without a select instruction would otherwise
    /// blend twice.
    #[inline]
    pub(super) const fn relaxed(current: Bound, via: Bound, rest: Bound) -> Bound {
        let sum = ((via.0 & !1) + 2).wrapping_add(rest.0 & (via.0 | !1));
        let is_tighter = -((sum < current.0) as i32);
        let is_finite = -((rest.0 != i32::MAX) as i32);
        Bound(current.0 ^ ((current.0 ^ sum) & is_tighter & is_finite))
    }
}

/// The bound on `x - z` that follows from one on `x - y` and one on `y - z`; infinite if one of
/// them is, or if there is none so loose.
impl Add for Bound {
    type Output = Bound;

    #[inline]
    fn add(self, other: Bound) -> Bound {
        if self.is_infinite() || other.is_infinite() {
            return Bound::INFINITY;
        }
        Bound::nearest(self.wide_sum(other))
    }
}

impl fmt::Debug for Bound {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Bound::INFINITY => formatter.write_str("<inf"),
            bound if bound.is_strict() => write!(formatter, "<{}", bound.value()),
            bound => write!(formatter, "<={}", bound.value()),
        }
    }
}
