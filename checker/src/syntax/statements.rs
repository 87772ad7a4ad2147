//! Statements of functions.

use super::ast::{Block, Expr, Statement};
use super::codes;
use super::declarations::Scope;
use super::keywords::Dialect;
use super::lexer::TokenKind;
use super::parser::Parser;
use crate::diagnostics::Diagnostic;

impl Parser<'_> {
    /// `{ declarations statements }`; the current token is the brace.
    pub(super) fn block(&mut self) -> Block {
        let mut block = Block::default();
        self.bump();
        self.nested(|parser| parser.block_items(&mut block));
        self.expect(TokenKind::RightBrace, "at the end of the block");
        block
    }

    fn block_items(&mut self, block: &mut Block) {
        while !self.at_end() && !self.at(TokenKind::RightBrace) && !self.at_missing_brace() {
            let before = self.progress();
            if self.at_declaration() {
                if !block.statements.is_empty() {
                    let message = "declaration after a statement";
                    self.report(
                        Diagnostic::new(codes::UNEXPECTED_TOKEN, self.here(), message)
                            .help("move it to the start of the block"),
                    );
                }
                self.declaration(Scope::Function, &mut block.declarations);
            } else {
                block.statements.push(self.statement());
            }
            if self.progress() == before {
                self.bump();
            }
        }
    }

    /// A word that no statement can begin with: the brace before it is missing.
    fn at_missing_brace(&self) -> bool {
        matches!(self.word(), "process" | "system") && self.dialect == Dialect::New
    }

    fn at_declaration(&self) -> bool {
        self.at_type_word()
            || matches!(self.word(), "typedef" | "before_update" | "after_update")
            || (self.is_name_at(0) && self.is_name_at(1))
    }

    /// A statement; it recovers by itself.
    fn statement(&mut self) -> Statement {
        match self.nested(Parser::statement_inside) {
            Some(statement) => statement,
            None => Statement::Empty,
        }
    }

    fn statement_inside(&mut self) -> Statement {
        match self.kind() {
            TokenKind::Semicolon => {
                self.bump();
                return Statement::Empty;
            }
            TokenKind::LeftBrace => return Statement::Block(self.block()),
            _ => {}
        }
        match self.word() {
            "for" => self.for_statement(),
            "while" => self.while_statement(),
            "do" => self.do_statement(),
            "if" => self.if_statement(),
            "return" => {
                let span = self.here();
                self.bump();
                let value = (!self.at(TokenKind::Semicolon)).then(|| self.expression());
                self.end_of_statement();
                Statement::Return(value, self.since(span))
            }
            "assert" => {
                let span = self.here();
                self.bump();
                let condition = self.expression();
                self.end_of_statement();
                Statement::Assert(condition, self.since(span))
            }
            "switch" if self.peek(1).kind == TokenKind::LeftParenthesis => self.reserved(),
            "break" | "continue" if self.peek(1).kind == TokenKind::Semicolon => self.reserved(),
            _ => {
                let expr = self.expression();
                self.end_of_statement();
                Statement::Expr(expr)
            }
        }
    }

    fn end_of_statement(&mut self) {
        if !self.eat(TokenKind::Semicolon) {
            self.missing("`;` after the statement");
            self.recover();
        }
    }

    fn reserved(&mut self) -> Statement {
        let message = format!("`{}` is reserved and has no meaning yet", self.word());
        self.report(
            Diagnostic::new(codes::RESERVED_STATEMENT, self.here(), message)
                .help("use `if` and the condition of the loop"),
        );
        self.bump();
        self.recover();
        Statement::Empty
    }

    /// `( condition )`
    fn condition(&mut self) -> Expr {
        let is_open = self.expect(TokenKind::LeftParenthesis, "before the condition");
        let condition = self.expression();
        if is_open {
            self.closing(TokenKind::RightParenthesis, "after the condition");
        }
        condition
    }

    fn for_statement(&mut self) -> Statement {
        self.bump();
        self.expect(TokenKind::LeftParenthesis, "after `for`");
        if self.at_word("int") {
            self.expected_with_hint(
                "the name of a variable",
                "write `for (i : int[0,2])`, or declare the variable before the loop",
            );
            self.bump();
        }
        if self.is_name_at(0) && self.peek(1).kind == TokenKind::Colon {
            let name = self.declared_name("the name of the loop variable");
            self.bump();
            let ty = self.type_expr();
            self.closing(TokenKind::RightParenthesis, "after the type");
            let body = Box::new(self.statement());
            return Statement::Iterate { name, ty, body };
        }
        let init = self.expressions_until(TokenKind::Semicolon);
        self.expect(TokenKind::Semicolon, "after the first part of `for`");
        let condition = (!self.at(TokenKind::Semicolon)).then(|| self.expression());
        self.expect(TokenKind::Semicolon, "after the condition of `for`");
        let step = self.expressions_until(TokenKind::RightParenthesis);
        self.closing(TokenKind::RightParenthesis, "after the last part of `for`");
        let body = self.statement();
        for_loop(init, condition, step, body)
    }

    pub(super) fn expressions_until(&mut self, end: TokenKind) -> Vec<Expr> {
        if self.at(end) {
            Vec::new()
        } else {
            self.expression_list()
        }
    }

    fn while_statement(&mut self) -> Statement {
        self.bump();
        let condition = self.condition();
        Statement::While(condition, Box::new(self.statement()))
    }

    fn do_statement(&mut self) -> Statement {
        self.bump();
        let body = Box::new(self.statement());
        if !self.eat_word("while") {
            self.missing("`while` after the body of `do`");
            let condition = self.error_expr();
            return Statement::DoWhile(body, condition);
        }
        let condition = self.condition();
        self.end_of_statement();
        Statement::DoWhile(body, condition)
    }

    fn if_statement(&mut self) -> Statement {
        let mut branches = Vec::new();
        loop {
            self.bump();
            let condition = self.condition();
            branches.push((condition, self.statement()));
            if !self.eat_word("else") {
                return Statement::If(branches, None);
            }
            if self.word() != "if" {
                return Statement::If(branches, Some(Box::new(self.statement())));
            }
        }
    }
}

/// A loop whose first and last part may be lists. The tree has one expression in each place, so the
/// others become statements before the loop and at the end of its body; there is no `continue` that
/// could tell the difference.
fn for_loop(
    mut init: Vec<Expr>,
    condition: Option<Expr>,
    mut step: Vec<Expr>,
    body: Statement,
) -> Statement {
    let last_step = step.pop();
    let body = in_sequence(vec![body], step, None);
    let last_init = init.pop();
    let for_loop = Statement::For {
        init: last_init,
        condition,
        step: last_step,
        body: Box::new(body),
    };
    in_sequence(Vec::new(), init, Some(for_loop))
}

fn in_sequence(first: Vec<Statement>, then: Vec<Expr>, last: Option<Statement>) -> Statement {
    let is_alone = then.is_empty();
    let mut statements = first;
    statements.extend(then.into_iter().map(Statement::Expr));
    statements.extend(last);
    if is_alone {
        return statements.pop().unwrap_or(Statement::Empty);
    }
    Statement::Block(Block {
        statements,
        ..Block::default()
    })
}
