//! Calls: of functions of the model and of the built-in ones.

use std::sync::Arc;

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::expressions::read;
use super::operators::folded_math;
use super::scope::Entity;
use super::typed::{Expr, Kind, Parameter, Signature};
use super::types::Type;
use crate::builtins::{self, Builtin};
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::arithmetic;
use crate::ir::Distribution;
use crate::ir::{FunctionId, RegisterType};
use crate::syntax::ast::{self, ExprKind};

impl Checker<'_> {
    /// `callee(arguments)`
    pub(super) fn call(&mut self, callee: &ast::Expr, arguments: &[ast::Expr], span: Span) -> Expr {
        let ExprKind::Name(name) = &callee.kind else {
            return self.call_of_member(callee, arguments, span);
        };
        match self.lookup(name) {
            Some(Entity::Function(function, signature)) => {
                self.call_function(function, &signature, arguments, span)
            }
            Some(Entity::Broken) => {
                self.check_all(arguments);
                Expr::error(span)
            }
            Some(Entity::OpenFunction) => {
                self.check_all(arguments);
                self.error(
                    codes::FUNCTION_RECURSIVE,
                    span,
                    format!("'{name}' calls itself"),
                    "use a loop",
                )
            }
            Some(entity) => {
                self.check_all(arguments);
                let is_array = matches!(
                    &entity,
                    Entity::Variable {
                        ty: Type::Array(_),
                        ..
                    }
                );
                let help = if is_array {
                    format!("write the index of an array in brackets: {name}[0]")
                } else {
                    String::from("only functions can be called")
                };
                self.error(
                    codes::CALL_OF_NO_FUNCTION,
                    callee.span,
                    format!("'{name}' is {}, not a function", entity.kind()),
                    &help,
                );
                Expr::error(span)
            }
            None => self.call_builtin(name, callee.span, arguments, span),
        }
    }

    fn check_all(&mut self, arguments: &[ast::Expr]) -> Vec<Expr> {
        arguments
            .iter()
            .map(|argument| self.expression(argument))
            .collect()
    }

    /// A call of a function that is known.
    pub(super) fn call_function(
        &mut self,
        function: FunctionId,
        signature: &Arc<Signature>,
        arguments: &[ast::Expr],
        span: Span,
    ) -> Expr {
        if arguments.len() != signature.parameters.len() {
            self.check_all(arguments);
            let wanted = signature.parameters.len();
            return self.wrong_count(&signature.name, wanted, arguments.len(), span);
        }
        let mut converted = Vec::with_capacity(arguments.len());
        for (argument, parameter) in arguments.iter().zip(&signature.parameters) {
            let before = self.unknowns.len();
            let argument = self.place(argument);
            let argument = if parameter.reference {
                self.reference_left_out(argument, parameter)
            } else {
                argument
            };
            let argument = self.argument(argument, parameter);
            converted.extend(argument.map(|argument| {
                self.value_left_out(argument, parameter, signature.may_write(), before)
            }));
        }
        if converted.len() < signature.parameters.len() || signature.result.is_error() {
            return Expr::error(span);
        }
        if let Some(unknown) = &signature.unknown {
            self.unknowns.push(unknown.diagnostic.clone());
        }
        let kind = Kind::Call {
            function,
            signature: Arc::clone(signature),
            arguments: converted,
        };
        Expr::new(kind, signature.result.clone(), span)
    }

    pub(super) fn wrong_count(
        &mut self,
        name: &str,
        wanted: usize,
        given: usize,
        span: Span,
    ) -> Expr {
        self.error(
            codes::ARGUMENT_COUNT,
            span,
            format!("'{name}' takes {wanted} arguments, but {given} are given"),
            "give one argument for each parameter",
        )
    }

    /// An argument by reference. What refers to a variable that is left out must be left out
    /// itself, and the other way round.
    fn reference_left_out(&mut self, argument: Expr, parameter: &Parameter) -> Expr {
        self.refers_to(&argument);
        let is_left_out = self.cause_of(parameter.declared).cloned();
        if self.target_left_out(&argument).is_some() {
            if is_left_out.is_none()
                && let Some(cause) = self.unknowns.last().cloned()
            {
                // What would be said of the argument stays.
                self.candidate_at(parameter.declared, &cause);
                self.unknowns.push(cause);
            }
            return self.place_left_out(argument);
        }
        if let Some(cause) = is_left_out
            && !parameter.constant
        {
            self.candidate(argument.variable(), &cause);
            let span = argument.span;
            self.unknowns.push(Diagnostic { span, ..cause });
        }
        argument
    }

    /// A converted argument by value: where the parameter is left out, it does not matter which.
    fn value_left_out(
        &mut self,
        argument: Expr,
        parameter: &Parameter,
        has_effect: bool,
        before: usize,
    ) -> Expr {
        if parameter.reference || !argument.is_unknown() {
            return argument;
        }
        if has_effect {
            self.takes_unknown(parameter.declared, &argument, before);
        }
        if self.cause_of(parameter.declared).is_some()
            && argument.ty == Type::Double
            && !argument.has_effect()
        {
            self.unknowns.truncate(before);
            return Expr::new(Kind::Double(0.0), Type::Double, argument.span);
        }
        argument
    }

    fn argument(&mut self, argument: Expr, parameter: &Parameter) -> Option<Expr> {
        if argument.is_error() || parameter.ty.is_error() {
            return None;
        }
        if parameter.ty == Type::String {
            return self.text(argument);
        }
        if !parameter.reference {
            return self.converted(read(argument), &parameter.ty);
        }
        let is_place = argument.is_place();
        let is_readable = is_place && parameter.ty.holds(&argument.ty);
        if parameter.constant && !is_readable {
            // A const reference also takes values; they get a place of their own.
            let argument = self.converted(argument, &parameter.ty)?;
            if argument.is_place() && argument.ty.is_register() {
                self.mark_addressed(&argument);
            }
            return Some(argument);
        }
        if !parameter.constant && !self.expect_mutable(&argument) {
            return None;
        }
        let fits =
            argument.ty.is_equivalent(&parameter.ty) && parameter.ty.accepts_channel(&argument.ty);
        if !(parameter.constant || fits) {
            self.report(
                Diagnostic::new(
                    codes::REFERENCE_MISMATCHED,
                    argument.span,
                    format!(
                        "the reference parameter '{}' needs {}, but this is {}",
                        parameter.name,
                        parameter.ty.described(),
                        argument.ty.described()
                    ),
                )
                .help("a reference needs a variable of the same type, range included, and a channel with the same prefixes as the parameter"),
            );
            return None;
        }
        self.mark_addressed(&argument);
        Some(argument)
    }

    fn call_builtin(
        &mut self,
        name: &str,
        name_span: Span,
        arguments: &[ast::Expr],
        span: Span,
    ) -> Expr {
        let arguments = self.check_all(arguments);
        let function = match builtins::named(name) {
            Some(Builtin::Math(function)) => function,
            Some(Builtin::Truncation) => return self.truncation(arguments, span),
            Some(Builtin::Random | Builtin::OldRandom) if self.reading == Reading::Stochastic => {
                return self.drawn(name, arguments, span);
            }
            Some(Builtin::Random | Builtin::OldRandom) => {
                return self.random(name, name_span, arguments);
            }
            None | Some(Builtin::Missing) => {
                self.unknown_name(name, name_span);
                return Expr::error(span);
            }
        };
        let parameters = function.parameters();
        if arguments.len() != parameters.len() {
            return self.wrong_count(name, parameters.len(), arguments.len(), span);
        }
        let mut converted = Vec::new();
        for (argument, &register) in arguments.into_iter().zip(parameters) {
            let wanted = if register == RegisterType::Double {
                Type::Double
            } else {
                Type::ANY_INT
            };
            converted.extend(self.converted(argument, &wanted));
        }
        if converted.len() < parameters.len() {
            return Expr::error(span);
        }
        folded_math(function, converted, span)
    }

    /// A random number.
    fn drawn(&mut self, name: &str, arguments: Vec<Expr>, span: Span) -> Expr {
        let Some(distribution) = Distribution::named(name) else {
            self.unknown_name(name, span);
            return Expr::error(span);
        };
        if arguments.len() != distribution.arity() {
            return self.wrong_count(name, distribution.arity(), arguments.len(), span);
        }
        let wanted = arguments.len();
        let converted: Vec<Expr> = arguments
            .into_iter()
            .filter_map(|argument| self.converted(argument, &Type::Double))
            .collect();
        if converted.len() < wanted {
            return Expr::error(span);
        }
        Expr::new(Kind::Random(distribution, converted), Type::Double, span)
    }

    /// A random number, which nothing may depend on.
    fn random(&mut self, name: &str, name_span: Span, arguments: Vec<Expr>) -> Expr {
        let diagnostic = Diagnostic::new(
            codes::RANDOM_UNSUPPORTED,
            name_span,
            format!(
                "'{name}' is a random function: these exist in statistical model checking only"
            ),
        );
        let diagnostic = diagnostic.help("use select, or several edges, for a choice");
        if arguments.iter().any(Expr::is_error) {
            return Expr::error(name_span);
        }
        if self.is_query || arguments.iter().any(Expr::has_effect) {
            self.report(diagnostic);
            return Expr::error(name_span);
        }
        let from = arguments.into_iter().next();
        let from = from.unwrap_or_else(|| Expr::int(0, Type::ANY_INT, name_span));
        self.unknown(diagnostic, from, Type::Double)
    }

    /// `fint(argument)`
    fn truncation(&mut self, mut arguments: Vec<Expr>, span: Span) -> Expr {
        let argument = match (arguments.pop(), arguments.len()) {
            (Some(argument), 0) => argument,
            (argument, rest) => {
                let given = rest + usize::from(argument.is_some());
                return self.wrong_count("fint", 1, given, span);
            }
        };
        if argument.is_error() || argument.ty.is_integral() {
            return Expr { span, ..argument };
        }
        let Some(argument) = self.converted(argument, &Type::Double) else {
            return Expr::error(span);
        };
        if let Kind::Double(value) = argument.kind
            && let Ok(value) = arithmetic::truncate(value)
        {
            return Expr::int(value, Type::ANY_INT, span);
        }
        Expr::new(Kind::ToInteger(Box::new(argument)), Type::ANY_INT, span)
    }
}
