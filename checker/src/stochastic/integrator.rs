//! Differential equations, solved step by step: adaptively by the method of Dormand and Prince of
//! order 5, whose steps can be read anywhere by polynomials of order 4, or by Euler's method with a
//! fixed step.
//!
//! Invariants:
//! * The steps that are kept follow each other without gaps. A solution that is asked for behind
//!   them goes on; one that is asked for before them begins again, with the same steps.
//! * An adaptive step that is not the shortest changes no value by more than [`MOST_CHANGE`] times
//!   what it was, or 1 if that is more: so anywhere in it rounding stays below what counts as equal
//!   when clocks are compared. Where the solution is a polynomial, no error would limit the step.
//!
//! Source: E. Hairer, S. P. Nørsett and G. Wanner, "Solving Ordinary Differential Equations I",
//! 2nd edition, sections II.4 to II.6.

use super::cubic::{Cubic, LEAST_PART, first_root, value_of};
use super::failure::Failure;
use crate::cancellation;

/// The error of a step relative to the values, at most.
const RELATIVE_ERROR: f64 = 1e-9;
/// The error of a step, at most, where values are near 0.
const ABSOLUTE_ERROR: f64 = 1e-12;
/// No step is shorter than this part of the time.
const LEAST_STEP: f64 = 1e-13;
/// What a step may change a value by, relative to what it was or to 1.
const MOST_CHANGE: f64 = 100.0;
/// So many steps are kept at a time; of more the older half is forgotten.
const MOST_STEPS: usize = 1 << 16;
/// The first step, if nothing better is known.
const FIRST_STEP: f64 = 1e-3;
/// No step is longer: nothing is looked for as far away.
const LONGEST_STEP: f64 = 1e12;
/// What a step takes, by value: see [`cancellation::work`].
const UNITS_FOR_STEP: usize = 128;

/// The coefficients of a step, by value: a polynomial in the part of the step that has passed.
type Polynomial = [f64; 5];

/// The right side of an equation: the slopes of the values at a time. An error if they are no
/// finite numbers.
pub(super) type Slopes<'a> = dyn FnMut(f64, &[f64], &mut [f64]) -> Result<(), Failure> + 'a;

#[derive(Clone, Copy, Debug)]
struct Step {
    start: f64,
    length: f64,
}

/// A solution as far as it is known.
#[derive(Clone, Debug, Default)]
pub(super) struct Integrator {
    /// The length of all steps of Euler's method; adaptive steps without it.
    pub(super) fixed_step: Option<f64>,
    steps: Vec<Step>,
    /// Of each step the polynomials of all values.
    polynomials: Vec<Polynomial>,
    /// The values at the end of the last step.
    values: Vec<f64>,
    end: f64,
    /// What length the next step should have; it is kept from one solution to the next.
    length: Option<f64>,
    /// The values and the length at time 0.
    initial: (Vec<f64>, Option<f64>),
    slopes: [Vec<f64>; 7],
    trial: Vec<f64>,
}

impl Integrator {
    /// One with steps of this length, by Euler's method; with adaptive ones without it.
    pub(super) fn new(fixed_step: Option<f64>) -> Integrator {
        Integrator {
            fixed_step,
            ..Integrator::default()
        }
    }

    /// Forgets how long steps were: what follows must not depend on what came before.
    pub(super) fn forget(&mut self) {
        self.length = None;
    }

    /// Begins a solution.
    pub(super) fn begin(&mut self, values: &[f64]) {
        self.initial.0.clear();
        self.initial.0.extend_from_slice(values);
        self.initial.1 = self.length;
        for slopes in &mut self.slopes {
            slopes.resize(values.len(), 0.0);
        }
        self.begin_again();
    }

    fn begin_again(&mut self) {
        self.steps.clear();
        self.polynomials.clear();
        self.values.clone_from(&self.initial.0);
        self.length = self.initial.1;
        self.end = 0.0;
    }

    /// Writes the values at a time to `values`, and their slopes to `rates`; none where nothing is
    /// solved yet.
    pub(super) fn at(
        &mut self,
        time: f64,
        slopes: &mut Slopes<'_>,
        values: &mut Vec<f64>,
        rates: &mut Vec<f64>,
    ) -> Result<(), Failure> {
        values.clear();
        rates.clear();
        if time <= 0.0 && self.steps.is_empty() {
            values.extend_from_slice(&self.values);
            return Ok(());
        }
        let index = self.step_at(time, slopes)?;
        let Step { start, length } = self.steps[index];
        let part = ((time - start) / length).clamp(0.0, 1.0);
        for polynomial in self.polynomials(index) {
            values.push(read(polynomial, part));
            rates.push(value_of(&slope_of(polynomial), part) / length);
        }
        Ok(())
    }

    /// The polynomials of a step.
    fn polynomials(&self, index: usize) -> &[Polynomial] {
        let count = self.values.len();
        &self.polynomials[index * count..(index + 1) * count]
    }

    /// When to look next, behind a time: each of so many parts of a step, and wherever a value
    /// turns. So a value between two looks lies between its values there.
    pub(super) fn next_look(
        &mut self,
        time: f64,
        parts: f64,
        slopes: &mut Slopes<'_>,
    ) -> Result<f64, Failure> {
        let index = self.step_at(time, slopes)?;
        let Step { start, length } = self.steps[index];
        let part = (time - start) / length;
        let mut next = ((part * parts).floor() + 1.0) / parts;
        for polynomial in self.polynomials(index) {
            next = first_root(&slope_of(polynomial), part + LEAST_PART, next).unwrap_or(next);
        }
        let next = start + length * next;
        Ok(if next > time { next } else { start + length })
    }

    /// The step in which a time lies, at its start rather than at the end of the one before.
    fn step_at(&mut self, time: f64, slopes: &mut Slopes<'_>) -> Result<usize, Failure> {
        if self.steps.first().is_some_and(|first| time < first.start) {
            self.begin_again();
        }
        while self.end <= time {
            if self.steps.len() == MOST_STEPS {
                let forgotten = MOST_STEPS / 2;
                self.steps.drain(..forgotten);
                self.polynomials.drain(..forgotten * self.values.len());
            }
            self.make_step(slopes)?;
        }
        Ok(self.steps.partition_point(|step| step.start <= time) - 1)
    }

    fn make_step(&mut self, slopes: &mut Slopes<'_>) -> Result<(), Failure> {
        if self.steps.is_empty() {
            slopes(0.0, &self.values, &mut self.slopes[0])?;
        }
        match self.fixed_step {
            Some(length) => self.euler_step(length, slopes),
            None => self.adaptive_step(slopes),
        }
    }

    fn euler_step(&mut self, length: f64, slopes: &mut Slopes<'_>) -> Result<(), Failure> {
        for (value, slope) in self.values.iter_mut().zip(&self.slopes[0]) {
            let change = length * slope;
            self.polynomials.push([*value, change, 0.0, 0.0, 0.0]);
            *value += change;
        }
        self.push(length);
        slopes(self.end, &self.values, &mut self.slopes[0])
    }

    fn push(&mut self, length: f64) {
        cancellation::work(UNITS_FOR_STEP * (1 + self.values.len()));
        let start = self.end;
        self.steps.push(Step { start, length });
        self.end += length;
    }

    fn adaptive_step(&mut self, slopes: &mut Slopes<'_>) -> Result<(), Failure> {
        let mut length = self.length.unwrap_or(FIRST_STEP);
        let least = LEAST_STEP * self.end.max(1.0);
        loop {
            length = length.clamp(least, LONGEST_STEP.max(least));
            let tried = self.try_step(length, slopes);
            let error = match tried {
                Ok(error) => error,
                // The solution may leave the domain of the equation within the step.
                Err(Failure::ClockRate(_)) if length > least => f64::INFINITY,
                Err(failure) => return Err(failure),
            };
            let factor = (0.9 * error.powf(-0.2)).clamp(0.2, 10.0);
            if error <= 1.0 || length <= least {
                self.keep(length);
                self.length = Some(length * factor);
                return Ok(());
            }
            length *= factor.min(0.9);
        }
    }

    /// Makes a step, whose end is then in `trial` and whose slopes in `slopes`; returns its error,
    /// of which 1 is allowed.
    fn try_step(&mut self, length: f64, slopes: &mut Slopes<'_>) -> Result<f64, Failure> {
        for (stage, (part, weights)) in STAGES.iter().enumerate() {
            self.trial.clear();
            for (value, start) in self.values.iter().enumerate() {
                let known = self.slopes.iter().zip(*weights);
                let change: f64 = known.map(|(slopes, weight)| slopes[value] * weight).sum();
                self.trial.push(start + length * change);
            }
            let mut target = std::mem::take(&mut self.slopes[stage + 1]);
            let found = slopes(self.end + part * length, &self.trial, &mut target);
            self.slopes[stage + 1] = target;
            found?;
        }
        let (mut sum, mut most) = (0.0_f64, 0.0_f64);
        for (value, (before, after)) in self.values.iter().zip(&self.trial).enumerate() {
            let known = self.slopes.iter().zip(ERROR_WEIGHTS);
            let error: f64 = known.map(|(slopes, weight)| slopes[value] * weight).sum();
            let allowed = ABSOLUTE_ERROR + RELATIVE_ERROR * before.abs().max(after.abs());
            sum += (length * error / allowed).powi(2);
            let change = (after - before).abs() / before.abs().max(1.0);
            most = most.max(change);
        }
        // An error grows with the fifth power of the length, a change with the first.
        let too_far = (most / MOST_CHANGE).powi(5);
        let error = (sum / self.values.len() as f64).sqrt();
        Ok(if error.is_nan() {
            f64::INFINITY
        } else {
            error.max(too_far)
        })
    }

    /// Takes over the step that was tried.
    fn keep(&mut self, length: f64) {
        for (value, (before, after)) in self.values.iter().zip(&self.trial).enumerate() {
            let change = after - before;
            let first = length * self.slopes[0][value] - change;
            let second = change - length * self.slopes[6][value] - first;
            let known = self.slopes.iter().zip(DENSE_WEIGHTS);
            let last: f64 = known.map(|(slopes, weight)| slopes[value] * weight).sum();
            let polynomial = [*before, change, first, second, length * last];
            self.polynomials.push(polynomial);
        }
        self.values.copy_from_slice(&self.trial);
        self.slopes.swap(0, 6);
        self.push(length);
    }
}

/// The value of a polynomial.
fn read(polynomial: &Polynomial, part: f64) -> f64 {
    let rest = 1.0 - part;
    let mut value = 0.0;
    for (place, &coefficient) in polynomial.iter().enumerate().rev() {
        let factor = if place % 2 == 0 { part } else { rest };
        value = coefficient + factor * value;
    }
    value
}

/// The slope of a polynomial, where the length of the step is 1.
fn slope_of(&[_, b, c, d, e]: &Polynomial) -> Cubic {
    [b + c, 2.0 * (d + e - c), -3.0 * (d + 2.0 * e), 4.0 * e]
}

/// The stages behind the first one: the part of the step, and the weights of the slopes so far. The
/// last one is the end of the step.
const STAGES: [(f64, &[f64]); 6] = [
    (1.0 / 5.0, &[1.0 / 5.0]),
    (3.0 / 10.0, &[3.0 / 40.0, 9.0 / 40.0]),
    (4.0 / 5.0, &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0]),
    (
        8.0 / 9.0,
        &[
            19372.0 / 6561.0,
            -25360.0 / 2187.0,
            64448.0 / 6561.0,
            -212.0 / 729.0,
        ],
    ),
    (
        1.0,
        &[
            9017.0 / 3168.0,
            -355.0 / 33.0,
            46732.0 / 5247.0,
            49.0 / 176.0,
            -5103.0 / 18656.0,
        ],
    ),
    (
        1.0,
        &[
            35.0 / 384.0,
            0.0,
            500.0 / 1113.0,
            125.0 / 192.0,
            -2187.0 / 6784.0,
            11.0 / 84.0,
        ],
    ),
];

const ERROR_WEIGHTS: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

const DENSE_WEIGHTS: [f64; 7] = [
    -12_715_105_075.0 / 11_282_082_432.0,
    0.0,
    87_487_479_700.0 / 32_700_410_799.0,
    -10_690_763_975.0 / 1_880_347_072.0,
    701_980_252_875.0 / 199_316_789_632.0,
    -1_453_857_185.0 / 822_651_844.0,
    69_997_945.0 / 29_380_423.0,
];

#[cfg(test)]
mod tests {
    #![expect(clippy::unnecessary_wraps, reason = "equations may fail")]

    use super::{Failure, Integrator};

    fn decay(_: f64, values: &[f64], slopes: &mut [f64]) -> Result<(), Failure> {
        slopes[0] = -values[0];
        Ok(())
    }

    /// A circle: the cosine and the sine.
    fn circle(_: f64, values: &[f64], slopes: &mut [f64]) -> Result<(), Failure> {
        slopes[0] = -values[1];
        slopes[1] = values[0];
        Ok(())
    }

    #[test]
    fn solutions_are_exact_to_nine_digits_anywhere() {
        let mut integrator = Integrator::default();
        let (mut found, mut rates) = (Vec::new(), Vec::new());
        integrator.begin(&[1.0]);
        for time in [0.0, 0.3, 5.0, 1.0, 0.001] {
            integrator
                .at(time, &mut decay, &mut found, &mut rates)
                .expect("it is finite");
            assert!(
                (found[0] - (-time).exp()).abs() < 1e-9,
                "{time}: {}",
                found[0]
            );
        }
        integrator.begin(&[1.0, 0.0]);
        for time in [0.7, 10.0, 3.0] {
            integrator
                .at(time, &mut circle, &mut found, &mut rates)
                .expect("it is finite");
            assert!((found[0] - time.cos()).abs() < 1e-7, "{time}: {}", found[0]);
            assert!((found[1] - time.sin()).abs() < 1e-7, "{time}: {}", found[1]);
        }
    }

    /// Of a body that is thrown upwards with 10 and falls with 10: `5 - 5 (t - 1)^2`.
    fn throw(_: f64, values: &[f64], slopes: &mut [f64]) -> Result<(), Failure> {
        slopes[0] = values[1];
        slopes[1] = -10.0;
        Ok(())
    }

    /// A parabola, which steps of any length solve without an error.
    fn falling(time: f64, _: &[f64], slopes: &mut [f64]) -> Result<(), Failure> {
        slopes[0] = 10.0 - time;
        Ok(())
    }

    #[test]
    fn steps_without_error_grow_no_longer_than_can_be_read() {
        let mut integrator = Integrator::default();
        let (mut found, mut rates) = (vec![0.0], Vec::new());
        for solution in 0..1000 {
            integrator.begin(&found);
            integrator
                .at(0.1, &mut falling, &mut found, &mut rates)
                .expect("it is finite");
            let exact = f64::from(solution + 1) * (0.1 * 10.0 - 0.1 * 0.1 / 2.0);
            let error = (found[0] - exact).abs();
            assert!(error < 1e-8 * exact, "{solution}: {} for {exact}", found[0]);
        }
    }

    #[test]
    fn rates_are_those_of_the_solution() {
        let mut integrator = Integrator::default();
        let (mut found, mut rates) = (Vec::new(), Vec::new());
        integrator.begin(&[1.0, 0.0]);
        for time in [0.7, 10.0, 3.0] {
            integrator
                .at(time, &mut circle, &mut found, &mut rates)
                .expect("it is finite");
            assert!((rates[0] + found[1]).abs() < 1e-6, "{time}: {}", rates[0]);
            assert!((rates[1] - found[0]).abs() < 1e-6, "{time}: {}", rates[1]);
        }
    }

    #[test]
    fn a_throw_is_looked_at_where_it_turns() {
        let mut integrator = Integrator::default();
        let (mut found, mut rates) = (Vec::new(), Vec::new());
        integrator.begin(&[0.0, 10.0]);
        let (mut time, mut highest) = (0.0, f64::NEG_INFINITY);
        while time < 2.0 {
            integrator
                .at(time, &mut throw, &mut found, &mut rates)
                .expect("it is finite");
            highest = found[0].max(highest);
            time = integrator
                .next_look(time, 4.0, &mut throw)
                .expect("it is finite");
        }
        assert!((highest - 5.0).abs() < 1e-12, "{highest}");
    }

    /// However often a solution that no error limits is begun anew, its steps stay short enough for
    /// values in them to be exact.
    #[test]
    fn steps_of_a_polynomial_stay_exact() {
        let mut integrator = Integrator::default();
        let (mut found, mut rates) = (Vec::new(), Vec::new());
        for _ in 0..100 {
            integrator.begin(&[0.0, 10.0]);
            integrator
                .at(2.0, &mut throw, &mut found, &mut rates)
                .expect("it is finite");
            assert!(found[0].abs() < 1e-12, "{}", found[0]);
            assert!((found[1] + 10.0).abs() < 1e-12, "{}", found[1]);
        }
    }

    /// What was forgotten is computed again, to the same bits.
    #[test]
    fn a_solution_of_many_steps_can_be_read_anywhere() {
        let mut integrator = Integrator::default();
        let (mut found, mut rates) = (Vec::new(), Vec::new());
        let mut read = |integrator: &mut Integrator, time| {
            integrator
                .at(time, &mut circle, &mut found, &mut rates)
                .expect("it is finite");
            found.clone()
        };
        integrator.begin(&[1.0, 0.0]);
        let times = [0.5, 1.0, 4000.0];
        let before = times.map(|time| read(&mut integrator, time));
        assert!(integrator.steps.len() <= super::MOST_STEPS);
        assert!(integrator.steps[0].start > 1.0, "some are forgotten");
        for (time, before) in times.into_iter().zip(before) {
            assert_eq!(read(&mut integrator, time), before);
        }
    }

    #[test]
    fn a_fixed_step_is_eulers() {
        let mut integrator = Integrator::new(Some(0.5));
        let (mut found, mut rates) = (Vec::new(), Vec::new());
        integrator.begin(&[1.0]);
        integrator
            .at(0.75, &mut decay, &mut found, &mut rates)
            .expect("it is finite");
        assert!((found[0] - 0.375).abs() < 1e-15);
    }
}
