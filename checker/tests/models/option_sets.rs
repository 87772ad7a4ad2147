//! The same question with different options: engine, order, threads, nodes of game graphs,
//! reductions, and what is wanted besides. None of them may change the answer.
//!
//! Questions are the queries of the corpus, asked of its models as they are or with some of their
//! numbers changed. Each is asked twice, with two random sets of options. If both answers are
//! definite, they must be the same, and all evidence must pass its independent check.
//!
//! `NETWORKS=20000 cargo test --release --test models option_sets::` tries more pairs than the
//! usual number.

use std::fs;
use std::time::Duration;

use checker::engine::{Answer, CodeEngine, LoadedModel, Options, Reductions, TraceWanted, Verdict};
use checker::game::Nodes;
use checker::search::reachability::report::Order;

use crate::checks::try_ask;
use crate::corpus;
use crate::random::{Random, networks};

/// A model of the corpus with its queries.
struct Model {
    name: String,
    text: String,
    queries: Vec<String>,
}

fn models() -> Vec<Model> {
    let mut models = Vec::new();
    for folder in ["verdicts", "games"] {
        for path in corpus::files(folder) {
            let text = fs::read_to_string(&path).expect("the corpus can be read");
            models.push(Model {
                name: path.display().to_string(),
                queries: corpus::queries(&text),
                text,
            });
        }
    }
    models
}

/// The text with up to three of the numbers of its declarations changed to a small one; comments
/// stay as they are.
fn changed(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..random.below(4) {
        let index = random.below(lines.len());
        let line = &lines[index];
        if line.trim_start().starts_with("//") {
            continue;
        }
        let is_digit = |byte: u8| byte.is_ascii_digit();
        let bytes = line.as_bytes();
        let numbers: Vec<usize> = (0..bytes.len())
            .filter(|&at| is_digit(bytes[at]))
            .filter(|&at| {
                at == 0 || !(bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_')
            })
            .collect();
        if numbers.is_empty() {
            continue;
        }
        let start = numbers[random.below(numbers.len())];
        let length = bytes[start..]
            .iter()
            .take_while(|byte| is_digit(**byte))
            .count();
        let number = random.below(6).to_string();
        lines[index].replace_range(start..start + length, &number);
    }
    lines.join("\n")
}

fn random_options(random: &mut Random) -> Options {
    let has_jit = cfg!(feature = "jit");
    let mut options = Options {
        order: [Order::BreadthFirst, Order::DepthFirst, Order::Random(11)][random.below(3)],
        threads: 1 + random.below(3),
        nodes: [Nodes::Automatic, Nodes::Symbolic, Nodes::Discrete][random.below(3)],
        code: if has_jit && random.chance(50) {
            CodeEngine::Jit
        } else {
            CodeEngine::Interpreter
        },
        strategy: random.chance(50),
        verify: random.chance(50),
        runs: random.chance(50),
        trace: [
            TraceWanted::Any,
            TraceWanted::Shortest,
            TraceWanted::Fastest,
        ][random.below(3)],
        certificate: random.chance(30),
        reductions: Reductions {
            symmetry: random.chance(50),
            partial_order: random.chance(50),
            live_variables: random.chance(50),
        },
        ..Options::default()
    };
    options.limits.states = Some(3_000);
    options.limits.timeout = Some(Duration::from_secs(2));
    options
}

fn answer(text: &str, query: &str, options: &Options) -> Option<Answer> {
    let mut model = LoadedModel::load("model.xta", text.as_bytes()).ok()?;
    try_ask(&mut model, query, options).ok()
}

/// What options may not change, if the answer is definite. Whether an error of the model is met
/// depends on what is looked at.
fn definite(answer: &Answer) -> Option<String> {
    match answer.verdict {
        Verdict::Satisfied | Verdict::NotSatisfied => {
            Some(format!("{:?} {:?}", answer.verdict, answer.value))
        }
        Verdict::Maybe | Verdict::Unknown(_) | Verdict::Error(_) => None,
    }
}

#[test]
fn options_do_not_change_answers() {
    let corpus = models();
    let mut compared = 0;
    let mut failures = Vec::new();
    let pairs = networks(300);
    for number in 1..=pairs {
        let mut random = Random::of_network(number);
        let model = &corpus[random.below(corpus.len())];
        let query = &model.queries[random.below(model.queries.len())];
        let text = changed(&model.text, &mut random);
        let sets = [random_options(&mut random), random_options(&mut random)];
        let answers = sets.each_ref().map(|options| answer(&text, query, options));
        let [Some(one), Some(other)] = &answers else {
            continue;
        };
        for (answer, options) in [(one, &sets[0]), (other, &sets[1])] {
            if answer.evidence.is_verified() == Some(false) {
                failures.push(format!(
                    "pair {number}, {}, {query}: evidence fails its check with {options:?}\n{text}",
                    model.name
                ));
            }
        }
        if let (Some(first), Some(second)) = (definite(one), definite(other)) {
            compared += 1;
            if first != second {
                failures.push(format!(
                    "pair {number}, {}, {query}: {first} with {:?}, {second} with {:?}\n{text}",
                    model.name, sets[0], sets[1]
                ));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
    assert!(compared * 2 > pairs, "only {compared} pairs were compared");
}
