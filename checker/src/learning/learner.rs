//! Learning a strategy: runs are made, what they cost is remembered, the partition is cut where
//! that tells something apart, and the values of actions are computed again, iteration by
//! iteration. Each iteration gives a strategy that takes the best action everywhere; the best of
//! them is kept.
//!
//! Whether one is better than another is judged by the same runs for all of them, which learning
//! never sees. All is determined by the seed: results count in the order of run numbers.
//!
//! Source: M. Jaeger et al., "Teaching Stratego to play ball", ATVA 2019 (abstract), for Q-learning
//! and M-learning on partitions; D. Russo et al., "A tutorial on Thompson sampling" (2018), for
//! what is tried while learning.

use std::ops::Range;
use std::sync::Arc;

use super::episode::Episode;
use super::experience::Experience;
use super::explorer::{Explorer, Explorers, Manner};
use super::options::{Learning, Method};
use super::partition::Partition;
use super::process::Process;
use super::refinement::{Rule, refine};
use super::whole_state::functions;
use crate::analysis::LiveVariables;
use crate::ir::{Asked, Observation, Optimum};
use crate::stochastic::statistics::Expectation;
use crate::stochastic::{Behaviour, Failure, RunId, Runner, runs_by};

/// Numbers of runs that learning never uses: those that judge the strategy of an iteration.
const JUDGING: u64 = 1 << 40;

/// The first part of the runs that judge a strategy is enough if its standard error is less than
/// this part of what random runs differ by.
const FIRST_PART: u64 = 5;
const SURE: f64 = 0.002;

/// A decision that gives more samples counts for more than one, so that it takes no more time.
const MANY_SAMPLES: f64 = 2.0;

/// A better strategy counts as such if it gains so many standard errors.
const NOTABLE: f64 = 0.2;

/// A mean with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
    /// Of how many runs.
    pub runs: u64,
}

/// How far learning is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// How many runs were made.
    pub runs: u64,
    /// How many iterations.
    pub iterations: u64,
    /// How many decisions a run has, about.
    pub steps_of_run: f64,
    /// The value of the best strategy until now, by the runs that judged it.
    pub best: Option<Mean>,
}

/// What an iteration came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// How many runs were made until its end.
    pub runs: u64,
    /// How many times all had been forgotten before.
    pub resets: u64,
    /// The value of its strategy, by the runs that judged it.
    pub value: Mean,
}

/// What learning came to.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The cells with the values of the best strategy.
    pub partition: Partition,
    /// What happened until then.
    pub progress: Progress,
    /// What its iterations came to, in their order.
    pub history: Vec<Iteration>,
    /// How many times all was forgotten.
    pub resets: u64,
    /// The iterations since then.
    pub iterations_in_last_reset: u64,
    /// Whether it was not ended before its time.
    pub is_complete: bool,
}

/// Learns.
///
/// # Errors
/// A run failed.
pub fn learn(
    behaviour: Behaviour<'_>,
    asked: &Optimum,
    observation: &Arc<Observation>,
    options: &Learning,
    mut watch: impl FnMut(&Progress) -> bool,
) -> Result<Learned, Failure> {
    let width = observation.words();
    let sign = if asked.is_greatest { -1.0 } else { 1.0 };
    let first = Manner {
        partition: Arc::new(Partition::new(width)),
        randomness: 1.0,
        learns: true,
    };
    let explorers = Explorers::new(Arc::clone(observation), asked.aim, sign, first);
    let live = asked.features.is_none().then(|| live_in(behaviour, asked));
    let explorers = explorers.without_dead(live.flatten());
    let behaviour = Behaviour {
        guidance: Some(&explorers),
        ..behaviour
    };
    let mut learner = Learner {
        asked,
        options,
        sign,
        runners: Runner::several(behaviour, options.threads),
        partition: Partition::new(width),
        experience: Experience::new(width, observation.continuous.len()),
        dimension: observation.continuous.len(),
        next_run: 0,
        samples_of_step: 1.0,
        spread: 0.0,
        progress: Progress {
            runs: 0,
            iterations: 0,
            steps_of_run: 1.0,
            best: None,
        },
        history: Vec::new(),
        best: Partition::new(width),
    };
    learner.all(&mut watch)
}

/// What is dead where, of what the whole state has.
fn live_in(behaviour: Behaviour<'_>, asked: &Optimum) -> Option<LiveVariables> {
    let functions = functions(asked).into_iter().chain(asked.aim.number());
    LiveVariables::new(behaviour.network, functions, false)
}

struct Learner<'a> {
    asked: &'a Optimum,
    options: &'a Learning,
    sign: f64,
    runners: Vec<Runner<'a>>,
    partition: Partition,
    experience: Experience,
    dimension: usize,
    next_run: u64,
    /// How many samples a decision gives: a wait gives one in each cell that it passes through.
    samples_of_step: f64,
    /// The standard deviation of what runs cost when all was random.
    spread: f64,
    progress: Progress,
    history: Vec<Iteration>,
    best: Partition,
}

impl Learner<'_> {
    fn all(&mut self, watch: &mut dyn FnMut(&Progress) -> bool) -> Result<Learned, Failure> {
        let (mut resets, mut since_better, mut in_reset) = (0, 0, 0);
        let mut is_complete = true;
        while self.progress.iterations < self.options.iterations {
            if !self.collect(in_reset, watch)? {
                is_complete = false;
                break;
            }
            self.value(in_reset);
            self.progress.iterations += 1;
            in_reset += 1;
            let Some(mean) = self.judge(watch)? else {
                is_complete = false;
                break;
            };
            self.history.push(Iteration {
                runs: self.progress.runs,
                resets,
                value: mean,
            });
            let gain = match self.progress.best {
                None => f64::INFINITY,
                Some(best) => self.sign * (best.value - mean.value),
            };
            if gain > 0.0 {
                self.progress.best = Some(mean);
                self.best = self.partition.clone();
            }
            if gain > NOTABLE * mean.error {
                since_better = 0;
            } else {
                since_better += 1;
            }
            if watch(&self.progress) {
                is_complete = false;
                break;
            }
            if self.options.has_enough(in_reset - 1, since_better) {
                if resets >= self.options.resets {
                    break;
                }
                resets += 1;
                (since_better, in_reset) = (0, 0);
                self.partition = Partition::new(self.options.width);
                self.experience = Experience::new(self.options.width, self.dimension);
            }
        }
        Ok(Learned {
            partition: std::mem::take(&mut self.best),
            progress: self.progress,
            history: std::mem::take(&mut self.history),
            resets,
            iterations_in_last_reset: in_reset,
            is_complete,
        })
    }

    /// Makes the runs of an iteration, and remembers their decisions. Returns whether all were
    /// made.
    fn collect(
        &mut self,
        iteration: u64,
        watch: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<bool, Failure> {
        let steps_of_run = self.progress.steps_of_run * self.weight();
        let count = self.options.runs(iteration, steps_of_run);
        let runs = self.next_run..self.next_run + count;
        self.next_run += count;
        let randomness = if iteration == 0 {
            1.0
        } else {
            self.options.randomness
        };
        let mut episodes = Vec::new();
        let is_whole = self.made(runs, randomness, true, &mut episodes, watch)?;
        let steps: usize = episodes.iter().map(|one| one.steps.len()).sum();
        self.progress.steps_of_run = (steps as f64 / episodes.len().max(1) as f64).max(1.0);
        if iteration == 0 {
            self.spread = mean_of(&episodes, 1.0).error * (episodes.len() as f64).sqrt();
        }
        if self.options.method == Method::Q {
            self.experience.forget(0);
        }
        for episode in &episodes {
            self.experience.add(&mut self.partition, episode);
        }
        let most = (self.options.memory as f64 / self.weight()) as usize;
        self.experience.forget(most);
        Ok(is_whole)
    }

    /// By how much a decision counts more than one, since it gives many samples.
    fn weight(&self) -> f64 {
        (self.samples_of_step / MANY_SAMPLES).max(1.0)
    }

    /// Cuts the partition further, and computes all values.
    fn value(&mut self, iteration: u64) {
        let discount = self.options.discount(self.progress.steps_of_run);
        let mut process = self.experience.process(&self.partition);
        process.begin_with(&self.partition.cells);
        if self.options.method == Method::M {
            self.compute(&mut process, discount);
        }
        let rule = Rule {
            score: self.options.score,
            difference: self.options.difference(iteration) * self.spread,
            samples: self.options.samples,
            cells: self.options.cells,
        };
        if refine(
            &mut self.partition,
            &process,
            self.dimension,
            rule,
            discount,
        ) > 0
        {
            process = self.experience.process(&self.partition);
            process.begin_with(&self.partition.cells);
        }
        match self.options.method {
            Method::M => self.compute(&mut process, discount),
            Method::Q => {
                let alpha = self.options.alpha;
                process.follow(&self.partition.cells, discount, alpha, self.spread);
            }
        }
        process.note(&mut self.partition.cells);
        self.samples_of_step = process.len() as f64 / self.experience.len() as f64;
    }

    /// Computes all values from all samples.
    fn compute(&self, process: &mut Process, discount: f64) {
        match self.options.trace(self.progress.steps_of_run) {
            0.0 => process.iterate(discount, self.spread),
            trace => process.follow_traces(discount, trace, self.spread),
        }
    }

    /// The mean value of runs under the strategy that takes the best action everywhere; none if it
    /// was ended.
    fn judge(&mut self, watch: &mut dyn FnMut(&Progress) -> bool) -> Result<Option<Mean>, Failure> {
        let count = self.options.judging(self.progress.steps_of_run);
        let first = match self.options.judging_runs {
            None => count / FIRST_PART,
            Some(_) => count,
        };
        let mut episodes = Vec::new();
        for part in [0..first, first..count] {
            let runs = JUDGING + part.start..JUDGING + part.end;
            if !self.made(runs, 0.0, false, &mut episodes, watch)? {
                return Ok(None);
            }
            let error = mean_of(&episodes, self.sign).error;
            // Where all runs are worth the same, what is rare has not been seen yet.
            if error > 0.0 && error < SURE * self.spread {
                break;
            }
        }
        Ok(Some(mean_of(&episodes, self.sign)))
    }

    /// Makes runs.
    fn made(
        &mut self,
        runs: Range<u64>,
        randomness: f64,
        learns: bool,
        episodes: &mut Vec<Episode>,
        watch: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<bool, Failure> {
        let partition = Arc::new(std::mem::take(&mut self.partition));
        for runner in &mut self.runners {
            explorer(runner).set(Some(Manner {
                partition: Arc::clone(&partition),
                randomness,
                learns,
            }));
        }
        let (asked, seed) = (self.asked, self.options.seed);
        let run = |runner: &mut Runner<'_>, run| {
            let outcome = runner.observe(RunId { seed, run }, &asked.bound, Asked::End(asked))?;
            if !outcome.value.is_finite() {
                return Err(Failure::NoNumber);
            }
            Ok(explorer(runner).ended(outcome.value, outcome.time))
        };
        let before = self.progress;
        let known = episodes.len();
        let made = runs_by(
            &mut self.runners,
            runs,
            run,
            |episode| episodes.push(episode),
            |made| {
                let runs = before.runs + made;
                watch(&Progress { runs, ..before })
            },
        );
        for runner in &mut self.runners {
            explorer(runner).set(None);
        }
        self.partition = Arc::into_inner(partition).expect("no explorer has it any more");
        self.progress.runs += (episodes.len() - known) as u64;
        made
    }
}

fn explorer<'r>(runner: &'r mut Runner<'_>) -> &'r mut Explorer {
    runner.chooser().expect("an explorer decides")
}

/// The mean value of runs; `sign` is that of their costs.
fn mean_of(episodes: &[Episode], sign: f64) -> Mean {
    let mut costs = Expectation::default();
    for episode in episodes {
        costs.push(episode.cost);
    }
    Mean {
        value: sign * costs.mean(),
        error: costs.error(),
        runs: costs.count(),
    }
}
