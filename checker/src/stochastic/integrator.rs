//! Differential equations, solved step by step: adaptively by the method of Dormand and Prince of
//! order 5, whose steps can be read anywhere by polynomials of order 4, or by Euler's method with a
//! fixed step.
//!
//! Invariant: the steps follow each other without gaps from time 0.
//!
//! Source: E. Hairer, S. P. Nørsett and G. Wanner, "Solving Ordinary Differential Equations I",
//! 2nd edition, sections II.4 to II.6.

use super::failure::Failure;
use crate::cancellation;

/// The error of a step relative to the values, at most.
const RELATIVE_ERROR: f64 = 1e-9;
/// The error of a step, at most, where values are near 0.
const ABSOLUTE_ERROR: f64 = 1e-12;
/// No step is shorter than this part of the time.
const LEAST_STEP: f64 = 1e-13;
/// The first step, if nothing better is known.
const FIRST_STEP: f64 = 1e-3;
/// No step is longer: nothing is looked for as far away.
const LONGEST_STEP: f64 = 1e12;
/// What a step takes, by value: see [`cancellation::work`].
const UNITS_FOR_STEP: usize = 128;
/// So many steps are kept at least before it is asked whether there is room for more.
const STEPS_OF_COURSE: usize = 1 << 16;

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

    /// Begins a solution.
    pub(super) fn begin(&mut self, values: &[f64]) {
        self.steps.clear();
        self.polynomials.clear();
        self.values.clear();
        self.values.extend_from_slice(values);
        self.end = 0.0;
        for slopes in &mut self.slopes {
            slopes.resize(values.len(), 0.0);
        }
    }

    /// Writes the values at a time to `target`.
    pub(super) fn at(
        &mut self,
        time: f64,
        slopes: &mut Slopes<'_>,
        target: &mut Vec<f64>,
    ) -> Result<(), Failure> {
        target.clear();
        if time <= 0.0 && self.steps.is_empty() {
            target.extend_from_slice(&self.values);
            return Ok(());
        }
        let index = self.step_at(time, slopes)?;
        let Step { start, length } = self.steps[index];
        let part = ((time - start) / length).clamp(0.0, 1.0);
        let count = self.values.len();
        let polynomials = &self.polynomials[index * count..(index + 1) * count];
        target.extend(polynomials.iter().map(|&[a, b, c, d, e]| {
            let rest = 1.0 - part;
            a + part * (b + rest * (c + part * (d + rest * e)))
        }));
        Ok(())
    }

    /// The start and the length of the step that goes on behind a time.
    pub(super) fn step_behind(
        &mut self,
        time: f64,
        slopes: &mut Slopes<'_>,
    ) -> Result<(f64, f64), Failure> {
        let index = self.step_at(time, slopes)?;
        let Step { start, length } = self.steps[index];
        Ok((start, length))
    }

    /// The step in which a time lies, at its start rather than at the end of the one before.
    fn step_at(&mut self, time: f64, slopes: &mut Slopes<'_>) -> Result<usize, Failure> {
        while self.end <= time {
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
        let kept = self.steps.len();
        if kept >= STEPS_OF_COURSE && kept.is_power_of_two() {
            let bytes = size_of::<Step>() + self.values.len() * size_of::<Polynomial>();
            cancellation::ask_for(2 * kept * bytes);
        }
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
        let mut sum = 0.0;
        for (value, (before, after)) in self.values.iter().zip(&self.trial).enumerate() {
            let known = self.slopes.iter().zip(ERROR_WEIGHTS);
            let error: f64 = known.map(|(slopes, weight)| slopes[value] * weight).sum();
            let allowed = ABSOLUTE_ERROR + RELATIVE_ERROR * before.abs().max(after.abs());
            // Between the ends of a step that changes a value much, the polynomial is read near
            // the lesser value, but is rounded like the change.
            let rounding = f64::EPSILON * (after - before).abs();
            let allowed_rounding = ABSOLUTE_ERROR + RELATIVE_ERROR * before.abs();
            let parts = (length * error / allowed).abs() + rounding / allowed_rounding;
            sum += parts.powi(2);
        }
        let error = (sum / self.values.len() as f64).sqrt();
        Ok(if error.is_nan() { f64::INFINITY } else { error })
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
        let mut found = Vec::new();
        integrator.begin(&[1.0]);
        for time in [0.0, 0.3, 5.0, 1.0, 0.001] {
            integrator
                .at(time, &mut decay, &mut found)
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
                .at(time, &mut circle, &mut found)
                .expect("it is finite");
            assert!((found[0] - time.cos()).abs() < 1e-7, "{time}: {}", found[0]);
            assert!((found[1] - time.sin()).abs() < 1e-7, "{time}: {}", found[1]);
        }
    }

    /// A parabola, which steps of any length solve without an error.
    fn falling(time: f64, _: &[f64], slopes: &mut [f64]) -> Result<(), Failure> {
        slopes[0] = 10.0 - time;
        Ok(())
    }

    #[test]
    fn steps_without_error_grow_no_longer_than_can_be_read() {
        let mut integrator = Integrator::default();
        let mut found = vec![0.0];
        for solution in 0..1000 {
            integrator.begin(&found);
            integrator
                .at(0.1, &mut falling, &mut found)
                .expect("it is finite");
            let exact = f64::from(solution + 1) * (0.1 * 10.0 - 0.1 * 0.1 / 2.0);
            let error = (found[0] - exact).abs();
            assert!(error < 1e-8 * exact, "{solution}: {} for {exact}", found[0]);
        }
    }

    #[test]
    fn a_fixed_step_is_eulers() {
        let mut integrator = Integrator::new(Some(0.5));
        let mut found = Vec::new();
        integrator.begin(&[1.0]);
        integrator
            .at(0.75, &mut decay, &mut found)
            .expect("it is finite");
        assert!((found[0] - 0.375).abs() < 1e-15);
    }
}
