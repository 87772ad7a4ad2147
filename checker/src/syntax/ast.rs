//! The syntax tree of UPPAAL models and queries: what was written, with its place, and nothing of
//! what it means.
//!
//! Invariants:
//! * Names are text; nothing is resolved, no type is known, no constant is folded.
//! * Every node carries the span that it was read from; a node made up by the reader has the span
//!   of its cause.
//! * The three readers (XML, XTA, old TA syntax) produce the same tree.

use crate::diagnostics::Span;

/// A name and where it stands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Name {
    /// The identifier.
    pub text: String,
    /// Where it stands.
    pub span: Span,
}

/// A whole model file.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// The global declarations.
    pub declarations: Vec<Declaration>,
    /// The templates, in file order.
    pub templates: Vec<Template>,
    /// What stands in `<instantiation>` and `<system>`: declarations, instantiations, the system
    /// line.
    pub system: System,
    /// The queries of the file, in order; empty and comment-only formulas are left out.
    pub queries: Vec<QueryText>,
    /// Constructs that were read and are not supported, such as LSC templates.
    pub unsupported: Vec<Unsupported>,
}

/// A construct that was read and is not supported.
#[derive(Clone, Debug)]
pub struct Unsupported {
    /// What it is, as messages call it.
    pub text: String,
    /// Where it stands.
    pub span: Span,
    /// What it is part of.
    pub part: UnsupportedPart,
}

/// What an unsupported construct is part of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum UnsupportedPart {
    /// The global declarations, the system section, or a query.
    Whole,
    /// A template, by its place in [`Document::templates`].
    Template(usize),
    /// It is a live sequence chart of this name.
    Chart(Name),
}

/// The text of a query in a file, before it is parsed.
#[derive(Clone, Debug, Default)]
pub struct QueryText {
    /// The formula's source; the span covers the formula without surrounding blanks and comments.
    pub span: Span,
    /// The formula as written, blanks collapsed, comments removed.
    pub text: String,
    /// The comment next to it, if any.
    pub comment: String,
    /// The expected verdict, from `<expect>`, `<result>` or an `EXPECT:` comment.
    pub expect: Option<Expectation>,
    /// The options of `<option>` elements, of the query or of all: names such as `--epsilon` with
    /// their values. Only XML has them.
    pub options: Vec<(String, String)>,
}

/// The verdict that a file states for one of its queries.
#[derive(Clone, Debug, PartialEq)]
pub enum Expectation {
    /// Satisfied.
    True,
    /// Not satisfied.
    False,
    /// Maybe satisfied.
    MaybeTrue,
    /// Maybe not satisfied.
    MaybeFalse,
    /// The query ends in an error.
    Error,
    /// A number, for `sup`, `inf` and the statistical queries.
    Number(f64),
}

/// A type as written.
#[derive(Clone, Debug)]
pub struct TypeExpr {
    /// The prefixes before it.
    pub prefixes: Prefixes,
    /// The type itself.
    pub kind: TypeKind,
    /// Where it stands, prefixes included.
    pub span: Span,
}

/// The prefixes of a type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is one keyword of the language"
)]
pub struct Prefixes {
    /// `const`
    pub constant: bool,
    /// `meta`
    pub meta: bool,
    /// `urgent`
    pub urgent: bool,
    /// `broadcast`
    pub broadcast: bool,
    /// `hybrid`
    pub hybrid: bool,
}

/// The kinds of types.
#[derive(Clone, Debug)]
pub enum TypeKind {
    /// `void`
    Void,
    /// `int`
    Int,
    /// `int[low, high]`
    Range(Box<Expr>, Box<Expr>),
    /// `bool`
    Bool,
    /// `double`
    Double,
    /// `string`
    String,
    /// `clock`
    Clock,
    /// `chan`
    Channel,
    /// `scalar[size]`
    Scalar(Box<Expr>),
    /// `struct { … }`
    Struct(Vec<StructField>),
    /// A name given by `typedef`.
    Named(Name),
}

/// One declarator of a `struct` field list.
#[derive(Clone, Debug)]
pub struct StructField {
    /// Its type, without the dimensions.
    pub ty: TypeExpr,
    /// Its name.
    pub name: Name,
    /// Its dimensions.
    pub dimensions: Vec<Dimension>,
}

/// One `[…]` after a declared name.
#[derive(Clone, Debug)]
pub enum Dimension {
    /// `[expression]`: a size. A bare type name also parses as this; the semantics tells them
    /// apart.
    Size(Expr),
    /// `[int[0,3]]`, `[scalar[2]]`: an index type.
    Type(TypeExpr),
}

/// A declaration.
#[derive(Clone, Debug)]
pub enum Declaration {
    /// `typedef T name[…];`
    Typedef {
        /// The type, without the dimensions.
        ty: TypeExpr,
        /// The new name.
        name: Name,
        /// Its dimensions.
        dimensions: Vec<Dimension>,
    },
    /// One declared name; `int a, b;` is two of these.
    Variable(Variable),
    /// A function.
    Function(Function),
    /// `chan priority a < default < b;`: the lowest level first.
    ChannelPriority {
        /// The levels; within a level, channel expressions, and `None` for `default`.
        levels: Vec<Vec<Option<Expr>>>,
        /// Where.
        span: Span,
    },
    /// `import "library" { … };`
    Import(Import),
    /// `dynamic T(parameters);`
    Dynamic(DynamicTemplate),
    /// `before_update { … }`
    BeforeUpdate(Vec<Expr>, Span),
    /// `after_update { … }`
    AfterUpdate(Vec<Expr>, Span),
}

/// The declaration that instances of a template may come and go while the model runs.
#[derive(Clone, Debug)]
pub struct DynamicTemplate {
    /// The name of the template.
    pub name: Name,
    /// The parameters.
    pub parameters: Vec<Parameter>,
}

/// A library and the functions that the model uses of it.
#[derive(Clone, Debug)]
pub struct Import {
    /// The library, as written between the quotes.
    pub library: Name,
    /// The functions.
    pub functions: Vec<ImportedFunction>,
}

/// A function of a library: `[name =] type symbol(parameters);`
#[derive(Clone, Debug)]
pub struct ImportedFunction {
    /// The type of what it returns.
    pub return_type: TypeExpr,
    /// Its name in the model.
    pub name: Name,
    /// Its name in the library.
    pub symbol: Name,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
}

/// One declared variable, constant, clock or channel.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Its type, without the dimensions.
    pub ty: TypeExpr,
    /// Its name.
    pub name: Name,
    /// Its dimensions.
    pub dimensions: Vec<Dimension>,
    /// Its initialiser.
    pub initialiser: Option<Initialiser>,
}

/// What stands after `=` in a declaration.
#[derive(Clone, Debug)]
pub enum Initialiser {
    /// An expression.
    Expr(Expr),
    /// `{ a, name: b, … }`
    List(Vec<(Option<Name>, Initialiser)>, Span),
    /// The same of many numbers, unread: [`super::TableReader`] reads it.
    Table(Span),
}

/// A formal parameter.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Its type, without the dimensions.
    pub ty: TypeExpr,
    /// Whether `&` was written.
    pub reference: bool,
    /// Its name.
    pub name: Name,
    /// Its dimensions.
    pub dimensions: Vec<Dimension>,
}

/// A function.
#[derive(Clone, Debug)]
pub struct Function {
    /// The type of what it returns.
    pub return_type: TypeExpr,
    /// Its name.
    pub name: Name,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Its body.
    pub body: Block,
}

/// `{ declarations statements }`
#[derive(Clone, Debug, Default)]
pub struct Block {
    /// Local declarations.
    pub declarations: Vec<Declaration>,
    /// The statements after them.
    pub statements: Vec<Statement>,
}

/// A statement.
#[derive(Clone, Debug)]
pub enum Statement {
    /// `;`
    Empty,
    /// `{ … }`
    Block(Block),
    /// `expression;`
    Expr(Expr),
    /// `for (init; condition; step) body`
    For {
        /// First part.
        init: Option<Expr>,
        /// Condition; missing means true.
        condition: Option<Expr>,
        /// Step.
        step: Option<Expr>,
        /// Body.
        body: Box<Statement>,
    },
    /// `for (name : type) body`
    Iterate {
        /// The bound name.
        name: Name,
        /// What it ranges over.
        ty: TypeExpr,
        /// Body.
        body: Box<Statement>,
    },
    /// `while (condition) body`
    While(Expr, Box<Statement>),
    /// `do body while (condition);`
    DoWhile(Box<Statement>, Expr),
    /// `if (condition) then else if (condition) then … else otherwise`: a chain of any length, so
    /// that nothing recurses along it.
    If(Vec<(Expr, Statement)>, Option<Box<Statement>>),
    /// `return expression;`
    Return(Option<Expr>, Span),
    /// `assert expression;`
    Assert(Expr, Span),
}

/// An expression.
#[derive(Clone, Debug)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// The kinds of expressions.
#[derive(Clone, Debug)]
pub enum ExprKind {
    /// An integer. `2147483648` is kept as it is; only below a unary minus is it legal.
    Int(i64),
    /// A floating-point literal.
    Double(f64),
    /// `true`, `false`
    Bool(bool),
    /// A string literal, without the quotes.
    String(String),
    /// A name.
    Name(String),
    /// `e.name`
    Field(Box<Expr>, Name),
    /// `e[index]`
    Index(Box<Expr>, Box<Expr>),
    /// `f(arguments)`, also `P(1)` for a member of a process set, and the built-in functions.
    Call(Box<Expr>, Vec<Expr>),
    /// `op e`
    Unary(UnaryOp, Box<Expr>),
    /// `left op right`
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `condition ? then : otherwise`
    Ternary(Box<Expr>, Box<Expr>, Box<Expr>),
    /// `target op= value`; `None` is plain assignment (`=` or `:=`).
    Assign(Option<BinaryOp>, Box<Expr>, Box<Expr>),
    /// `++e`, `e++`, `--e`, `e--`
    Step {
        /// The variable.
        target: Box<Expr>,
        /// +1 or -1.
        delta: i32,
        /// Whether the value is the old one.
        postfix: bool,
    },
    /// `x'`
    Rate(Box<Expr>),
    /// `forall (name : type) body` and its kin.
    Quantifier {
        /// Which.
        quantifier: Quantifier,
        /// The bound name.
        name: Name,
        /// What it ranges over.
        ty: Box<TypeExpr>,
        /// The body.
        body: Box<Expr>,
    },
    /// `spawn T(arguments)`: a new instance of a dynamic template.
    Spawn(Name, Vec<Expr>),
    /// `exit()`: the instance that takes the edge ends.
    Exit,
    /// `numOf(T)`: how many instances of a dynamic template there are.
    NumberOf(Name),
    /// `deadlock`, in queries.
    Deadlock,
    /// An expression that could not be read; a diagnostic was reported.
    Error,
    /// A construct that is listed in [`Document::unsupported`].
    Unsupported,
}

/// Unary operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnaryOp {
    /// `!`, `not`
    Not,
    /// `-`
    Minus,
    /// `+`
    Plus,
}

/// Binary operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum BinaryOp {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    /// `**`
    Power,
    ShiftLeft,
    ShiftRight,
    /// `<?`
    Minimum,
    /// `>?`
    Maximum,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
    BitAnd,
    BitXor,
    BitOr,
    And,
    Or,
    /// `xor` on truth values
    Xor,
    Imply,
}

/// Quantifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Quantifier {
    ForAll,
    Exists,
    Sum,
}

/// A template, or the single process of an XTA `process` definition.
#[derive(Clone, Debug, Default)]
pub struct Template {
    /// Its name.
    pub name: Name,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Its local declarations.
    pub declarations: Vec<Declaration>,
    /// Its locations.
    pub locations: Vec<Location>,
    /// Its branch points.
    pub branchpoints: Vec<Branchpoint>,
    /// The identifier of the initial location; `None` was reported.
    pub initial: Option<Name>,
    /// The names of locations behind `commit` and `urgent`, in textual models.
    pub marked: Vec<Name>,
    /// Its edges and the legs of its branch points, in file order.
    pub edges: Vec<Edge>,
}

/// A point of the drawing plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[expect(missing_docs, reason = "coordinates")]
pub struct Point {
    pub x: i32,
    pub y: i32,
}

/// What a label says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum LabelKind {
    Name,
    Invariant,
    ExponentialRate,
    Select,
    Guard,
    Synchronisation,
    Update,
    Probability,
}

/// A location.
#[derive(Clone, Debug, Default)]
pub struct Location {
    /// What edges refer to it by: the `id` in XML, the name in XTA.
    pub id: String,
    /// The name that expressions use, if it has one.
    pub name: Option<Name>,
    /// Invariant.
    pub invariant: Option<Expr>,
    /// Exponential rate; only the statistical queries would use it.
    pub exponential_rate: Option<Expr>,
    /// `urgent`
    pub urgent: bool,
    /// `committed`
    pub committed: bool,
    /// Where it is drawn.
    pub position: Option<Point>,
    /// Where its labels are drawn.
    pub labels: Vec<(LabelKind, Point)>,
    /// The colour it is drawn in, as red, green and blue of eight bits each.
    pub color: Option<u32>,
    /// Where it is declared.
    pub span: Span,
}

/// A branch point.
#[derive(Clone, Debug)]
pub struct Branchpoint {
    /// What edges refer to it by.
    pub id: String,
    /// Where it is drawn.
    pub position: Option<Point>,
    /// Where it is declared.
    pub span: Span,
}

/// A transition element: an edge, the entry of a branch point, or a leg of it.
#[derive(Clone, Debug, Default)]
pub struct Edge {
    /// The `id` of the location or branch point that it leaves.
    pub source: Name,
    /// The `id` of the location or branch point that it enters.
    pub target: Name,
    /// `select` bindings.
    pub select: Vec<(Name, TypeExpr)>,
    /// Guard.
    pub guard: Option<Expr>,
    /// Synchronisation.
    pub sync: Option<Sync>,
    /// Update: the expressions between the commas.
    pub update: Vec<Expr>,
    /// Weight of a leg.
    pub probability: Option<Expr>,
    /// Whose move it is; false for `controllable="false"` and `-u->`.
    pub controllable: bool,
    /// The bends of the arrow.
    pub nails: Vec<Point>,
    /// Where its labels are drawn.
    pub labels: Vec<(LabelKind, Point)>,
    /// The colour it is drawn in, as red, green and blue of eight bits each.
    pub color: Option<u32>,
    /// Where it stands.
    pub span: Span,
}

/// `channel!` or `channel?`
#[derive(Clone, Debug)]
pub struct Sync {
    /// The channel expression.
    pub channel: Expr,
    /// `!` is true.
    pub send: bool,
    /// Where.
    pub span: Span,
}

/// The system part of a model.
#[derive(Clone, Debug, Default)]
pub struct System {
    /// Declarations, in order with the instantiations.
    pub items: Vec<SystemItem>,
    /// The `system` line: the processes of each priority level, lowest first (one level without
    /// `<`).
    pub processes: Vec<Vec<Name>>,
    /// `progress { … }`: read, type-checked, not used.
    pub progress: Vec<Expr>,
}

/// One thing before the `system` line.
#[derive(Clone, Debug)]
pub enum SystemItem {
    /// A declaration.
    Declaration(Declaration),
    /// `name(parameters) = template(arguments);`
    Instantiation {
        /// The new name.
        name: Name,
        /// Parameters of a partial instantiation.
        parameters: Vec<Parameter>,
        /// The template or instantiation that is bound.
        template: Name,
        /// The arguments.
        arguments: Vec<Expr>,
    },
}

/// A parsed query.
#[derive(Clone, Debug)]
pub struct Query {
    /// `strategy name = …`
    pub strategy: Option<Name>,
    /// What is asked.
    pub kind: QueryKind,
    /// Where what is asked stands.
    pub formula: Span,
    /// `under name`
    pub under: Option<Name>,
    /// `imitate name`
    pub imitate: Option<Name>,
    /// The whole query.
    pub span: Span,
}

/// The kinds of queries.
#[derive(Clone, Debug)]
pub enum QueryKind {
    /// `E<> p`
    Reachable(Expr),
    /// `A[] p`
    Invariantly(Expr),
    /// `E[] p`
    PotentiallyAlways(Expr),
    /// `A<> p`
    Eventually(Expr),
    /// `p --> q`
    LeadsTo(Expr, Expr),
    /// `sup{p}: e, …`, `inf{p}: e, …`, `bounds{p}: e, …`
    Extremum {
        /// Which.
        extremum: Extremum,
        /// The states that count; all without it.
        predicate: Option<Expr>,
        /// What is measured.
        items: Vec<Expr>,
    },
    /// `control: …` and its kin.
    Control(Control),
    /// `saveStrategy("file", S)`
    SaveStrategy {
        /// The file.
        file: String,
        /// The strategy.
        strategy: Name,
    },
    /// `loadStrategy {discrete} -> {continuous} ("file")`, only after `strategy S =`.
    LoadStrategy {
        /// The file.
        file: String,
        /// What the strategy sees.
        features: Option<Features>,
    },
    /// `minE`, `maxE`, `minPr`, `maxPr`
    Optimum(Optimum),
    /// `acontrol: A[] p { … }`
    Shield(Shield),
    /// `Pr[…](…)` or `E[…](…)`
    Statistical(Statistical),
    /// A query that was recognised and is not supported; the name says which kind (statistical,
    /// learning, cost, …).
    Unsupported(Name),
}

/// A query for the best strategy.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// Whether the greatest value is the best.
    pub is_greatest: bool,
    /// What has a value.
    pub measured: Measured,
    /// How long a run is.
    pub bound: RunBound,
    /// What the strategy sees; everything if it is not said.
    pub features: Option<Features>,
    /// What ends a run before its bound.
    pub goal: Option<Expr>,
}

/// What a best strategy is best for.
#[derive(Clone, Debug)]
pub enum Measured {
    /// The expected value of an expression at the end of a run; of the time that it takes where
    /// there is none.
    Expected(Option<Expr>),
    /// The probability that the goal is reached.
    Probability,
}

/// What a strategy sees: `{discrete} -> {continuous}`.
#[derive(Clone, Debug)]
pub struct Features {
    /// Of these the exact values.
    pub discrete: Vec<Expr>,
    /// Of these in which intervals they lie.
    pub continuous: Vec<Expr>,
}

/// A query for a shield.
#[derive(Clone, Debug)]
pub struct Shield {
    /// What must hold for ever.
    pub invariant: Expr,
    /// What the shield sees.
    pub axes: Vec<ShieldAxis>,
}

/// `P.location`, `i[0,5]`, or `x[-13,13]:1300`.
#[derive(Clone, Debug)]
pub struct ShieldAxis {
    /// The location, the integer, the double or the clock.
    pub place: Expr,
    /// The least and the greatest value; none for a location.
    pub bounds: Option<Box<[Expr; 2]>>,
    /// How many cells there are; one for each value of an integer.
    pub cells: Option<Expr>,
    /// The whole.
    pub span: Span,
}

impl QueryKind {
    /// The strategy that is named behind the first of two probabilities.
    pub fn first_under(&self) -> Option<&Name> {
        match self {
            QueryKind::Statistical(Statistical::Comparison { left, .. }) => left.under.as_ref(),
            _ => None,
        }
    }

    /// The strategy that is named between a probability and the number that it is compared with.
    pub fn hypothesis_under(&self) -> Option<&Name> {
        match self {
            QueryKind::Statistical(Statistical::Hypothesis { estimated, .. }) => {
                estimated.under.as_ref()
            }
            _ => None,
        }
    }
}

/// A statistical query.
#[derive(Clone, Debug)]
pub enum Statistical {
    /// `Pr[bound](path)`
    Probability(Estimated),
    /// `Pr[bound](path) >= threshold`, or `<=`.
    Hypothesis {
        /// Whose probability.
        estimated: Estimated,
        /// Whether it is `>=`.
        at_least: bool,
        /// What it is compared with.
        threshold: Expr,
    },
    /// `Pr[bound](path) >= Pr[bound](path)`, or `<=`.
    Comparison {
        /// The first probability.
        left: Box<Estimated>,
        /// The second one.
        right: Box<Estimated>,
        /// Whether it is `>=`.
        at_least: bool,
    },
    /// `E[bound; runs](max: value)`, or `min`.
    Expectation {
        /// How long a run is.
        bound: RunBound,
        /// Whether the greatest value of a run counts, or the least.
        maximum: bool,
        /// What is measured.
        value: Expr,
    },
    /// `simulate [bound; runs] {a, b} : k : p`
    Simulation {
        /// How long a run is, and how many there are.
        bound: RunBound,
        /// What is shown.
        items: Vec<Shown>,
        /// The number of runs that are shown, and what they must reach.
        filter: Option<(Option<Expr>, Expr)>,
    },
}

/// What `simulate` shows: an expression, alone or behind `foreach (name : type)`.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The name and its type; each value of the type is shown.
    pub each: Option<(Name, TypeExpr)>,
    /// The expression.
    pub value: Expr,
}

/// What a probability is asked of.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// How long a run is; `None` leaves it to the formula.
    pub bound: Option<RunBound>,
    /// What is asked of a run.
    pub path: Path,
    /// `under name`, before what it is compared with.
    pub under: Option<Name>,
}

/// `[<=10; 100]`
#[derive(Clone, Debug)]
pub struct RunBound {
    /// What is limited.
    pub limit: RunLimit,
    /// To which value.
    pub value: Expr,
    /// The number of runs.
    pub runs: Option<Expr>,
}

/// What limits a run.
#[derive(Clone, Debug)]
pub enum RunLimit {
    /// `<=`: time.
    Time,
    /// `x<=`: a clock.
    Clock(Expr),
    /// `#<=`: the number of moves.
    Moves,
}

/// What is asked of a run.
#[derive(Clone, Debug)]
pub enum Path {
    /// `<> p`
    Eventually(Expr),
    /// `[] p`
    Always(Expr),
    /// `p U q`
    Until(Expr, Expr),
    /// Any other formula over time.
    Formula(Formula),
}

/// A formula over time: metric interval temporal logic.
#[derive(Clone, Debug)]
pub enum Formula {
    /// A condition on states.
    State(Expr),
    /// `!f`
    Not(Box<Formula>),
    /// `f && g`
    And(Box<Formula>, Box<Formula>),
    /// `f || g`
    Or(Box<Formula>, Box<Formula>),
    /// `X f`: behind the next move.
    Next(Box<Formula>),
    /// `<>[a,b] f`
    Eventually(Option<Interval>, Box<Formula>),
    /// `[][a,b] f`
    Always(Option<Interval>, Box<Formula>),
    /// `f U[a,b] g`
    Until(Option<Interval>, Box<Formula>, Box<Formula>),
    /// `f R[a,b] g`
    Release(Option<Interval>, Box<Formula>, Box<Formula>),
    /// `forall (name : type) f` if the first part is true, else `exists (name : type) f`.
    Quantified(bool, Name, TypeExpr, Box<Formula>),
}

impl Formula {
    /// Where its last condition on states stands.
    pub fn span(&self) -> Span {
        match self {
            Formula::State(state) => state.span,
            Formula::Not(inner)
            | Formula::Next(inner)
            | Formula::Eventually(_, inner)
            | Formula::Always(_, inner)
            | Formula::And(_, inner)
            | Formula::Or(_, inner)
            | Formula::Until(_, _, inner)
            | Formula::Release(_, _, inner)
            | Formula::Quantified(_, _, _, inner) => inner.span(),
        }
    }
}

/// `[a,b]`, the distance in time.
#[derive(Clone, Debug)]
pub struct Interval {
    /// The least distance.
    pub from: Expr,
    /// The greatest distance.
    pub to: Expr,
    /// Where it stands.
    pub span: Span,
}

/// `sup`, `inf`, `bounds`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Extremum {
    Sup,
    Inf,
    Bounds,
}

/// A game query.
#[derive(Clone, Debug)]
pub struct Control {
    /// What the controller is to enforce.
    pub objective: Objective,
    /// `E<> control: …`: whether it can be enforced from some state that is reachable with the
    /// environment's help.
    pub cooperative: bool,
    /// `control_t*(u, g)`: the bounds, each optional; `None` for plain `control`.
    pub time_optimal: Option<(Option<Expr>, Option<Expr>)>,
    /// `{ o1, o2 } control: …`: what the controller sees; `None` for full observation.
    pub observations: Option<Vec<ObservedPredicate>>,
}

/// What the controller sees the truth of.
#[derive(Clone, Debug)]
pub struct ObservedPredicate {
    /// The predicate.
    pub predicate: Expr,
    /// Where it stands, with the brackets around it.
    pub span: Span,
}

/// What the controller is to enforce.
#[derive(Clone, Debug)]
pub enum Objective {
    /// `A<> p`
    Reach(Expr),
    /// `A[] p`
    Safe(Expr),
    /// `A[p U q]`
    Until(Expr, Expr),
    /// `A[p W q]`
    WeakUntil(Expr, Expr),
    /// `A[] (p && A<> q)`
    Buchi(Expr, Expr),
}
