//! The methods that make intervals, by their names.

use std::fmt;

/// What made an interval, which says what its confidence means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Of Clopper and Pearson: exact for a fixed number of runs; see [`super::FixedWidth`] for
    /// numbers that depend on the results.
    ClopperPearson,
    /// [`super::ProbabilitySequence`]: right at any moment of stopping.
    ConfidenceSequence,
    /// Student's: right in the limit of many runs only.
    Student,
    /// [`super::BoundedMean`] for a planned number of runs.
    EmpiricalBernstein,
    /// [`super::BoundedMean`] for all numbers of runs: right at any moment of stopping.
    EmpiricalBernsteinSequence,
    /// [`super::Distribution`]: for a fixed number of runs.
    DvoretzkyKieferWolfowitz,
    /// Of independent repetitions of importance splitting: right in the limit of many.
    ImportanceSplitting,
    /// No runs: the value itself is computed between bounds.
    ValueIteration,
}

impl Method {
    /// The name that answers show.
    pub fn name(self) -> &'static str {
        match self {
            Method::ClopperPearson => "Clopper-Pearson",
            Method::ConfidenceSequence => "confidence sequence",
            Method::Student => "Student (asymptotic)",
            Method::EmpiricalBernstein => "empirical Bernstein",
            Method::EmpiricalBernsteinSequence => "empirical Bernstein confidence sequence",
            Method::DvoretzkyKieferWolfowitz => "Dvoretzky-Kiefer-Wolfowitz",
            Method::ImportanceSplitting => "importance splitting, Student (asymptotic)",
            Method::ValueIteration => "value iteration",
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
