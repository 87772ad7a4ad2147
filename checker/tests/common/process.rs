//! Tests that need a process of their own.

use std::env;
use std::process::Command;

/// Set in the process that does the work.
const ALONE: &str = "NTAGEN_ALONE";

/// Does the work of the test with this full name in a process of its own: constants for which sums
/// of bounds take 64 bits leave the loops for 32 bits untried in a whole process.
pub(crate) fn alone(test: &str, work: impl FnOnce()) {
    if env::var_os(ALONE).is_some() {
        return work();
    }
    let program = env::current_exe().expect("the program of the tests has a path");
    let output = Command::new(program)
        .args(["--exact", test, "--nocapture"])
        .env(ALONE, "")
        .output()
        .expect("the program of the tests can be run");
    let told =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{}", told.concat());
    assert!(told[0].contains("1 passed"), "no test {test}");
}
