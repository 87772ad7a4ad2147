//! The winning sets: for each node, the valuations from which the seeker wins, the rest of its
//! valuations, and when each part was gained.
//!
//! Invariants:
//! * A node has a rest only if a part of it is won. The part and the rest make up the whole node.
//! * Gains are in the order of ascending stamps; together they are what is won.
//! * The stored valuations have no unused room.

use rustc_hash::FxHashMap;

use crate::zones::Federation;
use crate::zones::federation::{block_bytes, table_bytes};

/// The valuations of a node from which the seeker wins.
#[derive(Clone, Debug)]
pub enum Win {
    /// None, as far as is known.
    Nothing,
    /// All.
    Everything,
    /// These.
    Part(Federation),
}

/// What a stamp added to the winning valuations of a node.
#[derive(Clone, Debug)]
pub struct Gain {
    /// A greater stamp came later.
    pub stamp: u32,
    /// What was added; `None` means the whole zone.
    pub part: Option<Federation>,
}

/// What a node gains.
#[derive(Clone, Debug)]
pub(super) enum Gained {
    /// Nothing.
    Nothing,
    /// All that was not won: this part, or the whole node.
    Everything(Option<Federation>),
    /// A part.
    Part {
        /// What is won now.
        won: Federation,
        /// The part that was not won before.
        part: Federation,
        /// What is not won.
        rest: Federation,
    },
}

/// The winning sets of all nodes.
#[derive(Debug, Default)]
pub struct WinningSets {
    /// For each node: the valuations from which the seeker wins.
    pub win: Vec<Win>,
    /// The rest of each node that is won in part.
    pub(in crate::game) rest: FxHashMap<u32, Federation>,
    /// For each node: the gains, by ascending stamp. The target has stamp 0.
    pub gains: Vec<Vec<Gain>>,
    /// The stamp of the last gain.
    pub(in crate::game) stamp: u32,
    /// The bytes that zones of the gains, the winning valuations and the rests take.
    pub(in crate::game) bytes: u64,
}

impl WinningSets {
    /// Adds a node, with what is won of it from the start, and the rest of it if that is a part.
    pub(in crate::game) fn add_node(&mut self, win: Win, rest: Option<Federation>) {
        let node = self.win.len() as u32;
        if let Some(mut rest) = rest {
            rest.shrink();
            self.replace_rest(node, Some(rest));
        }
        let part = match &win {
            Win::Nothing => None,
            Win::Everything => Some(None),
            Win::Part(part) => Some(Some(part.clone())),
        };
        let gains: Vec<Gain> = part
            .map(|part| Gain { stamp: 0, part })
            .into_iter()
            .collect();
        self.bytes += win.heap_bytes() + gains_bytes(&gains);
        self.win.push(win);
        self.gains.push(gains);
    }

    /// The bytes of the tables and of everything in them.
    pub(in crate::game) fn all_bytes(&self) -> u64 {
        self.table_bytes() + self.bytes
    }

    fn table_bytes(&self) -> u64 {
        let by_node = size_of::<Win>() + size_of::<Vec<Gain>>();
        let tables = self.win.len() * by_node;
        (tables + table_bytes::<(u32, Federation)>(self.rest.capacity())) as u64
    }

    /// Whether the valuation of a node is won; values are in whole units.
    pub(in crate::game) fn contains(&self, node: u32, values: &[i64]) -> bool {
        match &self.win[node as usize] {
            Win::Nothing => false,
            Win::Everything => true,
            Win::Part(part) => part.contains(values, 1),
        }
    }

    /// The valuations of a node that are not known to be won.
    pub(in crate::game) fn lost(&self, node: u32) -> Win {
        match &self.win[node as usize] {
            Win::Nothing => Win::Everything,
            Win::Everything => Win::Nothing,
            Win::Part(_) => Win::Part(self.rest[&node].clone()),
        }
    }

    /// Replaces the rest of a node and returns the old one. A node has a rest if a part of it is
    /// won.
    pub(in crate::game) fn replace_rest(
        &mut self,
        node: u32,
        rest: Option<Federation>,
    ) -> Option<Federation> {
        let old = match rest {
            Some(rest) => {
                self.bytes += rest.heap_bytes() as u64;
                self.rest.insert(node, rest)
            }
            None => self.rest.remove(&node),
        };
        let old_bytes = old.as_ref().map_or(0, Federation::heap_bytes);
        self.bytes -= old_bytes as u64;
        old
    }

    /// Replaces what a node wins.
    pub(in crate::game) fn replace_win(&mut self, node: usize, win: Win) {
        self.bytes += win.heap_bytes();
        let old = std::mem::replace(&mut self.win[node], win);
        self.bytes -= old.heap_bytes();
    }

    /// Records what a node gains with a new stamp.
    pub(super) fn note_gain(&mut self, node: u32, part: Option<Federation>) {
        self.stamp += 1;
        let gains = &mut self.gains[node as usize];
        // Most nodes gain only once.
        if gains.is_empty() {
            gains.reserve_exact(1);
        }
        let room = gains.capacity();
        let part_bytes = part.as_ref().map_or(0, Federation::heap_bytes);
        gains.push(Gain {
            stamp: self.stamp,
            part,
        });
        let bytes = |room: usize| block_bytes(room * size_of::<Gain>());
        let is_first = gains.len() == 1;
        self.bytes += (bytes(gains.capacity()) + part_bytes) as u64;
        self.bytes -= if is_first { 0 } else { bytes(room) as u64 };
    }
}

impl Win {
    /// A part that is not everything.
    pub(in crate::game) fn of(part: Federation) -> Win {
        if part.is_empty() {
            Win::Nothing
        } else {
            Win::Part(part)
        }
    }

    /// The bytes that it takes, without the value itself.
    pub(super) fn heap_bytes(&self) -> u64 {
        match self {
            Win::Nothing | Win::Everything => 0,
            Win::Part(part) => part.heap_bytes() as u64,
        }
    }
}

impl Gained {
    /// The bytes that it takes, without the value itself.
    pub(super) fn heap_bytes(&self) -> u64 {
        let bytes = match self {
            Gained::Nothing | Gained::Everything(None) => 0,
            Gained::Everything(Some(part)) => part.heap_bytes(),
            Gained::Part { won, part, rest } => {
                won.heap_bytes() + part.heap_bytes() + rest.heap_bytes()
            }
        };
        bytes as u64
    }

    /// Frees unused room.
    pub(super) fn shrink(&mut self) {
        match self {
            Gained::Nothing | Gained::Everything(None) => {}
            Gained::Everything(Some(part)) => part.shrink(),
            Gained::Part { won, part, rest } => {
                won.shrink();
                part.shrink();
                rest.shrink();
            }
        }
    }
}

/// The bytes that the gains of a node take, without the value itself.
pub(super) fn gains_bytes(gains: &Vec<Gain>) -> u64 {
    let parts = gains.iter().filter_map(|gain| gain.part.as_ref());
    let zones: usize = parts.map(Federation::heap_bytes).sum();
    (block_bytes(gains.capacity() * size_of::<Gain>()) + zones) as u64
}

/// The bytes that the winning valuations of all nodes take.
pub(in crate::game) fn wins_bytes(wins: &[Win]) -> u64 {
    size_of_val(wins) as u64 + wins.iter().map(Win::heap_bytes).sum::<u64>()
}
