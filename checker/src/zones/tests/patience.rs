//! Operations on large federations end when they are told to, and only then do they give less than
//! all.

use crate::zones::{Bound, ClockSet, Federation, Patience, Zone, past};

/// What gives a federation within some patience.
type Operation = Box<dyn Fn(&mut Patience<'_>) -> Federation>;

/// The clocks, the reference clock included.
const DIMENSION: usize = 4;

/// Boxes of one unit, every other one along each clock: none can be joined with another.
fn boxes(first: i32) -> Federation {
    let mut federation = Federation::empty(DIMENSION);
    for place in 0..125 {
        let mut zone = Zone::universe(DIMENSION);
        for (clock, step) in [(1, place % 5), (2, place / 5 % 5), (3, place / 25)] {
            let low = first + 2 * step;
            zone.constrain(clock, 0, Bound::weak(low + 1).expect("it is small"));
            zone.constrain(0, clock, Bound::weak(-low).expect("it is small"));
        }
        federation.push(zone.bounds());
    }
    federation
}

/// What an operation gives with a patience that ends after so many questions, and how often it
/// asked.
fn asked<R>(most: u32, operation: impl FnOnce(&mut Patience<'_>) -> R) -> (R, u32, bool) {
    let mut questions = 0;
    let mut goes_on = |_| {
        questions += 1;
        questions < most
    };
    let mut patience = Patience::as_long_as(&mut goes_on);
    let result = operation(&mut patience);
    let is_over = patience.is_over();
    (result, questions, is_over)
}

#[test]
fn operations_ask_and_end() {
    let (one, other) = (boxes(0), boxes(1));
    let operations: [(&str, Operation); 4] = [
        ("intersection", {
            let (one, other) = (one.clone(), other.clone());
            Box::new(move |patience| one.intersection_within(&other, patience))
        }),
        ("difference", {
            let (one, other) = (one.clone(), other.clone());
            Box::new(move |patience| {
                let mut rest = one.clone();
                rest.subtract_within(&other, patience);
                rest
            })
        }),
        ("shorter description", {
            let one = one.clone();
            Box::new(move |patience| {
                let mut shorter = one.clone();
                shorter.reduce_within(patience);
                shorter
            })
        }),
        ("predecessors", {
            Box::new(move |patience| {
                past::predecessors_within(&one, &other, &ClockSet::EMPTY, patience)
            })
        }),
    ];
    for (name, operation) in operations {
        let (whole, questions, is_over) = asked(u32::MAX, &operation);
        assert!(questions > 20 && !is_over, "{name}: {questions}");
        assert!(
            whole.is_same_set(&operation(&mut Patience::endless())),
            "{name}"
        );
        let (_, questions, is_over) = asked(10, &operation);
        assert_eq!((questions, is_over), (10, true), "{name}");
    }
}
