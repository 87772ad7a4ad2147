//! Operations on large federations end in the middle when they are told to, and give their whole
//! result otherwise.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::cancellation::{self, Cut};
use crate::zones::{Bound, ClockSet, Federation, Zone, past};

/// A function whose result is a federation.
type Operation = Box<dyn Fn() -> Federation>;

/// The clocks, the reference clock included.
const DIMENSION: usize = 4;

/// Boxes of one unit, every other one along each clock: no two of them can be joined.
fn boxes(first: i32, along_each: i32) -> Federation {
    let mut federation = Federation::empty(DIMENSION);
    for place in 0..along_each.pow(3) {
        let mut zone = Zone::universe(DIMENSION);
        let steps = [place, place / along_each, place / along_each.pow(2)];
        for (clock, step) in (1..).zip(steps) {
            let low = first + 2 * (step % along_each);
            zone.constrain(clock, 0, Bound::weak(low + 1).expect("it is small"));
            zone.constrain(0, clock, Bound::weak(-low).expect("it is small"));
        }
        federation.push(zone.bounds());
    }
    federation
}

/// The result of an operation that must end at the look with this number, and the number of looks.
fn ended(at: u32, operation: &Operation) -> (Result<Federation, Cut>, u32) {
    let looks = Arc::new(AtomicU32::new(0));
    let counted = Arc::clone(&looks);
    let look = Arc::new(move |_| counted.fetch_add(1, Ordering::Relaxed) + 1 >= at);
    let result = cancellation::within(look, operation);
    (result, looks.load(Ordering::Relaxed))
}

#[test]
fn operations_look_and_end() {
    let (one, other, few) = (boxes(0, 8), boxes(1, 8), boxes(0, 6));
    let operations: [(&str, Operation); 4] = [
        ("intersection", {
            let (one, other) = (one.clone(), other.clone());
            Box::new(move || one.intersection(&other))
        }),
        ("difference", {
            let (one, other) = (one.clone(), other.clone());
            Box::new(move || {
                let mut rest = one.clone();
                rest.subtract(&other);
                rest
            })
        }),
        ("shorter description", {
            Box::new(move || {
                let mut shorter = one.clone();
                shorter.reduce();
                shorter
            })
        }),
        ("predecessors", {
            Box::new(move || past::predecessors(&few, &other, &ClockSet::EMPTY))
        }),
    ];
    for (name, operation) in operations {
        let (whole, looks) = ended(u32::MAX, &operation);
        assert!(looks > 0, "{name}");
        assert!(whole.is_ok_and(|whole| !whole.is_empty()), "{name}");
        let (result, looks) = ended(1, &operation);
        assert!(result.is_err(), "{name}");
        assert_eq!(looks, 1, "{name}");
    }
}

#[test]
fn operands_count_while_a_large_result_grows() {
    let dimension = 128;
    let mut points = Federation::empty(dimension);
    for place in 0..32 {
        let mut zone = Zone::universe(dimension);
        zone.constrain(1, 0, Bound::weak(2 * place).expect("it is small"));
        zone.constrain(0, 1, Bound::weak(-2 * place).expect("it is small"));
        points.push(zone.bounds());
    }
    let whole = Federation::of_zone(dimension, Zone::universe(dimension).bounds());
    let most = points.heap_bytes() * 3 / 2;
    let asked = |operation: &dyn Fn()| {
        let look = Arc::new(move |bytes| bytes > most as u64);
        cancellation::within(look, operation)
    };
    let copy = || drop(points.intersection(&whole));
    assert_eq!(asked(&copy), Err(Cut));
    let alone = || {
        let mut copy = Federation::empty(dimension);
        points.zones().for_each(|zone| copy.push(zone));
    };
    assert_eq!(asked(&alone), Ok(()));
}
