//! Who decides for the controller in a random run, and when it is asked.
//!
//! The controller owns all controllable outputs of all processes. It is asked at a *decision*: when
//! one of them can be taken. There are two ways in which decisions come about:
//! * If it sees clocks, it is asked at once, whenever something has happened or one more of its
//!   moves is enabled. It moves at once, or it waits; then it is asked again after the time that it
//!   says, which is when what it sees changes next.
//! * If it sees none, a delay is drawn for its moves as for all others, and it is asked when that
//!   is over. If it waits then, it is not asked again before something has happened.
//!
//! In both, it chooses among all moves that are enabled, of whatever process, and it must move
//! where time cannot pass and nobody else can move. So a delay of the controller depends on what it
//! sees and on nothing else, and what is decided is the same in random runs, in the closed loop,
//! and in code that is made of a strategy.
//!
//! A move of the controller is known by its entry: the number of an instance in the program.
//!
//! A fence keeps it from some moves: whoever decides sees only what the fence leaves. If nobody
//! decides, one of the moves that are left is drawn.

use std::any::Any;

use crate::exec::arithmetic::double_of_words;
use crate::exec::{Context, Executor};
use crate::ir::{Aim, FunctionId, LocationId, Network, Part, ProcessId, STREAM_WORDS, Stream};

use super::failure::Failure;

/// A state as whoever decides sees it.
pub struct StateView<'s> {
    /// Its words.
    pub words: &'s mut [i32],
    /// Runs code of the network.
    pub executor: &'s dyn Executor,
    /// The network.
    pub network: &'s Network,
}

impl StateView<'_> {
    /// The number that a function leaves.
    pub fn real(&mut self, function: FunctionId) -> Result<f64, Failure> {
        let mut context = Context {
            state: self.words,
            constraints: &mut Vec::new(),
            assignments: &mut Vec::new(),
        };
        self.executor.call(function, &[], &mut context)?;
        Ok(self.double(self.network.chances.result))
    }

    /// What a run is worth that has lasted so long, by what its state says.
    pub fn worth(&mut self, aim: Aim, time: f64) -> Result<f64, Failure> {
        match aim {
            Aim::Probability => Ok(0.0),
            Aim::Time => Ok(time),
            Aim::Expected(number) => self.real(number),
        }
    }

    /// The double at a word.
    pub fn double(&self, word: u32) -> f64 {
        let word = word as usize;
        double_of_words(self.words[word], self.words[word + 1])
    }

    /// The integer at a word.
    pub fn integer(&self, word: u32) -> i32 {
        self.words[word as usize]
    }

    /// The rate of the clock at a word.
    pub fn rate(&self, clock: u32) -> f64 {
        self.double(clock + 2)
    }

    /// The random numbers of the run.
    pub fn stream(&mut self) -> Stream<'_> {
        let start = self.network.chances.stream as usize;
        Stream::of(&mut self.words[start..start + STREAM_WORDS])
    }

    /// Where a process is.
    pub fn location(&self, ProcessId(process): ProcessId) -> LocationId {
        LocationId(self.words[process as usize] as u32)
    }
}

/// A move that the controller may make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControllerMove {
    /// The number of its entry.
    pub number: u32,
    /// The edge with the values of its `select` bindings; of a leg that is an edge, the first leg
    /// of its entry.
    pub part: Part,
}

/// What is asked of the controller.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'m> {
    /// The moves that are possible, by the numbers of their entries, each once; never none.
    pub moves: &'m [u32],
    /// Whether it may wait.
    pub may_wait: bool,
    /// Whether all clocks keep their rates as time passes.
    pub is_straight: bool,
    /// How long the run has lasted.
    pub time: f64,
}

/// What the controller does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Chosen {
    /// It makes the move with this place among those that are possible.
    Move(usize),
    /// It waits, and is asked again after this time, if nothing has happened before; where its
    /// delays are drawn, only when something has happened.
    Wait(f64),
    /// It waits, and lets a delay be drawn for its moves as for those of others.
    Draw,
}

/// Decides for the controller, run by run.
pub trait Chooser: Any + Send {
    /// A run begins.
    fn begin(&mut self) {}

    /// Something has happened in the run.
    fn renew(&mut self) {}

    /// Whether it sees clocks.
    fn sees_time(&self) -> bool;

    /// Decides.
    fn choose(&mut self, state: &mut StateView<'_>, moment: Moment<'_>) -> Result<Chosen, Failure>;
}

/// Makes who decides, one for each thread.
pub trait Guidance: Sync {
    /// One of them.
    fn chooser(&self) -> Box<dyn Chooser>;

    /// Whether they decide the same if a run is made again from its begin, as happens where code
    /// gives one up.
    fn can_begin_anew(&self) -> bool {
        true
    }
}

/// Keeps the controller from some of its moves, whoever decides.
pub trait Fence: Sync {
    /// Leaves out of the moves that are possible those that must not be made; some are left.
    fn keep_allowed(&self, state: &StateView<'_>, moves: &mut Vec<u32>);
}

/// Makes those who choose among all moves with equal chances, and never wait.
pub(super) struct Uniform;

impl Guidance for Uniform {
    fn chooser(&self) -> Box<dyn Chooser> {
        Box::new(Uniform)
    }
}

impl Chooser for Uniform {
    fn sees_time(&self) -> bool {
        false
    }

    fn choose(&mut self, state: &mut StateView<'_>, moment: Moment<'_>) -> Result<Chosen, Failure> {
        let drawn = state.stream().below(moment.moves.len() as u32);
        Ok(Chosen::Move(drawn as usize))
    }
}

/// What a run keeps of who decides.
pub(super) struct Control {
    pub(super) chooser: Box<dyn Chooser>,
    /// For how long the controller waits.
    pub(super) hold: f64,
    /// Whether it is asked at once, or delays are drawn.
    sees_time: bool,
    /// Whether it has let delays be drawn.
    pub(super) draws: bool,
    /// Whether it lets others move where time cannot pass.
    pub(super) passes: bool,
    pub(super) moves: Vec<u32>,
}

impl Control {
    pub(super) fn new(guidance: &dyn Guidance) -> Control {
        let chooser = guidance.chooser();
        Control {
            sees_time: chooser.sees_time(),
            chooser,
            hold: 0.0,
            draws: false,
            passes: false,
            moves: Vec::new(),
        }
    }

    /// Whether who decides sees clocks.
    pub(super) fn sees_time(&self) -> bool {
        self.sees_time
    }

    /// Something has happened: it is asked anew.
    pub(super) fn renew(&mut self) {
        self.chooser.renew();
        self.hold = 0.0;
        self.draws = false;
        self.passes = false;
    }

    /// Whether delays are drawn for its moves.
    pub(super) fn is_drawing(&self) -> bool {
        self.draws || !self.sees_time
    }
}
