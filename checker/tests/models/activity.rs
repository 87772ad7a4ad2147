//! Which clocks matter where: models in which a clock is compared with a great constant, but only
//! behind a flag that is set together with the clock. Where this is seen, few states are stored;
//! where it is not so, the states that it takes must all be there.
//!
//! That nothing is lost by it, random networks show: they must give the same answers with a process
//! beside them that could write the flags and take part in the synchronisations, as far as the
//! analysis of a single process knows.

use checker::engine::{Answer, Verdict};

use crate::checks::{self, interpreted};
use crate::random::{Random, networks};

fn check(text: &str, query: &str) -> Answer {
    checks::check(text, query, &interpreted())
}

/// A worker ticks every time unit until it starts the timer's clock `x`, and stops when it shows
/// 300.
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

#[test]
fn clocks_matter_before_a_flag_that_is_set_without_them() {
    // `x` and `y` run in step, so that they never show 5 and 7 together; a search that has
    // forgotten them would not know.
    for (declarations, update, wanted) in [
        ("bool flag;", "flag = true", "flag"),
        ("int[0,3] stage;", "stage = (stage + 1) % 4", "stage == 3"),
        (
            "bool flags[2]; int[0,1] k;",
            "k = 1 - k, flags[k] = true",
            "flags[0] && flags[1]",
        ),
        (
            "bool flag; bool other;",
            "other = !other, flag = flag || other",
            "flag && !other",
        ),
        (
            "bool flag; void raise() { flag = !flag; }",
            "raise()",
            "flag",
        ),
        (
            "int[0,1] low; int[0,1] high;",
            "low = 1 - low, high = low == 0 ? 1 - high : high",
            "low + high == 2",
        ),
    ] {
        let text = format!(
            "clock x; clock y; {declarations}
             process P() {{
               clock tick;
               state Ticking {{ tick <= 1 }}, Never;
               init Ticking;
               trans Ticking -> Ticking {{ guard tick == 1; assign tick = 0, {update}; }},
                     Ticking -> Never {{ guard {wanted} && x == 5 && y == 7; }},
                     Ticking -> Never {{ guard !({wanted}) && x == 4 && y == 3; }};
             }}
             system P;"
        );
        assert_eq!(
            check(&text, "E<> P.Never").verdict,
            Verdict::NotSatisfied,
            "{text}"
        );
        let possible = text.replace("y == 7", "y == x").replace("y == 3", "y == x");
        assert_eq!(
            check(&possible, "E<> P.Never").verdict,
            Verdict::Satisfied,
            "{possible}"
        );
    }
}

/// What random networks are made of.
impl Random {
    /// A comparison of one of the three clocks.
    fn comparison(&mut self) -> String {
        let (clock, relation) = (
            self.one_of(&["x", "y", "z"]),
            self.one_of(&["<=", ">=", "==", "<", ">"]),
        );
        format!("{clock} {relation} {}", self.below(5))
    }

    /// A guard of the process with the flag.
    fn guard(&mut self, flag: &str) -> String {
        let (value, comparison) = (self.below(3), self.comparison());
        match self.below(6) {
            0 => comparison,
            1 => format!("{flag} == {value}"),
            2 => format!("({flag} == {value} || {comparison})"),
            3 => format!("{flag} != {value} && {comparison}"),
            _ => format!("{flag} == {value} && {comparison}"),
        }
    }

    fn process(&mut self, name: usize) -> String {
        let flag = format!("flag{name}");
        let mut edges = Vec::new();
        for _ in 0..8 {
            let sync = self.one_of(&["", "", "sync go!;", "sync go?;", "sync all!;", "sync all?;"]);
            let update = match self.below(5) {
                0 => format!("assign {flag} = ({flag} + 1) % 3;"),
                1 => format!("assign {flag} = {};", self.below(3)),
                2 => format!("assign {} = 0;", self.one_of(&["x", "y", "z"])),
                3 => format!(
                    "assign {flag} = {}, {} = 0;",
                    self.below(3),
                    self.one_of(&["x", "y", "z"])
                ),
                _ => String::new(),
            };
            // Guards of receivers of a broadcast are kept free of clocks: what they then mean is
            // not the matter here.
            let guard = match sync {
                "sync all?;" => format!("{flag} == {}", self.below(3)),
                _ => self.guard(&flag),
            };
            let (source, target) = (self.below(3), self.below(3));
            edges.push(format!(
                "L{source} -> L{target} {{ guard {guard}; {sync} {update} }}"
            ));
        }
        format!(
            "process P{name}() {{ state L0, L1, L2; init L0; trans {}; }}\n",
            edges.join(",\n  ")
        )
    }
}

#[test]
fn verdicts_do_not_hang_on_who_could_write_a_flag_or_take_part() {
    let (mut satisfied, mut fewer) = (0, 0);
    for number in 0..networks(800) {
        let mut random = Random::of_network(number);
        let processes = random.process(0) + &random.process(1);
        // Nobody gets to `B`, but the analysis of a single process does not know.
        let model = |edges: &str| {
            format!(
                "clock x, y, z; int[0,2] flag0, flag1; chan go; broadcast chan all;\n{processes}
                 process Other() {{ state A, B; init A; trans {edges}; }}
                 system P0, P1, Other;"
            )
        };
        let told = model("B -> B { guard false; }");
        let blind = model(
            "B -> B { assign flag0 = 0, flag1 = 0; }, B -> B { sync go!; }, B -> B { sync go?; }, B -> B { sync all!; }",
        );
        for location in [
            "P0.L2 && flag0 == 2",
            "P0.L1 && P1.L2",
            "P0.L2 && P1.L1",
            "P0.L2 && P1.L2 && flag0 + flag1 == 3",
        ] {
            let query = format!("E<> {location}");
            let (told, blind) = (check(&told, &query), check(&blind, &query));
            assert_eq!(told.verdict, blind.verdict, "{query}\n{}", model(""));
            satisfied += u32::from(told.verdict == Verdict::Satisfied);
            fewer += u32::from(told.counters.stored < blind.counters.stored);
        }
    }
    assert!(satisfied > 100, "{satisfied} queries are satisfied");
    assert!(fewer > 100, "{fewer} searches need fewer states");
}
