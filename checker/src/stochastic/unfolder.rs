//! States with all that may come next: what exact answers are computed from.

use super::behaviour::Behaviour;
use super::constants::TOLERANCE;
use super::control::{Chooser, Chosen, Control, Guidance, Moment, StateView};
use super::failure::Failure;
use super::observer::{aim_of, watched};
use super::program::Program;
use super::race::{Drawn, Found, NotFinite, Race, Unfolded, known};
use super::run::rest;
use crate::ir::{Optimum, RunLimit};

/// A state of a run, beside its words.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stage {
    /// How long the run has lasted.
    pub time: f64,
    /// How many moves it has made.
    pub moves: u64,
    /// Whether the controller is being asked, after chance has decided that it is.
    pub is_asked: bool,
}

/// A move that may be made.
#[derive(Clone, Copy, Debug)]
pub struct PossibleMove<'u> {
    /// How likely it is.
    pub chance: f64,
    /// By how much the value grows.
    pub gain: f64,
    /// The state behind it, clocks included.
    pub words: &'u [i32],
}

/// Finds all that may come next from states.
pub struct Unfolder<'a> {
    program: Program<'a>,
    race: Race<'a>,
    found: Unfolded,
}

impl<'a> Unfolder<'a> {
    /// For a network whose controller decides; it is asked as one that sees clocks, or sees none.
    pub fn new(behaviour: Behaviour<'a>, sees_time: bool) -> Unfolder<'a> {
        let guidance = Nobody(sees_time);
        let program = Program::new(behaviour.network, behaviour.executor);
        let mut race = Race::new(Behaviour {
            guidance: None,
            ..behaviour
        });
        race.control = Some(Control::new(&guidance));
        race.drawn = Some(Drawn::new(behaviour.network.processes.len()));
        Unfolder {
            program,
            race,
            found: Unfolded::default(),
        }
    }

    /// Finds what may come next from a state, or why that is not finite.
    ///
    /// # Errors
    /// A run fails there.
    pub fn unfold(
        &mut self,
        asked: &Optimum,
        words: &[i32],
        stage: Stage,
    ) -> Result<Result<(), NotFinite>, Failure> {
        self.found.clear();
        let before = known!(self.enter(asked, words, stage));
        let Unfolder {
            program,
            race,
            found,
        } = self;
        let bound = &asked.bound;
        if bound.limit == RunLimit::Moves && stage.moves as f64 >= bound.value {
            let end = watch(race, asked, 0.0)?.unwrap_or((false, 0.0));
            return self.ends(asked, end, before);
        }
        let rest = rest(race, bound);
        let rivals = known!(race.first_rivals(program, rest));
        let slack = if rest > 0.0 {
            TOLERANCE * bound.value.max(1.0)
        } else {
            TOLERANCE
        };
        let nobody = rivals.winners.is_empty();
        let is_over = rest + slack < rivals.delay
            || (nobody && rest.is_finite() && rest <= rivals.delay + slack);
        let delay = rivals.delay.min(rest).max(0.0);
        if let Some(end) = watch(race, asked, delay)? {
            return self.ends(asked, end, before);
        }
        if is_over {
            race.wait(delay)?;
            return self.ends(asked, (false, 0.0), before);
        }
        if nobody {
            return match race.lock_of(&rivals) {
                Some(failure) => Err(failure),
                None if bound.limit == RunLimit::Moves => self.ends(asked, (false, 0.0), before),
                None => Err(Failure::BoundNeverReached),
            };
        }
        known!(race.wait_for_rivals(delay));
        found.delay = delay;
        let is_asked = stage.is_asked;
        race.go_on_from(program, asked.aim, &rivals.winners, before, is_asked, found)
    }

    /// Goes to a state; what it says of the value.
    fn enter(&mut self, asked: &Optimum, words: &[i32], stage: Stage) -> Found<f64> {
        let moment = (stage.time, stage.moves);
        known!(self.race.go_to(&self.program, words, moment));
        Ok(Ok(self.race.worth(asked.aim)?))
    }

    /// Notes that the run ends, satisfied or not, so much later.
    fn ends(&mut self, asked: &Optimum, (satisfied, ahead): (bool, f64), before: f64) -> Found<()> {
        let value = aim_of(&mut self.race, asked.aim, satisfied, ahead)?;
        self.found.end = Some(value - before);
        Ok(Ok(()))
    }

    /// What the run is worth beyond what its state says, if it ends in the last state.
    pub fn end(&self) -> Option<f64> {
        self.found.end
    }

    /// How long time passes there before something happens.
    pub fn delay(&self) -> f64 {
        self.found.delay
    }

    /// How likely it is that the controller is asked there.
    pub fn asked(&self) -> f64 {
        self.found.asked
    }

    /// What may happen there without a choice; the chances are those before it is known whether
    /// the controller is asked.
    pub fn chances(&self) -> impl Iterator<Item = PossibleMove<'_>> {
        self.moves(0, self.found.chance_end)
    }

    /// How many choices the controller has, if all there depends on it.
    pub fn choices(&self) -> usize {
        self.found.choices.len()
    }

    /// The number of the move that a choice is, none to wait.
    pub fn choice(&self, choice: usize) -> Option<u32> {
        self.found.choices[choice].0
    }

    /// What may happen after a choice.
    pub fn chances_of(&self, choice: usize) -> impl Iterator<Item = PossibleMove<'_>> {
        let before = choice.checked_sub(1);
        let start = before.map_or(self.found.chance_end, |one| self.found.choices[one].1);
        self.moves(start, self.found.choices[choice].1)
    }

    fn moves(&self, start: usize, end: usize) -> impl Iterator<Item = PossibleMove<'_>> {
        let width = self.program.network.layout.words as usize;
        (start..end).map(move |place| PossibleMove {
            chance: self.found.outcomes[place].chance,
            gain: self.found.outcomes[place].gain,
            words: &self.found.words[place * width..][..width],
        })
    }

    /// What the words of a state say of the value.
    ///
    /// # Errors
    /// The code failed.
    pub fn worth(&mut self, asked: &Optimum, words: &[i32]) -> Result<f64, Failure> {
        self.race.machine.restore(words);
        self.view().worth(asked.aim, 0.0)
    }

    /// The last state as whoever decides sees it, after the delay.
    pub fn view(&mut self) -> StateView<'_> {
        self.race.machine.view_of_state()
    }
}

/// Whether what is to be reached is reached in the delay behind a state, and after which time.
fn watch(race: &mut Race<'_>, asked: &Optimum, delay: f64) -> Result<Option<(bool, f64)>, Failure> {
    match &asked.goal {
        Some(goal) => watched(race, goal, delay),
        None => Ok(None),
    }
}

/// Stands for a controller that is asked, but never answers: all its choices are looked at.
struct Nobody(bool);

impl Guidance for Nobody {
    fn chooser(&self) -> Box<dyn Chooser> {
        Box::new(Nobody(self.0))
    }
}

impl Chooser for Nobody {
    fn sees_time(&self) -> bool {
        self.0
    }

    fn choose(&mut self, _: &mut StateView<'_>, _: Moment<'_>) -> Result<Chosen, Failure> {
        Ok(Chosen::Draw)
    }
}
