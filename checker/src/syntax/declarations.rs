//! Declarations: types, variables, functions, priorities, hooks; what is recognised and not
//! supported is recorded.

use super::ast::{
    Block, Declaration, DynamicTemplate, Expr, Function, Import, ImportedFunction, Initialiser,
    Name, TypeExpr, Variable,
};
use super::codes;
use super::keywords::Dialect;
use super::lexer::TokenKind;
use super::parser::Parser;
use crate::diagnostics::Diagnostic;

/// Where a declaration stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    /// Outside everything: all declarations may stand there.
    Global,
    /// In a template: types, variables, functions.
    Template,
    /// In a function: types and variables.
    Function,
}

impl Parser<'_> {
    /// The declarations of a template, to the end of the text or a word that begins the next part
    /// of a process.
    pub(super) fn local_declarations(&mut self) -> Vec<Declaration> {
        let mut declarations = Vec::new();
        while !self.at_end() && !self.at(TokenKind::RightBrace) && !self.at_process_part() {
            self.declaration(Scope::Template, &mut declarations);
        }
        declarations
    }

    fn at_process_part(&self) -> bool {
        matches!(
            self.word(),
            "state" | "branchpoint" | "commit" | "init" | "trans"
        ) || (self.at_word("urgent") && !matches!(self.word_at(1), "chan" | "broadcast" | "clock"))
    }

    /// Reads one declaration, or reports and recovers; it consumes at least one token.
    pub(super) fn declaration(&mut self, scope: Scope, declarations: &mut Vec<Declaration>) {
        let before = self.progress();
        let is_new = self.dialect == Dialect::New;
        if is_new && scope != Scope::Global && self.at_global_only() {
            let message = format!("`{}` belongs to the global declarations", self.word());
            self.error(codes::UNEXPECTED_TOKEN, self.here(), message);
        }
        match self.word() {
            "typedef" if is_new => self.typedef(declarations),
            "before_update" | "after_update" if is_new => self.update_hook(declarations),
            "import" if is_new => self.import(declarations),
            "dynamic" if is_new => self.dynamic_template(declarations),
            "chan" if is_new && self.word_at(1) == "priority" => {
                self.channel_priority(declarations);
            }
            "const" if self.at_old_constant() => self.old_constants(declarations),
            _ if self.at_type_word() || self.is_name_at(0) => {
                self.variables_or_function(scope, declarations);
            }
            _ if self.at(TokenKind::Semicolon) => self.empty_declaration(),
            _ => {
                self.expected("a declaration");
                if self.at(TokenKind::Word) {
                    self.bump();
                }
                self.recover();
            }
        }
        if self.progress() == before {
            self.bump();
        }
    }

    fn at_global_only(&self) -> bool {
        match self.word() {
            "before_update" | "after_update" | "import" | "dynamic" => true,
            "chan" => self.word_at(1) == "priority",
            _ => false,
        }
    }

    /// `};` behind a function: a common slip, which UPPAAL refuses.
    fn empty_declaration(&mut self) {
        let message = "a `;` that ends nothing";
        self.report(
            Diagnostic::new(codes::UNEXPECTED_TOKEN, self.here(), message)
                .help("remove it; no `;` is needed after the `}` of a function or process"),
        );
        self.bump();
    }

    fn typedef(&mut self, declarations: &mut Vec<Declaration>) {
        let before = self.progress();
        self.bump();
        let ty = self.type_expr();
        self.declarators("the name of the type", |_, name, dimensions| {
            declarations.push(Declaration::Typedef {
                ty: ty.clone(),
                name,
                dimensions,
            });
        });
        self.end_of_declaration("after the type definition", before);
    }

    fn update_hook(&mut self, declarations: &mut Vec<Declaration>) {
        let span = self.here();
        let is_before = self.at_word("before_update");
        self.bump();
        self.expect(TokenKind::LeftBrace, "before the updates");
        let updates = self.expressions_until(TokenKind::RightBrace);
        self.closing(TokenKind::RightBrace, "after the updates");
        declarations.push(if is_before {
            Declaration::BeforeUpdate(updates, span)
        } else {
            Declaration::AfterUpdate(updates, span)
        });
    }

    /// `chan priority a, b[0] < default;`
    fn channel_priority(&mut self, declarations: &mut Vec<Declaration>) {
        let before = self.progress();
        let start = self.here();
        self.bump();
        self.bump();
        let mut levels = vec![vec![self.channel_of_priority()]];
        loop {
            if self.eat(TokenKind::Comma) {
                let channel = self.channel_of_priority();
                if let Some(level) = levels.last_mut() {
                    level.push(channel);
                }
            } else if self.eat(TokenKind::Less) {
                levels.push(vec![self.channel_of_priority()]);
            } else {
                break;
            }
        }
        let span = self.since(start);
        declarations.push(Declaration::ChannelPriority { levels, span });
        self.end_of_declaration("after the priorities", before);
    }

    fn channel_of_priority(&mut self) -> Option<Expr> {
        if self.eat_word("default") {
            return None;
        }
        // Above the comparisons, because `<` separates the levels.
        Some(self.expression_at(super::expressions::level::POSTFIX))
    }

    /// `dynamic T(parameters);`
    fn dynamic_template(&mut self, declarations: &mut Vec<Declaration>) {
        let before = self.progress();
        self.bump();
        let name = self.name("the name of the template");
        let parameters = self.parameter_list();
        declarations.push(Declaration::Dynamic(DynamicTemplate { name, parameters }));
        self.end_of_declaration("after the declaration", before);
    }

    /// `import "library" { … };`
    fn import(&mut self, declarations: &mut Vec<Declaration>) {
        let before = self.progress();
        self.bump();
        let named = self.at(TokenKind::String).then(|| self.bump());
        let Some(named) = named else {
            self.expected("the name of the library, in quotes");
            self.recover();
            return;
        };
        let text = self.text_of(named);
        let library = Name {
            text: text[1..text.len() - 1].to_owned(),
            span: self.span_of(named),
        };
        let mut functions = Vec::new();
        if self.expect(TokenKind::LeftBrace, "before the imported functions") {
            while !self.at_end() && !self.at(TokenKind::RightBrace) {
                let start = self.progress();
                functions.push(self.imported_function());
                if self.progress() == start {
                    self.bump();
                }
            }
            self.expect(TokenKind::RightBrace, "after the imported functions");
        }
        declarations.push(Declaration::Import(Import { library, functions }));
        self.end_of_declaration("after the import", before);
    }

    /// `[name =] type symbol(parameters);`
    fn imported_function(&mut self) -> ImportedFunction {
        let before = self.progress();
        let has_name = self.is_name_at(0) && self.peek(1).kind == TokenKind::Assign;
        let name = has_name.then(|| {
            let name = self.declared_name("the name of the function");
            self.bump();
            name
        });
        let return_type = self.type_expr();
        let symbol = if has_name {
            // It names nothing in the model.
            self.name("the name of the function in the library")
        } else {
            self.declared_name("the name of the function")
        };
        let parameters = self.parameter_list();
        self.end_of_declaration("after the imported function", before);
        ImportedFunction {
            return_type,
            name: name.unwrap_or_else(|| symbol.clone()),
            symbol,
            parameters,
        }
    }

    /// `const n 3`: a name that is not followed by another one cannot be a type.
    fn at_old_constant(&self) -> bool {
        self.is_name_at(1)
            && match self.peek(2).kind {
                TokenKind::Int
                | TokenKind::LeftBrace
                | TokenKind::Table
                | TokenKind::Minus
                | TokenKind::Comma => true,
                TokenKind::LeftBracket | TokenKind::Word => self.dialect == Dialect::Old,
                _ => false,
            }
    }

    fn old_constants(&mut self, declarations: &mut Vec<Declaration>) {
        let before = self.progress();
        let ty = self.old_constant_type();
        self.declarators("the name of a constant", |parser, name, dimensions| {
            parser.eat(TokenKind::Assign);
            let initialiser = Some(parser.initialiser());
            declarations.push(Declaration::Variable(Variable {
                ty: ty.clone(),
                name,
                dimensions,
                initialiser,
            }));
        });
        self.end_of_declaration("after the constants", before);
    }

    fn variables_or_function(&mut self, scope: Scope, declarations: &mut Vec<Declaration>) {
        let before = self.progress();
        let ty = self.type_expr();
        let is_function =
            self.kind() == TokenKind::Word && self.peek(1).kind == TokenKind::LeftParenthesis;
        if is_function && self.dialect == Dialect::New {
            if scope == Scope::Function {
                let message = "a function inside a function";
                self.report(
                    Diagnostic::new(codes::UNEXPECTED_TOKEN, self.here(), message)
                        .help("declare it beside the other one"),
                );
            }
            let function = self.function(ty);
            declarations.push(Declaration::Function(function));
            return;
        }
        self.variables(&ty, declarations);
        self.end_of_declaration("after the declaration", before);
    }

    fn function(&mut self, return_type: TypeExpr) -> Function {
        let name = self.declared_name("the name of the function");
        let parameters = self.parameter_list();
        let body = if self.at(TokenKind::LeftBrace) {
            self.block()
        } else {
            self.expected("`{` before the body of the function");
            self.recover();
            Block::default()
        };
        Function {
            return_type,
            name,
            parameters,
            body,
        }
    }

    fn variables(&mut self, ty: &TypeExpr, declarations: &mut Vec<Declaration>) {
        self.declarators("the name of a variable", |parser, name, dimensions| {
            let assigned = parser.eat(TokenKind::Assign) || parser.eat(TokenKind::ColonAssign);
            let initialiser = assigned.then(|| parser.initialiser());
            declarations.push(Declaration::Variable(Variable {
                ty: ty.clone(),
                name,
                dimensions,
                initialiser,
            }));
        });
    }

    pub(super) fn initialiser(&mut self) -> Initialiser {
        if self.at(TokenKind::Table) {
            let table = self.bump();
            return Initialiser::Table(self.span_of(table));
        }
        if !self.at(TokenKind::LeftBrace) {
            return Initialiser::Expr(self.expression());
        }
        match self.nested(Parser::initialiser_list) {
            Some(list) => list,
            None => Initialiser::Expr(self.error_expr()),
        }
    }

    fn initialiser_list(&mut self) -> Initialiser {
        let start = self.here();
        self.bump();
        let mut items = Vec::new();
        self.comma_separated(|parser| {
            let named = parser.is_name_at(0) && parser.peek(1).kind == TokenKind::Colon;
            let name = named.then(|| {
                let name = parser.name("the name of a field");
                parser.bump();
                name
            });
            items.push((name, parser.initialiser()));
        });
        self.closing(TokenKind::RightBrace, "after the values");
        Initialiser::List(items, self.since(start))
    }
}
