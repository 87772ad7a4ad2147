//! How long does loading take? The generated model of the needle, with compiling its code, against
//! the time that an enumerator written by hand in C for this one model needs for the whole problem
//! (`tests/benchmarks/needle.c`); and a large model against reading its XML alone.
//!
//! Code is compiled when it has become hot. So there are two figures: loading until a query can
//! start, which is what a user waits for, and loading with all guards, invariants and updates
//! compiled at once, and all that they call, which is more than a run ever does.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

#[path = "support/needle.rs"]
mod needle;
mod support;

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use checker::exec::{Jit, JitError};
use checker::ir::{FunctionId, Instruction, Network};

use needle::{load, needle_model};
use support::Scratch;

/// The least of so many repetitions counts; what is compared takes turns, so that both see the same
/// load.
const REPETITIONS: usize = 15;
const LARGE_BYTES: usize = 1 << 20;

fn main() -> Result<(), Box<dyn Error>> {
    let scratch = Scratch::new()?;
    let yardstick = scratch.compile("../tests/benchmarks/needle.c", &[])?;
    let needle = needle_model(scratch.folder())?;
    let large = large_model();
    let mut least = [f64::INFINITY; 6];
    for _ in 0..REPETITIONS {
        let (ready, compiled) = needle_seconds(&needle)?;
        let (reading, tree) = timed(|| roxmltree::Document::parse(&large).map(drop));
        tree?;
        let (loading, model) = timed(|| load(large.as_bytes()));
        let model = model?;
        let network = model.network();
        let (ending, ()) = timed(|| drop(Jit::new(&network.functions, &network.constants)));
        let seconds = [
            c_seconds(&yardstick)?,
            ready,
            compiled,
            reading,
            loading,
            ending,
        ];
        for (least, seconds) in least.iter_mut().zip(seconds) {
            *least = least.min(seconds);
        }
    }
    let [yardstick, ready, compiled, reading, loading, preparing] = least;
    let row = |what: &str, seconds: f64, of: f64| {
        println!(
            "{what:50} {:9.2} ms   ratio {:7.3}",
            1e3 * seconds,
            seconds / of
        );
    };
    row(
        "needle: the enumerator in C, whole problem",
        yardstick,
        yardstick,
    );
    row("needle: loaded, a query can start", ready, yardstick);
    row("needle: loaded, all code compiled", compiled, yardstick);
    row("1 MB of XML: read by roxmltree", reading, reading);
    row("1 MB of XML: loaded", loading, reading);
    row(
        "1 MB of XML: loaded, a query can start",
        loading + preparing,
        reading,
    );
    Ok(())
}

/// Seconds until a query can start, and until every function is compiled.
fn needle_seconds(bytes: &[u8]) -> Result<(f64, f64), Box<dyn Error>> {
    let (loading, model) = timed(|| load(bytes));
    let model = model?;
    let network = model.network();
    let (preparing, jit) = timed(|| Jit::new(&network.functions, &network.constants));
    jit?;
    let (compiling, compiled) = timed(|| compile_all(network));
    compiled?;
    Ok((loading + preparing, loading + compiling))
}

/// Compiles the functions that no other calls, each with all that it calls.
fn compile_all(network: &Network) -> Result<Jit, JitError> {
    let jit = Jit::new(&network.functions, &network.constants)?;
    let mut is_called = vec![false; network.functions.len()];
    let blocks = network
        .functions
        .iter()
        .flat_map(|function| &function.blocks);
    for instruction in blocks.flat_map(|block| &block.instructions) {
        if let Instruction::Call { function, .. } = instruction {
            is_called[function.0 as usize] = true;
        }
    }
    for (index, _) in is_called.iter().enumerate().filter(|(_, called)| !**called) {
        jit.compile_function(FunctionId(index as u32))?;
    }
    Ok(jit)
}

/// The seconds that a piece of work takes, and what it made.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begin = Instant::now();
    let made = work();
    (begin.elapsed().as_secs_f64(), made)
}

/// The seconds that the enumerator reports.
fn c_seconds(program: &Path) -> Result<f64, Box<dyn Error>> {
    let output = String::from_utf8(Command::new(program).output()?.stdout)?;
    let seconds = output.trim_end().rsplit(' ').next();
    Ok(seconds
        .ok_or("the enumerator prints its seconds")?
        .parse()?)
}

/// A model of about a megabyte: templates with declarations, functions, invariants and all kinds of
/// labels, each used once.
fn large_model() -> String {
    const LOCATIONS: usize = 40;
    let mut text = String::from(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<nta>\n<declaration>\
         const int N = 8;\ntypedef int[0, N - 1] id_t;\nint[0, 1000] count[N];\nbool busy;\nchan go[N];\nbroadcast chan all;\n\
         </declaration>\n",
    );
    let mut system = String::new();
    let mut templates = 0;
    while text.len() < LARGE_BYTES {
        let _ = write!(
            text,
            "<template><name x=\"10\" y=\"20\">T{templates}</name><parameter>const id_t own, int[0, 1000] &amp;shared</parameter>\
             <declaration>clock x, y;\nint[0, 100] steps = 0;\n// Whether another is ahead.\nbool is_first(id_t other) {{\n\
             for (i : id_t) {{ if (i != other &amp;&amp; count[i] &gt; count[other]) return false; }}\n\
             return true;\n}}\nvoid advance(int by) {{ steps = (steps + by) % 100; count[own] = steps; }}\n</declaration>\n"
        );
        for i in 0..LOCATIONS {
            let _ = writeln!(
                text,
                "<location id=\"t{templates}_{i}\" x=\"{}\" y=\"{}\"><name x=\"{}\" y=\"7\">L{i}</name>\
                 <label kind=\"invariant\" x=\"3\" y=\"-4\">x &lt;= {} &amp;&amp; y &lt;= {}</label></location>",
                i * 100,
                i % 7 * 50,
                i * 100 + 8,
                10 + i,
                20 + i
            );
        }
        let _ = writeln!(text, "<init ref=\"t{templates}_0\"/>");
        for i in 0..LOCATIONS {
            for (target, sync) in [(i + 1, "go[own]!"), (i + 7, "go[other]?"), (i + 13, "all!")] {
                let _ = writeln!(
                    text,
                    "<transition><source ref=\"t{templates}_{i}\"/><target ref=\"t{templates}_{}\"/>\
                     <label kind=\"select\" x=\"1\" y=\"2\">other : id_t</label>\
                     <label kind=\"guard\" x=\"1\" y=\"18\">x &gt;= {i} &amp;&amp; is_first(other) &amp;&amp; steps + {i} &lt; 90</label>\
                     <label kind=\"synchronisation\" x=\"1\" y=\"34\">{sync}</label>\
                     <label kind=\"assignment\" x=\"1\" y=\"50\">x = 0, advance({} * own + 1), shared = count[other]</label>\
                     <nail x=\"{i}\" y=\"60\"/></transition>",
                    target % LOCATIONS,
                    i % 3 + 1
                );
            }
        }
        text.push_str("</template>\n");
        let _ = writeln!(
            system,
            "P{templates} = T{templates}({}, count[{}]);",
            templates % 8,
            (templates + 3) % 8
        );
        templates += 1;
    }
    let names: Vec<String> = (0..templates).map(|i| format!("P{i}")).collect();
    let _ = write!(
        text,
        "<system>{system}system {};</system>\n</nta>\n",
        names.join(", ")
    );
    text
}
