//! Precedence and associativity, literals, and the forms that only some dialects know.

use crate::syntax::support::{
    document, expression, mistakes, query, query_shape, shape, with_guard,
};
use checker::syntax::ast::{Declaration, Initialiser, Statement};

fn check(text: &str, expected: &str) {
    assert_eq!(shape(&expression(text)), expected, "{text}");
}

/// The first diagnostic of a guard, without its place.
fn check_mistake(text: &str, expected: &str) {
    let found = mistakes(with_guard(text).as_bytes());
    let first = found.first().map_or("", String::as_str);
    assert!(first.contains(expected), "{text}: {found:?}");
}

#[test]
fn multiplication_binds_tighter_than_addition() {
    check("a + b * c", "(Add a (Multiply b c))");
    check("a * b + c", "(Add (Multiply a b) c)");
    check("a - b - c", "(Subtract (Subtract a b) c)");
    check("a / b % c", "(Remainder (Divide a b) c)");
}

#[test]
fn power_binds_tighter_than_multiplication_and_associates_to_the_left() {
    check("a * b ** c", "(Multiply a (Power b c))");
    check("a ** b ** c", "(Power (Power a b) c)");
    check("-a ** b", "(Power (Minus a) b)");
    check("a ** -b", "(Power a (Minus b))");
}

#[test]
fn minimum_and_maximum_bind_looser_than_shifts() {
    check("1 + 2 <? 2", "(Minimum (Add 1 2) 2)");
    check("a << b >? c", "(Maximum (ShiftLeft a b) c)");
    check("a <? b < c", "(Less (Minimum a b) c)");
}

#[test]
fn shifts_bind_looser_than_addition() {
    check("a << b + c", "(ShiftLeft a (Add b c))");
    check("a >> b >> c", "(ShiftRight (ShiftRight a b) c)");
}

#[test]
fn comparisons_bind_tighter_than_equality() {
    check("a < b == c >= d", "(Equal (Less a b) (GreaterEqual c d))");
    check("a != b <= c", "(NotEqual a (LessEqual b c))");
}

#[test]
fn bit_operators_have_three_levels() {
    check("a | b ^ c & d", "(BitOr a (BitXor b (BitAnd c d)))");
    check("a & b == c", "(BitAnd a (Equal b c))");
}

#[test]
fn or_xor_and_imply_share_a_level_from_the_left() {
    check("a imply b imply c", "(Imply (Imply a b) c)");
    check("a || b imply c", "(Imply (Or a b) c)");
    check("a imply b or c xor d", "(Xor (Or (Imply a b) c) d)");
}

#[test]
fn and_binds_tighter_than_or() {
    check("a or b and c", "(Or a (And b c))");
    check("a && b || c && d", "(Or (And a b) (And c d))");
    check("a & b && c | d", "(And (BitAnd a b) (BitOr c d))");
}

#[test]
fn not_binds_tighter_than_every_binary_operator() {
    check("not a && b", "(And (Not a) b)");
    check("!a == b", "(Equal (Not a) b)");
    check("not not a", "(Not (Not a))");
}

#[test]
fn the_conditional_associates_to_the_right() {
    check("a ? b : c ? d : e", "(? a b (? c d e))");
    check("a ? b ? c : d : e", "(? a (? b c d) e)");
    check("a || b ? c : d", "(? (Or a b) c d)");
}

#[test]
fn assignments_associate_to_the_right_and_reach_into_the_last_branch() {
    check("a = b := c", "(= a (= b c))");
    check("a = b ? c : d", "(= a (? b c d))");
    check("a ? b : c = d", "(? a b (= c d))");
    check("a += b -= c", "(Add= a (Subtract= b c))");
    check("a <<= 1", "(ShiftLeft= a 1)");
    check(
        "a *= b /= c %= d",
        "(Multiply= a (Divide= b (Remainder= c d)))",
    );
    check(
        "a &= b |= c ^= d >>= e",
        "(BitAnd= a (BitOr= b (BitXor= c (ShiftRight= d e))))",
    );
}

#[test]
fn postfix_forms_bind_tightest() {
    check("-a[i].b(c)'", "(Minus (' (call (. ([] a i) b) c)))");
    check("++a[0]", "(pre+1 ([] a 0))");
    check("a++ + --b", "(Add (post+1 a) (pre-1 b))");
    check("P(1).x - y", "(Subtract (. (call P 1) x) y)");
    check("P.location == 1", "(Equal (. P location) 1)");
    check("x' == 0 && y <= 3", "(And (Equal (' x) 0) (LessEqual y 3))");
}

#[test]
fn the_body_of_a_quantifier_extends_to_the_right() {
    check(
        "a && forall (i : int[0,3]) b || c",
        "(And a (ForAll i (int 0 3) (Or b c)))",
    );
    check("(exists (i : id_t) b) || c", "(Or (Exists i id_t b) c)");
    check("!sum (i : T) x = i", "(Not (Sum i T (= x i)))");
}

#[test]
fn literals_keep_their_values() {
    check("2147483647 - 007", "(Subtract 2147483647 7)");
    check("1.5 + 2e3 + 1.5e-3", "(Add (Add 1.5 2000.0) 0.0015)");
    check("true != false", "(NotEqual true false)");
}

#[test]
fn the_smallest_int_is_legal_behind_a_minus_only() {
    check("-2147483648", "(Minus 2147483648)");
    check_mistake("2147483648", "E0104");
    check_mistake("a - 2147483648", "E0104");
    check_mistake("-(2147483648)", "E0104");
    check_mistake("99999999999999999999", "E0104");
    check_mistake("1e999", "E0104");
}

#[test]
fn words_of_the_query_language_are_names_in_models() {
    check(
        "A + U + W + R + E + M + sup + inf + bounds + deadlock + control + strategy + Pr",
        "(Add (Add (Add (Add (Add (Add (Add (Add (Add (Add (Add (Add A U) W) R) E) M) sup) inf) bounds) deadlock) control) strategy) Pr)",
    );
}

#[test]
fn comparisons_of_the_old_syntax_are_named_in_the_new_one() {
    check_mistake("x =< 3", "`=<` is not an operator");
    check_mistake("x => 3", "`=>` is not an operator");
}

#[test]
fn long_runs_of_a_connective_are_balanced_in_order() {
    let operands: Vec<String> = (0..5000).map(|i| format!("b{i}")).collect();
    let found = shape(&expression(&operands.join(" && ")));
    let names: Vec<&str> = found
        .split(['(', ')', ' '])
        .filter(|word| word.starts_with('b'))
        .collect();
    assert_eq!(names, operands);
    let depth = found
        .chars()
        .take_while(|&c| c != 'b')
        .filter(|&c| c == '(');
    assert!(depth.count() < 20);
}

#[test]
fn initialisers_may_be_nested_and_named() {
    let document = document("T x[2] = { { a: 1, b: {2, 3} }, y }; system P;");
    let Declaration::Variable(variable) = &document.declarations[0] else {
        panic!("a variable was declared");
    };
    let Some(Initialiser::List(items, _)) = &variable.initialiser else {
        panic!("it has a list of values");
    };
    assert!(items[0].0.is_none());
    let Initialiser::List(fields, _) = &items[0].1 else {
        panic!("its first value is a list");
    };
    let names: Vec<Option<&str>> = fields
        .iter()
        .map(|(name, _)| name.as_ref().map(|n| n.text.as_str()))
        .collect();
    assert_eq!(names, [Some("a"), Some("b")]);
}

#[test]
fn the_lists_of_a_for_loop_become_statements_in_their_order() {
    let document = document("void f() { for (i = 0, j = 1; i < 3; i++, j--) k++; } system P;");
    let Declaration::Function(function) = &document.declarations[0] else {
        panic!("a function was declared");
    };
    let Statement::Block(outer) = &function.body.statements[0] else {
        panic!("the first part has two expressions");
    };
    let Statement::Expr(first) = &outer.statements[0] else {
        panic!("the first of them stands before the loop");
    };
    assert_eq!(shape(first), "(= i 0)");
    let Statement::For {
        init, step, body, ..
    } = &outer.statements[1]
    else {
        panic!("the loop follows");
    };
    assert_eq!(init.as_ref().map(shape).as_deref(), Some("(= j 1)"));
    assert_eq!(step.as_ref().map(shape).as_deref(), Some("(post-1 j)"));
    let Statement::Block(body) = body.as_ref() else {
        panic!("the body has the first step at its end");
    };
    assert_eq!(body.statements.len(), 2);
}

#[test]
fn reserved_words_differ_between_models_and_queries() {
    let (found, _) = query("E<> P.for && P.while");
    let found = found.map(|query| query_shape(&query));
    assert_eq!(found.as_deref(), Some("E<> (And (. P for) (. P while))"));
    check_mistake("for + 1", "E0105");
}
