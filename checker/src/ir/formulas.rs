//! Compiled formulas over time.

use super::labels::Guard;

/// A formula over time. `[]`, `R` and `||` are written by the others.
#[derive(Clone, Debug)]
pub struct Formula {
    /// The conditions on states, as masks (see [`super::Chances`]).
    pub atoms: Vec<Guard>,
    /// The formula over them.
    pub root: Temporal,
}

/// A formula over conditions that have numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum Temporal {
    /// What always holds.
    True,
    /// The condition with this number.
    Atom(usize),
    /// `!f`
    Not(Box<Temporal>),
    /// `f && g`
    And(Box<Temporal>, Box<Temporal>),
    /// `X f`
    Next(Box<Temporal>),
    /// `f U[a,b] g`
    Until {
        /// The least and the greatest distance; infinity if there is no greatest.
        interval: (f64, f64),
        /// What holds until then.
        keep: Box<Temporal>,
        /// What holds then.
        goal: Box<Temporal>,
    },
}

impl Temporal {
    /// `!f`
    #[must_use]
    pub fn negated(self) -> Temporal {
        match self {
            Temporal::Not(inner) => *inner,
            other => Temporal::Not(Box::new(other)),
        }
    }

    /// `f && g`
    #[must_use]
    pub fn and(self, other: Temporal) -> Temporal {
        Temporal::And(Box::new(self), Box::new(other))
    }

    /// `f || g`
    #[must_use]
    pub fn or(self, other: Temporal) -> Temporal {
        self.negated().and(other.negated()).negated()
    }

    /// `f U[a,b] g`
    #[must_use]
    pub fn until(self, interval: (f64, f64), goal: Temporal) -> Temporal {
        Temporal::Until {
            interval,
            keep: Box::new(self),
            goal: Box::new(goal),
        }
    }

    /// `f R[a,b] g`
    #[must_use]
    pub fn release(self, interval: (f64, f64), goal: Temporal) -> Temporal {
        self.negated().until(interval, goal.negated()).negated()
    }
}
