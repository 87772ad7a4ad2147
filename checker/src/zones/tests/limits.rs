//! Operations on zones and federations with bounds near the limits of their range, compared with
//! the same operations in 64 bits.
//!
//! The other side is written from the definitions: matrices of bounds with all sums in `i64`,
//! closed by Floyd and Warshall. Every operation starts from zones within [`Bound::most_in_zone`],
//! as the engine ensures. Its result may be beyond it, but no bound may wrap. With constants above
//! [`Bound::NARROW_VALUE`] it may lie beyond what a bound can hold. Then that is noted, and the
//! zone is larger.

use proptest::collection::vec;
use proptest::prelude::*;

use crate::zones::clocks::Assignment;
use crate::zones::dbm::{self, Constraint};
use crate::zones::{Bound, ClockSet, Federation, Zone, past, wide};

/// A bound: the constant, and whether it is weak; `None` means no bound. Tighter bounds are less.
type Wide = Option<(i64, bool)>;

fn least(one: Wide, other: Wide) -> Wide {
    match (one, other) {
        (None, bound) | (bound, None) => bound,
        (Some(one), Some(other)) => Some(one.min(other)),
    }
}

fn sum(one: Wide, other: Wide) -> Wide {
    let (one, other) = (one?, other?);
    Some((one.0 + other.0, one.1 && other.1))
}

/// A matrix of bounds; `None` is the empty zone.
#[derive(Clone, Debug, PartialEq)]
struct Matrix {
    dimension: usize,
    bounds: Option<Vec<Wide>>,
}

impl Matrix {
    fn of(zone: &Zone) -> Matrix {
        let wide = |bound: &Bound| {
            bound
                .is_finite()
                .then(|| (i64::from(bound.value()), !bound.is_strict()))
        };
        let bounds = zone.bounds().iter().map(wide).collect();
        Matrix {
            dimension: zone.dimension(),
            bounds: (!zone.is_empty()).then_some(bounds),
        }
    }

    fn closed(mut self) -> Matrix {
        let n = self.dimension;
        if let Some(bounds) = &mut self.bounds {
            for via in 0..n {
                for left in 0..n {
                    for right in 0..n {
                        let path = sum(bounds[left * n + via], bounds[via * n + right]);
                        bounds[left * n + right] = least(bounds[left * n + right], path);
                    }
                }
                if (0..n).any(|clock| bounds[clock * n + clock] < Some((0, true))) {
                    self.bounds = None;
                    return self;
                }
            }
        }
        self
    }

    fn constrained(mut self, constraints: &[Constraint]) -> Matrix {
        if let Some(bounds) = &mut self.bounds {
            for one in constraints {
                let entry = &mut bounds[one.left * self.dimension + one.right];
                let bound = (i64::from(one.bound.value()), !one.bound.is_strict());
                *entry = least(*entry, Some(bound));
            }
        }
        self.closed()
    }

    fn intersected(mut self, other: &Matrix) -> Matrix {
        self.bounds = self.bounds.zip(other.bounds.as_ref()).map(|(own, other)| {
            let both = own.iter().zip(other);
            both.map(|(one, other)| least(*one, *other)).collect()
        });
        self.closed()
    }

    fn after_delays(mut self) -> Matrix {
        if let Some(bounds) = &mut self.bounds {
            for left in 1..self.dimension {
                bounds[left * self.dimension] = None;
            }
        }
        self
    }

    fn before_delays(mut self) -> Matrix {
        if let Some(bounds) = &mut self.bounds {
            bounds[1..self.dimension].fill(Some((0, true)));
        }
        self.closed()
    }

    fn with_value(mut self, clock: usize, value: i32) -> Matrix {
        let n = self.dimension;
        if let Some(bounds) = &mut self.bounds {
            let value = Some((i64::from(value), true));
            let negated = value.map(|(value, _)| (-value, true));
            for other in (0..n).filter(|&other| other != clock) {
                bounds[clock * n + other] = sum(value, bounds[other]);
                bounds[other * n + clock] = sum(negated, bounds[other * n]);
            }
        }
        self
    }

    fn contains(&self, point: &[i64]) -> bool {
        let n = self.dimension;
        self.bounds.as_ref().is_some_and(|bounds| {
            (0..n * n).all(|index| {
                let difference = 2 * (point[index / n] - point[index % n]);
                bounds[index]
                    .is_none_or(|(value, is_weak)| difference <= 2 * value - i64::from(!is_weak))
            })
        })
    }
}

/// Constants near the ends of the range, and small ones.
fn constant(most: i32) -> impl Strategy<Value = i32> {
    prop_oneof![
        3 => (0..4).prop_map(move |less| most - less),
        2 => 0..=most,
        2 => 0..4_i32,
        1 => (0..4).prop_map(move |less| most / 2 - less),
    ]
}

fn constraint(
    dimension: usize,
    has_differences: bool,
    most: i32,
) -> impl Strategy<Value = Constraint> {
    let parts = (
        0..dimension,
        0..dimension,
        constant(most),
        any::<(bool, bool, bool)>(),
    );
    parts.prop_map(
        move |(left, right, value, (is_strict, is_negative, is_apart))| {
            let right = if left == right || !(has_differences && is_apart) {
                0
            } else {
                right
            };
            let (left, right) = if left == right { (1, 0) } else { (left, right) };
            let (left, right) = if is_negative {
                (right, left)
            } else {
                (left, right)
            };
            let value = if left == 0 || is_negative {
                -value
            } else {
                value
            };
            let bound = if is_strict {
                Bound::strict(value)
            } else {
                Bound::weak(value)
            };
            Constraint {
                left,
                right,
                bound: bound.expect("the constant is allowed"),
            }
        },
    )
}

#[derive(Clone, Debug)]
struct Case {
    dimension: usize,
    most: i32,
    first: Vec<Constraint>,
    second: Vec<Constraint>,
    third: Vec<Constraint>,
    assigned: (usize, i32),
}

fn cases(is_wide: bool) -> impl Strategy<Value = Case> {
    (2..=9_usize, any::<bool>()).prop_flat_map(move |(dimension, has_differences)| {
        // Constants are made before the test begins.
        wide::forced::set(is_wide);
        let most = if is_wide {
            Bound::MAX_VALUE
        } else {
            Bound::most_in_zone(dimension, has_differences).min(Bound::NARROW_VALUE)
        };
        let some = move |count: usize| vec(constraint(dimension, has_differences, most), 0..=count);
        (
            some(2 * dimension),
            some(dimension),
            some(3),
            1..dimension,
            constant(most),
        )
            .prop_map(move |(first, second, third, clock, value)| Case {
                dimension,
                most,
                first,
                second,
                third,
                assigned: (clock, value),
            })
    })
}

/// Valuations on the corners of zones and next to them.
fn points(zones: &[&Matrix]) -> Vec<Vec<i64>> {
    let mut points = Vec::new();
    for zone in zones {
        let n = zone.dimension;
        let Some(bounds) = &zone.bounds else { continue };
        for from in 0..n {
            for by in -1..=1 {
                let lowest = (0..n).map(|to| bounds[from * n + to].map(|(value, _)| -value + by));
                let highest = (0..n).map(|to| bounds[to * n + from].map(|(value, _)| value + by));
                for values in [lowest.collect::<Vec<_>>(), highest.collect()] {
                    let values: Vec<i64> = values.iter().map(|value| value.unwrap_or(7)).collect();
                    points.push(values.iter().map(|value| value - values[0]).collect());
                }
            }
        }
    }
    points.retain(|point: &Vec<i64>| point.iter().all(|&value| value >= 0));
    points
}

/// Whether the zone is the set of the matrix, or contains it where bounds were lost.
fn is_right(zone: &Zone, matrix: &Matrix) -> bool {
    let own = Matrix::of(zone);
    if !wide::has_forgotten() {
        return own == *matrix;
    }
    match (&own.bounds, &matrix.bounds) {
        (_, None) => true,
        (None, Some(_)) => false,
        (Some(own), Some(wanted)) => own
            .iter()
            .zip(wanted)
            .all(|(own, wanted)| least(*own, *wanted) == *wanted),
    }
}

/// Compares the operations on zones of a case with those on matrices.
fn check(case: Case) -> Result<(), TestCaseError> {
    let Case {
        dimension,
        most,
        first,
        second,
        third,
        assigned: (clock, value),
    } = case;
    wide::start();
    let mut zone = Zone::universe(dimension);
    let matrix = Matrix::of(&zone).constrained(&first);
    zone.constrain_all(&first);
    prop_assert!(is_right(&zone, &matrix));
    let mut other = Zone::universe(dimension);
    let other_matrix = Matrix::of(&other).constrained(&second);
    other.constrain_all(&second);
    prop_assert!(is_right(&other, &other_matrix));
    let is_in_range = |zone: &Zone| zone.is_empty() || dbm::is_in_range(zone.bounds(), most);
    if zone.is_empty() || other.is_empty() || !is_in_range(&zone) || !is_in_range(&other) {
        return Ok(());
    }
    let mut both = zone.clone();
    both.intersect(&other);
    prop_assert!(is_right(&both, &matrix.clone().intersected(&other_matrix)));
    let mut later = zone.clone();
    later.up(&ClockSet::EMPTY);
    prop_assert!(is_right(&later, &matrix.clone().after_delays()));
    let mut cut = later.clone();
    cut.constrain_all(&third);
    let cut_matrix = matrix.clone().after_delays().constrained(&third);
    prop_assert!(is_right(&cut, &cut_matrix));
    let mut earlier = zone.clone();
    earlier.down(&ClockSet::EMPTY);
    prop_assert!(is_right(&earlier, &matrix.clone().before_delays()));
    let mut set = zone.clone();
    set.assign(&[Assignment::Value { clock, value }]);
    prop_assert!(is_right(&set, &matrix.clone().with_value(clock, value)));
    let mut before = zone.clone();
    let is_left = before.preimage(&third, &[Assignment::Value { clock, value }]);
    let federation = |zone: &Zone| Federation::of_zone(dimension, zone.bounds());
    let mut rest = federation(&zone);
    rest.subtract_zone(other.bounds());
    let met = federation(&zone).intersection(&federation(&other));
    let nothing = Federation::empty(dimension);
    let past = past::predecessors(&federation(&zone), &nothing, &ClockSet::EMPTY);
    if wide::has_forgotten() {
        return Ok(());
    }
    for point in points(&[&matrix, &other_matrix]) {
        let (own, others) = (matrix.contains(&point), other_matrix.contains(&point));
        prop_assert_eq!(rest.contains(&point, 1), own && !others, "{:?}", &point);
        prop_assert_eq!(met.contains(&point, 1), own && others, "{:?}", &point);
        let could_be = Matrix::of(&earlier).contains(&point);
        prop_assert_eq!(past.contains(&point, 1), could_be, "{:?}", &point);
        let mut target = point.clone();
        target[clock] = i64::from(value);
        let universe = Matrix::of(&Zone::universe(dimension));
        let is_enabled = universe.constrained(&third).contains(&point);
        let leads_there = is_enabled && matrix.contains(&target);
        let is_before = is_left && before.contains(&point, 1);
        prop_assert_eq!(is_before, leads_there, "{:?}", &point);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn operations_near_the_limits_equal_those_in_64_bits(case in cases(false)) {
        check(case)?;
        prop_assert!(!wide::has_forgotten());
    }

    #[test]
    fn operations_on_great_constants_equal_those_in_64_bits(case in cases(true)) {
        check(case)?;
    }
}
