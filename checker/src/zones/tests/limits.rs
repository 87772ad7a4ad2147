//! Operations on zones and federations with bounds near the limits of their range, compared with
//! the same operations in 64 bits.
//!
//! The other side is written from the definitions: matrices of bounds with all sums in `i64`,
//! closed by Floyd and Warshall. Every operation starts from zones within [`Bound::most_in_zone`],
//! as the engine ensures. Its result may be beyond it, but no bound may wrap.

use proptest::collection::vec;
use proptest::prelude::*;

use crate::zones::clocks::Assignment;
use crate::zones::dbm::{self, Constraint};
use crate::zones::{Bound, ClockSet, Federation, Zone, past};

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

fn cases() -> impl Strategy<Value = Case> {
    (2..=9_usize, any::<bool>()).prop_flat_map(|(dimension, has_differences)| {
        let most = Bound::most_in_zone(dimension, has_differences).min(Bound::MAX_VALUE);
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

proptest! {
    #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn operations_near_the_limits_equal_those_in_64_bits(case in cases()) {
        let Case { dimension, most, first, second, third, assigned: (clock, value) } = case;
        let mut zone = Zone::universe(dimension);
        let matrix = Matrix::of(&zone).constrained(&first);
        zone.constrain_all(&first);
        prop_assert_eq!(&Matrix::of(&zone), &matrix);
        let mut other = Zone::universe(dimension);
        let other_matrix = Matrix::of(&other).constrained(&second);
        other.constrain_all(&second);
        prop_assert_eq!(&Matrix::of(&other), &other_matrix);
        let is_in_range = |zone: &Zone| zone.is_empty() || dbm::is_in_range(zone.bounds(), most);
        if zone.is_empty() || other.is_empty() || !is_in_range(&zone) || !is_in_range(&other) {
            return Ok(());
        }
        let mut both = zone.clone();
        if !other.is_empty() {
            both.intersect(&other);
            prop_assert_eq!(Matrix::of(&both), matrix.clone().intersected(&other_matrix));
        }
        let mut later = zone.clone();
        later.up(&ClockSet::EMPTY);
        prop_assert_eq!(Matrix::of(&later), matrix.clone().after_delays());
        let mut cut = later.clone();
        cut.constrain_all(&third);
        prop_assert_eq!(Matrix::of(&cut), matrix.clone().after_delays().constrained(&third));
        let mut earlier = zone.clone();
        earlier.down(&ClockSet::EMPTY);
        prop_assert_eq!(Matrix::of(&earlier), matrix.clone().before_delays());
        let mut set = zone.clone();
        set.assign(&[Assignment::Value { clock, value }]);
        prop_assert_eq!(Matrix::of(&set), matrix.clone().with_value(clock, value));
        let mut before = zone.clone();
        let is_left = before.preimage(&third, &[Assignment::Value { clock, value }]);
        let federation = |zone: &Zone| Federation::of_zone(dimension, zone.bounds());
        let mut rest = federation(&zone);
        if !other.is_empty() {
            rest.subtract_zone(other.bounds());
        }
        let mut met = federation(&zone);
        if !other.is_empty() {
            met = met.intersection(&federation(&other));
        }
        let nothing = Federation::empty(dimension);
        let past = past::predecessors(&federation(&zone), &nothing, &ClockSet::EMPTY);
        for point in points(&[&matrix, &other_matrix]) {
            let (own, others) = (matrix.contains(&point), other_matrix.contains(&point));
            prop_assert_eq!(rest.contains(&point, 1), own && !others, "{:?}", &point);
            prop_assert_eq!(met.contains(&point, 1), own && others, "{:?}", &point);
            let could_be = Matrix::of(&earlier).contains(&point);
            prop_assert_eq!(past.contains(&point, 1), could_be, "{:?}", &point);
            let mut target = point.clone();
            target[clock] = i64::from(value);
            let is_enabled = Matrix::of(&Zone::universe(dimension)).constrained(&third).contains(&point);
            let leads_there = is_enabled && matrix.contains(&target);
            prop_assert_eq!(is_left && before.contains(&point, 1), leads_there, "{:?}", &point);
        }
    }
}
