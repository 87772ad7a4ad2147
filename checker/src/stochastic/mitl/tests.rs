//! The monitor against an evaluation of the definitions on a grid.
//!
//! Signals change on whole moments only, and bounds are whole numbers. Then every formula has one
//! value at each whole moment and one between two of them, so the definitions can be tried for all
//! pairs of positions. The evaluation shares no code with the monitor.

use super::monitor::Monitor;
use super::signal::{Cut, Moment};
use crate::ir::{STREAM_WORDS, Stream, Temporal};

/// A position of the grid.
#[derive(Clone, Copy, Debug)]
struct Position {
    /// The number of moves before it.
    state: u64,
    /// Twice the moment; odd between two moments.
    half: i64,
}

/// A run on the grid: its positions, and of each which conditions hold.
struct Run {
    positions: Vec<Position>,
    holds: Vec<Vec<bool>>,
}

const CONDITIONS: usize = 2;

fn random_run(stream: &mut Stream<'_>) -> Run {
    let mut run = Run {
        positions: Vec::new(),
        holds: Vec::new(),
    };
    let mut half = 0;
    for state in 0..=u64::from(stream.below(5)) {
        let end = half + 2 * i64::from(stream.below(4));
        // Now and then conditions change within a state, as those of clocks do.
        let changes = stream.below(3) == 0;
        let mut now: Vec<bool> = (0..CONDITIONS).map(|_| stream.below(2) == 0).collect();
        while half <= end {
            run.positions.push(Position { state, half });
            run.holds.push(now.clone());
            if changes && stream.below(2) == 0 {
                now = (0..CONDITIONS).map(|_| stream.below(2) == 0).collect();
            }
            half += 1;
        }
        half = end;
    }
    run
}

fn random_formula(stream: &mut Stream<'_>, depth: u32) -> Temporal {
    if depth == 0 || stream.below(5) == 0 {
        return Temporal::Atom(stream.below(CONDITIONS as u32) as usize);
    }
    let kind = stream.below(8);
    let from = f64::from(stream.below(4));
    let to = from + f64::from(stream.below(4));
    let to = if stream.below(6) == 0 {
        f64::INFINITY
    } else {
        to
    };
    let mut part = || random_formula(stream, depth - 1);
    match kind {
        0 => part().negated(),
        1 => part().and(part()),
        2 => part().or(part()),
        3 => Temporal::Next(Box::new(part())),
        4 => Temporal::True.until((from, to), part()),
        5 => part().release((from, to), part()),
        _ => part().until((from, to), part()),
    }
}

/// At which positions a formula holds, from its definition.
fn evaluate(run: &Run, formula: &Temporal) -> Vec<bool> {
    let count = run.positions.len();
    match formula {
        Temporal::True => vec![true; count],
        Temporal::Atom(atom) => run.holds.iter().map(|holds| holds[*atom]).collect(),
        Temporal::Not(inner) => evaluate(run, inner).iter().map(|holds| !holds).collect(),
        Temporal::And(left, right) => {
            let (left, right) = (evaluate(run, left), evaluate(run, right));
            (0..count).map(|x| left[x] && right[x]).collect()
        }
        Temporal::Next(inner) => {
            let inner = evaluate(run, inner);
            let behind = |x: usize| {
                let next = run.positions[x].state + 1;
                let first = run.positions.iter().position(|one| one.state == next);
                first.is_some_and(|first| inner[first])
            };
            (0..count).map(behind).collect()
        }
        Temporal::Until {
            interval,
            keep,
            goal,
        } => {
            let (keep, goal) = (evaluate(run, keep), evaluate(run, goal));
            (0..count)
                .map(|x| (x..count).any(|y| reaches(run, (x, y), *interval, (&keep, &goal))))
                .collect()
        }
    }
}

/// Whether `keep U[a,b] goal` holds at x because of y.
fn reaches(
    run: &Run,
    (x, y): (usize, usize),
    (from, to): (f64, f64),
    (keep, goal): (&[bool], &[bool]),
) -> bool {
    if !goal[y] {
        return false;
    }
    if x == y && from == 0.0 {
        return true;
    }
    if (x..y).any(|between| !keep[between]) {
        return false;
    }
    let (start, end) = (run.positions[x].half, run.positions[y].half);
    let (is_between, ends_between) = (start % 2 != 0, end % 2 != 0);
    // Distances in halves: where y lies between two moments, all of them can be chosen if p holds
    // there, and else only the first.
    let (from, to) = (2.0 * from, 2.0 * to);
    let distance = (end - start) as f64;
    match (is_between, ends_between) {
        (false, false) => distance >= from && distance <= to,
        // Bounds are even here: all moments of x are at such a distance, or none is.
        (true, false) => distance > from && distance < to,
        (false, true) if keep[y] => distance + 1.0 > from && distance - 1.0 < to,
        (false, true) => distance - 1.0 >= from && distance - 1.0 < to,
        // Moments at the same place in two intervals are `distance` apart.
        (true, true) if keep[y] => distance >= from && distance <= to,
        // From x to the start of the interval of y.
        (true, true) => x != y && distance - 1.0 > from && distance - 1.0 < to,
    }
}

/// Whether the monitor says that a formula holds, and whether it said so before the run was over.
fn monitored(run: &Run, formula: &Temporal) -> (bool, bool) {
    let mut monitor = Monitor::new(formula, CONDITIONS);
    for (number, position) in run.positions.iter().enumerate() {
        let next = run.positions.get(number + 1);
        let is_last = next.is_none_or(|next| next.state != position.state);
        let moment = Moment::new((position.half / 2) as f64);
        let end = if position.half % 2 != 0 {
            Cut::before(Moment::new(((position.half + 1) / 2) as f64))
        } else if is_last {
            Cut {
                moment,
                order: position.state + 1,
            }
        } else {
            Cut::after(moment)
        };
        monitor.conditions(end, &run.holds[number]);
        if let Some(holds) = monitor.decided() {
            return (holds, true);
        }
        if is_last && next.is_some() {
            monitor.moves();
        }
    }
    (monitor.finish(), false)
}

#[test]
fn the_monitor_follows_the_definitions() {
    let cases: u64 = std::env::var("NTAGEN_CASES").map_or(20_000, |text| {
        text.parse().expect("NTAGEN_CASES is a number")
    });
    let (mut held, mut early) = (0, 0);
    for case in 0..cases {
        let mut words = [0; STREAM_WORDS];
        Stream::start(&mut words, 7, case);
        let mut stream = Stream::of(&mut words);
        let run = random_run(&mut stream);
        let formula = random_formula(&mut stream, 3);
        let expected = evaluate(&run, &formula)[0];
        let (holds, was_early) = monitored(&run, &formula);
        let shown: Vec<_> = run.positions.iter().zip(&run.holds).collect();
        assert_eq!(holds, expected, "case {case}: {formula:?} on {shown:?}");
        held += u64::from(holds);
        early += u64::from(was_early);
    }
    // Neither side is empty.
    assert!(held > cases / 10 && held < cases * 9 / 10, "{held} hold");
    assert!(early > cases / 10, "{early} are decided early");
}
