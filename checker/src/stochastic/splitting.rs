//! Importance splitting: the probability of a rare event, from runs that are started again where
//! others came nearer to it.
//!
//! A *level* is a number that says how near a state is to the event. Thresholds cut the way there
//! into stages. In each stage the same number of *parts* of runs, the effort, begin where parts of
//! the stage before reached their threshold, each with random numbers of its own; the shares of
//! parts that reach the next threshold are multiplied. The event counts as beyond all thresholds.
//!
//! Where a stage begins is taken in turn, from a random one on, so each beginning has the same
//! number of parts in the mean. So the product has the probability as its mean, whatever levels and
//! thresholds are; they decide only how much it varies. Independent repetitions say how much: the
//! interval is Student's for the logarithm of their mean, which is right in the limit of many
//! repetitions. A repetition has the value 0 if a stage is not passed.
//!
//! The thresholds are chosen by a pilot, which has random numbers of its own: in each stage the
//! greatest level that a share of [`PILOT_SHARE`] of the parts reach.
//!
//! Sources: M. J. J. Garvels, "The splitting method in rare event simulation", University of Twente
//! 2000, on fixed effort and its mean; F. Cérou and A. Guyader, "Adaptive
//! multilevel splitting for rare event analysis", Stochastic Analysis and Applications 25 (2007),
//! on thresholds from quantiles; C. E. Budde, P. R. D'Argenio and A. Hartmanns, "Better automated
//! importance splitting for transient rare events", SETTA 2017, on a pilot before it.

use crate::ir::{STREAM_WORDS, Stream};

/// What a part of a run comes to.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum End<S> {
    /// The threshold, in this state.
    Threshold(S),
    /// The event.
    Event,
    /// Neither.
    Nothing,
}

/// A part of a run.
pub(super) struct Part<S> {
    /// What it came to.
    pub(super) end: End<S>,
    /// The greatest level on the way, that of the first state included.
    pub(super) highest: f64,
}

/// What makes parts of runs.
pub(super) trait Parts {
    /// A state of a run, with all that is needed to go on.
    type State;
    /// Why a part has no result.
    type Failure;

    /// Goes on from a state, or from the initial one, until the level is at least `threshold`. A
    /// part with the same number of random numbers and the same beginning is the same part.
    fn part(
        &mut self,
        from: Option<&Self::State>,
        threshold: f64,
        numbers: u64,
    ) -> Result<Part<Self::State>, Self::Failure>;
}

/// A share of the parts of a stage that should reach its threshold: near to the best one,
/// exp(-2), for stages that are independent.
const PILOT_SHARE: f64 = 0.2;

/// There are no more thresholds.
const MOST_THRESHOLDS: usize = (1 << 12) - 1;

/// The greatest effort.
pub const MOST_EFFORT: u64 = 1 << 24;

/// Where a part of a stage begins.
enum Entry<S> {
    /// In the initial state.
    Start,
    /// In a state.
    State(S),
    /// Beyond all thresholds.
    Event,
}

/// Which stage it is.
#[derive(Clone, Copy)]
struct StageId {
    seed: u64,
    repetition: u64,
    stage: usize,
}

impl StageId {
    /// The number of random numbers of a part: different for all parts of all repetitions.
    fn part(self, index: u64) -> u64 {
        (self.repetition << 36) | ((self.stage as u64) << 24) | index
    }
}

/// The parts of one stage, up to a threshold.
struct Stage<S> {
    /// Where those of the next stage begin.
    entries: Vec<Entry<S>>,
    /// The greatest level of each part, infinite for the event; in order.
    highest: Vec<f64>,
}

fn stage<P: Parts>(
    parts: &mut P,
    entries: &[Entry<P::State>],
    threshold: f64,
    effort: u64,
    id: StageId,
) -> Result<Stage<P::State>, P::Failure> {
    // The number after those of all parts.
    let mut words = [0; STREAM_WORDS];
    Stream::start(&mut words, id.seed, id.part(MOST_EFFORT - 1));
    let first = Stream::of(&mut words).below(entries.len() as u32) as usize;
    let mut found = Stage {
        entries: Vec::new(),
        highest: Vec::new(),
    };
    for index in 0..effort {
        let from = match &entries[(first + index as usize) % entries.len()] {
            Entry::Start => None,
            Entry::State(state) => Some(state),
            Entry::Event => {
                found.entries.push(Entry::Event);
                found.highest.push(f64::INFINITY);
                continue;
            }
        };
        let part = parts.part(from, threshold, id.part(index))?;
        match part.end {
            End::Threshold(state) => {
                found.entries.push(Entry::State(state));
                found.highest.push(part.highest);
            }
            End::Event => {
                found.entries.push(Entry::Event);
                found.highest.push(f64::INFINITY);
            }
            End::Nothing => found.highest.push(part.highest),
        }
    }
    Ok(found)
}

/// What a pilot found.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pilot {
    /// The thresholds, in order.
    pub(super) thresholds: Vec<f64>,
    /// Whether it reached the event.
    pub(super) has_reached: bool,
    /// How many parts it made.
    pub(super) parts: u64,
}

/// Chooses thresholds.
pub(super) fn pilot<P: Parts>(parts: &mut P, seed: u64, effort: u64) -> Result<Pilot, P::Failure> {
    let mut found = Pilot {
        thresholds: Vec::new(),
        has_reached: false,
        parts: 0,
    };
    let mut entries = vec![Entry::Start];
    let mut level = f64::NEG_INFINITY;
    while found.thresholds.len() < MOST_THRESHOLDS {
        // Repetitions have numbers from 1 on.
        let here = StageId {
            seed,
            repetition: 0,
            stage: found.thresholds.len(),
        };
        let mut highest = stage(parts, &entries, f64::INFINITY, effort, here)?.highest;
        found.parts += effort;
        highest.sort_by(|one, other| other.total_cmp(one));
        found.has_reached = highest[0].is_infinite();
        let rank = (PILOT_SHARE * effort as f64).ceil() as usize;
        let mut next = highest[rank.clamp(1, highest.len()) - 1];
        if found.thresholds.is_empty() {
            // All parts begin with the level of the initial state.
            level = highest.iter().copied().fold(f64::INFINITY, f64::min);
        }
        if next <= level {
            // Few parts come any nearer: the least step that one of them made.
            let nearer = highest.iter().rev().find(|&&one| one > level);
            let Some(&nearer) = nearer else { break };
            next = nearer;
        }
        if next.is_infinite() {
            break;
        }
        entries = stage(parts, &entries, next, effort, here)?.entries;
        found.parts += effort;
        found.thresholds.push(next);
        level = next;
    }
    Ok(found)
}

/// The estimate of one repetition, numbered from 1, and how many parts it made.
pub(super) fn repetition<P: Parts>(
    parts: &mut P,
    thresholds: &[f64],
    effort: u64,
    seed: u64,
    repetition: u64,
) -> Result<(f64, u64), P::Failure> {
    let mut entries = vec![Entry::Start];
    let (mut product, mut made) = (1.0, 0);
    let stages = thresholds.iter().copied().chain([f64::INFINITY]);
    for (stage_number, threshold) in stages.enumerate() {
        let here = StageId {
            seed,
            repetition,
            stage: stage_number,
        };
        entries = stage(parts, &entries, threshold, effort, here)?.entries;
        made += effort;
        product *= entries.len() as f64 / effort as f64;
        if entries.is_empty() {
            break;
        }
    }
    Ok((product, made))
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::super::statistics::Expectation;
    use super::super::statistics::draws::Draws;
    use super::{End, Part, Parts, Pilot, pilot, repetition};

    /// A walk that goes up with a probability of `up`, from 1 until it is 0 or the goal.
    struct Walk {
        seed: u64,
        up: f64,
        goal: i32,
    }

    impl Walk {
        /// The probability of the goal: that of the gambler's ruin.
        fn exact(&self) -> f64 {
            let ratio = (1.0 - self.up) / self.up;
            (ratio - 1.0) / (ratio.powi(self.goal) - 1.0)
        }
    }

    impl Parts for Walk {
        type State = i32;
        type Failure = Infallible;

        fn part(
            &mut self,
            from: Option<&i32>,
            threshold: f64,
            numbers: u64,
        ) -> Result<Part<i32>, Infallible> {
            let mut draws = Draws::new(self.seed.rotate_left(48) ^ numbers);
            let mut place = from.copied().unwrap_or(1);
            let mut highest = f64::from(place);
            loop {
                highest = highest.max(f64::from(place));
                let end = if place == self.goal {
                    End::Event
                } else if place == 0 {
                    End::Nothing
                } else if f64::from(place) >= threshold {
                    End::Threshold(place)
                } else {
                    place += if draws.next() < self.up { 1 } else { -1 };
                    continue;
                };
                return Ok(Part { end, highest });
            }
        }
    }

    /// The mean of some repetitions, and whether its interval holds the probability.
    fn estimate(seed: u64, goal: i32, effort: u64, repetitions: u64) -> (f64, bool, u64) {
        let mut walk = Walk {
            seed,
            up: 0.3,
            goal,
        };
        let Ok(found) = pilot(&mut walk, seed, effort);
        assert!(found.has_reached);
        let mut mean = Expectation::default();
        let mut parts = found.parts;
        for number in 1..=repetitions {
            let Ok((value, made)) = repetition(&mut walk, &found.thresholds, effort, seed, number);
            mean.push(value);
            parts += made;
        }
        let interval = mean
            .student_of_logarithm(0.05)
            .expect("there are repetitions");
        let exact = walk.exact();
        let holds = interval.lower <= exact && exact <= interval.upper;
        (mean.mean(), holds, parts)
    }

    #[test]
    fn intervals_of_a_rare_ruin_hold_it_as_often_as_they_say() {
        const SEEDS: u64 = 1000;
        let walk = Walk {
            seed: 0,
            up: 0.3,
            goal: 25,
        };
        let exact = walk.exact();
        assert!((8e-10..9e-10).contains(&exact), "{exact}");
        let (mut held, mut sum) = (0, 0.0);
        for seed in 0..SEEDS {
            let (mean, holds, parts) = estimate(seed, 25, 200, 10);
            held += u64::from(holds);
            sum += mean;
            assert!(parts < 100_000, "{parts}");
        }
        assert!((905..=970).contains(&held), "{held} of {SEEDS}");
        // The mean of all 10,000 repetitions has no bias that shows.
        let ratio = sum / SEEDS as f64 / exact;
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    }

    #[test]
    fn any_thresholds_have_the_same_mean() {
        let mut walk = Walk {
            seed: 5,
            up: 0.3,
            goal: 8,
        };
        let exact = walk.exact();
        for thresholds in [&[][..], &[4.0], &[2.0, 3.0, 6.0], &[7.5, 7.5]] {
            let mut mean = Expectation::default();
            for number in 1..=4000 {
                let Ok((value, _)) = repetition(&mut walk, thresholds, 50, 5, number);
                mean.push(value);
            }
            let interval = mean.student(1e-6).expect("there are repetitions");
            assert!(
                interval.lower <= exact && exact <= interval.upper,
                "{thresholds:?}: {interval:?} without {exact}"
            );
        }
    }

    #[test]
    fn a_level_that_says_nothing_leaves_plain_runs() {
        struct Flat(Walk);
        impl Parts for Flat {
            type State = i32;
            type Failure = Infallible;
            fn part(
                &mut self,
                from: Option<&i32>,
                threshold: f64,
                numbers: u64,
            ) -> Result<Part<i32>, Infallible> {
                assert!(threshold.is_infinite());
                let Ok(part) = self.0.part(from, threshold, numbers);
                let highest = 0.0;
                Ok(Part { highest, ..part })
            }
        }
        let walk = |goal| Walk {
            seed: 3,
            up: 0.3,
            goal,
        };
        let Ok(found) = pilot(&mut Flat(walk(3)), 3, 100);
        let expected = Pilot {
            thresholds: Vec::new(),
            has_reached: true,
            parts: 100,
        };
        assert_eq!(found, expected);
        let Ok(found) = pilot(&mut Flat(walk(60)), 3, 100);
        assert!(!found.has_reached);
    }
}
