//! Statements.

use super::super::typed::{Expr, LocalId, Statement};
use super::super::types::Type;
use super::{Builder, Home, at, register_type};
use crate::diagnostics::Span;
use crate::ir::{Base, Instruction, RegisterType, RunTimeErrorKind, Terminator};

impl Builder<'_> {
    pub(super) fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Block(statements) => {
                for statement in statements {
                    self.statement(statement);
                }
            }
            Statement::Expr(expr) => self.effect(expr),
            Statement::Declare(local, initialisers) => self.declare(*local, initialisers),
            Statement::Loop { .. } => self.repeat(statement),
            Statement::Iterate { local, range, body } => {
                let place = Expr::bool(true, Span::default());
                self.count(*local, *range, &place, &mut |builder| {
                    builder.statement(body);
                });
            }
            Statement::If(branches, otherwise) => self.choose(branches, otherwise.as_deref()),
            Statement::Return(value) => self.give_back(value.as_ref()),
            Statement::Assert(condition, span) => {
                let condition = self.value(condition);
                let site = self.site(*span);
                self.emit(Instruction::Require {
                    condition,
                    kind: RunTimeErrorKind::AssertionFailed,
                    site,
                });
            }
        }
    }

    /// Brings a local into being. In a loop it starts afresh each time round.
    fn declare(&mut self, local: LocalId, initialisers: &[Expr]) {
        let declared = &self.locals[local.0 as usize];
        let (ty, addressed) = (declared.ty.clone(), declared.addressed);
        if ty.is_register() && !addressed {
            let home = self.register(register_type(&ty));
            self.homes[local.0 as usize] = Some(Home::Register(home));
            if initialisers.is_empty() {
                let start = match ty {
                    Type::Double => self.zero(RegisterType::Double),
                    _ => self.integer(ty.default_value()),
                };
                self.copy(home, start);
            }
        } else {
            let words = ty.size().words;
            let address = self.frame(words);
            self.homes[local.0 as usize] = Some(Home::Frame(address.offset));
            let mut image = Vec::with_capacity(words as usize);
            ty.default_words(&mut image);
            if self.loops > 0 || image.iter().any(|&word| word != 0) {
                self.default_words(address, image);
            }
        }
        for initialiser in initialisers {
            self.effect(initialiser);
        }
    }

    fn repeat(&mut self, statement: &Statement) {
        let Statement::Loop {
            condition,
            step,
            body,
            tested_first,
            span,
        } = statement
        else {
            unreachable!("called for loops only");
        };
        let (test, start, end) = (self.new_block(), self.new_block(), self.new_block());
        self.jump(if *tested_first { test } else { start });
        self.switch(test);
        match condition {
            Some(condition) => self.condition(condition, start, end),
            None => self.jump(start),
        }
        self.switch(start);
        let site = self.site(*span);
        self.emit(Instruction::CountRound { site });
        self.loops += 1;
        self.statement(body);
        if let Some(step) = step {
            self.effect(step);
        }
        self.loops -= 1;
        self.jump(test);
        self.switch(end);
    }

    fn choose(&mut self, branches: &[(Expr, Statement)], otherwise: Option<&Statement>) {
        let end = self.new_block();
        for (condition, then) in branches {
            let (yes, no) = (self.new_block(), self.new_block());
            self.condition(condition, yes, no);
            self.switch(yes);
            self.statement(then);
            self.jump(end);
            self.switch(no);
        }
        if let Some(otherwise) = otherwise {
            self.statement(otherwise);
        }
        self.jump(end);
        self.switch(end);
    }

    fn give_back(&mut self, value: Option<&Expr>) {
        let Some(value) = value else {
            self.terminate(Terminator::Return(None));
            return;
        };
        if let Some(result) = self.result_address {
            let ty = self.result.clone();
            let source = self.checked_address(value, &ty);
            self.copy_words(at(Base::Register(result), 0), source, ty.size().words);
            self.terminate(Terminator::Return(None));
            return;
        }
        let result = self.result.clone();
        let register = self.checked_value(value, &result);
        self.terminate(Terminator::Return(Some(register)));
    }
}
