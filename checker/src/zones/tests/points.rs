//! Zones and federations compared with sets of points.
//!
//! A zone with integer bounds over n clocks is determined by the points whose coordinates are
//! multiples of 1 / (n + 1): these points have every order of the fractional parts. For at most two
//! clocks the tests try every such point up to [`LARGEST`], for more clocks a sample. What an
//! operation promises about a set is tested point by point. Every zone that it returns must be
//! closed, consistent and positive, which makes its matrix unique.

use std::collections::BTreeSet;

use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;

use crate::zones::clocks::{self, Assignment};
use crate::zones::dbm::{self, Constraint};
use crate::zones::extrapolate::{self, Ceilings};
use crate::zones::{Bound, ClockSet, Federation, Zone, instants, minimal, past, simulation, wide};

/// The greatest constant in generated constraints.
const CONSTANT: i32 = 4;
/// The greatest coordinate of the points that the tests try.
const LARGEST: i64 = 6;
/// The greatest delay or forgotten value that a test of existence tries. Beyond it nothing new can
/// happen.
const HORIZON: i64 = 40;
/// Points in a sample.
const SAMPLE: usize = 300;

/// A valuation in multiples of one over twice the dimension; clock 0 first.
type Point = Vec<i64>;

fn denominator(dimension: usize) -> i64 {
    2 * i64::try_from(dimension).unwrap()
}

/// All points of the grid, or a sample that `seed` determines.
fn points(dimension: usize, seed: u64) -> Vec<Point> {
    let steps = LARGEST * denominator(dimension) / 2 + 1;
    let clocks = dimension - 1;
    if clocks <= 2 {
        let total = steps.pow(u32::try_from(clocks).unwrap());
        let digit =
            |index: i64, clock: usize| index / steps.pow(u32::try_from(clock).unwrap()) % steps;
        let point = |index| (0..clocks).map(move |clock| 2 * digit(index, clock));
        return (0..total)
            .map(|index| std::iter::once(0).chain(point(index)).collect())
            .collect();
    }
    let mut state = seed | 1;
    let mut coordinate = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        2 * i64::try_from((state >> 33) % u64::try_from(steps).unwrap()).unwrap()
    };
    let mut sample: Vec<Point> = Vec::new();
    for index in 0..SAMPLE {
        let mut point: Point = (0..dimension).map(|_| coordinate()).collect();
        point[0] = 0;
        // Half of the points get clocks with equal fractional parts, where weak and strict bounds
        // differ.
        if index % 2 == 0 {
            let unit = denominator(dimension);
            let fraction = point[1] % unit;
            point
                .iter_mut()
                .skip(2)
                .for_each(|value| *value = *value / unit * unit + fraction);
        }
        sample.push(point);
    }
    sample
}

/// Whether the point satisfies the constraint.
fn satisfies(point: &Point, constraint: &Constraint) -> bool {
    let Constraint { left, right, bound } = *constraint;
    let difference = point[left] - point[right];
    let limit = i64::from(bound.value()) * denominator(point.len());
    bound.is_infinite() || difference < limit || difference == limit && !bound.is_strict()
}

/// The point after a delay of the clocks outside `stopped`; clock 0 stays.
fn delayed(point: &Point, delay: i64, stopped: &ClockSet) -> Point {
    let is_running = |clock: usize| clock != 0 && !stopped.contains(clock);
    let moved = |(clock, value): (usize, &i64)| {
        if is_running(clock) {
            value + delay
        } else {
            *value
        }
    };
    point.iter().enumerate().map(moved).collect()
}

/// The delays in half steps of the grid, up to the horizon.
fn delays(dimension: usize) -> std::ops::RangeInclusive<i64> {
    0..=HORIZON * denominator(dimension)
}

/// The point after a clock is set to a value.
fn with(point: &Point, clock: usize, value: i64) -> Point {
    let mut point = point.clone();
    point[clock] = value;
    point
}

/// The point after the assignment; none if a clock would become negative.
fn assigned(point: &Point, assignment: &Assignment) -> Option<Point> {
    let unit = denominator(point.len());
    let (clock, value) = match *assignment {
        Assignment::Value { clock, value } => (clock, i64::from(value) * unit),
        Assignment::Copy {
            clock,
            source,
            increment,
        } => (clock, point[source] + i64::from(increment) * unit),
    };
    (value >= 0).then(|| with(point, clock, value))
}

fn contains(zone: &Zone, point: &Point) -> bool {
    zone.contains(point, denominator(point.len()))
}

fn federation_contains(federation: &Federation, point: &Point) -> bool {
    federation.contains(point, denominator(point.len()))
}

/// Asserts that the matrix is marked empty, or closed, consistent and positive.
fn check_closed(bounds: &[Bound], dimension: usize) {
    if dbm::is_empty(bounds) {
        return;
    }
    let bound = |left: usize, right: usize| bounds[left * dimension + right];
    for left in 0..dimension {
        assert_eq!(
            bound(left, left),
            Bound::LE_ZERO,
            "diagonal at {left} in {bounds:?}"
        );
        assert!(
            bound(0, left) <= Bound::LE_ZERO,
            "clock {left} can be negative in {bounds:?}"
        );
        for right in 0..dimension {
            for via in 0..dimension {
                let path = bound(left, via) + bound(via, right);
                assert!(
                    bound(left, right) <= path,
                    "({left}, {right}) not tight over {via} in {bounds:?}"
                );
            }
        }
    }
}

/// Asserts that the zone is closed and contains exactly the points for which `expected` holds.
fn check_zone(zone: &Zone, seed: u64, expected: impl Fn(&Point) -> bool) {
    check_closed(zone.bounds(), zone.dimension());
    for point in points(zone.dimension(), seed) {
        assert_eq!(
            contains(zone, &point),
            expected(&point),
            "point {point:?} in {zone:?}"
        );
    }
}

/// Asserts that the zones of the federation are closed and not empty, and that it contains exactly
/// the points for which `expected` holds.
fn check_federation(federation: &Federation, seed: u64, expected: impl Fn(&Point) -> bool) {
    for zone in federation.zones() {
        assert!(!dbm::is_empty(zone), "an empty zone in a federation");
        check_closed(zone, federation.dimension());
    }
    for point in points(federation.dimension(), seed) {
        let is_inside = federation_contains(federation, &point);
        assert_eq!(
            is_inside,
            expected(&point),
            "point {point:?} in {federation:?}"
        );
    }
}

fn dimensions() -> std::ops::RangeInclusive<usize> {
    2..=5
}

fn bounds() -> impl Strategy<Value = Bound> {
    (-CONSTANT..=CONSTANT, any::<bool>()).prop_map(|(value, is_strict)| {
        if is_strict {
            Bound::strict(value).unwrap()
        } else {
            Bound::weak(value).unwrap()
        }
    })
}

fn constraint(dimension: usize) -> impl Strategy<Value = Constraint> {
    (0..dimension, 1..dimension, bounds()).prop_map(move |(left, step, bound)| Constraint {
        left,
        right: (left + step) % dimension,
        bound,
    })
}

fn constraints(dimension: usize, most: usize) -> impl Strategy<Value = Vec<Constraint>> {
    prop::collection::vec(constraint(dimension), 0..=most)
}

fn assignments(dimension: usize) -> impl Strategy<Value = Assignment> {
    prop_oneof![
        (1..dimension, 0..=CONSTANT).prop_map(|(clock, value)| Assignment::Value { clock, value }),
        (1..dimension, 1..dimension, -2..=CONSTANT).prop_map(|(clock, source, increment)| {
            Assignment::Copy {
                clock,
                source,
                increment,
            }
        }),
    ]
}

/// Zones that are not empty: constraints that would empty a zone are left out. In some zones time
/// has passed.
fn zones(dimension: usize) -> impl Strategy<Value = Zone> {
    let parts = (
        constraints(dimension, 6),
        constraints(dimension, 3),
        any::<bool>(),
    );
    parts.prop_map(move |(first, second, passes)| {
        let mut zone = Zone::universe(dimension);
        let constrain = |zone: &mut Zone, constraints: &[Constraint]| {
            for constraint in constraints {
                if dbm::satisfies(zone.bounds(), dimension, constraint) {
                    zone.constrain_all(&[*constraint]);
                }
            }
        };
        constrain(&mut zone, &first);
        if passes {
            zone.up(&ClockSet::EMPTY);
        }
        constrain(&mut zone, &second);
        zone
    })
}

fn two_zones() -> impl Strategy<Value = (Zone, Zone)> {
    dimensions().prop_flat_map(|dimension| (zones(dimension), zones(dimension)))
}

fn federations(dimension: usize, most: usize) -> impl Strategy<Value = Federation> {
    prop::collection::vec(zones(dimension), 0..=most).prop_map(move |zones| {
        let mut federation = Federation::empty(dimension);
        for zone in &zones {
            federation.push(zone.bounds());
        }
        federation
    })
}

fn two_federations() -> impl Strategy<Value = (Federation, Federation)> {
    dimensions().prop_flat_map(|dimension| (federations(dimension, 3), federations(dimension, 3)))
}

fn clock_sets(dimension: usize) -> impl Strategy<Value = ClockSet> {
    prop::collection::vec(any::<bool>(), dimension)
        .prop_map(|members| (1..members.len()).filter(|clock| members[*clock]).collect())
}

type Constants = Vec<Option<i32>>;

fn lower_and_upper(dimension: usize) -> impl Strategy<Value = (Constants, Constants)> {
    let constants = || prop::collection::vec(prop::option::weighted(0.8, 0..=CONSTANT), dimension);
    (constants(), constants())
}

fn configuration() -> ProptestConfig {
    let seeds = FileFailurePersistence::Direct("src/zones/tests/regressions.txt");
    ProptestConfig {
        cases: 96,
        failure_persistence: Some(Box::new(seeds)),
        ..ProptestConfig::default()
    }
}

/// The zone with all constants multiplied, so that half steps of the grid become integers.
fn scaled(zone: &Zone, factor: i32) -> Zone {
    let scale = |bound: &Bound| match *bound {
        bound if bound.is_infinite() => bound,
        bound if bound.is_strict() => Bound::strict(bound.value() * factor).unwrap(),
        bound => Bound::weak(bound.value() * factor).unwrap(),
    };
    let bounds: Vec<Bound> = zone.bounds().iter().map(scale).collect();
    Zone::from_bounds(zone.dimension(), &bounds)
}

/// Whether some valuation of the zone simulates the point with respect to the constants: each clock
/// has the same value, or is less but above L, or is greater while the point is above U (Behrmann
/// et al. 2004, definition 3).
fn is_simulated(zone: &Zone, point: &Point, lower: &Constants, upper: &Constants) -> bool {
    let unit = i32::try_from(denominator(point.len())).unwrap();
    let mut candidates = scaled(zone, unit);
    (1..point.len()).all(|clock| {
        let value = i32::try_from(point[clock]).unwrap();
        let is_above =
            |constant: Option<i32>| constant.is_none_or(|constant| value > constant * unit);
        let least = match lower[clock] {
            Some(constant) if is_above(lower[clock]) => Bound::strict(-constant * unit).unwrap(),
            Some(_) => Bound::weak(-value).unwrap(),
            None => Bound::LE_ZERO,
        };
        let greatest = if is_above(upper[clock]) {
            Bound::INFINITY
        } else {
            Bound::weak(value).unwrap()
        };
        candidates.constrain(0, clock, least) && candidates.constrain(clock, 0, greatest)
    })
}

/// The closure of the matrix after each entry (left, right) is replaced.
fn replaced(zone: &Zone, replacement: impl Fn(usize, usize) -> Bound) -> Zone {
    let dimension = zone.dimension();
    let mut result = zone.clone();
    for left in 0..dimension {
        for right in (0..dimension).filter(|right| *right != left) {
            let limit = if left == 0 {
                Bound::LE_ZERO
            } else {
                Bound::INFINITY
            };
            result.bounds_mut()[left * dimension + right] = replacement(left, right).min(limit);
        }
    }
    dbm::close(result.bounds_mut(), dimension);
    result
}

/// The constant of a clock; that of the reference clock is 0.
fn constant(values: &Constants, clock: usize) -> Option<i32> {
    if clock == 0 { Some(0) } else { values[clock] }
}

/// `< -U`, or no bound without U.
fn forgotten_below(upper: Option<i32>) -> Bound {
    upper.map_or(Bound::INFINITY, |upper| Bound::strict(-upper).unwrap())
}

/// The matrix of the definition of `Extra_LU` or, with `plus`, `Extra_LU+`, closed.
fn extrapolated_by_definition(
    zone: &Zone,
    lower: &Constants,
    upper: &Constants,
    plus: bool,
) -> Zone {
    let exceeds = |bound: Bound, limit: Option<i32>| {
        bound.is_finite() && limit.is_none_or(|limit| bound.value() > limit)
    };
    let is_below = |bound: Bound, limit: Option<i32>| {
        bound.is_finite() && limit.is_none_or(|limit| -bound.value() > limit)
    };
    replaced(zone, |left, right| {
        let (l, u) = (constant(lower, left), constant(upper, right));
        let bound = zone.bound(left, right);
        let is_low = plus && is_below(zone.bound(0, left), l);
        let is_high = is_below(if plus { zone.bound(0, right) } else { bound }, u);
        match (
            exceeds(bound, l) || is_low || plus && is_high && left != 0,
            is_high,
        ) {
            (true, _) => Bound::INFINITY,
            (false, true) => forgotten_below(u),
            (false, false) => bound,
        }
    })
}

/// The closure of the matrix without the entries that inclusion in `aLU` ignores: those of a clock
/// without L, those against a clock above U, and those whose sum with `< -L` is not below the lower
/// bound of the other clock.
fn reduced_by_definition(zone: &Zone, lower: &Constants, upper: &Constants) -> Zone {
    replaced(zone, |left, right| {
        let (l, u) = (constant(lower, left), constant(upper, right));
        let (bound, least) = (zone.bound(left, right), zone.bound(0, right));
        let counts = u.is_some_and(|u| least >= Bound::weak(-u).unwrap());
        let is_above = |l: i32| bound + Bound::strict(-l).unwrap() >= least;
        match (left == 0, counts) {
            (true, false) => forgotten_below(u),
            (false, false) => Bound::INFINITY,
            (false, true) if l.is_none_or(is_above) => Bound::INFINITY,
            _ => bound,
        }
    })
}

/// The exact `aLU` of a zone: for each way in which clocks can be simulated, the valuations v for
/// which the zone contains a w. It takes a zone of v and w together, and keeps the part of v.
fn all_simulated(zone: &Zone, lower: &Constants, upper: &Constants) -> Federation {
    let dimension = zone.dimension();
    let clocks = dimension - 1;
    let other = |clock: usize| if clock == 0 { 0 } else { clocks + clock };
    let mut simulated = Federation::empty(dimension);
    for way in 0..3_usize.pow(u32::try_from(clocks).unwrap()) {
        let mut both = Zone::universe(2 * clocks + 1);
        let mut constrain = |left: usize, right: usize, bound: Bound| {
            bound.is_infinite() || both.constrain(left, right, bound)
        };
        let mut is_possible = (0..dimension).all(|left| {
            (0..dimension)
                .all(|right| constrain(other(left), other(right), zone.bound(left, right)))
        });
        for clock in 1..dimension {
            let (v, w) = (clock, other(clock));
            let above =
                |limit: Option<i32>| limit.map_or(Bound::LE_ZERO, |l| Bound::strict(-l).unwrap());
            is_possible = is_possible
                && match way / 3_usize.pow(u32::try_from(clock - 1).unwrap()) % 3 {
                    0 => constrain(v, w, Bound::LE_ZERO) && constrain(w, v, Bound::LE_ZERO),
                    1 => constrain(w, v, Bound::LT_ZERO) && constrain(0, w, above(lower[clock])),
                    _ => constrain(v, w, Bound::LT_ZERO) && constrain(0, v, above(upper[clock])),
                };
        }
        if is_possible {
            let rows =
                (0..dimension).flat_map(|left| (0..dimension).map(move |right| (left, right)));
            let bounds: Vec<Bound> = rows.map(|(left, right)| both.bound(left, right)).collect();
            simulated.push(&bounds);
        }
    }
    simulated
}

proptest! {
    #![proptest_config(configuration())]

    #[test]
    fn sum_of_bounds_is_weak_only_if_both_are(left in bounds(), right in bounds()) {
        let sum = left + right;
        assert_eq!(sum.value(), left.value() + right.value());
        assert_eq!(sum.is_strict(), left.is_strict() || right.is_strict());
        assert_eq!(left + Bound::INFINITY, Bound::INFINITY);
        assert_eq!(left.negated().negated(), left);
        assert_ne!(left.negated().is_strict(), left.is_strict());
    }

    #[test]
    fn constraining_keeps_the_points_that_satisfy_all(
        (dimension, list) in dimensions().prop_flat_map(|dimension| (Just(dimension), constraints(dimension, 8))),
        seed: u64,
    ) {
        let zone = Zone::of_constraints(dimension, &list);
        check_zone(&zone, seed, |point| list.iter().all(|constraint| satisfies(point, constraint)));
    }

    #[test]
    fn closing_all_at_once_equals_constraining_one_by_one(
        (dimension, list) in (2..=9_usize).prop_flat_map(|dimension| (Just(dimension), constraints(dimension, 8))),
    ) {
        let expected = Zone::of_constraints(dimension, &list);
        let mut matrix = Zone::universe(dimension);
        let mut touched = ClockSet::EMPTY;
        for constraint in &list {
            let entry = &mut matrix.bounds_mut()[constraint.left * dimension + constraint.right];
            *entry = (*entry).min(constraint.bound);
            touched.insert(constraint.left);
            touched.insert(constraint.right);
        }
        let mut closed = matrix.clone();
        assert_eq!(dbm::close(closed.bounds_mut(), dimension), !expected.is_empty());
        assert_eq!(&closed, &expected);
        dbm::close_touched(matrix.bounds_mut(), dimension, &touched);
        assert_eq!(&matrix, &expected);
        check_closed(matrix.bounds(), dimension);
    }

    #[test]
    fn intersection_is_that_of_the_sets((one, other) in two_zones(), seed: u64) {
        let mut both = one.clone();
        both.intersect(&other);
        check_zone(&both, seed, |point| contains(&one, point) && contains(&other, point));
        if dbm::are_apart(one.bounds(), other.bounds(), one.dimension()) {
            assert!(both.is_empty(), "zones that meet are called apart: {one:?}, {other:?}");
        }
        assert!(both.is_subset(&one) && both.is_subset(&other));
    }

    #[test]
    fn inclusion_is_that_of_the_sets((one, other) in two_zones(), seed: u64) {
        let mut hull = one.clone();
        dbm::hull(hull.bounds_mut(), other.bounds());
        check_closed(hull.bounds(), hull.dimension());
        assert!(one.is_subset(&hull) && other.is_subset(&hull));
        let points = points(one.dimension(), seed);
        let has_only = |one: &Zone, other: &Zone| {
            points.iter().any(|point| contains(one, point) && !contains(other, point))
        };
        if has_only(&one, &other) {
            assert!(!one.is_subset(&other));
        }
        if has_only(&other, &one) {
            assert!(!other.is_subset(&one));
        }
        if one == other {
            assert_eq!(dbm::hash(one.bounds()), dbm::hash(other.bounds()));
        }
    }

    #[test]
    fn future_is_reached_by_a_delay(zone in dimensions().prop_flat_map(zones), seed: u64) {
        let none = ClockSet::EMPTY;
        let mut future = zone.clone();
        future.up(&none);
        check_zone(&future, seed, |point| {
            delays(zone.dimension()).any(|delay| contains(&zone, &delayed(point, -delay, &none)))
        });
        assert!(!dbm::is_delay_bounded(future.bounds(), zone.dimension(), &none));
    }

    #[test]
    fn future_within_constraints_is_that_of_delays_that_keep_them(
        (zone, within) in dimensions().prop_flat_map(|n| (zones(n), constraints(n, 4))),
    ) {
        let dimension = zone.dimension();
        let mut entry = zone.bounds().to_vec();
        prop_assume!(dbm::constrain_all(&mut entry, dimension, &within));
        let mut expected = entry.clone();
        clocks::up(&mut expected, dimension);
        for one in &within {
            dbm::constrain(&mut expected, dimension, one.left, one.right, one.bound);
        }
        clocks::up_within(&mut entry, dimension, &within);
        prop_assert_eq!(entry, expected);
    }

    #[test]
    fn past_reaches_the_zone_by_a_delay(zone in dimensions().prop_flat_map(zones), seed: u64) {
        let mut past = zone.clone();
        past.down(&ClockSet::EMPTY);
        check_zone(&past, seed, |point| {
            delays(zone.dimension()).any(|delay| contains(&zone, &delayed(point, delay, &ClockSet::EMPTY)))
        });
    }

    #[test]
    fn instants_before_and_after_a_set_see_it_at_any_small_delay(
        (federation, stopped) in dimensions().prop_flat_map(|dimension| (federations(dimension, 3), clock_sets(dimension))),
        seed: u64,
    ) {
        let before = instants::before(&federation, &stopped);
        let after = instants::after(&federation, &stopped);
        // Points lie two steps apart, so a delay of one step is as good as any smaller one.
        for point in points(federation.dimension(), seed) {
            let is_in = |delay: i64| {
                let moved = delayed(&point, delay, &stopped);
                moved.iter().all(|&value| value >= 0) && federation_contains(&federation, &moved)
            };
            assert_eq!(federation_contains(&before, &point), is_in(1));
            assert_eq!(federation_contains(&after, &point), is_in(-1));
        }
    }

    #[test]
    fn stopped_clocks_give_a_closed_zone_around_the_exact_set(
        (zone, stopped) in dimensions().prop_flat_map(|dimension| (zones(dimension), clock_sets(dimension))),
        seed: u64,
    ) {
        let dimension = zone.dimension();
        let (mut future, mut past) = (zone.clone(), zone.clone());
        future.up(&stopped);
        past.down(&stopped);
        check_closed(future.bounds(), dimension);
        check_closed(past.bounds(), dimension);
        for point in points(dimension, seed).iter().filter(|point| contains(&zone, point)) {
            for delay in (0..30).map(|step| step * step) {
                assert!(contains(&future, &delayed(point, delay, &stopped)));
                let earlier = delayed(point, -delay, &stopped);
                assert!(earlier.iter().any(|value| *value < 0) || contains(&past, &earlier));
            }
        }
    }

    #[test]
    fn past_with_stopped_clocks_is_the_least_zone(
        (zone, stopped) in (2..=3_usize).prop_flat_map(|dimension| (zones(dimension), clock_sets(dimension))),
    ) {
        let dimension = zone.dimension();
        let mut past = zone.clone();
        for clock in 1..dimension {
            // Within the points of the grid, so that each supremum is nearly met.
            past.constrain(clock, 0, Bound::weak(CONSTANT).unwrap());
        }
        let inside: Vec<Point> = points(dimension, 0).into_iter().filter(|point| contains(&past, point)).collect();
        let earlier = |point: &Point| {
            let point = point.clone();
            let times = delays(dimension).map(|delay| delayed(&point, -delay, &stopped));
            times.take(200).take_while(|point| point.iter().all(|value| *value >= 0)).collect::<Vec<_>>()
        };
        let exact: Vec<Point> = inside.iter().flat_map(earlier).collect();
        past.down(&stopped);
        for (left, right) in (0..dimension).flat_map(|left| (0..dimension).map(move |right| (left, right))) {
            let limit = i64::from(past.bound(left, right).value()) * denominator(dimension);
            let reached = exact.iter().map(|point| point[left] - point[right]).max();
            let is_near = reached.is_none_or(|reached| reached <= limit && limit - reached <= 4);
            assert!(past.is_empty() || is_near, "({left}, {right}) of {past:?} is not tight: {reached:?}");
        }
    }

    #[test]
    fn stopping_no_clock_and_every_clock_are_the_plain_cases(zone in dimensions().prop_flat_map(zones)) {
        let dimension = zone.dimension();
        let (mut plain, mut stopped) = (zone.clone(), zone.clone());
        clocks::down(plain.bounds_mut(), dimension);
        clocks::down_stopped(stopped.bounds_mut(), dimension, &ClockSet::EMPTY);
        assert_eq!(&plain, &stopped);
        clocks::up(plain.bounds_mut(), dimension);
        clocks::up_stopped(stopped.bounds_mut(), dimension, &ClockSet::EMPTY);
        assert_eq!(plain, stopped);
        let mut still = zone.clone();
        still.up(&ClockSet::all(dimension));
        still.down(&ClockSet::all(dimension));
        assert_eq!(still, zone);
    }

    #[test]
    fn assignment_carries_points_over(
        (zone, assignment) in dimensions().prop_flat_map(|dimension| (zones(dimension), assignments(dimension))),
        seed: u64,
    ) {
        let mut image = zone.clone();
        image.assign(&[assignment]);
        let (Assignment::Value { clock, .. } | Assignment::Copy { clock, .. }) = assignment;
        check_zone(&image, seed, |point| {
            delays(zone.dimension()).any(|value| {
                let before = with(point, clock, value);
                assigned(&before, &assignment).as_ref() == Some(point) && contains(&zone, &before)
            })
        });
    }

    #[test]
    fn freed_clock_takes_any_value(
        (zone, clock) in dimensions().prop_flat_map(|dimension| (zones(dimension), 1..dimension)),
        seed: u64,
    ) {
        let mut image = zone.clone();
        clocks::free_clock(image.bounds_mut(), zone.dimension(), clock);
        check_zone(&image, seed, |point| {
            delays(zone.dimension()).any(|value| contains(&zone, &with(point, clock, value)))
        });
    }

    #[test]
    fn preimage_is_carried_into_the_set(
        (target, guard, update) in dimensions().prop_flat_map(|dimension| {
            let update = prop::collection::vec(assignments(dimension), 0..=3);
            (federations(dimension, 2), constraints(dimension, 2), update)
        }),
        seed: u64,
    ) {
        let mut image = target.clone();
        image.preimage(&guard, &update);
        check_federation(&image, seed, |point| {
            let after = update.iter().try_fold(point.clone(), |point, assignment| assigned(&point, assignment));
            guard.iter().all(|constraint| satisfies(point, constraint))
                && after.is_some_and(|after| federation_contains(&target, &after))
        });
    }

    #[test]
    fn minimal_constraints_give_the_zone_back_and_none_is_idle(zone in (2..=7_usize).prop_flat_map(zones)) {
        let mut minimal = Vec::new();
        minimal::for_each_minimal(zone.bounds(), zone.dimension(), |one| minimal.push(one));
        let described_by = |constraints: &[Constraint]| {
            let mut described = Zone::universe(zone.dimension());
            described.constrain_all(constraints);
            described
        };
        assert_eq!(&described_by(&minimal), &zone);
        for index in 0..minimal.len() {
            let mut fewer = minimal.clone();
            fewer.remove(index);
            assert_ne!(&described_by(&fewer), &zone, "constraint {index} of {minimal:?} is idle");
        }
    }

    #[test]
    fn extrapolations_are_ordered_and_simulated(
        (zone, (lower, upper)) in (2..=4_usize).prop_flat_map(|dimension| (zones(dimension), lower_and_upper(dimension))),
        seed: u64,
    ) {
        let limits = Ceilings::lower_upper(&lower, &upper);
        let greatest: Constants = lower.iter().zip(&upper).map(|(lower, upper)| *lower.max(upper)).collect();
        let maximal = Ceilings::lower_upper(&greatest, &greatest);
        assert_eq!(&limits.to_maximal(), &maximal);
        let abstracted = |abstraction: fn(&mut [Bound], usize, &Ceilings), limits: &Ceilings| {
            let mut result = zone.clone();
            abstraction(result.bounds_mut(), zone.dimension(), limits);
            result
        };
        let m = abstracted(extrapolate::lu, &maximal);
        let m_plus = abstracted(extrapolate::lu_plus, &maximal);
        let lu = abstracted(extrapolate::lu, &limits);
        let lu_plus = abstracted(extrapolate::lu_plus, &limits);
        let published = extrapolated_by_definition(&zone, &lower, &upper, true);
        for (finer, coarser) in [
            (&zone, &m), (&m, &m_plus), (&m, &lu), (&m_plus, &lu_plus), (&lu, &published), (&published, &lu_plus),
        ] {
            assert!(finer.is_subset(coarser), "{finer:?} is not a subset of {coarser:?}");
        }
        for (result, again, limits) in [
            (&m, extrapolate::lu as fn(&mut [Bound], usize, &Ceilings), &maximal),
            (&m_plus, extrapolate::lu_plus, &maximal),
            (&lu, extrapolate::lu, &limits),
            (&lu_plus, extrapolate::lu_plus, &limits),
        ] {
            let mut twice = result.clone();
            again(twice.bounds_mut(), zone.dimension(), limits);
            assert_eq!(&twice, result, "a second time changes something");
        }
        for (result, lower, upper) in [(&lu_plus, &lower, &upper), (&m_plus, &greatest, &greatest)] {
            for point in points(zone.dimension(), seed).iter().filter(|point| contains(result, point)) {
                assert!(is_simulated(&zone, point, lower, upper), "{point:?} of {result:?} is not simulated");
            }
        }
    }

    #[test]
    fn extrapolation_equals_its_definition(
        (zone, (lower, upper)) in (2..=8_usize).prop_flat_map(|dimension| (zones(dimension), lower_and_upper(dimension))),
    ) {
        let dimension = zone.dimension();
        let limits = Ceilings::lower_upper(&lower, &upper);
        let (mut lu, mut lu_plus) = (zone.clone(), zone.clone());
        extrapolate::lu(lu.bounds_mut(), dimension, &limits);
        extrapolate::lu_plus(lu_plus.bounds_mut(), dimension, &limits);
        check_closed(lu.bounds(), dimension);
        check_closed(lu_plus.bounds(), dimension);
        assert_eq!(lu, extrapolated_by_definition(&zone, &lower, &upper, false));
        assert_eq!(lu_plus, reduced_by_definition(&zone, &lower, &upper));
    }

    #[test]
    fn inclusion_by_demands_equals_inclusion_in_all_that_is_simulated(
        (zone, other, (lower, upper)) in dimensions().prop_flat_map(|dimension| {
            (zones(dimension), zones(dimension), lower_and_upper(dimension))
        }),
    ) {
        let dimension = zone.dimension();
        let limits = Ceilings::lower_upper(&lower, &upper);
        let reduced = |zone: &Zone| {
            let mut reduced = zone.bounds().to_vec();
            simulation::reduce(&mut reduced, dimension, &limits);
            reduced
        };
        let demands = |zone: &Zone| {
            let mut demands = zone.bounds().to_vec();
            simulation::demands(&reduced(zone), dimension, limits.limits(), &mut demands);
            demands
        };
        let extrapolated = |zone: &Zone| {
            let mut result = zone.clone();
            extrapolate::lu_plus(result.bounds_mut(), dimension, &limits);
            result
        };
        for (zone, other) in [(&zone, &other), (&other, &zone), (&extrapolated(&zone), &other), (&zone, &extrapolated(&other))] {
            let is_met = dbm::is_subset(&demands(zone), &demands(other));
            assert_eq!(is_met, dbm::is_subset(&demands(zone), other.bounds()));
            assert_eq!(is_met, dbm::is_subset(&demands(zone), &reduced(other)));
            let simulated = all_simulated(other, &lower, &upper);
            assert_eq!(is_met, simulated.includes_zone(zone.bounds()), "{zone:?} within {other:?}");
        }
        let mut restored = Zone::from_bounds(dimension, &reduced(&zone));
        simulation::restore(restored.bounds_mut(), dimension, &limits);
        check_closed(restored.bounds(), dimension);
        assert_eq!(restored, extrapolated(&zone));
        assert_eq!(reduced(&restored), reduced(&zone));
        assert!(all_simulated(&zone, &lower, &upper).includes_zone(extrapolated(&zone).bounds()));
    }

    #[test]
    fn parts_cut_by_differences_stay_on_their_sides(
        (zone, (lower, upper), differences) in (3..=4_usize).prop_flat_map(|dimension| {
            (zones(dimension), lower_and_upper(dimension), constraints(dimension, 3))
        }),
        seed: u64,
    ) {
        let dimension = zone.dimension();
        let is_difference = |constraint: &Constraint| constraint.left != 0 && constraint.right != 0;
        let differences: Vec<_> = differences.into_iter().filter(is_difference).collect();
        let limits = Ceilings::lower_upper(&lower, &upper);
        let mut parts = Federation::empty(dimension);
        extrapolate::split_by_differences(zone.bounds(), dimension, &limits, &differences, &mut parts);
        assert!(parts.includes_zone(zone.bounds()));
        let sides = |point: &Point| differences.iter().map(|side| satisfies(point, side)).collect::<Vec<_>>();
        let points = points(dimension, seed);
        for part in parts.zones() {
            check_closed(part, dimension);
            let inside = points.iter().filter(|point| dbm::contains(part, point, denominator(dimension)));
            let mut all_sides: Vec<_> = inside.map(sides).collect();
            all_sides.dedup();
            assert!(all_sides.len() <= 1, "a part lies on both sides of a difference: {part:?}");
        }
    }

    #[test]
    fn subtraction_removes_exactly_the_subtrahend((minuend, subtrahend) in two_federations(), seed: u64) {
        let mut difference = minuend.clone();
        difference.subtract(&subtrahend);
        check_federation(&difference, seed, |point| {
            federation_contains(&minuend, point) && !federation_contains(&subtrahend, point)
        });
        assert!(!difference.intersects(&subtrahend));
        assert!(difference.is_subset(&minuend));
        assert_eq!(difference.is_empty(), minuend.is_subset(&subtrahend));
        let mut whole = difference.clone();
        whole.unite(&minuend.intersection(&subtrahend));
        assert!(whole.is_same_set(&minuend));
    }

    #[test]
    fn a_conjunction_is_removed_as_its_zone_is((minuend, _) in two_federations(), seed: u64, drawn in constraints(5, 6), has_differences: bool) {
        let dimension = minuend.dimension();
        let is_kept = |one: &Constraint| one.left.max(one.right) < dimension && (has_differences || one.left.min(one.right) == 0);
        let drawn: Vec<_> = drawn.into_iter().filter(is_kept).collect();
        let mut difference = minuend.clone();
        difference.subtract_conjunction(&drawn);
        check_federation(&difference, seed, |point| {
            federation_contains(&minuend, point) && !drawn.iter().all(|one| satisfies(point, one))
        });
        let mut by_zone = minuend.clone();
        by_zone.subtract_zone(Zone::of_constraints(dimension, &drawn).bounds());
        assert!(difference.is_same_set(&by_zone));
    }

    #[test]
    fn union_and_intersection_are_those_of_the_sets((one, other) in two_federations(), seed: u64) {
        let mut union = one.clone();
        let is_new = union.unite(&other);
        check_federation(&union, seed, |point| {
            federation_contains(&one, point) || federation_contains(&other, point)
        });
        assert!(is_new || other.is_subset(&one));
        let intersection = one.intersection(&other);
        check_federation(&intersection, seed, |point| {
            federation_contains(&one, point) && federation_contains(&other, point)
        });
        assert_eq!(!intersection.is_empty(), one.intersects(&other));
    }

    #[test]
    fn reduction_keeps_the_set(
        federation in (2..=4_usize).prop_flat_map(|dimension| federations(dimension, 5)),
        seed: u64,
    ) {
        let mut reduced = federation.clone();
        reduced.reduce();
        assert!(reduced.zone_count() <= federation.zone_count());
        assert!(reduced.is_same_set(&federation));
        check_federation(&reduced, seed, |point| federation_contains(&federation, point));
    }

    #[test]
    fn pieces_of_a_cut_zone_join_again(
        (zone, cut) in dimensions().prop_flat_map(|dimension| (zones(dimension), constraint(dimension))),
    ) {
        let mut pieces = Federation::empty(zone.dimension());
        for side in [cut, cut.negated()] {
            let mut piece = zone.clone();
            piece.constrain_all(&[side]);
            pieces.push(piece.bounds());
        }
        pieces.reduce();
        assert_eq!(pieces.zone_count(), 1);
        assert_eq!(pieces.zone(0), zone.bounds());
    }

    #[test]
    fn safe_predecessors_reach_the_good_before_the_bad(
        (good, bad) in (2..=4_usize).prop_flat_map(|dimension| (federations(dimension, 2), federations(dimension, 3))),
        seed: u64,
    ) {
        let none = ClockSet::EMPTY;
        let safe = past::predecessors(&good, &bad, &none);
        check_federation(&safe, seed, |point| {
            delays(good.dimension())
                .map(|delay| delayed(point, delay, &none))
                .take_while(|later| !federation_contains(&bad, later))
                .any(|later| federation_contains(&good, &later))
        });
        let still = past::predecessors(&good, &bad, &ClockSet::all(good.dimension()));
        check_federation(&still, seed, |point| {
            federation_contains(&good, point) && !federation_contains(&bad, point)
        });
    }

    #[test]
    fn upper_faces_are_where_time_stops(
        (zone, invariant) in dimensions().prop_flat_map(|dimension| (zones(dimension), constraints(dimension, 4))),
        seed: u64,
    ) {
        let mut zone = zone;
        let mut holds = |constraint: &Constraint| {
            let is_invariant = constraint.right == 0 && dbm::satisfies(zone.bounds(), zone.dimension(), constraint);
            is_invariant && zone.constrain_all(&[*constraint])
        };
        let invariant: Vec<_> = invariant.into_iter().filter(&mut holds).collect();
        let mut faces = Federation::empty(zone.dimension());
        faces.add_upper_faces(zone.bounds(), &invariant, &ClockSet::EMPTY);
        check_federation(&faces, seed, |point| {
            // Strict bounds leave room for a small delay everywhere, so only weak ones stop time.
            let later = delayed(point, 1, &ClockSet::EMPTY);
            let is_stopping = |bound: &Constraint| !bound.bound.is_strict() && !satisfies(&later, bound);
            contains(&zone, point) && invariant.iter().any(is_stopping)
        });
    }
}

#[test]
fn sums_beyond_the_range_are_noticed() {
    wide::forced::set(false);
    let mut zone = Zone::universe(2);
    let most = Bound::most_in_zone(2, false);
    zone.constrain(1, 0, Bound::weak(Bound::NARROW_VALUE).unwrap());
    assert!(dbm::is_in_range(zone.bounds(), most));
    for _ in 0..2 {
        zone.assign(&[Assignment::Copy {
            clock: 1,
            source: 1,
            increment: Bound::NARROW_VALUE,
        }]);
    }
    assert!(!dbm::is_in_range(zone.bounds(), most));
}

#[test]
fn constants_beyond_the_range_are_refused() {
    wide::forced::set(true);
    assert_eq!(Bound::weak(Bound::MAX_VALUE + 1), None);
    assert_eq!(Bound::strict(i32::MIN), None);
    wide::start();
    let increase = [Assignment::Copy {
        clock: 1,
        source: 1,
        increment: 1,
    }];
    let mut zone = Zone::universe(2);
    zone.constrain(1, 0, Bound::weak(Bound::MAX_VALUE - 1).unwrap());
    zone.assign(&increase);
    assert_eq!(zone.bound(1, 0), Bound::weak(Bound::MAX_VALUE).unwrap());
    assert!(!wide::has_forgotten());
    zone.assign(&increase);
    assert!(zone.bound(1, 0).is_infinite() && wide::has_forgotten());
}

#[test]
fn empty_zone_stays_empty_under_every_operation() {
    let mut zone = Zone::universe(3);
    zone.constrain(0, 1, Bound::strict(-1).unwrap());
    assert!(!zone.constrain(1, 0, Bound::weak(1).unwrap()));
    zone.up(&ClockSet::EMPTY);
    zone.down(&ClockSet::EMPTY);
    assert!(!zone.assign(&[Assignment::Value { clock: 1, value: 0 }]));
    assert!(!zone.preimage(&[], &[]));
    assert!(!zone.intersect(&Zone::universe(3)));
    assert!(zone.is_empty() && zone.is_subset(&Zone::zero(3)) && !Zone::zero(3).is_subset(&zone));
}

#[test]
fn clock_set_lists_its_clocks_in_order() {
    let set: ClockSet = [200, 3, 64, 0].into_iter().collect();
    assert_eq!(set.iter().collect::<Vec<_>>(), [0, 3, 64, 200]);
    assert_eq!(set.len(), 4);
    assert!(set.contains(64) && !set.contains(65) && !set.contains(100_000));
    assert_eq!(
        set.intersection(&ClockSet::all(65)),
        [3, 64].into_iter().collect()
    );
}

proptest! {
    #![proptest_config(configuration())]

    /// A set of clocks behaves like a `BTreeSet` of numbers. The first 256 clocks and those beyond
    /// are stored in different places.
    #[test]
    fn clock_sets_are_sets_of_numbers(
        left in prop::collection::btree_set(0_usize..1500, 0..40),
        right in prop::collection::btree_set(0_usize..1500, 0..40),
        removed in prop::collection::vec(0_usize..1500, 0..40),
    ) {
        let of = |numbers: &BTreeSet<usize>| numbers.iter().copied().collect::<ClockSet>();
        let (mut set, mut numbers) = (of(&left), left.clone());
        prop_assert_eq!(set.union(&of(&right)), of(&(&left | &right)));
        prop_assert_eq!(set.intersection(&of(&right)), of(&(&left & &right)));
        for clock in removed.into_iter().chain(left.iter().copied().rev().take(30)) {
            set.remove(clock);
            numbers.remove(&clock);
            prop_assert_eq!(&set, &of(&numbers));
        }
        prop_assert_eq!(set.iter().collect::<Vec<_>>(), numbers.iter().copied().collect::<Vec<_>>());
        prop_assert_eq!((set.len(), set.is_empty()), (numbers.len(), numbers.is_empty()));
        prop_assert!((0..1600).all(|clock| set.contains(clock) == numbers.contains(&clock)));
    }
}
