//! Where the code of a race keeps what it knows: in words behind those of the state.

use crate::ir::{FunctionId, Urgency};
use crate::stochastic::condition::Condition;
use crate::stochastic::program::Program;

/// The bits of a word that are used for processes.
pub(super) const BITS: usize = 31;

/// The words of a race. Doubles take two.
#[derive(Debug)]
pub(super) struct Layout {
    /// By process: the double that says in how long it tries to move; none if it never does.
    pub(super) attempts: Vec<Option<u32>>,
    /// By process: the double that says how long it may stay, if it tries to move only later;
    /// none if it may always stay for ever.
    pub(super) stays: Vec<Option<u32>>,
    /// Whether some process has such a limit now.
    pub(super) has_stays: u32,
    /// The first of the words whose bits say who plans anew.
    pub(super) stale: u32,
    /// How many words these are.
    pub(super) stale_words: u32,
    /// How many processes are in committed locations.
    pub(super) committed: u32,
    /// How long the run has lasted.
    pub(super) time: u32,
    /// How much later than that what was asked of it has been decided.
    pub(super) decided_after: u32,
    /// How long it lasts.
    pub(super) bound: u32,
    /// How many moves may be made before the code returns.
    pub(super) moves_left: u32,
    /// The greatest value so far, if that is asked.
    pub(super) best: u32,
    /// Windows of a plan: their number, their low and their high ends, and the rate of the delay.
    pub(super) windows: u32,
    pub(super) lows: u32,
    pub(super) highs: u32,
    pub(super) rate: u32,
    /// The most windows of a plan.
    pub(super) most_windows: u32,
    /// Where runs draw their random numbers.
    pub(super) stream: u32,
    /// Where functions leave doubles.
    pub(super) result: u32,
    /// The function that draws a delay in windows: the first behind those of the network.
    pub(super) in_windows: FunctionId,
    /// The clocks whose rates are set, with the double that keeps what a rate was.
    pub(super) rates: Vec<(u32, u32)>,
    /// Where the code keeps what the controller does, if somebody decides for it.
    pub(super) decisions: Option<Decisions>,
    /// All words, those of the state included.
    pub(super) words: u32,
}

/// The words for what the controller does.
#[derive(Debug)]
pub(super) struct Decisions {
    /// Whether it is asked at once, or delays are drawn.
    pub(super) sees_time: bool,
    /// For how long it waits: a double.
    pub(super) hold: u32,
    /// Whether delays are drawn for its moves.
    pub(super) draws: u32,
    /// How the code goes on when it is called again: see [`super::decisions`].
    pub(super) resume: u32,
    /// By process, if it has outputs of both sides in one location: whether its attempt is the
    /// moment at which the controller is asked.
    pub(super) questions: Vec<Option<u32>>,
    /// The process whose delay is over.
    pub(super) winner: u32,
    /// The moves that are possible: their number, and their places among `entries`.
    pub(super) move_count: u32,
    pub(super) moves: u32,
    /// Whether one of them is on an urgent channel.
    pub(super) urgent: u32,
    /// All moves of the controller, by their numbers, ascending.
    pub(super) entries: Vec<u32>,
}

impl Layout {
    /// The words of a race whose locations set the rates of these clocks.
    /// `sees_time` says of who decides for the controller, if anybody does, whether it sees clocks.
    pub(super) fn of(
        program: &Program<'_>,
        rated: &[(u32, u32)],
        sees_time: Option<bool>,
    ) -> Layout {
        let network = program.network;
        let mut words = network.initial.len() as u32;
        let mut take = |count: u32| {
            let first = words.next_multiple_of(2);
            words = first + count;
            first
        };
        let processes = network.processes.len();
        let attempts = (0..processes).map(|process| {
            let mut spots = program.spots_of(process).iter();
            spots.any(|spot| !spot.outputs.is_empty()).then(|| take(2))
        });
        let attempts: Vec<_> = attempts.collect();
        let stays = (0..processes).map(|process| {
            let mut spots = program.spots_of(process).iter();
            spots
                .any(|spot| {
                    spot.urgency != Urgency::Normal
                        || matches!(spot.invariant, Condition::Compared(_))
                })
                .then(|| take(2))
        });
        let stays = stays.collect();
        let most_windows = (0..processes)
            .flat_map(|process| program.spots_of(process))
            .map(|spot| spot.outputs.numbers().len() as u32)
            .max()
            .unwrap_or(0)
            .max(1);
        let stale_words = processes.div_ceil(BITS) as u32;
        Layout {
            attempts,
            stays,
            has_stays: take(1),
            stale: take(stale_words),
            stale_words,
            committed: take(1),
            time: take(2),
            decided_after: take(2),
            bound: take(2),
            moves_left: take(1),
            best: take(2),
            windows: take(1),
            lows: take(2 * most_windows),
            highs: take(2 * most_windows),
            rate: take(2),
            most_windows,
            stream: network.chances.stream,
            result: network.chances.result,
            in_windows: FunctionId(network.functions.len() as u32),
            rates: rated.iter().map(|&(_, clock)| (clock, take(2))).collect(),
            decisions: sees_time.map(|sees_time| {
                let entries = program.outputs_of_controller().map(|(number, _)| number);
                let entries: Vec<u32> = entries.collect();
                Decisions {
                    sees_time,
                    hold: take(2),
                    draws: take(1),
                    resume: take(1),
                    questions: (0..processes)
                        .map(|process| {
                            let mut spots = program.spots_of(process).iter();
                            let is_mixed = spots.any(|spot| program.is_mixed(spot));
                            is_mixed.then(|| take(1))
                        })
                        .collect(),
                    winner: take(1),
                    move_count: take(1),
                    moves: take(entries.len() as u32),
                    urgent: take(1),
                    entries,
                }
            }),
            words,
        }
    }

    /// Whether locations set the rate of a clock.
    pub(super) fn is_rated(&self, clock: u32) -> bool {
        self.rates.iter().any(|&(one, _)| one == clock)
    }

    /// The double that keeps what the rate of a clock was.
    pub(super) fn rate_before(&self, clock: u32) -> u32 {
        let mut known = self.rates.iter();
        let (_, word) = known
            .find(|&&(one, _)| one == clock)
            .expect("its rate is set");
        *word
    }

    /// The word and the bit that say whether a process plans anew.
    pub(super) fn stale_bit(&self, process: usize) -> (u32, i32) {
        (self.stale + (process / BITS) as u32, 1 << (process % BITS))
    }
}
