//! One bound on a difference of two clocks: `< c`, `<= c`, or none.
//!
//! Encoding: `2 * c + 1` for `<= c`, `2 * c` for `< c`, `i32::MAX` for none. The tighter of two
//! bounds has the lesser encoding: `< c` is below `<= c`, both are below every bound with a greater
//! constant, and all are below infinity.
//!
//! The bound on `x - z` that follows from those on `x - y` and `y - z` is their sum: it adds the
//! constants, and is weak only if both bounds are weak. In the encoding, for a fixed first bound
//! `a`, `a + b = (a & !1) + (b & (a | !1))`. So the rest of a row costs one `and` and one `add` per
//! entry, and no branch.
//!
//! Range: constants of a model lie within ±[`Bound::MAX_VALUE`]. An operation on a zone adds the
//! bounds along a path. Where single clocks are compared with constants, a path has at most two
//! bounds of the zone and two new ones. Where clocks are compared with each other, it may visit all
//! clocks. The sum fits into an `i32` as long as no bound of the zone exceeds
//! [`Bound::most_in_zone`]. Extrapolated zones keep within it. Code that lets bounds grow without
//! extrapolation calls [`super::dbm::is_in_range`] once per step, and stops or uses another
//! abstraction if the answer is no.

use std::fmt;
use std::ops::Add;

/// A bound on a difference of clocks: `< c`, `<= c` or none. A smaller bound is tighter.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(transparent)]
pub struct Bound(pub(super) i32);

impl Bound {
    /// No bound.
    pub const INFINITY: Bound = Bound(i32::MAX);
    /// `<= 0`, the bound of a clock against itself.
    pub const LE_ZERO: Bound = Bound(1);
    /// `< 0`, which no clock satisfies against itself.
    pub const LT_ZERO: Bound = Bound(0);
    /// The greatest constant, and the negative of the least one, that a model may write.
    pub const MAX_VALUE: i32 = (1 << 27) - 1;

    /// The greatest constant, and the negative of the least one, that a zone of this dimension may
    /// have so that no sum leaves the range of the encoding. `has_differences` says whether the
    /// model compares clocks with each other.
    pub const fn most_in_zone(dimension: usize, has_differences: bool) -> i32 {
        const MOST: usize = 2 * (Bound::MAX_VALUE as usize + 1);
        let shared = (1 << 30) / (dimension + 1);
        if has_differences && shared < MOST {
            shared as i32
        } else {
            MOST as i32
        }
    }

    /// The bound `< value`; none if the value lies beyond [`Bound::MAX_VALUE`].
    pub const fn strict(value: i32) -> Option<Bound> {
        if Bound::is_allowed(value) {
            Some(Bound(2 * value))
        } else {
            None
        }
    }

    /// The bound `<= value`; none if the value lies beyond [`Bound::MAX_VALUE`].
    pub const fn weak(value: i32) -> Option<Bound> {
        if Bound::is_allowed(value) {
            Some(Bound(2 * value + 1))
        } else {
            None
        }
    }

    /// Whether a model may use this constant.
    pub const fn is_allowed(value: i32) -> bool {
        -Bound::MAX_VALUE <= value && value <= Bound::MAX_VALUE
    }

    /// The constant; meaningless for infinity.
    #[inline]
    pub const fn value(self) -> i32 {
        self.0 >> 1
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
        Bound(1_i32.saturating_sub(self.0))
    }

    /// The encoding, for storing and hashing.
    pub const fn raw(self) -> i32 {
        self.0
    }

    /// The bound with this encoding.
    pub const fn from_raw(raw: i32) -> Bound {
        Bound(raw)
    }

    /// This bound moved by a constant; infinity stays.
    #[must_use]
    pub const fn shifted(self, value: i32) -> Bound {
        if self.is_infinite() {
            self
        } else {
            Bound(self.0.saturating_add(2 * value))
        }
    }

    /// The sum of two bounds without a branch. Each must be infinite or far from the ends of the
    /// range; then the result is the same as that of `+`.
    #[inline]
    pub(super) const fn plus(self, other: Bound) -> Bound {
        let sum = (self.0 & !1).wrapping_add(other.0 & (self.0 | !1));
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
        let sum = (via.0 & !1).wrapping_add(rest.0 & (via.0 | !1));
        let is_tighter = -((sum < current.0) as i32);
        let is_finite = -((rest.0 != i32::MAX) as i32);
        Bound(current.0 ^ ((current.0 ^ sum) & is_tighter & is_finite))
    }
}

/// The bound on `x - z` that follows from one on `x - y` and one on `y - z`; infinite if one of
/// them is.
impl Add for Bound {
    type Output = Bound;

    #[inline]
    fn add(self, other: Bound) -> Bound {
        if self.is_infinite() || other.is_infinite() {
            return Bound::INFINITY;
        }
        Bound((self.0 & !1).saturating_add(other.0 & (self.0 | !1)))
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
