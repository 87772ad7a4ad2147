//! Which clocks matter where: models in which a clock is compared with a great constant, but only behind a flag that is set together
//! with the clock. Where this is seen, few states are stored; where it is not so, the states that it takes must all be there.
//!
//! That nothing is lost by it is what the comparison with brute force in `tests/oracle` shows.

use checker::engine::{Answer, CodeEngine, LoadedModel, Options, Verdict};

fn check(text: &str, query: &str) -> Answer {
    let mut model = LoadedModel::load("activity.xta", text.as_bytes())
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")));
    let query = model.add_query(query);
    let options = Options {
        code: CodeEngine::Interpreter,
        ..Options::default()
    };
    model
        .check(&query, &options)
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")))
}

/// A worker ticks every time unit until it starts the timer's clock `x`, and stops when it shows 300.
struct Timer<'a> {
    declarations: &'a str,
    /// The guard with which it stops, in the location in which it ticks.
    stop: &'a str,
    /// Label and update with which it starts.
    start: &'a str,
    other: &'a str,
}

const FLAG: Timer<'_> = Timer {
    declarations: "chan go; bool running = false;",
    stop: "running && x == 300",
    start: "sync go!; assign running = true;",
    other: "process Other() { state L; init L; trans L -> L { sync go?; assign x = 0; }; }",
};

impl Timer<'_> {
    fn text(&self) -> String {
        format!(
            "clock x; {}
             process Worker() {{
               clock tick;
               state Ticking {{ tick <= 1 }}, Waiting, Stopped;
               init Ticking;
               trans Ticking -> Ticking {{ guard tick == 1; assign tick = 0; }},
                     Ticking -> Waiting {{ {} }},
                     Ticking -> Stopped {{ guard {}; }},
                     Waiting -> Ticking {{ guard x == 300; assign tick = 0, running = false; }};
             }}
             {}
             system Worker, Other;",
            self.declarations, self.start, self.stop, self.other
        )
    }

    fn stored(&self) -> u64 {
        check(&self.text(), "E<> false").counters.stored
    }

    fn stops(&self) -> Verdict {
        check(&self.text(), "E<> Worker.Stopped").verdict
    }
}

#[test]
fn a_clock_does_not_matter_before_its_flag_is_set() {
    let timer = FLAG;
    assert!(timer.stored() <= 5, "{} states", timer.stored());
    assert_eq!(timer.stops(), Verdict::NotSatisfied);
}

#[test]
fn a_flag_with_a_number_in_an_array_of_which_only_one_part_is_written_does_as_well() {
    let timer = Timer {
        declarations: "chan go; const int limit[2] = {300, 200}; int[0,1] k; int running = 0; bool off[2];",
        stop: "(off[k] || running > 0) && !off[1 - k] && x == limit[k]",
        start: "sync go!; assign running = 1;",
        ..FLAG
    };
    // The values of `running` are too many to be told apart.
    assert!(timer.stored() > 100, "{} states", timer.stored());
    let declarations = timer
        .declarations
        .replace("int running", "int[0,3] running");
    let timer = Timer {
        declarations: &declarations,
        ..timer
    };
    assert!(timer.stored() <= 5, "{} states", timer.stored());
    assert_eq!(timer.stops(), Verdict::NotSatisfied);
}

#[test]
fn a_clock_matters_where_somebody_else_may_set_the_flag() {
    let timer = Timer {
        other: "process Other() { state L; init L;
                  trans L -> L { sync go?; assign x = 0; }, L -> L { assign running = true; }; }",
        ..FLAG
    };
    assert!(timer.stored() > 100, "{} states", timer.stored());
    assert_eq!(timer.stops(), Verdict::Satisfied);
}

#[test]
fn a_clock_matters_where_one_partner_does_not_reset_it() {
    let start = "sync go!; assign running = true;";
    for (other, channel, is_reset) in [
        ("L -> L { sync go?; assign x = 0; }", "chan", true),
        (
            "L -> L { sync go?; assign x = 0; }",
            "broadcast chan",
            false,
        ),
        (
            "L -> L { sync go?; assign x = 0; }, L -> L { sync go?; }",
            "chan",
            false,
        ),
        (
            "L -> L { sync go?; assign x = 0; }, L -> L { guard false; sync go?; }",
            "chan",
            true,
        ),
    ] {
        let declarations = format!("{channel} go; bool running = false;");
        let other = format!("process Other() {{ state L, M; init L; trans {other}; }}");
        // From `Waiting` it gets to ticking with the flag set, and so to a comparison.
        let timer = Timer {
            declarations: &declarations,
            start,
            other: &other,
            ..FLAG
        };
        let text = timer.text().replace(
            "Waiting -> Ticking { guard x == 300; assign tick = 0, running = false; }",
            "Waiting -> Stopped { guard x == 300; }",
        );
        let stored = check(&text, "E<> false").counters.stored;
        assert_eq!(stored <= 5, is_reset, "{channel} {other}: {stored} states");
    }
}

#[test]
fn receivers_of_a_broadcast_know_what_their_sender_resets() {
    for (reset, is_reset) in [("assign x = 0;", true), ("", false)] {
        let other =
            format!("process Other() {{ state L; init L; trans L -> L {{ sync go!; {reset} }}; }}");
        let timer = Timer {
            declarations: "broadcast chan go; bool running = false;",
            start: "sync go?; assign running = true;",
            other: &other,
            ..FLAG
        };
        let text = timer.text().replace(
            "Waiting -> Ticking { guard x == 300; assign tick = 0, running = false; }",
            "Waiting -> Stopped { guard x == 300; }",
        );
        let stored = check(&text, "E<> false").counters.stored;
        assert_eq!(stored <= 5, is_reset, "{reset}: {stored} states");
    }
}
