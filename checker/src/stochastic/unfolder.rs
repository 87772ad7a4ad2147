//! States with all that may come next: what exact answers are computed from.

use super::behaviour::Behaviour;
use super::control::{Chooser, Chosen, Control, Guidance, Moment, StateView};
use super::failure::Failure;
use super::program::Program;
use super::race::{Drawn, NotFinite, Race, Step, Unfolded};
use super::run_id::RunId;
use crate::ir::{Aim, Optimum};

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
        let Stage {
            time,
            moves,
            is_asked,
        } = stage;
        let step = Step {
            words,
            time,
            moves,
            is_asked,
        };
        self.race
            .unfold(&self.program, asked, step, &mut self.found)
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
        match asked.aim {
            Aim::Expected(number) => {
                self.race.machine.restore(words);
                self.race.machine.real(number, &[])
            }
            Aim::Time | Aim::Probability => Ok(0.0),
        }
    }

    /// The last state as whoever decides sees it, after the delay.
    pub fn view(&mut self) -> StateView<'_> {
        self.race.machine.view_of_state()
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
    fn begin(&mut self, _: RunId) {}

    fn sees_time(&self) -> bool {
        self.0
    }

    fn choose(&mut self, _: &mut StateView<'_>, _: Moment<'_>) -> Result<Chosen, Failure> {
        Ok(Chosen::Draw)
    }
}
