//! Which delays would be drawn, where none are: see [`super::unfolding`].

use super::Race;

/// Which delays would be drawn.
#[derive(Clone, Debug)]
pub(in crate::stochastic) struct Drawn {
    /// Of the plan that is being made.
    is_drawn: bool,
    of_process: Vec<bool>,
}

impl Drawn {
    pub(in crate::stochastic) fn new(processes: usize) -> Drawn {
        Drawn {
            is_drawn: false,
            of_process: vec![false; processes],
        }
    }

    pub(super) fn note(&mut self, is_drawn: bool) {
        self.is_drawn |= is_drawn;
    }

    /// The plan is that of this process.
    pub(super) fn keep(&mut self, process: usize) {
        self.of_process[process] = std::mem::take(&mut self.is_drawn);
    }
}

impl Race<'_> {
    /// Takes those out of the race whose delays would be drawn; returns when the first of them
    /// could move, and who.
    pub(super) fn set_drawn_apart(&mut self) -> Option<(f64, usize)> {
        let drawn = self.drawn.as_ref().expect("nothing is drawn");
        let mut earliest: Option<(f64, usize)> = None;
        for (process, &is_drawn) in drawn.of_process.iter().enumerate() {
            if !is_drawn {
                continue;
            }
            let low = std::mem::replace(&mut self.attempts[process], f64::INFINITY);
            if low.is_finite() && earliest.is_none_or(|(known, _)| low < known) {
                earliest = Some((low, process));
            }
        }
        earliest
    }
}
