//! From syntax trees to the network: names, types, constants, every static rule of the language,
//! and lowering to code.
//!
//! The way: declarations are checked in order, functions are lowered as soon as they are checked,
//! so that constants can be computed with them; then the system section is instantiated, and every
//! template is checked and lowered once for each of its processes, with its parameters known.
//! Templates that no process uses are checked with unknown parameters.
//!
//! Invariants:
//! * All mistakes are reported in one run; what follows from a mistake is not reported.
//! * Nothing is lowered after a mistake, so lowering never fails.
//! * The scopes of a model outlive its check: queries are compiled against them, and only append to
//!   the network.
//!
//! Source: UPPAAL's language reference, and the rules of its official parser where that is silent.
//! Where we differ:
//! * Names that UPPAAL predeclares may be declared again by a model.
//! * Parameters of templates by value are constants, unless the template assigns to them.
//! * Mutable doubles are part of the state, with a warning.
//! * Clocks with rates other than 0 and 1 are left out, with a warning, if no condition depends on
//!   them; UPPAAL refuses the queries.
//!
//! Cost: linear in the trees, times the number of processes of a template.

pub mod codes;

mod types;

mod typed;

mod scope;

mod groups;
mod hints;

mod pools;

mod processes;

mod offsets;

mod layout;

mod checker;

mod operators;

mod clock_expressions;

mod left_out;

mod expressions;

mod assignments;

mod quantifiers;

mod calls;

mod constants;

mod type_expressions;

mod initialisers;

mod declarations;

mod scalars;

mod functions;

mod dynamic;

mod externals;

mod lower;

mod labels;
mod learning;

mod assigned;

mod legs;

mod templates;

mod instantiate;

mod hooks;

mod system;

mod members;
mod nodes;

mod queries;

mod each;

mod formulas;
mod value_ranges;

mod shields;
mod statistical;

use self::left_out::LeftOut;
use crate::diagnostics::{Diagnostic, SourceMap};
use crate::exec::Libraries;
use crate::ir;
use crate::syntax::ast;

/// A checked model: the network, and what is needed to compile queries for it.
#[derive(Debug)]
pub struct Model {
    /// The network.
    pub network: ir::Network,
    reading: Reading,
    world: checker::World,
    relocation: layout::Relocation,
    /// The variables whose values queries cannot know.
    left_out: left_out::Causes,
}

/// What clocks are to a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reading {
    /// Dimensions of zones: what symbolic and game queries need.
    #[default]
    Symbolic,
    /// Words of the state with a value and a rate: what statistical queries need.
    Stochastic,
}

/// How many slots a dynamic template has at first.
pub const FIRST_POOL: u32 = 16;

/// Checks and lowers a model with the libraries that it may import, and with this number of slots
/// for the instances of each dynamic template; symbolic readings have one. `None` if there are
/// mistakes. The diagnostics are sorted by place.
pub fn analyse(
    document: &ast::Document,
    prelude: &[ast::Declaration],
    sources: &SourceMap,
    reading: Reading,
    libraries: &Libraries,
    pool: u32,
) -> (Option<Model>, Vec<Diagnostic>) {
    let mut causes = left_out::Causes::default();
    let mut rounds = 1;
    let (checker, relocation) = loop {
        let world = checker::World::default();
        let mut checker = checker::Checker::new(sources, reading, world);
        checker.libraries = libraries.clone();
        if reading == Reading::Stochastic {
            checker.pool = pool;
        }
        checker.left_out = LeftOut::of(causes);
        let relocation = checker.document(document, prelude);
        if !checker.has_errors() || rounds == left_out::MOST_ROUNDS {
            break (checker, relocation);
        }
        let Some(next) = checker.left_out.next() else {
            break (checker, relocation);
        };
        causes = next;
        rounds += 1;
    };
    let has_errors = checker.has_errors();
    let mut world = checker.world;
    let network = std::mem::take(&mut world.network);
    let model = Model {
        network,
        reading,
        world,
        relocation,
        left_out: checker.left_out.into_fixed(),
    };
    ((!has_errors).then_some(model), sorted(checker.diagnostics))
}

/// Whether a mistake is one in the symbolic reading only: the model may have a meaning in the
/// stochastic one.
pub fn is_symbolic(diagnostic: &Diagnostic) -> bool {
    [
        codes::RANDOM_UNSUPPORTED,
        codes::RATE_NOT_ZERO_OR_ONE,
        codes::CLOCK_AS_NUMBER,
        codes::CLOCK_WITH_DOUBLE,
        codes::CLOCK_SET_TO_DIFFERENCE,
        codes::HYBRID_CLOCK_COMPARED,
        codes::EXTERNAL_SYMBOLIC,
        codes::DYNAMIC_SYMBOLIC,
    ]
    .contains(&diagnostic.code)
}

impl Model {
    /// Checks and lowers a query; its functions and sites are appended to the network. `strategies`
    /// are the names of the strategies that exist so far. Statistical queries need the stochastic
    /// reading, all others the symbolic one.
    pub fn compile_query(
        &mut self,
        query: &ast::Query,
        sources: &SourceMap,
        strategies: &[String],
    ) -> (Option<ir::Query>, Vec<Diagnostic>) {
        self.compile(sources, |checker| checker.query(query, strategies))
    }

    /// Checks and lowers what `sup` can measure.
    pub(crate) fn compile_measure(
        &mut self,
        expr: &ast::Expr,
        sources: &SourceMap,
    ) -> (Option<ir::Measure>, Vec<Diagnostic>) {
        self.compile(sources, |checker| Some(checker.measure(expr)?.0))
    }

    /// Checks and lowers what `E` can measure, in the stochastic reading; the function leaves a
    /// double.
    pub(crate) fn compile_number(
        &mut self,
        expr: &ast::Expr,
        sources: &SourceMap,
    ) -> (Option<ir::FunctionId>, Vec<Diagnostic>) {
        self.compile(sources, |checker| Some(checker.number(expr)?.0))
    }

    /// Checks and lowers what a strategy sees, in the stochastic reading.
    pub(crate) fn compile_feature(
        &mut self,
        expr: &ast::Expr,
        sources: &SourceMap,
        is_discrete: bool,
    ) -> (Option<ir::Feature>, Vec<Diagnostic>) {
        self.compile(sources, |checker| checker.feature(expr, is_discrete))
    }

    /// Checks and lowers all that a strategy sees, in the stochastic reading.
    pub(crate) fn compile_features(
        &mut self,
        features: &ast::Features,
        sources: &SourceMap,
    ) -> (Option<ir::Observation>, Vec<Diagnostic>) {
        self.compile(sources, |checker| checker.features(features))
    }

    /// Adds what a query brings to the network.
    fn compile<T>(
        &mut self,
        sources: &SourceMap,
        check: impl FnOnce(&mut checker::Checker<'_>) -> Option<T>,
    ) -> (Option<T>, Vec<Diagnostic>) {
        let mut world = std::mem::take(&mut self.world);
        world.network = std::mem::take(&mut self.network);
        let known = world.network.functions.len();
        let scopes = std::mem::take(&mut world.query_scopes);
        let mut checker = checker::Checker::new(sources, self.reading, world);
        checker.scopes = scopes;
        checker.left_out = LeftOut::of(std::mem::take(&mut self.left_out));
        checker.is_query = true;
        checker.relocation = self.relocation;
        let compiled = check(&mut checker);
        let has_errors = !checker.can_lower();
        let diagnostics = sorted(checker.diagnostics);
        self.left_out = checker.left_out.into_fixed();
        self.world = checker.world;
        self.world.query_scopes = checker.scopes;
        self.network = std::mem::take(&mut self.world.network);
        if has_errors {
            self.network.functions.truncate(known);
        }
        self.relocation
            .functions(&mut self.network.functions[known..]);
        (compiled.filter(|_| !has_errors), diagnostics)
    }
}

fn sorted(mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    diagnostics.sort_by_key(|diagnostic| diagnostic.span);
    diagnostics
}
