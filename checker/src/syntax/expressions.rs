//! Expressions: operator precedence, prefix and postfix forms, quantifiers.
//!
//! Precedence, loosest first: assignment and `?:` (from the right); `|| or xor imply` (one level,
//! from the left); `&& and`; `|`; `^`; `&`; `== !=`; `< <= >= >`; `<? >?`; `<< >>`; `+ -`; `* / %`;
//! `**`; prefix; postfix. The body of a quantifier extends as far to the right as it can.
//!
//! Long runs of one of `&&` and `||` become a balanced tree: generated models join thousands of
//! operands, and the order of evaluation stays the same. Other trees are refused beyond
//! [`MAX_HEIGHT`] levels, so that every walk over a tree may recurse.

use super::ast::{
    BinaryOp, Expr, ExprKind, Name, Quantifier, TypeExpr, UnaryOp, Unsupported, UnsupportedPart,
};
use super::codes;
use super::keywords::{self, Dialect};
use super::lexer::TokenKind;
use super::parser::{MAX_HEIGHT, Parser};
use crate::diagnostics::{Diagnostic, Span};

/// Levels of precedence; an operator of a higher level binds tighter.
pub(super) mod level {
    pub(crate) const ASSIGNMENT: u8 = 1;
    pub(crate) const TERNARY: u8 = 2;
    pub(crate) const OR: u8 = 3;
    pub(crate) const AND: u8 = 4;
    pub(crate) const POWER: u8 = 14;
    pub(crate) const PREFIX: u8 = 15;
    pub(crate) const POSTFIX: u8 = 16;
}

/// The level of a binary operator; all of them associate to the left.
pub(super) fn level_of(operator: BinaryOp) -> u8 {
    match operator {
        BinaryOp::Or | BinaryOp::Xor | BinaryOp::Imply => level::OR,
        BinaryOp::And => level::AND,
        BinaryOp::BitOr => 5,
        BinaryOp::BitXor => 6,
        BinaryOp::BitAnd => 7,
        BinaryOp::Equal | BinaryOp::NotEqual => 8,
        BinaryOp::Less | BinaryOp::LessEqual | BinaryOp::Greater | BinaryOp::GreaterEqual => 9,
        BinaryOp::Minimum | BinaryOp::Maximum => 10,
        BinaryOp::ShiftLeft | BinaryOp::ShiftRight => 11,
        BinaryOp::Add | BinaryOp::Subtract => 12,
        BinaryOp::Multiply | BinaryOp::Divide | BinaryOp::Remainder => 13,
        BinaryOp::Power => level::POWER,
    }
}

/// Runs of `&&` or `||` with more operands than this are balanced.
const LONGEST_SPINE: usize = 64;

/// What can stand between two operands.
enum Infix {
    Binary(BinaryOp),
    Ternary,
    Assign(Option<BinaryOp>),
}

impl Parser<'_> {
    /// An expression of any level.
    pub(super) fn expression(&mut self) -> Expr {
        self.expression_at(level::ASSIGNMENT)
    }

    /// One or more expressions with commas between them.
    pub(super) fn expression_list(&mut self) -> Vec<Expr> {
        let mut list = Vec::new();
        self.comma_separated(|parser| list.push(parser.expression()));
        list
    }

    /// An expression whose operators bind at least as tightly as `least`.
    pub(super) fn expression_at(&mut self, least: u8) -> Expr {
        match self.nested(|parser| parser.operators(least)) {
            Some(expr) => expr,
            None => self.error_expr(),
        }
    }

    fn operators(&mut self, least: u8) -> Expr {
        let start = self.here();
        let mut left = self.prefix();
        while let Some(infix) = self.infix() {
            let (level, height) = (infix.level(), self.height);
            if level < least {
                break;
            }
            left = match infix {
                Infix::Binary(operator @ (BinaryOp::And | BinaryOp::Or)) => {
                    self.logical_run(start, left, operator)
                }
                Infix::Binary(operator) => {
                    self.bump();
                    let right = self.expression_at(level + 1);
                    let kind = ExprKind::Binary(operator, Box::new(left), Box::new(right));
                    self.node(start, kind, height)
                }
                Infix::Ternary => self.ternary(start, left),
                Infix::Assign(None) if self.dialect == Dialect::Query => {
                    let message = format!("expected `==` to compare, found {}", self.found());
                    let diagnostic = Diagnostic::new(codes::UNEXPECTED_TOKEN, self.here(), message)
                        .help("write `==`: a query compares, it changes nothing");
                    self.report(diagnostic);
                    self.bump();
                    let right = self.expression_at(level_of(BinaryOp::Equal) + 1);
                    let kind = ExprKind::Binary(BinaryOp::Equal, Box::new(left), Box::new(right));
                    self.node(start, kind, height)
                }
                Infix::Assign(operator) => {
                    self.bump();
                    let value = self.expression_at(level::ASSIGNMENT);
                    let kind = ExprKind::Assign(operator, Box::new(left), Box::new(value));
                    self.node(start, kind, height)
                }
            };
        }
        left
    }

    /// The node from `start` to here, one level above the last expression and another of the given
    /// height.
    fn node(&mut self, start: Span, kind: ExprKind, other_height: u32) -> Expr {
        self.height = self.height.max(other_height) + 1;
        let span = self.since(start);
        if self.height > MAX_HEIGHT {
            let message = format!("this expression has more than {MAX_HEIGHT} levels of operators");
            self.error(codes::NESTING_TOO_DEEP, span, message);
            return self.error_expr();
        }
        Expr { kind, span }
    }

    /// `left op … op …` for one of `&&` and `||`, from the first operator on.
    fn logical_run(&mut self, start: Span, left: Expr, operator: BinaryOp) -> Expr {
        let mut highest = self.height;
        let mut operands = vec![left];
        while matches!(self.infix(), Some(Infix::Binary(next)) if next == operator) {
            self.bump();
            operands.push(self.expression_at(level_of(operator) + 1));
            highest = highest.max(self.height);
        }
        highest += match u32::try_from(operands.len()) {
            Ok(count) if operands.len() <= LONGEST_SPINE => count,
            _ => operands.len().ilog2() + 2,
        };
        let kind = join_all(operator, operands).map_or(ExprKind::Error, |expr| expr.kind);
        self.height = highest - 1;
        self.node(start, kind, 0)
    }

    fn ternary(&mut self, start: Span, condition: Expr) -> Expr {
        let mut height = self.height;
        self.bump();
        let then = self.expression();
        height = height.max(self.height);
        self.expect(TokenKind::Colon, "between the two values of `?:`");
        // The last operand takes assignments in: `a ? b : c = d` is `a ? b : (c = d)`.
        let otherwise = self.expression();
        let kind = ExprKind::Ternary(Box::new(condition), Box::new(then), Box::new(otherwise));
        self.node(start, kind, height)
    }

    fn infix(&self) -> Option<Infix> {
        use BinaryOp as B;
        use TokenKind as T;
        Some(Infix::Binary(match self.kind() {
            T::Word => match self.word() {
                "and" => B::And,
                "or" => B::Or,
                "imply" => B::Imply,
                "xor" if self.dialect != Dialect::Old => B::Xor,
                _ => return None,
            },
            T::OrOr => B::Or,
            T::AndAnd => B::And,
            T::Or => B::BitOr,
            T::Xor => B::BitXor,
            T::And => B::BitAnd,
            T::EqualEqual => B::Equal,
            T::NotEqual => B::NotEqual,
            T::Less => B::Less,
            T::LessEqual => B::LessEqual,
            T::Greater => B::Greater,
            T::GreaterEqual => B::GreaterEqual,
            T::EqualLess if self.dialect == Dialect::Old => B::LessEqual,
            T::EqualGreater if self.dialect == Dialect::Old => B::GreaterEqual,
            T::Minimum => B::Minimum,
            T::Maximum => B::Maximum,
            T::ShiftLeft => B::ShiftLeft,
            T::ShiftRight => B::ShiftRight,
            T::Plus => B::Add,
            T::Minus => B::Subtract,
            T::Star => B::Multiply,
            T::Slash => B::Divide,
            T::Percent => B::Remainder,
            T::Power => B::Power,
            // `c?` at the end of a synchronisation is no condition.
            T::Question => {
                let next = self.peek(1).kind;
                let ends = matches!(next, T::End | T::Semicolon | T::RightBrace);
                return (!ends).then_some(Infix::Ternary);
            }
            T::Assign | T::ColonAssign => return Some(Infix::Assign(None)),
            _ => {
                let operator = self.compound_operator()?;
                return Some(Infix::Assign(Some(operator)));
            }
        }))
    }

    /// The operator before the `=` of a compound assignment.
    fn compound_operator(&self) -> Option<BinaryOp> {
        use BinaryOp as B;
        use TokenKind as T;
        Some(match self.kind() {
            T::PlusAssign => B::Add,
            T::MinusAssign => B::Subtract,
            T::StarAssign => B::Multiply,
            T::SlashAssign => B::Divide,
            T::PercentAssign => B::Remainder,
            T::AndAssign => B::BitAnd,
            T::OrAssign => B::BitOr,
            T::XorAssign => B::BitXor,
            T::ShiftLeftAssign => B::ShiftLeft,
            T::ShiftRightAssign => B::ShiftRight,
            _ => return None,
        })
    }

    fn prefix(&mut self) -> Expr {
        let start = self.here();
        let unary = match self.kind() {
            TokenKind::Minus => UnaryOp::Minus,
            TokenKind::Plus => UnaryOp::Plus,
            TokenKind::Exclamation => UnaryOp::Not,
            TokenKind::Word if self.at_word("not") => UnaryOp::Not,
            TokenKind::Increment => return self.prefix_step(1),
            TokenKind::Decrement => return self.prefix_step(-1),
            _ => return self.postfix(),
        };
        self.bump();
        let operand = match self.smallest_int(unary) {
            Some(literal) => literal,
            None => self.expression_at(level::PREFIX),
        };
        self.node(start, ExprKind::Unary(unary, Box::new(operand)), 0)
    }

    fn prefix_step(&mut self, delta: i32) -> Expr {
        let start = self.here();
        self.bump();
        let target = Box::new(self.expression_at(level::PREFIX));
        let kind = ExprKind::Step {
            target,
            delta,
            postfix: false,
        };
        self.node(start, kind, 0)
    }

    /// The literal of the smallest `int` without its sign, which is legal only behind a minus.
    fn smallest_int(&mut self, operator: UnaryOp) -> Option<Expr> {
        let token = self.token();
        let is_it = operator == UnaryOp::Minus
            && token.kind == TokenKind::Int
            && self.text_of(token).trim_start_matches('0') == "2147483648";
        is_it.then(|| {
            self.bump();
            self.height = 1;
            Expr {
                kind: ExprKind::Int(2_147_483_648),
                span: self.span_of(token),
            }
        })
    }

    fn postfix(&mut self) -> Expr {
        self.operand_of(true)
    }

    /// A variable or a location without an index: `x`, `P.x` or `P(1).location`.
    pub(super) fn plain_place(&mut self) -> Expr {
        self.operand_of(false)
    }

    fn operand_of(&mut self, is_indexed: bool) -> Expr {
        let start = self.here();
        let mut expr = self.primary();
        loop {
            let height = self.height;
            let kind = match self.kind() {
                TokenKind::LeftBracket if is_indexed => {
                    self.bump();
                    let index = self.expression();
                    self.closing(TokenKind::RightBracket, "after the index");
                    ExprKind::Index(Box::new(expr), Box::new(index))
                }
                TokenKind::LeftParenthesis => {
                    let arguments = self.arguments();
                    ExprKind::Call(Box::new(expr), arguments)
                }
                TokenKind::Dot => {
                    self.bump();
                    let name = self.field_name();
                    ExprKind::Field(Box::new(expr), name)
                }
                TokenKind::Increment | TokenKind::Decrement => {
                    let delta = if self.bump().kind == TokenKind::Increment {
                        1
                    } else {
                        -1
                    };
                    let target = Box::new(expr);
                    ExprKind::Step {
                        target,
                        delta,
                        postfix: true,
                    }
                }
                TokenKind::Apostrophe => {
                    self.bump();
                    ExprKind::Rate(Box::new(expr))
                }
                _ => return expr,
            };
            expr = self.node(start, kind, height);
        }
    }

    fn field_name(&mut self) -> Name {
        if self.at_word("location") {
            let token = self.bump();
            return Name {
                text: "location".to_owned(),
                span: self.span_of(token),
            };
        }
        self.name("the name of a member")
    }

    /// `(a, b, …)` with the parentheses; the height is that of the highest argument.
    pub(super) fn arguments(&mut self) -> Vec<Expr> {
        self.bump();
        let mut arguments = Vec::new();
        let mut highest = 0;
        if !self.at(TokenKind::RightParenthesis) {
            self.comma_separated(|parser| {
                arguments.push(parser.expression());
                highest = highest.max(parser.height);
            });
        }
        self.closing(TokenKind::RightParenthesis, "after the arguments");
        self.height = highest;
        arguments
    }

    /// Expects a closing bracket; on a mistake skips to it if it stands at this level.
    pub(super) fn closing(&mut self, kind: TokenKind, context: &str) {
        if !self.expect(kind, context) {
            self.skip_to(&[kind, TokenKind::Semicolon]);
            if !self.eat(kind) {
                self.suppress_reports();
            }
        }
    }

    fn primary(&mut self) -> Expr {
        let start = self.here();
        self.height = 1;
        let kind = match self.kind() {
            TokenKind::Int => self.int_literal(),
            TokenKind::Double => self.double_literal(),
            TokenKind::String => {
                let token = self.bump();
                let text = self.text_of(token);
                ExprKind::String(text[1..text.len() - 1].to_owned())
            }
            TokenKind::LeftParenthesis => return self.parenthesised(),
            TokenKind::Word => return self.word_expression(),
            TokenKind::AlwaysFinally
            | TokenKind::AlwaysGlobally
            | TokenKind::ExistsFinally
            | TokenKind::ExistsGlobally => return self.nested_path_quantifier(),
            _ => {
                self.expected("an expression");
                return self.error_expr();
            }
        };
        let span = self.since(start);
        Expr { kind, span }
    }

    fn int_literal(&mut self) -> ExprKind {
        let token = self.token();
        match self.text_of(token).parse::<i64>() {
            Ok(value) if value <= i64::from(i32::MAX) => {
                self.bump();
                ExprKind::Int(value)
            }
            _ => {
                let span = self.here();
                let message = "this number is larger than 2147483647";
                self.report(
                    Diagnostic::new(codes::NUMBER_TOO_LARGE, span, message)
                        .help("integers have 32 bits"),
                );
                self.bump();
                ExprKind::Error
            }
        }
    }

    fn double_literal(&mut self) -> ExprKind {
        let token = self.token();
        let value = self.text_of(token).parse::<f64>().unwrap_or(f64::INFINITY);
        if value.is_infinite() {
            let message = "this number is too large for a double";
            self.error(codes::NUMBER_TOO_LARGE, self.here(), message);
        }
        self.bump();
        if value.is_infinite() {
            ExprKind::Error
        } else {
            ExprKind::Double(value)
        }
    }

    pub(super) fn parenthesised(&mut self) -> Expr {
        self.bump();
        let expr = self.expression();
        let height = self.height;
        self.closing(TokenKind::RightParenthesis, "to close the parenthesis");
        self.height = height;
        expr
    }

    fn word_expression(&mut self) -> Expr {
        let start = self.here();
        let word = self.word();
        let reserved = keywords::is_reserved(word, self.dialect);
        let kind = match word {
            "true" => ExprKind::Bool(true),
            "false" => ExprKind::Bool(false),
            "deadlock" if reserved => ExprKind::Deadlock,
            "forall" if reserved => return self.quantified(Quantifier::ForAll),
            "exists" if reserved => return self.quantified(Quantifier::Exists),
            "sum" if reserved => return self.quantified(Quantifier::Sum),
            "spawn" | "exit" | "numOf" | "foreach" if reserved => return self.dynamic(),
            _ if reserved => {
                self.expected("an expression");
                return self.error_expr();
            }
            _ => ExprKind::Name(word.to_owned()),
        };
        self.bump();
        Expr { kind, span: start }
    }

    /// `forall (name : type) body`
    fn quantified(&mut self, quantifier: Quantifier) -> Expr {
        let start = self.here();
        self.bump();
        let (name, ty) = self.bound_variable("after the quantifier");
        let (ty, type_height) = (Box::new(ty), self.height);
        let body = Box::new(self.expression());
        let kind = ExprKind::Quantifier {
            quantifier,
            name,
            ty,
            body,
        };
        self.node(start, kind, type_height)
    }

    /// A variable and its type in parentheses; the height is that of the type.
    pub(super) fn bound_variable(&mut self, context: &str) -> (Name, TypeExpr) {
        self.expect(TokenKind::LeftParenthesis, context);
        let name = self.declared_name("the name of the bound variable");
        self.expect(TokenKind::Colon, "between the variable and its type");
        let ty = self.type_expr();
        self.closing(TokenKind::RightParenthesis, "after the type");
        (name, ty)
    }

    /// `spawn T(…)`, `exit()`, `numOf(T)`; `foreach (i : T) e` is read and recorded.
    fn dynamic(&mut self) -> Expr {
        let span = self.here();
        let word = self.word();
        self.bump();
        self.height = 1;
        let kind = match word {
            "spawn" => {
                let template = self.name("the name of a dynamic template");
                let arguments = if self.at(TokenKind::LeftParenthesis) {
                    self.arguments()
                } else {
                    self.expected("`(` before the arguments of the new instance");
                    Vec::new()
                };
                ExprKind::Spawn(template, arguments)
            }
            "foreach" => self.for_each(span),
            _ => {
                self.expect(TokenKind::LeftParenthesis, "after the word");
                let kind = if word == "exit" {
                    ExprKind::Exit
                } else {
                    ExprKind::NumberOf(self.name("the name of a dynamic template"))
                };
                self.closing(TokenKind::RightParenthesis, "at the end");
                kind
            }
        };
        let height = self.height;
        self.node(span, kind, height)
    }

    fn for_each(&mut self, span: Span) -> ExprKind {
        self.skip_to(&[TokenKind::LeftParenthesis, TokenKind::Semicolon]);
        self.eat(TokenKind::LeftParenthesis);
        self.skip_to(&[TokenKind::RightParenthesis, TokenKind::Semicolon]);
        self.eat(TokenKind::RightParenthesis);
        self.expression();
        self.unsupported.push(Unsupported {
            text: "`foreach` over the instances of a dynamic template".to_owned(),
            span,
            part: UnsupportedPart::Whole,
        });
        ExprKind::Unsupported
    }

    fn nested_path_quantifier(&mut self) -> Expr {
        let span = self.here();
        if self.dialect != Dialect::Query {
            self.expected("an expression");
            return self.error_expr();
        }
        let message = format!("{} inside another formula", self.kind().shown());
        self.report(
            Diagnostic::new(codes::NESTED_PATH_QUANTIFIERS, span, message)
                .help("a query has one path quantifier, at its start; `p --> q` stands for `A[] (p imply A<> q)`"),
        );
        self.bump();
        self.expression_at(level::PREFIX);
        self.height = 1;
        Expr {
            kind: ExprKind::Error,
            span: self.since(span),
        }
    }
}

impl Infix {
    fn level(&self) -> u8 {
        match self {
            Infix::Binary(operator) => level_of(*operator),
            Infix::Ternary => level::TERNARY,
            Infix::Assign(_) => level::ASSIGNMENT,
        }
    }
}

fn join(operator: BinaryOp, left: Expr, right: Expr) -> Expr {
    let span = left.span.to(right.span);
    Expr {
        kind: ExprKind::Binary(operator, Box::new(left), Box::new(right)),
        span,
    }
}

/// The operands joined by one of `&&` and `||`; nothing without operands.
pub(super) fn join_all(operator: BinaryOp, operands: Vec<Expr>) -> Option<Expr> {
    if operands.len() > LONGEST_SPINE {
        return balance(operator, operands);
    }
    operands
        .into_iter()
        .reduce(|left, right| join(operator, left, right))
}

/// The operands joined pairwise, again and again, in their order.
fn balance(operator: BinaryOp, mut operands: Vec<Expr>) -> Option<Expr> {
    while operands.len() > 1 {
        let mut pairs = Vec::with_capacity(operands.len().div_ceil(2));
        let mut rest = operands.into_iter();
        while let Some(left) = rest.next() {
            pairs.push(match rest.next() {
                Some(right) => join(operator, left, right),
                None => left,
            });
        }
        operands = pairs;
    }
    operands.pop()
}
