//! Files of evidence: certificates, traces, strategies and machines for the models of the corpus,
//! and what is done with a mutated one.
//!
//! An input begins with a line that holds the number of its model; the file follows. It is read as
//! `ntagen verify` reads it. If it passes, the engine must not give the opposite answer to the
//! query in the file: no mutation may make evidence that is accepted for a wrong verdict.

use std::fmt::Write as _;
use std::time::Duration;

use checker::engine::format::{json, machine_json, strategy_json};
use checker::engine::{Answer, CodeEngine, LoadedModel, Options, Rules, Verdict};
use serde_json::Value as Json;

/// Larger models take too long to be worth it.
const MOST_MODEL_BYTES: usize = 3_000;
/// Larger files take too long to be worth it.
const MOST_FILE_BYTES: usize = 20_000;
/// Queries of one model that files are made for.
const MOST_QUERIES: usize = 6;

/// Models, and files that were written for them.
#[derive(Default)]
pub(crate) struct Evidence {
    models: Vec<Vec<u8>>,
    /// The inputs, each with the number of its model in the first line.
    pub(crate) inputs: Vec<Vec<u8>>,
}

impl Evidence {
    /// Makes the files of a model for its queries.
    pub(crate) fn add_model(&mut self, bytes: &[u8], queries: &[String]) {
        if bytes.len() > MOST_MODEL_BYTES || load(bytes).is_none() {
            return;
        }
        let number = self.models.len();
        for query in queries.iter().take(MOST_QUERIES) {
            for file in files(bytes, query) {
                if file.len() <= MOST_FILE_BYTES {
                    self.inputs.push(format!("{number}\n{file}").into_bytes());
                }
            }
        }
        self.models.push(bytes.to_vec());
    }

    /// Checks an input; panics if it passes for a verdict that is wrong.
    pub(crate) fn run(&self, input: &[u8]) {
        let text = String::from_utf8_lossy(input);
        let (number, file) = text.split_once('\n').unwrap_or(("0", &text));
        let number: usize = number.parse().unwrap_or(0);
        let bytes = &self.models[number % self.models.len()];
        let mut model = load(bytes).expect("models that do not load are left out");
        let rules = Rules::default();
        let Ok(checked) = model.verify_evidence("evidence", file, rules) else {
            return;
        };
        if checked.holds == Some(true) {
            compare(&mut model, file);
        }
    }
}

/// Asks the engine what the file is evidence for.
fn compare(model: &mut LoadedModel, file: &str) {
    let header = file.lines().next().unwrap_or_default();
    let header: Json = serde_json::from_str(header)
        .or_else(|_| serde_json::from_str(file))
        .expect("it was read before");
    let query = header["query"].as_str().unwrap_or_default().to_owned();
    let wrong = match header["format"].as_str().unwrap_or_default() {
        // A certificate shows that no state is such, a trace that there is one.
        "ntagen-certificate" => opposite(&query, false),
        "ntagen-trace" if header["kind"] != "failure" && header.get("traces").is_none() => {
            opposite(&query, true)
        }
        "ntagen-machine" => Some(Verdict::NotSatisfied),
        "ntagen-strategy" => match header["owner"].as_str() {
            Some("controller") => Some(Verdict::NotSatisfied),
            Some("environment") => Some(Verdict::Satisfied),
            _ => None,
        },
        _ => None,
    };
    let text = model.add_query(&query);
    if let (Some(wrong), Ok(answer)) = (wrong, model.check(&text, &options(false))) {
        assert_ne!(answer.verdict, wrong, "the evidence passes: {query}");
    }
}

/// The verdict that cannot be, if the states that a query looks for exist, or do not.
fn opposite(query: &str, exist: bool) -> Option<Verdict> {
    let looks_for_good = query.trim_start().starts_with("E<>");
    let looks_for_bad = query.trim_start().starts_with("A[]");
    if !looks_for_good && !looks_for_bad {
        return None;
    }
    Some(if looks_for_good == exist {
        Verdict::NotSatisfied
    } else {
        Verdict::Satisfied
    })
}

fn load(bytes: &[u8]) -> Option<LoadedModel> {
    LoadedModel::load("model", bytes).ok()
}

fn options(with_evidence: bool) -> Options {
    let mut options = Options {
        code: CodeEngine::Interpreter,
        strategy: with_evidence,
        runs: with_evidence,
        certificate: with_evidence,
        ..Options::default()
    };
    options.limits.states = Some(500);
    options.limits.timeout = Some(Duration::from_millis(200));
    options
}

/// All files that back the answer to a query.
fn files(bytes: &[u8], query: &str) -> Vec<String> {
    let Some(mut model) = load(bytes) else {
        return Vec::new();
    };
    let text = model.add_query(query);
    match model.check(&text, &options(true)) {
        Ok(answer) => texts(&model, &answer, query),
        Err(_) => Vec::new(),
    }
}

fn texts(model: &LoadedModel, answer: &Answer, query: &str) -> Vec<String> {
    let network = model.network();
    let evidence = &answer.evidence;
    let mut texts = Vec::new();
    if !evidence.witnesses.is_empty() {
        let mut text = String::new();
        let _ = write!(
            text,
            "{}",
            json::witnesses(network, &evidence.witnesses, query)
        );
        texts.push(text);
    }
    if let Some(certificate) = &evidence.certificate {
        let lines = certificate.lines(0..certificate.state_count());
        texts.push(certificate.head(network, query) + &lines);
    }
    if let Some(strategy) = &evidence.strategy {
        texts.push(strategy_json::text(network, strategy, query));
    }
    if let Some(machine) = &evidence.machine {
        texts.push(machine_json::write(network, machine, query).to_string());
    }
    texts
}
