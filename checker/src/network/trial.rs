//! Whether a heuristic pays, which the model decides and only its use can tell.
//!
//! In each [`Trial`] enough states must gain by the heuristic. A heuristic that failed is given up
//! for good, or tried again after a [`Pause`].

/// How many states have gained by a heuristic since its last trial ended.
#[derive(Debug, Default)]
pub(super) struct Trial {
    states: u32,
    gains: u32,
}

impl Trial {
    /// How many states a trial has.
    pub(super) const LENGTH: u32 = 1024;

    /// Counts a state that uses the heuristic. Returns whether a trial ends with this state and has
    /// failed: before it, fewer than one in `least_share` states gained.
    pub(super) fn fails(&mut self, least_share: u32) -> bool {
        self.states += 1;
        if self.states < Trial::LENGTH {
            return false;
        }
        let gains = std::mem::take(self).gains;
        gains < Trial::LENGTH / least_share
    }

    /// Counts a state that gained.
    pub(super) fn gain(&mut self) {
        self.gains += 1;
    }
}

/// How many states do without a heuristic that failed.
#[derive(Debug, Default)]
pub(super) struct Pause {
    left: u32,
    last: u32,
}

impl Pause {
    /// Counts a state if the pause lasts, and returns whether it does.
    pub(super) fn lasts(&mut self) -> bool {
        let lasts = self.left > 0;
        self.left = self.left.saturating_sub(1);
        lasts
    }

    /// Begins a pause, four times as long as the one before, within these lengths.
    pub(super) fn begin(&mut self, first: u32, longest: u32) {
        self.last = self.last.saturating_mul(4).min(longest).max(first);
        self.left = self.last;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a trial fails, and in which state, where this many of its states gain.
    fn failure(trial: &mut Trial, gaining: u32) -> Option<u32> {
        (1..=Trial::LENGTH).find(|&state| {
            let fails = trial.fails(4);
            if state <= gaining {
                trial.gain();
            }
            fails
        })
    }

    #[test]
    fn a_trial_fails_at_its_end_if_too_few_states_gain() {
        let mut trial = Trial::default();
        let enough = Trial::LENGTH / 4;
        assert_eq!(failure(&mut trial, enough), None);
        assert_eq!(failure(&mut trial, enough - 1), Some(Trial::LENGTH));
        assert_eq!(failure(&mut trial, enough), None, "each trial begins anew");
    }

    #[test]
    fn pauses_grow_up_to_the_longest() {
        let mut pause = Pause::default();
        assert!(!pause.lasts());
        let lengths = [2, 8, 20, 20];
        for length in lengths {
            pause.begin(2, 20);
            let lasting = (0..100).take_while(|_| pause.lasts()).count();
            assert_eq!(lasting, length);
        }
    }
}
