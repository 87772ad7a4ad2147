//! Moves one after the other, packed into words: a step takes one word if it is small, else two, of
//! which the first, the upper half, is marked.

use crate::search::outcome::Step;

/// Marks the first of two words.
const MARK: u32 = 1 << 31;

/// Appends the steps.
pub(in crate::search) fn pack(steps: &[Step], words: &mut Vec<u32>) {
    for &step in steps {
        if step >= Step::from(MARK) {
            words.push((step >> 32) as u32 | MARK);
        }
        words.push(step as u32);
    }
}

/// Appends the steps of a row of words, the last first.
pub(in crate::search) fn unpack_reversed(words: &[u32], steps: &mut Vec<Step>) {
    let first = steps.len();
    let mut upper = None;
    for &word in words {
        match upper.take() {
            Some(upper) => steps.push(Step::from(upper) << 32 | Step::from(word)),
            None if word >= MARK => upper = Some(word & !MARK),
            None => steps.push(Step::from(word)),
        }
    }
    steps[first..].reverse();
}

#[cfg(test)]
mod tests {
    use super::{pack, unpack_reversed};

    #[test]
    fn steps_are_packed_and_unpacked() {
        let steps = [7, 1 << 31, (1 << 62) - 1, 3, 1 << 40, 0, (1 << 31) - 1];
        let (mut words, mut back) = (Vec::new(), vec![9]);
        pack(&steps, &mut words);
        unpack_reversed(&words, &mut back);
        assert_eq!(back[0], 9);
        assert!(back[1..].iter().eq(steps.iter().rev()));
    }
}
