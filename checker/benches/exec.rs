//! How fast is compiled code? A step and a roll of the needle, from the text of the generated model
//! through the front end, against the same arithmetic written by hand in C (`exec.c`, compiled with
//! `cc -O2`).
//!
//! Prints nanoseconds a call and the ratio to C; fails if the two reach different states.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

#[path = "support/needle.rs"]
mod needle;
mod support;

use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use checker::exec::{Context, Executor, Interpreter, Jit};
use checker::ir::{FunctionId, Network};

use needle::{load, needle_model};
use support::Scratch;

const ROUNDS: u32 = 2_000;
/// The fastest of so many repetitions counts; C and compiled code take turns, so that both see the
/// same load.
const REPETITIONS: u32 = 40;
/// What the C program calls `dt`, `velocity` and `radius`; constants in the model, and so no part
/// of its state.
const CONSTANTS: [i32; 3] = [2, 1_000, 30_000];
/// The variables of the model that the C program knows, in its order.
const VARIABLES: [&str; 8] = [
    "needle_progress",
    "tip_roll",
    "motion_circle_yaw",
    "ROT_counter",
    "tip_pos",
    "motion_circle_center",
    "vectors",
    "matrices",
];

/// A run of the rounds.
struct Run {
    step: f64,
    roll: f64,
    state: Vec<i32>,
}

impl Run {
    fn take_faster(&mut self, other: &Run) {
        self.step = self.step.min(other.step);
        self.roll = self.roll.min(other.roll);
    }
}

/// The functions of the model that are called.
struct Functions {
    step: FunctionId,
    roll: FunctionId,
}

fn main() -> Result<(), Box<dyn Error>> {
    let scratch = Scratch::new()?;
    let model = load(&needle_model(scratch.folder())?)?;
    let network = model.network();
    let functions = Functions {
        step: function(network, "step")?,
        roll: function(network, "rotate_deg")?,
    };
    let jit = Jit::new(&network.functions, &network.constants)?;
    jit.compile_function(functions.step)?;
    jit.compile_function(functions.roll)?;
    let program = scratch.compile("benches/exec.c", &[])?;
    let mut c = run_c(&program, network)?;
    let mut compiled = run(&jit, network, &functions)?;
    for _ in 1..REPETITIONS {
        c.take_faster(&run_c(&program, network)?);
        compiled.take_faster(&run(&jit, network, &functions)?);
    }
    let interpreter = Interpreter::new(&network.functions, &network.constants);
    let interpreted = run(&interpreter, network, &functions)?;
    for (name, run) in [
        ("compiled code", &compiled),
        ("the interpreter", &interpreted),
    ] {
        assert_eq!(run.state, c.state, "{name} and C reach the same state");
    }
    for (name, times) in [
        ("C", &c),
        ("compiled", &compiled),
        ("interpreted", &interpreted),
    ] {
        println!(
            "{name:12} step {:8.0} ns ({:5.2} x C)   roll {:8.0} ns ({:5.2} x C)",
            times.step,
            times.step / c.step,
            times.roll,
            times.roll / c.roll
        );
    }
    Ok(())
}

fn function(network: &Network, name: &str) -> Result<FunctionId, Box<dyn Error>> {
    let found = network.functions.iter().position(|f| f.name == name);
    let index = found.ok_or_else(|| format!("the model has no function {name}"))?;
    Ok(FunctionId(u32::try_from(index)?))
}

/// The words that the C program knows, out of those of a state.
fn known_words(network: &Network, state: &[i32]) -> Result<Vec<i32>, Box<dyn Error>> {
    let mut known = CONSTANTS.to_vec();
    for name in VARIABLES {
        let variables = &network.layout.variables;
        let variable = variables
            .iter()
            .find(|variable| variable.name == name)
            .ok_or_else(|| format!("the model has no variable {name}"))?;
        let words = variable.shape.words() as usize;
        known.extend(&state[variable.offset as usize..][..words]);
    }
    Ok(known)
}

fn run(
    engine: &dyn Executor,
    network: &Network,
    functions: &Functions,
) -> Result<Run, Box<dyn Error>> {
    let mut state = network.initial.clone();
    call(engine, functions.roll, &[90], 1, &mut state)?;
    let step = call(engine, functions.step, &[], ROUNDS, &mut state)?;
    let roll = call(engine, functions.roll, &[90], ROUNDS, &mut state)?;
    let nanoseconds = |time: Duration| time.as_secs_f64() * 1e9 / f64::from(ROUNDS);
    Ok(Run {
        step: nanoseconds(step),
        roll: nanoseconds(roll),
        state: known_words(network, &state)?,
    })
}

fn call(
    engine: &dyn Executor,
    function: FunctionId,
    arguments: &[i32],
    rounds: u32,
    state: &mut [i32],
) -> Result<Duration, Box<dyn Error>> {
    let mut context = Context {
        state,
        constraints: &mut Vec::new(),
        assignments: &mut Vec::new(),
    };
    let begin = Instant::now();
    for _ in 0..rounds {
        engine
            .call(function, arguments, &mut context)
            .map_err(|error| format!("{error:?}"))?;
    }
    Ok(begin.elapsed())
}

fn run_c(program: &Path, network: &Network) -> Result<Run, Box<dyn Error>> {
    let mut child = Command::new(program)
        .arg(ROUNDS.to_string())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut input = String::new();
    for word in known_words(network, &network.initial)? {
        write!(input, "{word} ")?;
    }
    let mut stdin = child.stdin.take().ok_or("the program has an input")?;
    stdin.write_all(input.as_bytes())?;
    drop(stdin);
    let output = String::from_utf8(child.wait_with_output()?.stdout)?;
    let mut fields = output.split_whitespace();
    let mut time = || -> Result<f64, Box<dyn Error>> {
        Ok(fields.next().ok_or("the program prints times")?.parse()?)
    };
    let (step, roll) = (time()?, time()?);
    let state = fields.map(str::parse).collect::<Result<_, _>>()?;
    Ok(Run { step, roll, state })
}
