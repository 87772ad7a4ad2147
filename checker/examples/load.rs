//! Loads models.
#![allow(missing_docs, clippy::all)]
use checker::{diagnostics::SourceMap, semantics, syntax};
fn main() {
    let verbose = std::env::var("V").is_ok();
    for path in std::env::args().skip(1) {
        let bytes = std::fs::read(&path).unwrap();
        let mut sources = SourceMap::default();
        let prelude = syntax::prelude(&mut sources);
        let parsed = syntax::read_model(&path, &bytes, &mut sources);
        let mut errors = parsed.diagnostics.clone();
        let t = std::time::Instant::now();
        let (model, d) = semantics::analyse(&parsed.document, &prelude, &sources);
        let dt = t.elapsed();
        errors.extend(d);
        for e in &errors {
            if e.is_error() || verbose {
                println!("{}", e.render(&sources));
            }
        }
        let Some(mut model) = model else {
            println!("{path}: REJECTED");
            continue;
        };
        println!(
            "{path}: ok {:?} {} procs {} words {} functions {} clocks",
            dt,
            model.network.processes.len(),
            model.network.layout.words,
            model.network.functions.len(),
            model.network.clocks.len()
        );
        let mut strategies = vec![];
        for q in &parsed.document.queries {
            let (query, d) = syntax::parse_query(q.span, &sources);
            for e in &d {
                println!("{}", e.render(&sources));
            }
            if let Some(query) = query {
                let (c, d) = model.compile_query(&query, &sources, &strategies);
                for e in &d {
                    println!("{}", e.render(&sources));
                }
                if let Some(c) = c {
                    if let Some(s) = &c.strategy {
                        strategies.push(s.clone());
                    }
                    if verbose {
                        println!("{:?}", c.kind);
                    }
                }
            }
        }
        if verbose {
            for f in &model.network.functions {
                println!("{f}");
            }
            println!("{:#?}", model.network.processes);
        }
    }
}
