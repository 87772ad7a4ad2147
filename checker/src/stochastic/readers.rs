//! Whose plans depend on which words, and so who plans anew when some are written.
//!
//! Where many processes read the same words, and many branches write them, the branches share one
//! list: what is kept grows with the processes, not with their square.

use std::sync::Arc;

use rustc_hash::FxHashMap;

/// A process whose plans depend on a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Reader {
    pub(super) process: u32,
    /// The location where they do; none if they do wherever it plans.
    pub(super) location: Option<u32>,
}

impl Reader {
    /// A process whose plans depend on a word wherever it is.
    pub(super) fn everywhere(process: u32) -> Reader {
        Reader {
            process,
            location: None,
        }
    }
}

/// The processes by the words that they read.
#[derive(Debug)]
pub(super) struct Readers {
    /// By word: the number of the list of those that read it; that of the empty list is 0.
    of_word: Vec<u32>,
    /// Ascending, and no two are equal.
    lists: Vec<Arc<[Reader]>>,
    /// Unions that were asked for, by the numbers of their lists.
    unions: FxHashMap<Box<[u32]>, Arc<[Reader]>>,
}

impl Readers {
    /// Takes for each word the processes that read it, ascending.
    pub(super) fn new(by_word: Vec<Vec<Reader>>) -> Readers {
        let empty: Arc<[Reader]> = Arc::new([]);
        let mut lists = vec![Arc::clone(&empty)];
        let mut known = FxHashMap::default();
        known.insert(empty, 0);
        let of_word = by_word.into_iter().map(|readers| {
            let readers: Arc<[Reader]> = readers.into();
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
    ) -> Arc<[Reader]> {
        let mut numbers = Vec::new();
        for (first, count) in ranges {
            let words = &self.of_word[first as usize..(first + count) as usize];
            let of_others = words.iter().copied().filter(|&list| {
                let readers = &*self.lists[list as usize];
                readers.iter().any(|reader| Some(reader.process) != but)
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
                        let mut union: Vec<Reader> = readers.copied().collect();
                        union.sort_unstable();
                        // Of a process, the reader everywhere comes first, and stands for all.
                        union.dedup_by(|later, kept| {
                            later == kept
                                || later.process == kept.process && kept.location.is_none()
                        });
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

    use super::{Reader, Readers};

    fn everywhere(processes: &[u32]) -> Vec<Reader> {
        processes.iter().copied().map(Reader::everywhere).collect()
    }

    #[test]
    fn branches_that_write_the_same_share_a_list() {
        let all: Vec<u32> = (0..100).collect();
        let own = (0..100).map(|process| everywhere(&[process]));
        let by_word = [everywhere(&all), everywhere(&all)].into_iter().chain(own);
        let mut readers = Readers::new(by_word.collect());
        let first = readers.of([(0, 2), (7, 1)], Some(5));
        let second = readers.of([(1, 1), (8, 1)], Some(6));
        assert_eq!(first.len(), 100);
        assert!(Arc::ptr_eq(&first, &second));
    }

    #[test]
    fn a_union_holds_everyone_once() {
        let lists: [&[u32]; 5] = [&[1, 3], &[], &[3, 4], &[2], &[9]];
        let mut readers = Readers::new(lists.map(everywhere).to_vec());
        assert_eq!(
            *readers.of([(2, 3), (0, 2)], None),
            everywhere(&[1, 2, 3, 4, 9])
        );
        assert_eq!(*readers.of([(0, 1), (2, 1)], None), everywhere(&[1, 3, 4]));
        assert_eq!(*readers.of([(3, 2)], Some(2)), everywhere(&[9]));
        assert_eq!(*readers.of([(1, 1)], None), []);
    }

    #[test]
    fn a_reader_everywhere_stands_for_its_locations() {
        let at = |process, location| Reader {
            process,
            location: Some(location),
        };
        let everywhere = Reader::everywhere;
        let lists = [
            vec![at(1, 0), at(1, 2), everywhere(3)],
            vec![everywhere(1), at(2, 4)],
            vec![at(1, 2), at(2, 1), at(3, 0)],
        ];
        let mut readers = Readers::new(lists.to_vec());
        assert_eq!(
            *readers.of([(0, 2)], None),
            [everywhere(1), at(2, 4), everywhere(3)]
        );
        assert_eq!(
            *readers.of([(0, 1), (2, 1)], None),
            [at(1, 0), at(1, 2), at(2, 1), everywhere(3)]
        );
    }
}
