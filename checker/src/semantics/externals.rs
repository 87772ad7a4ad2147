//! Functions of libraries that a model imports: their static rules, and the functions of the
//! network that call them.
//!
//! A function of a library has a function of its own in the network, which passes the arguments on
//! and checks the result. So the rest of the model calls it as any other function. If its library
//! is not loaded, that function ends in an error.
//!
//! Only statistical queries call them: what they do on sets of states cannot be known.
//!
//! Source: UPPAAL's documentation, "External Functions". Where we differ:
//! * The library is loaded only if the user allows it (see [`Libraries`]).
//! * Channels, and the type `ptr_t`, are not passed on.
//! * A variable that is no array can be passed by reference too.

use std::path::Path;
use std::sync::Arc;

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::scope::{Entity, Scope};
use super::typed::{Effects, Expr, Kind, Parameter, Signature, Unknown};
use super::types::Type;
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::{Libraries, LibraryError};
use crate::ir::{
    ExternalId, ExternalLibrary, ExternalParameter, ExternalSignature, ExternalType, FunctionId,
};
use crate::syntax::ast;

/// The hooks of a library that are run around queries.
const BEGIN: &str = "__ON_BEGIN__";
const END: &str = "__ON_END__";

impl Checker<'_> {
    /// Declares the functions of a library.
    pub(super) fn import(&mut self, import: &ast::Import) {
        let name = unescaped(&import.library.text);
        let file = self.libraries.find(&name);
        let mut library = ExternalLibrary {
            name: name.to_string(),
            functions: Vec::new(),
            is_loaded: file.is_some(),
            begin: None,
            end: None,
        };
        if let Some(file) = &file {
            let hook = |hook| Libraries::function(file, hook, &ExternalSignature::default()).ok();
            (library.begin, library.end) = (hook(BEGIN), hook(END));
        }
        for function in &import.functions {
            library.functions.push(function.name.text.clone());
            let entity = self.imported_function(function, &import.library, file.as_deref());
            self.declare(&function.name, entity.unwrap_or(Entity::Broken));
        }
        self.world.network.externals.push(library);
    }

    fn imported_function(
        &mut self,
        function: &ast::ImportedFunction,
        library: &ast::Name,
        file: Option<&Path>,
    ) -> Option<Entity> {
        let outer_locals = std::mem::take(&mut self.locals);
        let result = self.result_type(&function.return_type);
        self.function_span = function.name.span;
        self.scopes.push(Scope::default());
        let parameters: Vec<Parameter> = function
            .parameters
            .iter()
            .map(|parameter| {
                let ty = self.dimensioned(&parameter.ty, &parameter.dimensions);
                if ty != Type::String {
                    self.check_parameter_type(parameter, &ty);
                }
                self.parameter_of_type(parameter, ty)
            })
            .collect();
        self.scopes.pop();
        let locals = std::mem::replace(&mut self.locals, outer_locals);
        let types = self.external_signature(function, &parameters, &result)?;
        let id = match file {
            None => None,
            Some(file) => match Libraries::function(file, &function.symbol.text, &types) {
                Ok(id) => Some(id),
                Err(error) => {
                    self.report_library(&error, function, library, file);
                    return None;
                }
            },
        };
        let mut signature = Signature {
            name: function.name.text.clone(),
            parameters,
            result,
            effects: Effects::default(),
            is_external: true,
            unknown: None,
        };
        if self.reading == Reading::Symbolic {
            let message = format!(
                "'{}' is a function of a library: only statistical queries call it",
                signature.name
            );
            let may_write = signature.may_write();
            let diagnostic = Diagnostic::new(codes::EXTERNAL_SYMBOLIC, function.name.span, message)
                .help("write the function in the language of the model");
            signature.unknown = Some(Unknown::of_external(diagnostic, may_write));
        }
        let held = std::mem::replace(&mut self.locals, locals);
        let lowered = self.lower_external(&signature, id, &types, function.name.span);
        self.locals = held;
        Some(Entity::Function(lowered, Arc::new(signature)))
    }

    fn lower_external(
        &mut self,
        signature: &Signature,
        id: Option<ExternalId>,
        types: &ExternalSignature,
        span: Span,
    ) -> FunctionId {
        if signature.unknown.is_some() || !self.can_lower() {
            return super::functions::NO_FUNCTION;
        }
        let locals = std::mem::take(&mut self.locals);
        let mut builder = self.builder_over(locals);
        builder.signature(&signature.parameters, &signature.result);
        builder.external(signature, id, types, span)
    }

    /// The type of an imported function in C; reports what has none.
    fn external_signature(
        &mut self,
        function: &ast::ImportedFunction,
        parameters: &[Parameter],
        result: &Type,
    ) -> Option<ExternalSignature> {
        let mut signature = ExternalSignature::default();
        let mut is_right = !result.is_error();
        signature.result = external_type(result);
        let is_value = signature.result.is_some();
        if !is_value && !matches!(result, Type::Void | Type::Error) {
            is_right = false;
            self.error(
                codes::EXTERNAL_SIGNATURE,
                function.return_type.span,
                format!("an imported function cannot return {}", result.described()),
                "return an integer, a truth value or a double, or nothing",
            );
        }
        for (parameter, written) in parameters.iter().zip(&function.parameters) {
            match external_parameter(parameter) {
                _ if parameter.ty.is_error() => is_right = false,
                Ok(kind) => signature.parameters.push(kind),
                Err(help) => {
                    is_right = false;
                    self.error(
                        codes::EXTERNAL_SIGNATURE,
                        written.name.span,
                        format!(
                            "{} cannot be given to an imported function{}",
                            parameter.ty.described(),
                            if parameter.reference { "" } else { " by value" }
                        ),
                        help,
                    );
                }
            }
        }
        is_right.then_some(signature)
    }

    fn report_library(
        &mut self,
        error: &LibraryError,
        function: &ast::ImportedFunction,
        library: &ast::Name,
        file: &Path,
    ) {
        let file = file.display();
        let diagnostic = match error {
            LibraryError::NoSymbol => Diagnostic::new(
                codes::EXTERNAL_MISSING,
                function.symbol.span,
                format!("{file} has no function '{}'", function.symbol.text),
            )
            .help(
                "write its name as the library exports it: C++ code needs extern \"C\"; as in \
                 `nm -D` of the library",
            ),
            LibraryError::NotLoaded(cause) => Diagnostic::new(
                codes::EXTERNAL_LIBRARY,
                library.span,
                format!("{file} is no library that can be loaded here"),
            )
            .note(cause.clone())
            .help("build it for this system and processor, with all that it needs"),
            LibraryError::Changed => Diagnostic::new(
                codes::EXTERNAL_LIBRARY,
                library.span,
                format!("{file} has changed since this process loaded it"),
            )
            .help("start again: a library stays loaded until the process ends"),
            LibraryError::NotCallable(cause) => Diagnostic::new(
                codes::EXTERNAL_LIBRARY,
                library.span,
                format!("functions of libraries cannot be called: {cause}"),
            )
            .help("use an engine that is built with its compiler"),
        };
        self.report(diagnostic);
    }

    /// A text for a constant or a parameter of that type.
    pub(super) fn text(&mut self, value: Expr) -> Option<Expr> {
        if value.is_error() {
            return None;
        }
        if matches!(value.kind, Kind::Text(_)) {
            return Some(value);
        }
        self.refused(
            codes::TYPE_MISMATCHED,
            value.span,
            format!("a text is needed, but this is {}", value.ty.described()),
            "write it in quotes, or name a constant of type string",
        )
    }
}

/// What a value of this type is in C.
fn external_type(ty: &Type) -> Option<ExternalType> {
    match ty {
        Type::Int { .. } => Some(ExternalType::Integer),
        Type::Bool => Some(ExternalType::Bool),
        // A clock is passed in the stochastic reading only, where it has words.
        Type::Double | Type::RealClock | Type::Clock { .. } => Some(ExternalType::Double),
        _ => None,
    }
}

/// What a parameter is in C; if it is nothing, what helps.
fn external_parameter(parameter: &Parameter) -> Result<ExternalParameter, &'static str> {
    let ty = &parameter.ty;
    if *ty == Type::String {
        return Ok(ExternalParameter::Text);
    }
    let (part, length) = match ty {
        Type::Array(array) if parameter.reference => (&array.part, array.index.length),
        Type::Array(_) => return Err("write & before the name"),
        other => (other, 1),
    };
    let of = external_type(part).ok_or(
        "pass an integer, a truth value, a double, a text, or an array of these but texts with one \
         dimension",
    )?;
    if !parameter.reference {
        return Ok(ExternalParameter::Value(of));
    }
    Ok(ExternalParameter::Pointer {
        of,
        length,
        stride: part.size().words,
        written: (!parameter.constant).then(|| part.bounds()),
    })
}

/// A text as written between quotes, without the backslashes that escape characters.
pub(super) fn unescaped(written: &str) -> Arc<str> {
    let mut text = String::with_capacity(written.len());
    let mut rest = written.chars();
    while let Some(next) = rest.next() {
        match next {
            '\\' => match rest.next() {
                Some('n') => text.push('\n'),
                Some('t') => text.push('\t'),
                Some(other) => text.push(other),
                None => text.push('\\'),
            },
            other => text.push(other),
        }
    }
    text.into()
}
