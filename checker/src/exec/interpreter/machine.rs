//! The stacks of a thread, and where words lie in them.

/// The stacks of a thread.
#[derive(Debug, Default)]
pub(super) struct Stacks {
    /// The registers of all active functions.
    pub(super) registers: Vec<u64>,
    /// The frames of all active functions.
    pub(super) frames: Vec<i32>,
    /// The callers of the running function, outermost first.
    pub(super) callers: Vec<Activation>,
}

impl Stacks {
    pub(super) fn reset(&mut self) {
        self.registers.clear();
        self.frames.clear();
        self.callers.clear();
    }
}

/// A function that is running.
#[derive(Clone, Copy, Debug)]
pub(super) struct Activation {
    pub(super) function: usize,
    pub(super) block: usize,
    /// The instruction of the block that runs next.
    pub(super) next: usize,
    /// The first of its registers.
    pub(super) registers: usize,
    /// The first word of its frame.
    pub(super) frame: usize,
}

/// The memories that an address can lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Space {
    State,
    Constants,
    Frames,
}

/// A word.
#[derive(Clone, Copy, Debug)]
pub(super) struct WordPlace {
    pub(super) space: Space,
    pub(super) offset: usize,
}

impl WordPlace {
    pub(super) fn to_bits(self) -> u64 {
        (self.space as u64) << 62 | self.offset as u64
    }

    pub(super) fn from_bits(bits: u64) -> WordPlace {
        let space = match bits >> 62 {
            0 => Space::State,
            1 => Space::Constants,
            _ => Space::Frames,
        };
        WordPlace {
            space,
            offset: (bits & (u64::MAX >> 2)) as usize,
        }
    }

    pub(super) fn new(space: Space, offset: usize) -> WordPlace {
        WordPlace { space, offset }
    }

    pub(super) fn plus(self, words: usize) -> WordPlace {
        WordPlace {
            offset: self.offset + words,
            ..self
        }
    }
}
