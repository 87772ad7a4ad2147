//! How long does one zone operation take, and one full successor?
//!
//! `cargo bench --no-default-features --bench zones` prints nanoseconds per operation, copying the source zone included,
//! over zones that a random walk of successors reaches. The figures in brackets were published for the C code of UDBM on
//! another machine and are an order of magnitude to compare with, not a limit. The least of several rounds is printed, so a
//! busy machine disturbs little.

#![expect(clippy::print_stdout, reason = "a benchmark prints its table")]

use std::hint::black_box;
use std::time::Instant;

use checker::zones::extrapolate::{self, Ceilings};
use checker::zones::{Bound, clocks, dbm, minimal};

/// Clocks and the reference clock.
const DIMENSIONS: [usize; 5] = [4, 6, 11, 16, 21];
/// Zones that an operation is averaged over.
const ZONES: u16 = 200;
/// Steps of the random walk between two zones that are kept.
const STRIDE: usize = 7;
/// Rounds over all zones; the fastest counts.
const ROUNDS: usize = 200;
/// The greatest constant of a guard or invariant.
const GREATEST: u32 = 20;

/// One step of a clock automaton: wait for a guard from below, reset a clock, delay within an invariant.
struct Step {
    guarded: usize,
    at_least: Bound,
    reset: usize,
    limited: usize,
    at_most: Bound,
}

/// A zone that can take its step.
struct Case {
    zone: Vec<Bound>,
    step: Step,
}

/// Everything that is measured at one dimension.
struct Bench {
    dimension: usize,
    ceilings: Ceilings,
    cases: Vec<Case>,
    /// Zones of other cases, for comparisons.
    others: Vec<Vec<Bound>>,
}

/// A linear congruential generator: the same zones in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap_or(0) % limit
    }

    fn constant(&mut self) -> i32 {
        i32::try_from(self.below(GREATEST as usize + 1)).unwrap_or(0)
    }

    fn step(&mut self, dimension: usize) -> Step {
        let bound = |value: i32| Bound::weak(value).expect("the constant is small");
        Step {
            guarded: 1 + self.below(dimension - 1),
            at_least: bound(-self.constant()),
            reset: 1 + self.below(dimension - 1),
            limited: 1 + self.below(dimension - 1),
            at_most: bound(self.constant()),
        }
    }
}

impl Step {
    /// The zone after the step; returns whether something is left.
    fn take(&self, zone: &mut [Bound], dimension: usize, ceilings: &Ceilings) -> bool {
        if !dbm::constrain(zone, dimension, 0, self.guarded, self.at_least) {
            return false;
        }
        clocks::reset(zone, dimension, self.reset, 0);
        clocks::up(zone, dimension);
        if !dbm::constrain(zone, dimension, self.limited, 0, self.at_most) {
            return false;
        }
        extrapolate::lu_plus(zone, dimension, ceilings);
        true
    }
}

impl Bench {
    fn new(dimension: usize) -> Bench {
        let mut random = Random(dimension as u64);
        let lower: Vec<_> = (0..dimension).map(|_| Some(random.constant())).collect();
        let upper: Vec<_> = (0..dimension).map(|_| Some(random.constant())).collect();
        let ceilings = Ceilings::lower_upper(&lower, &upper);
        let mut zone = vec![Bound::LE_ZERO; dimension * dimension];
        let mut cases = Vec::new();
        let mut taken = 0;
        while cases.len() < usize::from(ZONES) {
            let step = random.step(dimension);
            let source = zone.clone();
            if !step.take(&mut zone, dimension, &ceilings) {
                zone = source;
                continue;
            }
            taken += 1;
            if taken % STRIDE == 0 {
                cases.push(Case { zone: source, step });
            }
        }
        let others = (0..ZONES)
            .map(|_| cases[random.below(ZONES.into())].zone.clone())
            .collect();
        Bench {
            dimension,
            ceilings,
            cases,
            others,
        }
    }

    /// Nanoseconds that `operation` takes on a copy of each zone; it returns something that depends on its result.
    fn measure(&self, operation: impl Fn(&mut [Bound], usize) -> bool) -> f64 {
        let mut scratch = vec![Bound::LE_ZERO; self.dimension * self.dimension];
        let mut round = || {
            let start = Instant::now();
            for (index, case) in self.cases.iter().enumerate() {
                scratch.copy_from_slice(&case.zone);
                black_box(operation(black_box(&mut scratch), index));
            }
            start.elapsed()
        };
        let fastest = (0..ROUNDS).map(|_| round()).min().unwrap_or_default();
        fastest.as_secs_f64() * 1e9 / f64::from(ZONES)
    }

    /// Nanoseconds of the operation with this name in [`TABLE`].
    fn time(&self, name: &str) -> f64 {
        let dimension = self.dimension;
        match name {
            "copy" => self.measure(|_, _| true),
            "close" => self.measure(|zone, _| dbm::close(zone, dimension)),
            "constrain" => self.measure(|zone, index| {
                let step = &self.cases[index].step;
                dbm::constrain(zone, dimension, 0, step.guarded, step.at_least)
            }),
            "up" => self.measure(|zone, _| {
                clocks::up(zone, dimension);
                true
            }),
            "reset" => self.measure(|zone, index| {
                clocks::reset(zone, dimension, self.cases[index].step.reset, 0);
                true
            }),
            "extrapolate LU+" => self.measure_delayed(),
            "is_subset" => self.measure(|zone, index| dbm::is_subset(zone, &self.others[index])),
            "intersect" => {
                self.measure(|zone, index| dbm::intersect(zone, &self.others[index], dimension))
            }
            "down" => self.measure(|zone, _| {
                clocks::down(zone, dimension);
                true
            }),
            "hash" => self.measure(|zone, _| dbm::hash(zone) == 0),
            "minimal constraints" => self.measure(|zone, _| {
                let mut count = 0;
                minimal::for_each_minimal(zone, dimension, |_| count += 1);
                count == 0
            }),
            _ => self.measure(|zone, index| {
                self.cases[index].step.take(zone, dimension, &self.ceilings)
            }),
        }
    }

    /// Extrapolation is measured where it happens: after delay and invariant, before which little is forgotten.
    fn measure_delayed(&self) -> f64 {
        let without = |case: &Case| {
            let (mut zone, step) = (case.zone.clone(), &case.step);
            dbm::constrain(&mut zone, self.dimension, 0, step.guarded, step.at_least);
            clocks::reset(&mut zone, self.dimension, step.reset, 0);
            clocks::up(&mut zone, self.dimension);
            dbm::constrain(&mut zone, self.dimension, step.limited, 0, step.at_most);
            zone
        };
        let delayed: Vec<Vec<Bound>> = self.cases.iter().map(without).collect();
        self.measure(|zone, index| {
            zone.copy_from_slice(&delayed[index]);
            extrapolate::lu_plus(zone, self.dimension, &self.ceilings);
            true
        })
    }
}

/// The operations with the published figures in nanoseconds, where there are any.
const TABLE: [(&str, [u32; 5]); 12] = [
    ("copy", [4, 5, 9, 17, 27]),
    ("close", [75, 262, 561, 1_017, 3_106]),
    ("constrain", [36, 59, 117, 183, 247]),
    ("up", [6, 7, 16, 20, 47]),
    ("reset", [13, 17, 32, 52, 69]),
    ("extrapolate LU+", [66, 153, 1_038, 1_958, 4_205]),
    ("is_subset", [6, 8, 10, 15, 23]),
    ("intersect", [0; 5]),
    ("down", [0; 5]),
    ("hash", [0; 5]),
    ("minimal constraints", [0; 5]),
    ("full successor", [113, 220, 1_253, 2_512, 4_272]),
];

fn main() {
    let benches = DIMENSIONS.map(Bench::new);
    print!("{:20}", "ns (published)");
    for dimension in DIMENSIONS {
        print!("{dimension:>14}");
    }
    println!();
    for (name, published) in TABLE {
        print!("{name:20}");
        for (bench, published) in benches.iter().zip(published) {
            let figure = if published == 0 {
                String::new()
            } else {
                format!("({published})")
            };
            print!("{:>7.0} {figure:>6}", bench.time(name));
        }
        println!();
    }
    // What the walk reaches should not be trivial: the share of finite entries tells.
    for bench in &benches {
        let bounds = bench.cases.iter().flat_map(|case| &case.zone);
        let finite = bounds.filter(|bound| bound.is_finite()).count();
        let all = usize::from(ZONES) * bench.dimension * bench.dimension;
        println!(
            "dimension {}: {} % of the entries are finite",
            bench.dimension,
            100 * finite / all
        );
    }
}
