//! Models of which statistical queries are measured, and the same law in C.

use std::error::Error;
use std::path::Path;
use std::process::Command;

use checker::diagnostics::{Diagnostic, SourceMap};
use checker::exec::Libraries;
use checker::ir::{Network, QueryKind, Statistical};
use checker::semantics::{self, FIRST_POOL, Reading};
use checker::syntax;

/// How many standard deviations two estimates may differ by.
pub(crate) const DEVIATIONS: f64 = 5.0;

/// What was measured of all runs: how many are satisfied, their moves, and seconds.
pub(crate) struct Measured {
    pub(crate) satisfied: u64,
    /// `None` if they were not counted.
    pub(crate) moves: Option<u64>,
    pub(crate) seconds: f64,
}

impl Measured {
    /// Makes the runs of a model in C.
    pub(crate) fn in_c(program: &Path, model: &str, runs: u64) -> Result<Self, Box<dyn Error>> {
        let output = Command::new(program)
            .args([model, &runs.to_string(), "1"])
            .output()?;
        let output = String::from_utf8(output.stdout)?;
        let mut fields = output.split_whitespace();
        let mut field = || fields.next().ok_or("the program prints three numbers");
        Ok(Self {
            satisfied: field()?.parse()?,
            moves: Some(field()?.parse()?),
            seconds: field()?.parse::<f64>()? / 1e9,
        })
    }

    fn share(&self, runs: u64) -> f64 {
        self.satisfied as f64 / runs as f64
    }

    /// How many moves a run has.
    ///
    /// # Panics
    ///
    /// Panics if they were not counted.
    pub(crate) fn mean_moves(&self, runs: u64) -> f64 {
        self.moves.expect("moves were counted") as f64 / runs as f64
    }

    /// The probabilities here and in C.
    ///
    /// # Panics
    ///
    /// Panics if they differ by more than chance.
    pub(crate) fn shares(&self, c: &Self, model: &str, runs: u64) -> (f64, f64) {
        let (ours, theirs) = (self.share(runs), c.share(runs));
        let mean = f64::midpoint(ours, theirs);
        let variance = 2.0 * mean * (1.0 - mean) / runs as f64;
        assert!(
            (ours - theirs).abs() <= DEVIATIONS * variance.sqrt(),
            "{model}: the probability is {ours} here and {theirs} in C"
        );
        (ours, theirs)
    }
}

/// A model in the stochastic reading, with a compiled query.
pub(crate) fn load(model: &str, query: &str) -> Result<(Network, Statistical), Box<dyn Error>> {
    let mut sources = SourceMap::default();
    let prelude = syntax::prelude(&mut sources);
    let parsed = syntax::read_model("model.xta", model.as_bytes(), &mut sources);
    let (model, more) = semantics::analyse(
        &parsed.document,
        &prelude,
        &sources,
        Reading::Stochastic,
        &Libraries::default(),
        FIRST_POOL,
    );
    let mut found = parsed.diagnostics;
    found.extend(more);
    let span = syntax::add_query_text(query, &mut sources);
    let (parsed, more) = syntax::parse_query(span, &sources);
    found.extend(more);
    let mut compiled = None;
    let mut model = model.filter(|_| !found.iter().any(Diagnostic::is_error));
    if let (Some(model), Some(parsed)) = (&mut model, parsed) {
        let (query, more) = model.compile_query(&parsed, &sources, &[]);
        found.extend(more);
        compiled = query.and_then(|query| match query.kind {
            QueryKind::Statistical(asked) => Some(*asked),
            _ => None,
        });
    }
    let (Some(model), Some(query)) = (model, compiled) else {
        let texts: Vec<String> = found.iter().map(|one| one.render(&sources)).collect();
        return Err(texts.join("\n").into());
    };
    Ok((model.network, query))
}
