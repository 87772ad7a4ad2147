//! How long does one zone operation take, and one full successor?
//!
//! `cargo bench --no-default-features --bench zones` prints nanoseconds per operation, copying the
//! source zone included, over zones that a random walk of successors reaches. With the folders of
//! the sources of UDBM and of `UUtils`, on which it rests, in `NTAGEN_UDBM` and `NTAGEN_UUTILS`,
//! the same operations on the same zones are timed in its C code (`udbm.c`), in turns with ours,
//! and the ratio stands beside each figure. Without them the figures in brackets are those
//! published for another machine, an order of magnitude. The least of several rounds is printed, so
//! a busy machine disturbs little.

#![expect(clippy::print_stdout, reason = "a benchmark prints its table")]

mod support;

use std::env;
use std::error::Error;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::hint::black_box;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use checker::zones::extrapolate::{self, Ceilings};
use checker::zones::{Bound, clocks, dbm, minimal};

use support::Scratch;

/// Clocks and the reference clock.
const DIMENSIONS: [usize; 5] = [4, 6, 11, 16, 21];
/// Zones that an operation is averaged over.
const ZONES: u16 = 200;
/// Steps of the random walk between two zones that are kept.
const STRIDE: usize = 7;
/// Rounds over all zones; the fastest counts.
const ROUNDS: usize = 50;
/// Turns of such rounds.
const TURNS: usize = 4;
/// The greatest constant of a guard or invariant.
const GREATEST: u32 = 20;

/// One step of a clock automaton: wait for a guard from below, reset a clock, delay within an
/// invariant.
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
    /// The greatest constants of comparisons from below and from above.
    greatest: [Vec<Option<i32>>; 2],
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
        let is_left = self.delay(zone, dimension);
        if is_left {
            extrapolate::lu_plus(zone, dimension, ceilings);
        }
        is_left
    }

    /// The same without extrapolation.
    fn delay(&self, zone: &mut [Bound], dimension: usize) -> bool {
        if !dbm::constrain(zone, dimension, 0, self.guarded, self.at_least) {
            return false;
        }
        clocks::reset(zone, dimension, self.reset, 0);
        clocks::up(zone, dimension);
        dbm::constrain(zone, dimension, self.limited, 0, self.at_most)
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
            greatest: [lower, upper],
            ceilings,
            cases,
            others,
        }
    }

    /// Nanoseconds that `operation` takes on a copy of each zone; it returns something that depends
    /// on its result.
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

    /// The zones of the cases after delay and invariant, where extrapolation happens: before,
    /// little would be forgotten.
    fn delayed(&self) -> Vec<Vec<Bound>> {
        let without = |case: &Case| {
            let mut zone = case.zone.clone();
            case.step.delay(&mut zone, self.dimension);
            zone
        };
        self.cases.iter().map(without).collect()
    }

    fn measure_delayed(&self) -> f64 {
        let delayed = self.delayed();
        self.measure(|zone, index| {
            zone.copy_from_slice(&delayed[index]);
            extrapolate::lu_plus(zone, self.dimension, &self.ceilings);
            true
        })
    }

    /// What `udbm.c` reads.
    fn cases_as_text(&self) -> String {
        let mut text = format!("{} {ZONES}\n", self.dimension);
        let mut line = |numbers: &mut dyn Iterator<Item = i32>| {
            for number in numbers {
                // Writing to a string does not fail.
                let _ = write!(text, "{number} ");
            }
            text.push('\n');
        };
        for greatest in &self.greatest {
            line(
                &mut (0..).zip(greatest).map(|(clock, constant)| match clock {
                    0 => 0,
                    _ => constant.unwrap_or(i32::MIN / 4),
                }),
            );
        }
        for (case, other) in self.cases.iter().zip(&self.others) {
            let step = &case.step;
            line(
                &mut [
                    step.guarded as i32,
                    encoded(step.at_least),
                    step.reset as i32,
                    step.limited as i32,
                    encoded(step.at_most),
                ]
                .into_iter(),
            );
            line(&mut case.zone.iter().copied().map(encoded));
            line(&mut other.iter().copied().map(encoded));
        }
        text
    }

    /// What UDBM takes for the operations of [`TABLE`] that it is asked for, in their order.
    fn time_udbm(&self, program: &Path) -> Result<Vec<f64>, Box<dyn Error>> {
        let mut child = Command::new(program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut input = child.stdin.take().ok_or("the program has an input")?;
        input.write_all(self.cases_as_text().as_bytes())?;
        drop(input);
        let output = String::from_utf8(child.wait_with_output()?.stdout)?;
        let mut fields = output.split_whitespace();
        let sum: i64 = fields.next().ok_or("the program wrote nothing")?.parse()?;
        let delayed = self.delayed();
        let finite = delayed.iter().flatten().filter(|bound| bound.is_finite());
        let ours: i64 = finite.map(|&bound| i64::from(encoded(bound))).sum();
        assert_eq!(sum, ours, "UDBM and we reach the same zones");
        let times: Result<Vec<f64>, _> = fields.map(str::parse).collect();
        Ok(times?)
    }
}

/// The bound as `udbm.c` reads it.
fn encoded(bound: Bound) -> i32 {
    if bound.is_infinite() {
        return i32::MAX;
    }
    2 * bound.value() + i32::from(!bound.is_strict())
}

/// The yardstick, if the folders of its sources are given.
fn compile_udbm(scratch: &Scratch) -> Result<Option<PathBuf>, Box<dyn Error>> {
    let Some(udbm) = env::var_os("NTAGEN_UDBM").map(PathBuf::from) else {
        return Ok(None);
    };
    let uutils = env::var_os("NTAGEN_UUTILS").map(PathBuf::from);
    let uutils =
        uutils.ok_or("UDBM rests on UUtils: set NTAGEN_UUTILS to the folder of its sources")?;
    let include = |folder: PathBuf| {
        let mut option = OsString::from("-I");
        option.push(folder);
        option
    };
    // The sources of UDBM leave out a header that they need; what is not used needs nothing of
    // `UUtils` but headers.
    let mut arguments: Vec<OsString> = [
        "-O3",
        "-march=native",
        "-DNDEBUG",
        "-w",
        "-ffunction-sections",
        "-Wl,--gc-sections",
        "-include",
        "stdlib.h",
    ]
    .map(OsString::from)
    .into();
    arguments.extend(
        [
            udbm.join("include"),
            udbm.join("src"),
            uutils.join("include"),
        ]
        .map(include),
    );
    arguments
        .extend([udbm.join("src/dbm.c"), uutils.join("src/base/bitstring.c")].map(OsString::from));
    scratch.compile("benches/udbm.c", &arguments).map(Some)
}

/// The operations with the published figures in nanoseconds, where there are any: those that
/// `udbm.c` times, in its order.
const TABLE: [(&str, [u32; 5]); 12] = [
    ("copy", [4, 5, 9, 17, 27]),
    ("close", [75, 262, 561, 1_017, 3_106]),
    ("constrain", [36, 59, 117, 183, 247]),
    ("up", [6, 7, 16, 20, 47]),
    ("reset", [13, 17, 32, 52, 69]),
    ("extrapolate LU+", [66, 153, 1_038, 1_958, 4_205]),
    ("is_subset", [6, 8, 10, 15, 23]),
    ("full successor", [113, 220, 1_253, 2_512, 4_272]),
    ("intersect", [0; 5]),
    ("down", [0; 5]),
    ("hash", [0; 5]),
    ("minimal constraints", [0; 5]),
];

/// Nanoseconds of every operation at one dimension, and those of UDBM as far as it was timed.
struct Figures {
    ours: Vec<f64>,
    udbm: Vec<f64>,
}

impl Figures {
    fn of(bench: &Bench, udbm: Option<&Path>) -> Result<Figures, Box<dyn Error>> {
        let mut figures = Figures {
            ours: vec![f64::INFINITY; TABLE.len()],
            udbm: Vec::new(),
        };
        for _ in 0..TURNS {
            for (least, (name, _)) in figures.ours.iter_mut().zip(TABLE) {
                *least = least.min(bench.time(name));
            }
            if let Some(program) = udbm {
                let times = bench.time_udbm(program)?;
                figures.udbm.resize(times.len(), f64::INFINITY);
                for (least, time) in figures.udbm.iter_mut().zip(times) {
                    *least = least.min(time);
                }
            }
        }
        Ok(figures)
    }

    /// Our figure, and what stands beside it.
    fn cell(&self, operation: usize, published: u32) -> String {
        let ours = self.ours[operation];
        match (self.udbm.get(operation), published) {
            (Some(udbm), _) => format!("{ours:>7.0} /{udbm:>6.0} = {:<5.2}", ours / udbm),
            (None, 0) => format!("{ours:>7.0} {:>6}", ""),
            (None, _) => format!("{ours:>7.0} {:>6}", format!("({published})")),
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let scratch = Scratch::new()?;
    let udbm = compile_udbm(&scratch)?;
    let benches = DIMENSIONS.map(Bench::new);
    let figures = benches
        .iter()
        .map(|bench| Figures::of(bench, udbm.as_deref()));
    let figures: Vec<Figures> = figures.collect::<Result<_, _>>()?;
    let (title, width) = match udbm {
        Some(_) => ("ns / UDBM = ratio", 22),
        None => ("ns (published)", 14),
    };
    print!("{title:20}");
    for dimension in DIMENSIONS {
        print!("{dimension:>width$}");
    }
    println!();
    for (operation, (name, published)) in TABLE.iter().enumerate() {
        print!("{name:20}");
        for (figures, &published) in figures.iter().zip(published) {
            print!("{:width$}", figures.cell(operation, published));
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
    Ok(())
}
