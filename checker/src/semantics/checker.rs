//! The state of a run of checking: diagnostics, scopes, and the network under construction.

use std::collections::HashSet;

use rustc_hash::FxHashMap;

use super::Reading;
use super::codes;
use super::layout::Relocation;
use super::left_out::causes::{LeftOut, declared_at};
use super::lower::{Builder, Images};
use super::scope::{Entity, Scope};
use super::typed::{Element, Expr, Kind, Local, LocalId, Place, Root};
use super::types::{Size, Type};
use crate::diagnostics::{Code, Diagnostic, SourceMap, Span};
use crate::exec::{Context, EmittedAssignment, Executor, Interpreter, Libraries, RunTimeError};
use crate::ir::{
    Channel, Clock, Coordinate, Function, FunctionId, Instruction, Network, ProcessId,
    RunTimeErrorKind, SiteId, Variable,
};

/// The place of the system section's scope: behind the prelude's and the global one.
const SYSTEM_SCOPE: usize = 2;

/// How many rounds of loops all constants of a model may take together: about a second.
const CONSTANT_ROUND_LIMIT: u64 = 10_000_000;

#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an independent fact about what is being checked"
)]
/// Everything that checking knows; a model keeps the lasting part for its queries.
pub(super) struct Checker<'a> {
    /// The texts, for labels and messages.
    pub(super) sources: &'a SourceMap,
    /// What clocks are.
    pub(super) reading: Reading,
    /// Where libraries may come from.
    pub(super) libraries: Libraries,
    /// From provisional offsets to those of the layout, while a query is checked.
    pub(super) relocation: Relocation,
    /// What lasts.
    pub(super) world: World,
    /// The open scopes, outermost first.
    pub(super) scopes: Vec<Scope>,
    /// What was found.
    pub(super) diagnostics: Vec<Diagnostic>,
    reported: HashSet<(&'static str, Span)>,
    has_errors: bool,
    /// The locals of the function, guard or update that is being checked.
    pub(super) locals: Vec<Local>,
    /// The values that only statistical queries know, as long as it is open whether anything
    /// depends on them: what is reported if something does.
    pub(super) unknowns: Vec<Diagnostic>,
    /// The variables that are left out because only statistical queries know their values.
    pub(super) left_out: LeftOut,
    /// The hybrid clocks that were declared; a warning about each if the model is accepted.
    pub(super) hybrid_clocks: Vec<(String, Span)>,
    /// Set when a free parameter is looked up.
    pub(super) free_parameter_seen: bool,
    /// Whether a template is checked without an instance: values of parameters are unknown.
    pub(super) is_generic: bool,
    /// Whether the scope of the system section stands above that of the global declarations.
    pub(super) system_is_open: bool,
    /// Whether the declarations of the system section are out of sight.
    pub(super) hides_system: bool,
    /// Set when a quantifier can only be checked value by value, because the members of a process
    /// set differ.
    pub(super) needs_unrolling: bool,
    /// Whether a query is checked.
    pub(super) is_query: bool,
    /// How many slots a dynamic template has.
    pub(super) pool: u32,
    /// What counts the instances of the template that is being checked, if it is a dynamic one.
    pub(super) leaving: Option<Place>,
    /// The name of the function that is being checked.
    pub(super) function_span: Span,
    /// The process whose declarations are being checked.
    pub(super) process: Option<(ProcessId, String)>,
}

/// What lasts from the model to its queries.
#[derive(Debug, Default)]
pub(super) struct World {
    /// The network under construction.
    pub(super) network: Network,
    /// What lies in the constant memory.
    pub(super) images: Images,
    /// The initial words of the variables.
    pub(super) initial: Vec<i32>,
    /// The initial words of the `meta` variables.
    pub(super) initial_meta: Vec<i32>,
    /// How many rounds of loops the constants have taken so far.
    pub(super) constant_rounds: u64,
    /// The scopes that queries see: prelude, globals, system.
    pub(super) query_scopes: Vec<Scope>,
    /// The processes by the name in the system line.
    pub(super) processes: super::processes::Processes,
    /// The dynamic templates.
    pub(super) dynamics: Vec<super::pools::Dynamic>,
}

/// What was reported at a time.
pub(super) struct Reports {
    diagnostics: Vec<Diagnostic>,
    has_errors: bool,
}

impl<'a> Checker<'a> {
    pub(super) fn new(sources: &'a SourceMap, reading: Reading, world: World) -> Checker<'a> {
        Checker {
            sources,
            reading,
            libraries: Libraries::default(),
            relocation: Relocation::default(),
            world,
            scopes: vec![Scope::default()],
            diagnostics: Vec::new(),
            reported: HashSet::new(),
            has_errors: false,
            locals: Vec::new(),
            unknowns: Vec::new(),
            left_out: LeftOut::default(),
            hybrid_clocks: Vec::new(),
            free_parameter_seen: false,
            is_generic: false,
            system_is_open: false,
            hides_system: false,
            needs_unrolling: false,
            is_query: false,
            pool: 1,
            leaving: None,
            function_span: Span::default(),
            process: None,
        }
    }

    /// Checks something in a scope of its own, where the name stands for the entity.
    pub(super) fn scoped<T>(
        &mut self,
        name: &crate::syntax::ast::Name,
        entity: Entity,
        check: impl FnOnce(&mut Self) -> T,
    ) -> T {
        self.scopes.push(Scope::default());
        self.declare(name, entity);
        let checked = check(self);
        self.scopes.pop();
        checked
    }

    /// Reports a diagnostic, unless the same was reported at the same place (for another instance).
    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        if self
            .reported
            .insert((diagnostic.code.code, diagnostic.span))
        {
            self.has_errors |= diagnostic.is_error();
            self.diagnostics.push(diagnostic);
        }
    }

    /// Begins to hold back what is reported; returns what was reported before.
    pub(super) fn hold_reports(&mut self) -> Reports {
        Reports {
            diagnostics: std::mem::take(&mut self.diagnostics),
            has_errors: std::mem::take(&mut self.has_errors),
        }
    }

    /// Goes back to what was reported before; returns what was held back, which can be reported
    /// again.
    pub(super) fn release_reports(&mut self, before: Reports) -> Vec<Diagnostic> {
        let found = std::mem::replace(&mut self.diagnostics, before.diagnostics);
        self.has_errors = before.has_errors;
        for diagnostic in &found {
            self.reported
                .remove(&(diagnostic.code.code, diagnostic.span));
        }
        found
    }

    /// Reports a mistake and how to fix it.
    pub(super) fn error(
        &mut self,
        code: Code,
        span: Span,
        message: impl Into<String>,
        help: &str,
    ) -> Expr {
        self.report(Diagnostic::new(code, span, message).help(help));
        Expr::error(span)
    }

    /// Reports a mistake where there is nothing to go on with.
    pub(super) fn refused<T>(
        &mut self,
        code: Code,
        span: Span,
        message: impl Into<String>,
        help: &str,
    ) -> Option<T> {
        self.error(code, span, message, help);
        None
    }

    /// A value that only statistical queries know; what is said of it is reported if anything
    /// depends on it.
    pub(super) fn unknown(&mut self, diagnostic: Diagnostic, from: Expr, ty: Type) -> Expr {
        let span = diagnostic.span;
        self.unknowns.push(diagnostic);
        Expr::new(Kind::Unknown(Box::new(from)), ty, span)
    }

    /// A construct that is not supported, which is reported as a whole.
    pub(super) fn unsupported(&mut self, span: Span) -> Expr {
        // In a template that no process uses, it does no harm.
        self.has_errors |= !self.is_generic;
        Expr::error(span)
    }

    /// An expression that the parser has reported: nothing can be lowered any more.
    pub(super) fn reported_by_parser(&mut self, span: Span) -> Expr {
        self.has_errors = true;
        Expr::error(span)
    }

    /// Whether code may be made: nothing was wrong so far, and all values are known.
    pub(super) fn can_lower(&mut self) -> bool {
        for diagnostic in std::mem::take(&mut self.unknowns) {
            self.report(diagnostic);
        }
        !self.has_errors && !self.is_generic
    }

    /// Whether a mistake was reported.
    pub(super) fn has_errors(&self) -> bool {
        self.has_errors
    }

    /// What a name stands for.
    pub(super) fn lookup(&mut self, name: &str) -> Option<Entity> {
        let hidden = self.hides_system.then_some(SYSTEM_SCOPE);
        let visible = self.scopes.iter().enumerate().rev();
        let entity = visible
            .filter(|&(i, _)| Some(i) != hidden)
            .find_map(|(_, scope)| scope.get(name))
            .map(|(entity, _)| entity.clone())?;
        if let Entity::Constant { free: true, .. } = entity {
            self.free_parameter_seen = true;
        }
        Some(entity)
    }

    /// A declared name like the given one.
    pub(super) fn similar_name(&self, name: &str) -> Option<String> {
        let nearest = self
            .scopes
            .iter()
            .rev()
            .filter_map(|scope| scope.similar(name));
        nearest
            .min_by_key(|&(distance, _)| distance)
            .map(|(_, name)| name.to_owned())
    }

    /// Declares a name in the innermost scope. The system section may not declare what the global
    /// declarations do.
    pub(super) fn declare(&mut self, name: &crate::syntax::ast::Name, entity: Entity) {
        let innermost = self.scopes.len() - 1;
        let outermost = innermost - usize::from(self.system_is_open && innermost == SYSTEM_SCOPE);
        let mut same = self.scopes[outermost..].iter();
        if let Some(first) = same
            .find_map(|scope| scope.get(&name.text))
            .map(|found| found.1)
        {
            let place = self.sources.position(first);
            self.report(
                Diagnostic::new(
                    codes::NAME_DECLARED_TWICE,
                    name.span,
                    format!("'{}' is declared twice", name.text),
                )
                .note(format!("first declared in line {}", place.line))
                .help("give one of the two another name"),
            );
            return;
        }
        self.scopes[innermost].set(&name.text, entity, name.span);
    }

    /// A new local of the body that is being checked.
    pub(super) fn new_local(&mut self, ty: Type) -> LocalId {
        self.locals.push(Local {
            ty,
            addressed: false,
            reference: false,
        });
        LocalId(self.locals.len() as u32 - 1)
    }

    /// Notes that a place is referred to, so that it must lie in memory.
    pub(super) fn mark_addressed(&mut self, expr: &Expr) {
        match &expr.kind {
            Kind::Variable(Place {
                root: Root::Local(local),
                ..
            }) => self.locals[local.0 as usize].addressed = true,
            Kind::Index(Element { array: inner, .. })
            | Kind::Field { record: inner, .. }
            | Kind::Assign(inner, _)
            | Kind::Compound(_, inner, _)
            | Kind::Step { target: inner, .. } => self.mark_addressed(inner),
            Kind::Ternary(_, then, otherwise) => {
                self.mark_addressed(then);
                self.mark_addressed(otherwise);
            }
            _ => {}
        }
    }

    /// A builder for code over the given locals.
    pub(super) fn builder_over(&mut self, locals: Vec<Local>) -> Builder<'_> {
        Builder::new(&mut self.world.network, &mut self.world.images, locals)
    }

    /// A builder for code over the locals so far; these are its parameters.
    pub(super) fn builder(&mut self, parameters: &[LocalId]) -> Builder<'_> {
        let mut builder = self.builder_over(self.locals.clone());
        builder.select_parameters(parameters);
        builder
    }

    /// Room for a variable of the state, with the given initial words and the names of its parts.
    pub(super) fn allocate(
        &mut self,
        name: &str,
        declared: Span,
        ty: &Type,
        meta: bool,
        words: &[i32],
    ) -> Place {
        let full_name = match &self.process {
            Some((_, process)) => format!("{process}.{name}"),
            None => name.to_owned(),
        };
        let region = if meta {
            &mut self.world.initial_meta
        } else {
            &mut self.world.initial
        };
        let offset = region.len() as u32;
        region.extend_from_slice(words);
        let base = Size {
            words: if meta {
                super::typed::META_WORDS + offset
            } else {
                offset
            },
            clocks: self.world.network.clocks.len() as u32,
            channels: self.world.network.channels.len() as u32,
        };
        let owner = self.process.as_ref().map(|(process, _)| *process);
        // What is left out has no value that could be shown.
        if !words.is_empty() && self.cause_of(declared).is_none() {
            self.world.network.layout.variables.push(Variable {
                name: full_name.clone(),
                owner,
                offset: base.words,
                shape: super::layout::shape(ty),
                meta,
            });
        }
        self.add_parts(&full_name, ty, owner, &mut Vec::new());
        let clocks = &mut self.world.network.chances.clocks;
        super::layout::real_clocks(ty, base.words, clocks);
        Place {
            root: Root::State,
            base,
            mutable: true,
            declared: declared_at(ty, declared),
        }
    }

    /// Adds the clocks and channels of a variable.
    fn add_parts(
        &mut self,
        name: &str,
        ty: &Type,
        owner: Option<ProcessId>,
        coordinates: &mut Vec<Coordinate>,
    ) {
        match ty {
            Type::Clock { .. } | Type::RealClock => {
                // A real clock lies among the words; its name is for people.
                let of_zones = Some(&*coordinates).filter(|_| ty.is_clock());
                self.world.network.clocks.push(Clock {
                    name: name.to_owned(),
                    owner,
                    hybrid: *ty == Type::Clock { hybrid: true },
                    coordinates: of_zones.cloned().unwrap_or_default(),
                });
                self.world.network.initial_clocks.push(0);
            }
            Type::Channel { urgent, broadcast } => self.world.network.channels.push(Channel {
                name: name.to_owned(),
                broadcast: *broadcast,
                urgent: *urgent,
                priority: 0,
            }),
            Type::Array(array) if ty.any(&Type::is_named_part) => {
                for i in 0..array.index.length {
                    let index = i64::from(array.index.first) + i64::from(i);
                    let name = format!("{name}[{index}]");
                    coordinates.extend(array.index.set.map(|set| Coordinate {
                        set,
                        member: i,
                        stride: array.part.size().clocks,
                    }));
                    self.add_parts(&name, &array.part, owner, coordinates);
                    if array.index.set.is_some() {
                        coordinates.pop();
                    }
                }
            }
            Type::Struct(record) => {
                for (field, ty) in &record.fields {
                    self.add_parts(&format!("{name}.{field}"), ty, owner, coordinates);
                }
            }
            _ => {}
        }
    }

    /// Runs a function that writes `words` words to the start of an otherwise empty state.
    pub(super) fn run(
        &mut self,
        function: FunctionId,
        words: u32,
    ) -> Result<Vec<i32>, RunTimeErrorKind> {
        let state = vec![0; words as usize];
        let result = self.run_on(function, state, &mut Vec::new());
        result.map_err(|error| error.kind)
    }

    /// Warns that what is computed while the model is loaded wrapped round.
    fn constant_wraps(&mut self, site: SiteId) {
        let first = &mut self.world.network.wrapped_constant;
        *first = Some(first.map_or(site, |first| first.min(site)));
        let span = self.world.network.sites[site.0 as usize].span;
        self.report(
            Diagnostic::new(
                codes::CONSTANT_WRAPS,
                span,
                "this does not fit into 32 bits, and wraps round",
            )
            .help("use smaller numbers; with --overflow error every query ends in an error here"),
        );
    }

    /// Runs a function on the words of a state, and gives them back; what it assigns to clocks is
    /// appended.
    pub(super) fn run_on(
        &mut self,
        function: FunctionId,
        mut state: Vec<i32>,
        assignments: &mut Vec<EmittedAssignment>,
    ) -> Result<Vec<i32>, RunTimeError> {
        let network = &self.world.network;
        let functions = excerpt(&network.functions, function);
        let interpreter = Interpreter::new(&functions, &network.constants);
        let mut context = Context {
            state: &mut state,
            constraints: &mut Vec::new(),
            assignments,
        };
        let left = CONSTANT_ROUND_LIMIT.saturating_sub(self.world.constant_rounds);
        let (result, rounds) = interpreter.call_within(left, FunctionId(0), &[], &mut context);
        self.world.constant_rounds += rounds;
        if let Some(site) = interpreter.wraps().first() {
            self.constant_wraps(site);
        }
        result.map(|_| state)
    }
}

/// A function and all that it calls, as a program of its own that begins with it.
fn excerpt(functions: &[Function], root: FunctionId) -> Vec<Function> {
    let mut numbers = FxHashMap::from_iter([(root, FunctionId(0))]);
    let mut wanted = vec![root];
    let mut program = Vec::new();
    while let Some(&next) = wanted.get(program.len()) {
        let mut function = functions[next.0 as usize].clone();
        let blocks = function.blocks.iter_mut();
        for instruction in blocks.flat_map(|block| &mut block.instructions) {
            if let Instruction::Call { function, .. } = instruction {
                let called = *function;
                *function = *numbers.entry(called).or_insert_with(|| {
                    wanted.push(called);
                    FunctionId(wanted.len() as u32 - 1)
                });
            }
        }
        program.push(function);
    }
    program
}
