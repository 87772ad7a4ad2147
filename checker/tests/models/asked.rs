//! How often the functions of a model run.

use std::sync::atomic::{AtomicU64, Ordering};

use checker::analysis::{Abstraction, ClockBounds};
use checker::exec::{Context, Executor, Interpreter, RunTimeError, Wraps};
use checker::ir::{Constants, Function, FunctionId, Predicate};
use checker::network::{Stepper, Symbolic};
use checker::search::limits::Unlimited;
use checker::search::reachability::report::Order;
use checker::search::reachability::search;
use checker::tuning::Tuning;

use crate::checks::load;

/// An interpreter that counts its calls.
struct Counting(Interpreter, AtomicU64);

impl Executor for Counting {
    fn call(
        &self,
        function: FunctionId,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> Result<i32, RunTimeError> {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.call(function, arguments, context)
    }

    fn with_code(&self, _: &[Function], _: &Constants, _: FunctionId) -> Option<Box<dyn Executor>> {
        None
    }

    fn wraps(&self) -> &Wraps {
        self.0.wraps()
    }
}

#[test]
fn guard_is_asked_once_for_all_select_values_that_it_does_not_read() {
    let model = load(
        "int[0, 1] flips; int[0, 999] count; int[0, 1] bits[40];
        process Counter() { state on; init on; trans
            on -> on { guard count < 999; assign count++; }; }
        process Flipper() { state on; init on; trans
            on -> on { select bit : int[0, 39]; guard flips < 1; assign bits[bit] = 1, flips++; }; }
        system Counter, Flipper;",
    );
    let network = model.network();
    let counting = Counting(
        Interpreter::new(&network.functions, &network.constants),
        AtomicU64::new(0),
    );
    let bounds = ClockBounds::new(network, &[], Abstraction::LowerUpper, Tuning::default());
    let mut symbolic = Symbolic::new(Stepper::new(network, &counting), bounds);
    let goal = Predicate::Constant(false);
    let report = search::search(
        &mut symbolic,
        &mut &goal,
        Order::BreadthFirst,
        &mut Unlimited,
    );
    let states = report.counters.stored;
    assert_eq!(states, 41 * 1000);
    // Two guards and about two updates for each state; a call for each bit would be forty more.
    let calls = counting.1.into_inner();
    assert!(calls < 5 * states, "{calls} calls for {states} states");
}
