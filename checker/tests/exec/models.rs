//! Whole models: on random walks through each model of the corpus, all engines must see the same
//! states.
//!
//! * `ENGINES_STEPS`: how many moves a walk has.
//! * `ENGINES_MODELS`: folders with more models, separated by colons.

use std::fs;
use std::path::Path;

use checker::engine::LoadedModel;
use checker::engine::session::walk::{Point, successors, symbolic};
use checker::exec::Executor;
use checker::ir::{Network, Overflow};
use checker::network::{Failure, Symbolic};
use checker::zones::{Bound, Zone};

use crate::corpus;
use crate::support::engines;

/// Walks from the initial state, so that not all depends on the first moves.
const WALKS: u64 = 3;
/// Larger models take too long: their zones alone are megabytes.
const MOST_CLOCKS: usize = 60;
const MOST_PROCESSES: usize = 200;

/// A linear congruential generator: the same walks in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % limit
    }
}

/// What a state looks like to one engine: its words, and its zone.
type Seen = (Vec<i32>, Vec<Bound>);

fn seen(point: &Point) -> Seen {
    (point.words.clone(), point.zone.bounds().to_vec())
}

/// All successors of a state as text, or the failure.
fn look(symbolic: &mut Symbolic<'_>, point: &Point) -> (Vec<Point>, String) {
    match successors(symbolic, point) {
        Ok(found) => {
            let shown: Vec<_> = found
                .iter()
                .map(|(parts, next)| (parts, seen(next)))
                .collect();
            let shown = format!("{shown:?}");
            (found.into_iter().map(|(_, next)| next).collect(), shown)
        }
        Err(failure) => (Vec::new(), format!("{failure:?}")),
    }
}

/// The initial words, and the zone after time has passed.
fn initial(symbolic: &mut Symbolic<'_>) -> Result<(Vec<i32>, Zone), Failure> {
    let (mut words, mut zone, invariant) = symbolic.start()?;
    let may_delay = symbolic.may_delay(&mut words)?;
    symbolic.delay(&words, may_delay, &invariant, zone.bounds_mut())?;
    Ok((words, zone))
}

/// Walks with all engines at once; the first difference, if there is one.
fn walk(
    network: &Network,
    executors: &[(&str, Box<dyn Executor>)],
    steps: usize,
    random: &mut Random,
) -> Result<(), String> {
    let mut sides: Vec<_> = executors
        .iter()
        .map(|(_, executor)| symbolic(network, executor.as_ref()))
        .collect();
    let starts: Vec<_> = sides.iter_mut().map(initial).collect();
    let shown: Vec<String> = starts
        .iter()
        .map(|start| match start {
            Ok((words, zone)) => format!("{:?}", (words, zone.bounds())),
            Err(failure) => format!("{failure:?}"),
        })
        .collect();
    compare(executors, &shown, 0)?;
    let Ok((words, zone)) = starts.into_iter().next().expect("there is an engine") else {
        return Ok(());
    };
    let mut point = Point { words, zone };
    for step in 1..=steps {
        let mut next = Vec::new();
        let mut shown = Vec::new();
        for symbolic in &mut sides {
            let (points, text) = look(symbolic, &point);
            next = points;
            shown.push(text);
        }
        compare(executors, &shown, step)?;
        if next.is_empty() {
            break;
        }
        point = next.swap_remove(random.below(next.len()));
    }
    Ok(())
}

fn compare(
    executors: &[(&str, Box<dyn Executor>)],
    shown: &[String],
    step: usize,
) -> Result<(), String> {
    for ((name, _), text) in executors.iter().zip(shown).skip(1) {
        if *text != shown[0] {
            let first = executors[0].0;
            return Err(format!(
                "at step {step}, {first}:\n{:.2000}\n{name}:\n{text:.2000}",
                shown[0]
            ));
        }
    }
    Ok(())
}

fn is_model(path: &Path) -> bool {
    path.extension()
        .is_some_and(|kind| kind == "xml" || kind == "xta")
}

#[test]
fn engines_agree_on_walks_through_every_model() {
    let steps = std::env::var("ENGINES_STEPS").map_or(60, |steps| {
        steps.parse().expect("ENGINES_STEPS is a number")
    });
    let mut paths = corpus::files_and_more("ENGINES_MODELS");
    paths.retain(|path| is_model(path));
    let mut walked = 0;
    let mut differences = Vec::new();
    for path in &paths {
        let bytes = fs::read(path).expect("the model can be read");
        let Ok(model) = LoadedModel::load("model", bytes.as_slice()) else {
            continue;
        };
        let network = model.network();
        if network.clocks.len() > MOST_CLOCKS || network.processes.len() > MOST_PROCESSES {
            continue;
        }
        let executors = engines(&network.functions, &network.constants, Overflow::default());
        walked += 1;
        let mut random = Random(7);
        for _ in 0..WALKS {
            if let Err(difference) = walk(network, &executors, steps, &mut random) {
                differences.push(format!("{}: {difference}\n", path.display()));
                break;
            }
        }
    }
    assert!(walked > 50, "only {walked} models were walked through");
    assert!(differences.is_empty(), "{}", differences.concat());
}
