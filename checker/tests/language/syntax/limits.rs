//! Hostile input: whatever is too deep, too long or no text at all ends in a diagnostic and not in
//! a crash.

use crate::syntax::support::{mistakes, query, with_guard};

fn check(text: &str, expected: &str) {
    let found = mistakes(text.as_bytes());
    assert!(
        found.iter().any(|mistake| mistake.contains(expected)),
        "{text:.60}…: {found:?}"
    );
}

const DEEP: usize = 100_000;

#[test]
fn deep_expressions_are_refused() {
    for opening in [
        "(",
        "-",
        "!",
        "not ",
        "++",
        "a[",
        "f(",
        "a ? b : ",
        "a = ",
        "a ? ",
        "f(a, ",
        "forall (i : T) ",
        "forall (i : int[0, ",
        "sum (i : scalar[",
    ] {
        check(&with_guard(&opening.repeat(DEEP)), "E0106");
    }
}

#[test]
fn long_chains_are_refused_unless_they_are_conjunctions_or_disjunctions() {
    for link in ["a + ", "a - ", "a == ", "a imply ", "a | ", "a xor b || "] {
        let text = with_guard(&format!("{}a", link.repeat(DEEP)));
        check(&text, "E0106");
    }
    for link in [".a", "[0]", "()", "'", "++"] {
        let text = with_guard(&format!("a{}", link.repeat(DEEP)));
        check(&text, "E0106");
    }
    for link in ["a && ", "a or "] {
        let text = with_guard(&format!("{}a", link.repeat(DEEP)));
        assert_eq!(mistakes(text.as_bytes()), Vec::<String>::new());
    }
}

#[test]
fn deep_heights_add_up_across_types() {
    let range = format!("forall (i : int[0, {}1]) ", "1 + ".repeat(400));
    let text = with_guard(&format!("{}true", range.repeat(50)));
    assert_eq!(mistakes(text.as_bytes()), Vec::<String>::new());
    let mut inner = "1".to_owned();
    for _ in 0..20 {
        inner = format!("(forall (i : int[0, {inner}{}]) true)", " + 1".repeat(100));
    }
    check(&with_guard(&inner), "E0106");
}

#[test]
fn deep_declarations_are_refused() {
    for opening in [
        "int x = {{",
        "struct { struct {",
        "void f() { {",
        "void f() { if (a) if (a)",
        "void f() { while (a) while (a)",
        "void f() { do do",
        "void f() { for (i : T) for (i : T)",
    ] {
        let (start, again) = opening.split_at(opening.len() / 2);
        let text = format!("{start}{}", again.repeat(DEEP));
        let found = mistakes(text.as_bytes());
        assert!(!found.is_empty(), "{opening}");
        assert!(found.len() <= 101, "{opening}: {} mistakes", found.len());
    }
    check(&format!("int x = {}", "{".repeat(DEEP)), "E0106");
    check(&format!("void f() {}", "{".repeat(DEEP)), "E0106");
    check(&format!("{} int x;", "struct { ".repeat(DEEP)), "E0106");
}

#[test]
fn long_chains_of_else_if_are_read_and_blocks_in_them_are_counted() {
    let chain = "if (a) ; else ".repeat(DEEP);
    let text = format!("void f() {{ {chain} a = 1; }}");
    let found = mistakes(text.as_bytes());
    assert!(!found.iter().any(|one| one.contains("E0106")), "{found:?}");
    let deep = "if (a) { if (a) ; else ".repeat(DEEP);
    check(&format!("void f() {{ {deep}"), "E0106");
}

#[test]
fn deep_queries_are_refused() {
    for opening in ["E<> ", "A[] (", "control: A[] (", "control: A[ ", "{ "] {
        let (found, diagnostics) = query(&opening.repeat(DEEP));
        assert!(found.is_none());
        assert!(!diagnostics.is_empty());
    }
    let (found, _) = query(&format!("E<> {}", "(".repeat(DEEP)));
    assert!(found.is_none());
}

#[test]
fn at_most_a_hundred_mistakes_are_reported() {
    let text = format!("{} system P;", "int x y;\n".repeat(10_000));
    let found = mistakes(text.as_bytes());
    assert_eq!(found.len(), 101);
    assert!(found[100].starts_with("E0111"));
    let labels = "<location><label kind=\"invariant\">1 1</label></location>".repeat(10_000);
    let text =
        format!("<nta><template><name>T</name>{labels}</template><system>system T;</system></nta>");
    assert_eq!(mistakes(text.as_bytes()).len(), 101);
}

#[test]
fn files_that_are_no_models_get_one_diagnostic() {
    for (bytes, expected) in [
        (&b""[..], "E0122 at 1:1 \"the file is empty\""),
        (b" \r\n\t\n", "E0122 at 1:1 \"the file is empty\""),
        (b"\xef\xbb\xbf", "E0122 at 1:1 \"the file is empty\""),
        (
            b"\x7fELF\x02\x01\x01\x00\x00",
            "E0121 at 1:1 \"this is a binary file, not a text\"",
        ),
        (
            b"\xff\xfe\x00",
            "E0123 at 1:1 \"the file begins like UTF-16, but is not UTF-16\"",
        ),
        (
            b"<?xml version=\"1.0\" encoding=\"koi8-r\"?><nta>\xd0</nta>",
            "E0123 at 1:1 \"the encoding `koi8-r` is not supported\"",
        ),
        (
            b"# Notes\n\nSee the other file; it is better.",
            "E0121 at 1:1 \"this text is not a UPPAAL model\"",
        ),
        (
            b"<html><body/></html>",
            "E0121 at 1:1 \"this XML file is not a UPPAAL model: its root is `<html>`\"",
        ),
        (b"<nta>\n<template>\n</nta>", "E0120 at 3:1"),
        (b"<nta>&nbsp;</nta>", "E0120 at 1:6"),
        (b"<", "E0120"),
    ] {
        let found = mistakes(bytes);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].starts_with(expected), "{found:?}");
    }
}

#[test]
fn entity_bombs_are_refused() {
    let declared = (1..12).map(|level| {
        let references = format!("&a{};", level - 1).repeat(10);
        format!("<!ENTITY a{level} \"{references}\">")
    });
    let entities: Vec<String> = std::iter::once("<!ENTITY a0 \"aaaaaaaaaa\">".to_owned())
        .chain(declared)
        .collect();
    let entities = entities.concat();
    let nested = format!("<!DOCTYPE nta [{entities}]><nta>&a11;</nta>");
    assert!(mistakes(nested.as_bytes())[0].starts_with("E0120"));
    let long = "a".repeat(100_000);
    let flat = format!(
        "<!DOCTYPE nta [<!ENTITY a \"{long}\">]><nta>{}</nta>",
        "&a;".repeat(100_000)
    );
    assert!(mistakes(flat.as_bytes())[0].starts_with("E0120"));
}

#[test]
fn deeply_nested_elements_do_no_harm() {
    let text = format!("<nta>{}{}</nta>", "<a>".repeat(DEEP), "</a>".repeat(DEEP));
    let found = mistakes(text.as_bytes());
    assert_eq!(found, ["E0128 at 1:1 \"no `<system>` element\""]);
}
