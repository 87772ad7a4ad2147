//! Properties over generated texts: printing and parsing are inverse, and no text crashes a reader.

use std::sync::OnceLock;

use checker::diagnostics::{Diagnostic, SourceMap, Span};
use checker::syntax::ast::{
    BinaryOp, Expr, ExprKind, Name, Prefixes, Quantifier, TypeExpr, TypeKind, UnaryOp,
};
use checker::syntax::{add_query_text, parse_query, print_expr, read_model, read_queries};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};

use crate::corpus;
use crate::syntax::support::{expression, shape};

fn expr(kind: ExprKind) -> Expr {
    let span = Span::default();
    Expr { kind, span }
}

fn name(text: &str) -> Name {
    let span = Span::default();
    let text = text.to_owned();
    Name { text, span }
}

fn names() -> impl Strategy<Value = &'static str> {
    select(vec![
        "a", "b", "x", "y", "A", "E", "sup", "deadlock", "_1", "e1",
    ])
}

fn leaves() -> impl Strategy<Value = Expr> {
    prop_oneof![
        (0..=i64::from(i32::MAX)).prop_map(|value| expr(ExprKind::Int(value))),
        (0.0..1e300).prop_map(|value| expr(ExprKind::Double(value))),
        any::<bool>().prop_map(|value| expr(ExprKind::Bool(value))),
        names().prop_map(|text| expr(ExprKind::Name(text.to_owned()))),
        Just(expr(ExprKind::String("a \\ 'b'".to_owned()))),
        Just(expr(ExprKind::Unary(
            UnaryOp::Minus,
            Box::new(expr(ExprKind::Int(2_147_483_648)))
        ))),
    ]
}

fn operators() -> impl Strategy<Value = BinaryOp> {
    use BinaryOp as B;
    select(vec![
        B::Add,
        B::Subtract,
        B::Multiply,
        B::Divide,
        B::Remainder,
        B::Power,
        B::ShiftLeft,
        B::ShiftRight,
        B::Minimum,
        B::Maximum,
        B::Less,
        B::LessEqual,
        B::Greater,
        B::GreaterEqual,
        B::Equal,
        B::NotEqual,
        B::BitAnd,
        B::BitXor,
        B::BitOr,
        B::And,
        B::Or,
        B::Xor,
        B::Imply,
    ])
}

fn assignments() -> impl Strategy<Value = Option<BinaryOp>> {
    use BinaryOp as B;
    select(vec![
        None,
        Some(B::Add),
        Some(B::Subtract),
        Some(B::Multiply),
        Some(B::Divide),
        Some(B::Remainder),
        Some(B::BitAnd),
        Some(B::BitOr),
        Some(B::BitXor),
        Some(B::ShiftLeft),
        Some(B::ShiftRight),
    ])
}

fn types(inner: BoxedStrategy<Expr>) -> impl Strategy<Value = TypeExpr> {
    let pair = (inner.clone(), inner.clone());
    let kind = prop_oneof![
        Just(TypeKind::Int),
        Just(TypeKind::Bool),
        Just(TypeKind::Named(name("id_t"))),
        inner.prop_map(|size| TypeKind::Scalar(Box::new(size))),
        pair.prop_map(|(low, high)| TypeKind::Range(Box::new(low), Box::new(high))),
    ];
    kind.prop_map(|kind| TypeExpr {
        prefixes: Prefixes::default(),
        kind,
        span: Span::default(),
    })
}

fn expressions() -> impl Strategy<Value = Expr> {
    leaves().prop_recursive(6, 48, 3, |inner| {
        let one = || inner.clone().prop_map(Box::new);
        prop_oneof![
            (one(), names()).prop_map(|(e, n)| ExprKind::Field(e, name(n))),
            one().prop_map(|e| ExprKind::Field(e, name("location"))),
            (one(), one()).prop_map(|(a, i)| ExprKind::Index(a, i)),
            (one(), vec(inner.clone(), 0..3)).prop_map(|(f, a)| ExprKind::Call(f, a)),
            one().prop_map(ExprKind::Rate),
            (
                select(vec![UnaryOp::Not, UnaryOp::Minus, UnaryOp::Plus]),
                one()
            )
                .prop_map(|(o, e)| ExprKind::Unary(o, e)),
            (operators(), one(), one()).prop_map(|(o, l, r)| ExprKind::Binary(o, l, r)),
            (operators(), one(), one()).prop_map(|(o, l, r)| ExprKind::Binary(o, l, r)),
            (one(), one(), one()).prop_map(|(c, t, e)| ExprKind::Ternary(c, t, e)),
            (assignments(), one(), one()).prop_map(|(o, t, v)| ExprKind::Assign(o, t, v)),
            (one(), select(vec![1, -1]), any::<bool>()).prop_map(|(target, delta, postfix)| {
                ExprKind::Step {
                    target,
                    delta,
                    postfix,
                }
            }),
            (
                select(vec![
                    Quantifier::ForAll,
                    Quantifier::Exists,
                    Quantifier::Sum
                ]),
                names(),
                types(inner.clone().boxed()).prop_map(Box::new),
                one(),
            )
                .prop_map(|(quantifier, n, ty, body)| ExprKind::Quantifier {
                    quantifier,
                    name: name(n),
                    ty,
                    body,
                }),
        ]
        .prop_map(expr)
    })
}

/// Reads a text in every way and shows every diagnostic; the spans must lie in their sources.
fn read_in_every_way(bytes: &[u8]) {
    let mut sources = SourceMap::default();
    let parsed = read_model("model", bytes, &mut sources);
    check_diagnostics(&parsed.diagnostics, &sources);
    for query in &parsed.document.queries {
        check_diagnostics(&parse_query(query.span, &sources).1, &sources);
    }
    let (queries, diagnostics) = read_queries("queries", bytes, &mut sources);
    check_diagnostics(&diagnostics, &sources);
    for query in &queries {
        check_diagnostics(&parse_query(query.span, &sources).1, &sources);
    }
    let span = add_query_text(&String::from_utf8_lossy(bytes), &mut sources);
    let (query, diagnostics) = parse_query(span, &sources);
    check_diagnostics(&diagnostics, &sources);
    assert!(
        query.is_some() || !diagnostics.is_empty(),
        "a refusal has a reason"
    );
}

fn check_diagnostics(diagnostics: &[Diagnostic], sources: &SourceMap) {
    for diagnostic in diagnostics {
        let text = &sources.get(diagnostic.span.source).text;
        let (start, end) = (diagnostic.span.start as usize, diagnostic.span.end as usize);
        assert!(start <= end && end <= text.len(), "{diagnostic:?}");
        assert!(
            text.is_char_boundary(start) && text.is_char_boundary(end),
            "{diagnostic:?}"
        );
        assert!(sources.position(diagnostic.span).column > 0);
        assert!(diagnostic.render(sources).contains(diagnostic.code.code));
    }
}

/// The corpus files, as seeds.
fn seeds() -> &'static [Vec<u8>] {
    static SEEDS: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    SEEDS.get_or_init(read_seeds)
}

fn read_seeds() -> Vec<Vec<u8>> {
    let paths = ["ok", "err"].map(|folder| corpus::files(&format!("syntax/{folder}")));
    let paths = paths.concat();
    paths
        .iter()
        .map(|path| std::fs::read(path).expect("the file can be read"))
        .collect()
}

/// One change of a text.
#[derive(Clone, Debug)]
enum Mutation {
    Remove(Index, usize),
    Repeat(Index, usize),
    Insert(Index, &'static str),
    Set(Index, u8),
    Swap(Index, Index),
}

fn mutations() -> impl Strategy<Value = Mutation> {
    let words = select(vec![
        "(",
        ")",
        "[",
        "]",
        "{",
        "}",
        ";",
        ",",
        "<",
        ">",
        "&",
        "&lt;",
        "<![CDATA[",
        "]]>",
        "<!--",
        "-->",
        "\"",
        "/*",
        "*/",
        "//",
        "\\\n",
        "forall (i : T) ",
        "int",
        "const ",
        "struct {",
        "process",
        "system ",
        "A[]",
        "E<>",
        "control:",
        " under S",
        "2147483648",
        "1e9",
        "?",
        ":",
        "=",
        "-u->",
        "->",
        "\r\n",
        "\u{e4}",
        "\0",
        "</template>",
        "<location id=\"x\">",
    ]);
    prop_oneof![
        (any::<Index>(), 1..40_usize).prop_map(|(i, n)| Mutation::Remove(i, n)),
        (any::<Index>(), 1..40_usize).prop_map(|(i, n)| Mutation::Repeat(i, n)),
        (any::<Index>(), words).prop_map(|(i, w)| Mutation::Insert(i, w)),
        (any::<Index>(), any::<u8>()).prop_map(|(i, b)| Mutation::Set(i, b)),
        (any::<Index>(), any::<Index>()).prop_map(|(i, j)| Mutation::Swap(i, j)),
    ]
}

fn mutate(mut bytes: Vec<u8>, mutation: &Mutation) -> Vec<u8> {
    if bytes.is_empty() {
        return bytes;
    }
    let range = |index: &Index, length: usize| {
        let start = index.index(bytes.len());
        start..(start + length).min(bytes.len())
    };
    match mutation {
        Mutation::Remove(index, length) => {
            let range = range(index, *length);
            bytes.drain(range);
        }
        Mutation::Repeat(index, length) => {
            let range = range(index, *length);
            let piece = bytes[range.clone()].to_vec();
            bytes.splice(range.start..range.start, piece);
        }
        Mutation::Insert(index, word) => {
            let at = index.index(bytes.len());
            bytes.splice(at..at, word.bytes());
        }
        Mutation::Set(index, byte) => {
            let at = index.index(bytes.len());
            bytes[at] = *byte;
        }
        Mutation::Swap(first, second) => {
            let (first, second) = (first.index(bytes.len()), second.index(bytes.len()));
            bytes.swap(first, second);
        }
    }
    bytes
}

proptest! {
    // `PROPTEST_CASES` asks for more.
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases.max(1000)))]

    #[test]
    fn printed_expressions_are_read_back(tree in expressions()) {
        let text = print_expr(&tree);
        prop_assert_eq!(shape(&expression(&text)), shape(&tree), "{}", text);
    }

    #[test]
    fn arbitrary_bytes_crash_no_reader(bytes in vec(any::<u8>(), 0..200)) {
        read_in_every_way(&bytes);
    }

    #[test]
    fn arbitrary_texts_crash_no_reader(text in "\\PC{0,80}") {
        read_in_every_way(text.as_bytes());
    }

    #[test]
    fn arbitrary_labels_crash_no_reader(label in "[-a-cAEUW0-9\\[\\]{}()<>&|!?.,:;='\"/* \n+]{0,60}") {
        read_in_every_way(label.as_bytes());
        let escaped = label.replace('&', "&amp;").replace('<', "&lt;");
        let xml = format!(
            "<nta><template><name>T</name><location id=\"a\"/><init ref=\"a\"/><transition>\
             <source ref=\"a\"/><target ref=\"a\"/><label kind=\"guard\">{escaped}</label>\
             <label kind=\"assignment\">{escaped}</label></transition></template>\
             <system>{escaped}</system></nta>"
        );
        read_in_every_way(xml.as_bytes());
    }

    #[test]
    fn mutated_models_crash_no_reader(
        seed in any::<Index>(),
        mutations in vec(mutations(), 1..6),
    ) {
        let seeds = seeds();
        let bytes = seeds[seed.index(seeds.len())].clone();
        let bytes = mutations.iter().fold(bytes, mutate);
        read_in_every_way(&bytes);
    }
}
