//! Searches in every manner with and without a reduction, whose traces are shown to be runs.

use checker::engine::evidence::witness::Proof;
use checker::engine::{Answer, Options};
use checker::search::reachability::report::{Manner, Order};

use crate::checks::{check, interpreted};

/// The manner in which states are counted.
pub(crate) const BREADTH_FIRST: Manner = Manner {
    order: Order::BreadthFirst,
    threads: 1,
};

/// All manners that differ in what is found first.
const MANNERS: [Manner; 4] = [
    BREADTH_FIRST,
    Manner {
        order: Order::DepthFirst,
        threads: 1,
    },
    Manner {
        order: Order::Random(7),
        threads: 1,
    },
    Manner {
        order: Order::BreadthFirst,
        threads: 2,
    },
];

/// The answer to a query, with the options that `adjust` leaves; `is_shown` says whether what an
/// independent replay makes of a trace is all right.
pub(crate) fn answer_in(
    manner: Manner,
    (text, query): (&str, &str),
    adjust: impl FnOnce(&mut Options),
    is_shown: impl Fn(Option<&Proof>) -> bool,
) -> Answer {
    let mut options = Options {
        order: manner.order,
        threads: manner.threads,
        runs: true,
        ..interpreted()
    };
    adjust(&mut options);
    let answer = check(text, query, &options);
    for witness in &answer.evidence.witnesses {
        assert!(
            is_shown(witness.run.as_ref()),
            "{query}: {:#?}\n{text}",
            witness.run
        );
    }
    answer
}

/// Whether a trace was replayed. The replay runs every move that is possible on the way, and some
/// of those may fail.
pub(crate) fn is_replayed_or_cut(run: Option<&Proof>) -> bool {
    matches!(run, Some(Proof::Replayed(..))) || format!("{run:?}").contains("NotCovered(RunTime(")
}

/// The answers without and with a reduction, breadth first, which `answer` gives; `compare` has to
/// find that the answer with the reduction agrees in every manner of search.
pub(crate) fn answers(
    answer: impl Fn(Manner, bool) -> Answer,
    compare: impl Fn(Manner, &Answer, &Answer),
) -> (Answer, Answer) {
    let full = answer(BREADTH_FIRST, false);
    let [reduced, ..] = MANNERS.map(|manner| {
        let reduced = answer(manner, true);
        compare(manner, &full, &reduced);
        reduced
    });
    (full, reduced)
}

/// What many searches stored.
#[derive(Debug, Default)]
pub(crate) struct Total {
    pub(crate) full: u64,
    pub(crate) reduced: u64,
    /// In how many searches the reduction left something out.
    pub(crate) fewer: u64,
}

impl Total {
    pub(crate) fn add(&mut self, full: u64, reduced: u64) {
        self.full += full;
        self.reduced += reduced;
        self.fewer += u64::from(reduced < full);
    }
}
