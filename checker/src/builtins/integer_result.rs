//! What functions give whose result may wrap round or not exist.

/// The integer that a function gives, if there is one, and whether it wrapped round: the true
/// result is another one modulo 2^32.
///
/// Compiled code takes it apart: it is negative if there is none; else its low half is the integer,
/// and the bit above that half says whether it wrapped round.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct IntegerResult(i64);

impl IntegerResult {
    pub(crate) const NONE: IntegerResult = IntegerResult(-1);
    /// The bit that says that the integer wrapped round.
    pub(crate) const HAS_WRAPPED: i64 = 1 << 32;

    pub(crate) fn new(value: i32, has_wrapped: bool) -> IntegerResult {
        let wrapped = if has_wrapped { Self::HAS_WRAPPED } else { 0 };
        IntegerResult(i64::from(value as u32) | wrapped)
    }

    pub(crate) fn get(self) -> Option<(i32, bool)> {
        (self.0 >= 0).then_some((self.0 as i32, self.0 & Self::HAS_WRAPPED != 0))
    }
}
