//! Hashes of stored bytes and numbers.

/// A hash of bytes: four lanes of multiply and fold, so that the multiplications overlap.
pub(in crate::search) fn hash_bytes(bytes: &[u8]) -> u32 {
    const FACTORS: [u64; 4] = [
        0x9e37_79b9_7f4a_7c15,
        0xc2b2_ae3d_27d4_eb4f,
        0x1656_67b1_9e37_79f9,
        0xd6e8_feb8_6659_fd93,
    ];
    let mut lanes = FACTORS;
    let (words, rest) = bytes.as_chunks::<8>();
    let (blocks, others) = words.as_chunks::<4>();
    let mut absorb = |lane: usize, word: [u8; 8]| {
        lanes[lane] = fold(lanes[lane] ^ u64::from_le_bytes(word), FACTORS[lane]);
    };
    for block in blocks {
        (0..4).for_each(|lane| absorb(lane, block[lane]));
    }
    for (lane, word) in others.iter().enumerate() {
        absorb(lane, *word);
    }
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    absorb(3, last);
    let all = lanes.iter().fold(bytes.len() as u64, |hash, lane| {
        fold(hash ^ lane, FACTORS[0])
    });
    (all ^ (all >> 32)) as u32
}

/// Multiplies, and folds the upper half over the lower one.
pub(super) fn fold(value: u64, factor: u64) -> u64 {
    let product = value.wrapping_mul(factor);
    product ^ (product >> 29)
}

/// The 64 bits that the table wants, from the 32 bits that are kept.
pub(in crate::search) fn spread(hash: u32) -> u64 {
    u64::from(hash).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}
