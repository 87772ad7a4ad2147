//! Mutations: bytes and tokens are removed, doubled, swapped, replaced by words of the language, or
//! taken from another seed.

use super::seeds::Seeds;
use super::targets::Kind;

/// The numbers of a case: a function of the case alone.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(case: u64) -> Random {
        Random(case)
    }

    /// `SplitMix64` (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014).
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

/// An input of a kind.
pub(crate) fn mutated(seeds: &Seeds, kind: Kind, random: &mut Random) -> Vec<u8> {
    let of_kind = seeds.of(kind);
    let mut text = of_kind[random.below(of_kind.len())].clone();
    // Most mutations break the syntax, so that few of them reach furthest.
    let mutations = 1 + random.below(2) * random.below(2) * random.below(8);
    for _ in 0..mutations {
        mutate(&mut text, of_kind, &seeds.words, random);
    }
    text
}

fn mutate(text: &mut Vec<u8>, others: &[Vec<u8>], words: &[Vec<u8>], random: &mut Random) {
    let tokens = tokens(text);
    let token = tokens[random.below(tokens.len())].clone();
    let another = tokens[random.below(tokens.len())].clone();
    let word = &words[random.below(words.len())];
    match random.below(12) {
        0 => drop(text.splice(token, [])),
        1 | 2 => drop(text.splice(token, word.iter().copied())),
        3 => drop(text.splice(token.end..token.end, word.iter().copied())),
        4 | 5 => {
            let copy = text[another].to_vec();
            text.splice(token, copy);
        }
        6 => {
            let copy = text[another].to_vec();
            text.splice(token.end..token.end, copy);
        }
        7 => {
            let (first, last) = (token.start.min(another.start), token.end.max(another.end));
            let few = first..last.min(first + 200);
            if random.below(2) == 0 {
                text.splice(few, []);
            } else {
                let copy = text[few.clone()].to_vec();
                text.splice(few.end..few.end, copy);
            }
        }
        8 | 9 => {
            let other = &others[random.below(others.len())];
            let start = random.below(other.len() + 1);
            let end = (start + random.below(80)).min(other.len());
            text.splice(token, other[start..end].iter().copied());
        }
        10 => {
            let number = match random.below(4) {
                0 => i64::from(i32::MAX),
                1 => i64::from(i32::MIN),
                2 => 1 << random.below(33),
                _ => random.below(12) as i64 - 2,
            };
            let is_number = |range: &&std::ops::Range<usize>| {
                text.get(range.start).is_some_and(u8::is_ascii_digit)
            };
            let from = random.below(tokens.len());
            let (before, after) = tokens.split_at(from);
            let token = after
                .iter()
                .chain(before)
                .find(is_number)
                .cloned()
                .unwrap_or(token);
            text.splice(token, number.to_string().into_bytes());
        }
        _ => {
            let place = random.below(text.len().max(1));
            if let Some(byte) = text.get_mut(place) {
                *byte ^= 1 << random.below(8);
            }
        }
    }
}

/// Words, numbers and single symbols; at least one, which may be empty.
fn tokens(text: &[u8]) -> Vec<std::ops::Range<usize>> {
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
    let mut tokens = Vec::new();
    let mut start = 0;
    while start < text.len() {
        let length = text[start..]
            .iter()
            .take_while(|byte| is_word(byte))
            .count()
            .max(1);
        if !text[start].is_ascii_whitespace() {
            tokens.push(start..start + length);
        }
        start += length;
    }
    if tokens.is_empty() {
        tokens.push(0..0);
    }
    tokens
}
