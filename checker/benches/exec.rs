//! How fast is compiled code? A step and a roll of the needle, against the same arithmetic written by hand in C
//! (`exec.c`, compiled with `cc -O2`), and how long compiling takes.
//!
//! Prints nanoseconds a call and the ratio to C; fails if the two reach different states.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

#[path = "../tests/exec/needle.rs"]
mod needle;

use std::error::Error;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use checker::exec::{Context, Executor, Interpreter, Jit};
use checker::ir::FunctionId;

const ROUNDS: u32 = 2_000;
/// The fastest of so many repetitions counts; C and compiled code take turns, so that both see the same load.
const REPETITIONS: u32 = 40;

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

fn main() -> Result<(), Box<dyn Error>> {
    let functions = needle::functions();
    let begin = Instant::now();
    let jit = Jit::new(&functions, &[])?;
    for function in [needle::STEP, needle::ROTATE] {
        jit.compile_function(function)?;
    }
    println!("compiling step and roll: {:.2?}", begin.elapsed());
    let program = CProgram::compile()?;
    let (mut c, mut compiled) = (program.run()?, run(&jit)?);
    for _ in 1..REPETITIONS {
        c.take_faster(&program.run()?);
        compiled.take_faster(&run(&jit)?);
    }
    let interpreted = run(&Interpreter::new(&functions, &[]))?;
    assert_eq!(
        compiled.state, c.state,
        "compiled code and C reach the same state"
    );
    assert_eq!(
        interpreted.state, c.state,
        "the interpreter and C reach the same state"
    );
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

fn run(engine: &dyn Executor) -> Result<Run, Box<dyn Error>> {
    let mut state = needle::initial_state();
    call(engine, needle::ROTATE, &[90], 1, &mut state)?;
    let step = call(engine, needle::STEP, &[], ROUNDS, &mut state)?;
    let roll = call(engine, needle::ROTATE, &[90], ROUNDS, &mut state)?;
    let nanoseconds = |time: Duration| time.as_secs_f64() * 1e9 / f64::from(ROUNDS);
    Ok(Run {
        step: nanoseconds(step),
        roll: nanoseconds(roll),
        state,
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

/// The compiled C program; its file is removed in the end.
struct CProgram(PathBuf);

impl CProgram {
    fn compile() -> Result<CProgram, Box<dyn Error>> {
        let program = std::env::temp_dir().join(format!("exec-bench-{}", std::process::id()));
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/exec.c");
        let compiled = Command::new("cc")
            .args(["-O2", "-o"])
            .arg(&program)
            .args([source, "-lm"])
            .status()?;
        if !compiled.success() {
            return Err("cc failed".into());
        }
        Ok(CProgram(program))
    }

    fn run(&self) -> Result<Run, Box<dyn Error>> {
        let mut child = Command::new(&self.0)
            .arg(ROUNDS.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut input = String::new();
        for word in needle::initial_state() {
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
}

impl Drop for CProgram {
    fn drop(&mut self) {
        // A file that is left over in the temporary folder does no harm.
        let _ = std::fs::remove_file(&self.0);
    }
}
