//! What the tests of this folder share: parsing small texts and showing trees without places.

use checker::diagnostics::{Diagnostic, SourceMap, Span};
use checker::syntax::ast::{
    Control, Document, Estimated, Expr, ExprKind, Formula, Interval, Measured, Objective, Optimum,
    Path, Query, QueryKind, RunBound, RunLimit, Shield, Shown, Statistical, TypeExpr, TypeKind,
};
use checker::syntax::{Parsed, parse_query, print_type, read_model};

/// The document of a model without mistakes.
pub(crate) fn document(text: &str) -> Document {
    let mut sources = SourceMap::default();
    let Parsed {
        document,
        diagnostics,
        ..
    } = read_model("model", text.as_bytes(), &mut sources);
    assert!(
        diagnostics.iter().all(|d| !d.is_error()),
        "unexpected mistakes:\n{}",
        rendered(&diagnostics, &sources)
    );
    document
}

/// All diagnostics of a model, one a line: code, line, column, message.
pub(crate) fn mistakes(bytes: &[u8]) -> Vec<String> {
    let mut sources = SourceMap::default();
    let parsed = read_model("model", bytes, &mut sources);
    parsed
        .diagnostics
        .iter()
        .map(|diagnostic| shown(diagnostic, &sources))
        .collect()
}

/// `CODE at LINE:COLUMN "message"`
pub(crate) fn shown(diagnostic: &Diagnostic, sources: &SourceMap) -> String {
    let position = sources.position(diagnostic.span);
    format!(
        "{} at {}:{} \"{}\"",
        diagnostic.code.code, position.line, position.column, diagnostic.message
    )
}

pub(crate) fn rendered(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    diagnostics.iter().map(|d| d.render(sources)).collect()
}

/// A model with one edge that has this guard.
pub(crate) fn with_guard(guard: &str) -> String {
    format!("process P() {{ state A; init A; trans A -> A {{ guard {guard}; }}; }} system P;")
}

/// The expression that a guard's text means.
pub(crate) fn expression(text: &str) -> Expr {
    let mut document = document(&with_guard(text));
    let mut edge = document.templates.remove(0).edges.remove(0);
    edge.guard.take().expect("the edge has a guard")
}

/// A query and its diagnostics.
pub(crate) fn query(text: &str) -> (Option<Query>, Vec<String>) {
    let mut sources = SourceMap::default();
    let span = checker::syntax::add_query_text(text, &mut sources);
    let (query, diagnostics) = parse_query(span, &sources);
    let diagnostics = diagnostics.iter().map(|d| shown(d, &sources)).collect();
    (query, diagnostics)
}

/// The span of a whole source that holds one text.
pub(crate) fn whole(text: &str, sources: &mut SourceMap) -> Span {
    checker::syntax::add_query_text(text, sources)
}

/// A tree with every bracket: `(|| a (&& b c))`.
pub(crate) fn shape(expr: &Expr) -> String {
    match &expr.kind {
        ExprKind::Int(value) => value.to_string(),
        ExprKind::Double(value) => format!("{value:?}"),
        ExprKind::Bool(value) => value.to_string(),
        ExprKind::String(text) => format!("{text:?}"),
        ExprKind::Name(name) => name.clone(),
        ExprKind::Field(object, name) => format!("(. {} {})", shape(object), name.text),
        ExprKind::Index(array, index) => format!("([] {} {})", shape(array), shape(index)),
        ExprKind::Call(function, arguments) => {
            format!("(call {}{})", shape(function), shapes(arguments))
        }
        ExprKind::Unary(operator, operand) => format!("({operator:?} {})", shape(operand)),
        ExprKind::Binary(operator, left, right) => {
            format!("({operator:?} {} {})", shape(left), shape(right))
        }
        ExprKind::Ternary(condition, then, otherwise) => format!(
            "(? {} {} {})",
            shape(condition),
            shape(then),
            shape(otherwise)
        ),
        ExprKind::Assign(operator, target, value) => match operator {
            Some(operator) => format!("({operator:?}= {} {})", shape(target), shape(value)),
            None => format!("(= {} {})", shape(target), shape(value)),
        },
        ExprKind::Step {
            target,
            delta,
            postfix,
        } => {
            let order = if *postfix { "post" } else { "pre" };
            format!("({order}{delta:+} {})", shape(target))
        }
        ExprKind::Rate(clock) => format!("(' {})", shape(clock)),
        ExprKind::Quantifier {
            quantifier,
            name,
            ty,
            body,
        } => format!(
            "({quantifier:?} {} {} {})",
            name.text,
            type_shape(ty),
            shape(body)
        ),
        ExprKind::Spawn(name, arguments) => format!("(spawn {}{})", name.text, shapes(arguments)),
        ExprKind::Exit => "exit".to_owned(),
        ExprKind::NumberOf(name) => format!("(numOf {})", name.text),
        ExprKind::Deadlock => "deadlock".to_owned(),
        ExprKind::Error | ExprKind::Unsupported => "error".to_owned(),
    }
}

fn shapes<'e>(exprs: impl IntoIterator<Item = &'e Expr>) -> String {
    let texts: Vec<String> = exprs
        .into_iter()
        .map(|e| format!(" {}", shape(e)))
        .collect();
    texts.concat()
}

fn type_shape(ty: &TypeExpr) -> String {
    match &ty.kind {
        TypeKind::Range(low, high) => format!("(int {} {})", shape(low), shape(high)),
        TypeKind::Scalar(size) => format!("(scalar {})", shape(size)),
        _ => print_type(ty),
    }
}

/// A query with every bracket.
pub(crate) fn query_shape(query: &Query) -> String {
    let strategy = query
        .strategy
        .as_ref()
        .map_or(String::new(), |name| format!("strategy {} = ", name.text));
    let under = query
        .under
        .as_ref()
        .map_or(String::new(), |name| format!(" under {}", name.text));
    let imitate = query
        .imitate
        .as_ref()
        .map_or(String::new(), |name| format!(" imitate {}", name.text));
    format!("{strategy}{}{under}{imitate}", kind_shape(&query.kind))
}

fn kind_shape(kind: &QueryKind) -> String {
    match kind {
        QueryKind::Reachable(p) => format!("E<> {}", shape(p)),
        QueryKind::Invariantly(p) => format!("A[] {}", shape(p)),
        QueryKind::PotentiallyAlways(p) => format!("E[] {}", shape(p)),
        QueryKind::Eventually(p) => format!("A<> {}", shape(p)),
        QueryKind::LeadsTo(p, q) => format!("{} --> {}", shape(p), shape(q)),
        QueryKind::Extremum {
            extremum,
            predicate,
            items,
        } => {
            let predicate = predicate
                .as_ref()
                .map_or(String::new(), |p| format!("{{{}}}", shape(p)));
            format!("{extremum:?}{predicate}:{}", shapes(items))
        }
        QueryKind::Control(control) => control_shape(control),
        QueryKind::SaveStrategy { file, strategy } => format!("save {file:?} {}", strategy.text),
        QueryKind::LoadStrategy { file, .. } => format!("load {file:?}"),
        QueryKind::Optimum(optimum) => optimum_shape(optimum),
        QueryKind::Shield(shield) => shield_shape(shield),
        QueryKind::Statistical(query) => statistical_shape(query),
        QueryKind::Unsupported(name) => format!("unsupported: {}", name.text),
    }
}

fn optimum_shape(query: &Optimum) -> String {
    let best = if query.is_greatest { "max" } else { "min" };
    let measured = match &query.measured {
        Measured::Expected(Some(price)) => format!("E({})", shape(price)),
        Measured::Expected(None) => String::from("E"),
        Measured::Probability => String::from("Pr"),
    };
    let features = query.features.as_ref().map_or(String::new(), |features| {
        let (discrete, continuous) = (shapes(&features.discrete), shapes(&features.continuous));
        format!("{{{discrete}}} -> {{{continuous}}}")
    });
    let goal = query.goal.as_ref();
    let goal = goal.map_or(String::new(), |goal| format!(": {}", shape(goal)));
    format!(
        "{best}{measured}{}{features}{goal}",
        bound_shape(&query.bound)
    )
}

fn shield_shape(query: &Shield) -> String {
    let axes = query.axes.iter().map(|axis| {
        let bounds = axis.bounds.as_ref().map_or(String::new(), |bounds| {
            format!("[{},{}]", shape(&bounds[0]), shape(&bounds[1]))
        });
        let cells = axis.cells.as_ref();
        let cells = cells.map_or(String::new(), |cells| format!(":{}", shape(cells)));
        format!("{}{bounds}{cells}", shape(&axis.place))
    });
    let axes: Vec<String> = axes.collect();
    format!(
        "acontrol: {} {{{}}}",
        shape(&query.invariant),
        axes.join(", ")
    )
}

fn statistical_shape(query: &Statistical) -> String {
    match query {
        Statistical::Probability(estimated) => estimated_shape(estimated),
        Statistical::Simulation {
            bound,
            items,
            filter,
        } => simulation_shape(bound, items, filter.as_ref()),
        Statistical::Hypothesis {
            estimated,
            at_least,
            threshold,
        } => {
            let relation = if *at_least { ">=" } else { "<=" };
            format!(
                "{} {relation} {}",
                estimated_shape(estimated),
                shape(threshold)
            )
        }
        Statistical::Comparison {
            left,
            right,
            at_least,
        } => {
            let relation = if *at_least { ">=" } else { "<=" };
            format!(
                "{} {relation} {}",
                estimated_shape(left),
                estimated_shape(right)
            )
        }
        Statistical::Expectation {
            bound,
            maximum,
            value,
        } => {
            let which = if *maximum { "max" } else { "min" };
            format!("E{}({which}: {})", bound_shape(bound), shape(value))
        }
    }
}

fn simulation_shape(
    bound: &RunBound,
    items: &[Shown],
    filter: Option<&(Option<Expr>, Expr)>,
) -> String {
    let filter = filter.map_or(String::new(), |(runs, reached)| {
        let runs = runs.as_ref();
        let runs = runs.map_or(String::new(), |runs| format!(" : {}", shape(runs)));
        format!("{runs} : {}", shape(reached))
    });
    let items: String = items.iter().map(shown_shape).collect();
    format!("simulate{}{{{items}}}{filter}", bound_shape(bound))
}

fn shown_shape(shown: &Shown) -> String {
    let value = shape(&shown.value);
    match &shown.each {
        Some((name, ty)) => format!(" (foreach {}:{} {value})", name.text, print_type(ty)),
        None => format!(" {value}"),
    }
}

fn estimated_shape(estimated: &Estimated) -> String {
    let path = match &estimated.path {
        Path::Eventually(p) => format!("<> {}", shape(p)),
        Path::Always(p) => format!("[] {}", shape(p)),
        Path::Until(p, q) => format!("{} U {}", shape(p), shape(q)),
        Path::Formula(formula) => formula_shape(formula),
    };
    let bound = estimated.bound.as_ref().map_or(String::new(), bound_shape);
    format!("Pr{bound}({path})")
}

fn formula_shape(formula: &Formula) -> String {
    let interval = |interval: &Option<Interval>| {
        interval.as_ref().map_or(String::new(), |interval| {
            format!("[{},{}]", shape(&interval.from), shape(&interval.to))
        })
    };
    match formula {
        Formula::State(p) => shape(p),
        Formula::Not(f) => format!("(not {})", formula_shape(f)),
        Formula::And(f, g) => format!("(and {} {})", formula_shape(f), formula_shape(g)),
        Formula::Or(f, g) => format!("(or {} {})", formula_shape(f), formula_shape(g)),
        Formula::Next(f) => format!("(X {})", formula_shape(f)),
        Formula::Eventually(i, f) => format!("(<>{} {})", interval(i), formula_shape(f)),
        Formula::Always(i, f) => format!("([]{} {})", interval(i), formula_shape(f)),
        Formula::Quantified(is_for_all, name, ty, f) => {
            let word = if *is_for_all { "forall" } else { "exists" };
            let (ty, f) = (print_type(ty), formula_shape(f));
            format!("({word} {}:{ty} {f})", name.text)
        }
        Formula::Until(i, f, g) => {
            format!(
                "(U{} {} {})",
                interval(i),
                formula_shape(f),
                formula_shape(g)
            )
        }
        Formula::Release(i, f, g) => {
            format!(
                "(R{} {} {})",
                interval(i),
                formula_shape(f),
                formula_shape(g)
            )
        }
    }
}

fn bound_shape(bound: &RunBound) -> String {
    let limit = match &bound.limit {
        RunLimit::Time => String::new(),
        RunLimit::Clock(clock) => shape(clock),
        RunLimit::Moves => String::from("#"),
    };
    let runs = bound.runs.as_ref();
    let runs = runs.map_or(String::new(), |runs| format!("; {}", shape(runs)));
    format!("[{limit}<={}{runs}]", shape(&bound.value))
}

fn control_shape(control: &Control) -> String {
    let objective = match &control.objective {
        Objective::Reach(p) => format!("A<> {}", shape(p)),
        Objective::Safe(p) => format!("A[] {}", shape(p)),
        Objective::Until(p, q) => format!("A[{} U {}]", shape(p), shape(q)),
        Objective::WeakUntil(p, q) => format!("A[{} W {}]", shape(p), shape(q)),
        Objective::Buchi(p, q) => format!("A[]({} A<> {})", shape(p), shape(q)),
    };
    let cooperative = if control.cooperative { "E<> " } else { "" };
    let observed = control.observations.as_ref().map_or(String::new(), |list| {
        format!("{{{} }} ", shapes(list.iter().map(|one| &one.predicate)))
    });
    let bounds = control
        .time_optimal
        .as_ref()
        .map_or(String::new(), |(u, g)| {
            let bound = |e: &Option<Expr>| e.as_ref().map_or("-".to_owned(), shape);
            format!("_t*({}, {})", bound(u), bound(g))
        });
    format!("{observed}{cooperative}control{bounds}: {objective}")
}
