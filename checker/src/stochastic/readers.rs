//! Whose plans depend on which words, and so who plans anew when some are written.
//!
//! Where many processes read the same words, and many branches write them, the branches share one
//! list: what is kept grows with the processes, not with their square.

use std::sync::Arc;

use rustc_hash::FxHashMap;

/// The processes by the words that they read.
#[derive(Debug)]
pub(super) struct Readers {
    /// By word: the number of the list of those that read it; that of the empty list is 0.
    of_word: Vec<u32>,
    /// Ascending, and no two are equal.
    lists: Vec<Arc<[u32]>>,
    /// Unions that were asked for, by the numbers of their lists.
    unions: FxHashMap<Box<[u32]>, Arc<[u32]>>,
}

impl Readers {
    /// Takes for each word the processes that read it, ascending.
    pub(super) fn new(by_word: Vec<Vec<u32>>) -> Readers {
        let empty: Arc<[u32]> = Arc::new([]);
        let mut lists = vec![Arc::clone(&empty)];
        let mut known = FxHashMap::default();
        known.insert(empty, 0);
        let of_word = by_word.into_iter().map(|readers| {
            let readers: Arc<[u32]> = readers.into();
            *known.entry(readers).or_insert_with_key(|readers| {
                lists.push(Arc::clone(readers));
                lists.len() as u32 - 1
            })
        });
        Readers {
            of_word: of_word.collect(),
            lists,
            unions: FxHashMap::default(),
        }
    }

    /// Those that read some word of these ranges, ascending; `but` may be missing.
    pub(super) fn of(
        &mut self,
        ranges: impl IntoIterator<Item = (u32, u32)>,
        but: Option<u32>,
    ) -> Arc<[u32]> {
        let mut numbers = Vec::new();
        for (first, count) in ranges {
            let words = &self.of_word[first as usize..(first + count) as usize];
            let of_others = words.iter().copied().filter(|&list| {
                let readers = &*self.lists[list as usize];
                !readers.is_empty() && but.is_none_or(|one| readers != [one])
            });
            numbers.extend(of_others);
            numbers.sort_unstable();
            numbers.dedup();
        }
        match numbers[..] {
            [] => Arc::clone(&self.lists[0]),
            [list] => Arc::clone(&self.lists[list as usize]),
            _ => {
                let lists = &self.lists;
                let union = self
                    .unions
                    .entry(numbers.into())
                    .or_insert_with_key(|numbers| {
                        let readers = numbers.iter().flat_map(|&list| &*lists[list as usize]);
                        let mut union: Vec<u32> = readers.copied().collect();
                        union.sort_unstable();
                        union.dedup();
                        union.into()
                    });
                Arc::clone(union)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::Readers;

    #[test]
    fn branches_that_write_the_same_share_a_list() {
        let all: Vec<u32> = (0..100).collect();
        let own = (0..100).map(|process| vec![process]);
        let by_word: Vec<Vec<u32>> = [all.clone(), all].into_iter().chain(own).collect();
        let mut readers = Readers::new(by_word);
        let first = readers.of([(0, 2), (7, 1)], Some(5));
        let second = readers.of([(1, 1), (8, 1)], Some(6));
        assert_eq!(first.len(), 100);
        assert!(Arc::ptr_eq(&first, &second));
    }

    #[test]
    fn a_union_holds_everyone_once() {
        let mut readers = Readers::new(vec![vec![1, 3], vec![], vec![3, 4], vec![2], vec![9]]);
        assert_eq!(*readers.of([(2, 3), (0, 2)], None), [1, 2, 3, 4, 9]);
        assert_eq!(*readers.of([(0, 1), (2, 1)], None), [1, 3, 4]);
        assert_eq!(*readers.of([(3, 2)], Some(2)), [9]);
        assert_eq!(*readers.of([(1, 1)], None), [] as [u32; 0]);
    }
}
