//! The three formats: what the tree holds, and where things stand in the file.

use crate::syntax::support::{document, mistakes, shape};
use checker::diagnostics::SourceMap;
use checker::syntax::ast::{Declaration, Expectation, Expr, Point, SystemItem};
use checker::syntax::{prelude, read_model};

fn nta(templates: &str) -> String {
    format!("<nta>{templates}<system>system T;</system></nta>")
}

/// A template with locations `a` (named `Free`) and `b`, and one edge with these labels.
fn template(labels: &str) -> String {
    nta(&format!(
        "<template><name>T</name><location id=\"a\"><name>Free</name></location>\
         <location id=\"b\"/><init ref=\"a\"/>\
         <transition><source ref=\"a\"/><target ref=\"b\"/>{labels}</transition></template>"
    ))
}

fn shape_of(expr: Option<&Expr>) -> String {
    expr.map_or(String::new(), shape)
}

#[test]
fn labels_of_an_edge() {
    let document = document(&template(
        "<label kind=\"select\">i : int[0,3], j : T</label>\
         <label kind=\"guard\">x &lt; 3 &amp;&amp; y &gt;= i</label>\
         <label kind=\"synchronisation\">c[i]!</label>\
         <label kind=\"assignment\">x = 0, f(j)</label>\
         <label kind=\"probability\">3</label>\
         <label kind=\"comments\">x @ y</label><nail x=\"1\" y=\"-2\"/>",
    ));
    let edge = &document.templates[0].edges[0];
    assert_eq!(edge.select.len(), 2);
    assert_eq!(
        shape_of(edge.guard.as_ref()),
        "(And (Less x 3) (GreaterEqual y i))"
    );
    let sync = edge.sync.as_ref().expect("the edge synchronises");
    assert!(sync.send);
    assert_eq!(shape(&sync.channel), "([] c i)");
    let update: Vec<String> = edge.update.iter().map(shape).collect();
    assert_eq!(update, ["(= x 0)", "(call f j)"]);
    assert_eq!(shape_of(edge.probability.as_ref()), "3");
    assert_eq!(edge.nails, [Point { x: 1, y: -2 }]);
    assert!(edge.controllable);
}

#[test]
fn blank_labels_and_labels_with_comments_only_are_absent() {
    let document = document(&template(
        "<label kind=\"guard\"> </label><label kind=\"synchronisation\"/>\
         <label kind=\"assignment\">// none\n /* at all */</label>",
    ));
    let edge = &document.templates[0].edges[0];
    assert!(edge.guard.is_none() && edge.sync.is_none() && edge.update.is_empty());
}

#[test]
fn an_edge_is_controllable_if_the_attribute_is_absent_or_true() {
    for (attribute, expected) in [
        ("", true),
        (" controllable=\"true\"", true),
        (" controllable=\"false\"", false),
        (" controllable=\"FALSE\"", false),
        (" controllable=\"True\"", false),
        (" controllable=\"\"", false),
        (" controllable=\"0\"", false),
    ] {
        let text = template("").replace("<transition>", &format!("<transition{attribute}>"));
        let document = document(&text);
        assert_eq!(
            document.templates[0].edges[0].controllable, expected,
            "{attribute}"
        );
    }
}

#[test]
fn locations_keep_their_marks() {
    let document = document(&nta(
        "<template><name>T</name><location id=\"a\" x=\"3\" y=\"4.6\"><name> L </name>\
         <label kind=\"invariant\">x' == 0</label><label kind=\"exponentialrate\">1 : 2</label>\
         <urgent/></location><location id=\"b\"><committed/></location>\
         <branchpoint id=\"c\" x=\"0\" y=\"0\"/><init ref=\"a\"/></template>",
    ));
    let template = &document.templates[0];
    let [first, second] = &template.locations[..] else {
        panic!("there are two locations");
    };
    assert_eq!(first.name.as_ref().map(|n| n.text.as_str()), Some("L"));
    assert_eq!(first.position, Some(Point { x: 3, y: 5 }));
    assert_eq!(shape_of(first.invariant.as_ref()), "(Equal (' x) 0)");
    assert_eq!(
        shape_of(first.exponential_rate.as_ref()),
        "(Divide (Multiply 1.0 1) 2)"
    );
    assert!(first.urgent && !first.committed && second.committed && second.name.is_none());
    assert_eq!(template.branchpoints[0].id, "c");
    assert_eq!(
        template.initial.as_ref().map(|n| n.text.as_str()),
        Some("a")
    );
}

#[test]
fn queries_of_the_file_come_with_comment_and_expectation() {
    let text = template("").replace(
        "</nta>",
        "<queries><option key=\"--diagnostic\" value=\"0\"/>\
         <query><formula>A[] x\n &lt; 3</formula><comment> bound </comment>\
         <expect outcome=\"failure\" type=\"quality\"/><result outcome=\"success\"/></query>\
         <query><formula/></query><query><formula>// later</formula></query>\
         <query><formula>sup: x</formula><expect outcome=\"success\" type=\"quantity\" value=\"7\"/></query>\
         </queries></nta>",
    );
    let document = document(&text);
    let found: Vec<(&str, &str, Option<&Expectation>)> = document
        .queries
        .iter()
        .map(|q| (q.text.as_str(), q.comment.as_str(), q.expect.as_ref()))
        .collect();
    assert_eq!(
        found,
        [
            ("A[] x < 3", "bound", Some(&Expectation::False)),
            ("sup: x", "", Some(&Expectation::Number(7.0))),
        ]
    );
}

#[test]
fn every_document_type_is_read_without_looking_it_up() {
    for head in [
        "",
        "<?xml version=\"1.0\"?>",
        "<?xml version='1.0' encoding='utf-8'?>\r\n<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.1//EN' 'http://www.it.uu.se/research/group/darts/uppaal/flat-1_2.dtd'>\r\n",
        "<!DOCTYPE nta SYSTEM \"no such file.dtd\">",
        "<!DOCTYPE nta [<!ENTITY lt2 \"&#38;lt;\"><!ELEMENT nta ANY>]>",
    ] {
        let document = document(&format!("{head}{}", template("")));
        assert_eq!(document.templates.len(), 1, "{head}");
    }
}

#[test]
fn the_root_may_be_a_project_and_instantiations_may_stand_apart() {
    let document = document(
        "<project><declaration>int x;</declaration><instantiation>P = T(1);</instantiation>\
         <system>int y; Q(int[0,3] i) = T(i); system P, Q;</system></project>",
    );
    assert_eq!(document.declarations.len(), 1);
    let kinds: Vec<&str> = document
        .system
        .items
        .iter()
        .map(|item| match item {
            SystemItem::Declaration(_) => "declaration",
            SystemItem::Instantiation { name, .. } => name.text.as_str(),
        })
        .collect();
    assert_eq!(kinds, ["P", "declaration", "Q"]);
}

#[test]
fn encodings_are_understood() {
    let text = "<?xml version=\"1.0\" encoding=\"ENC\"?><nta><declaration>// \u{e4}\u{f6}\nint x</declaration><system>system T;</system></nta>";
    let latin1: Vec<u8> = text
        .replace("ENC", "iso-8859-1")
        .chars()
        .map(|c| u8::try_from(u32::from(c)).expect("the text is Latin-1"))
        .collect();
    let utf16: Vec<u8> = std::iter::once(0xfeff)
        .chain(text.replace("ENC", "utf-16").encode_utf16())
        .flat_map(u16::to_be_bytes)
        .collect();
    let utf8 = format!("\u{feff}{}", text.replace("ENC", "utf-8")).into_bytes();
    let expected = "E0105 at 2:6 \"expected `;` after the declaration, found the end of the text\"";
    for bytes in [latin1, utf16, utf8] {
        assert_eq!(mistakes(&bytes), [expected]);
    }
}

#[test]
fn bytes_that_are_not_utf8_are_read_as_latin1_with_a_warning() {
    let found = mistakes(b"// \xe4\nint x; system P;");
    assert_eq!(
        found,
        ["W0106 at 1:1 \"the file is not UTF-8; it is read as Latin-1\""]
    );
}

/// The places of the mistakes in a model, in words and in the file.
fn places(text: &str) -> Vec<(String, u32, u32)> {
    let mut sources = SourceMap::default();
    let parsed = read_model("model.xml", text.as_bytes(), &mut sources);
    parsed
        .diagnostics
        .iter()
        .map(|diagnostic| {
            let position = sources.position(diagnostic.span);
            let place = sources.get(diagnostic.span.source).place.clone();
            (place, position.line, position.column)
        })
        .collect()
}

#[test]
fn mistakes_stand_at_their_place_in_the_file_and_in_words() {
    let text = "<nta>\r\n<declaration>int x\r\n int y;</declaration>\r\n<template><name>Gate</name>\
        <parameter>int &amp;n, int</parameter>\r\n<declaration>clock &#x63;; int &lt;;</declaration>\r\n\
        <location id=\"a\"><name>Free</name><label kind=\"invariant\">x &lt;= 3 3</label></location>\r\n\
        <location id=\"b\"><name>Occ</name></location><init ref=\"a\"/>\r\n\
        <transition><source ref=\"a\"/><target ref=\"b\"/>\r\n<label kind=\"guard\"><![CDATA[a &&\r\n x < ]]>&amp; 1</label></transition>\r\n\
        </template><system>system Gate</system></nta>";
    let expected = [
        ("global declarations", 2, 19),
        ("template Gate, parameters", 4, 54),
        ("template Gate, declarations", 5, 32),
        ("template Gate, location Free, invariant", 6, 69),
        ("template Gate, edge Free → Occ, guard", 10, 9),
        ("system declarations", 11, 31),
    ];
    let found = places(text);
    let found: Vec<(&str, u32, u32)> = found.iter().map(|(p, l, c)| (p.as_str(), *l, *c)).collect();
    assert_eq!(found, expected);
}

#[test]
fn columns_count_characters() {
    let found = places("<nta><declaration>\nint ä;</declaration><system>system T;</system></nta>");
    assert_eq!(found, [("global declarations".to_owned(), 2, 5)]);
    let found = places(
        "<nta><declaration>\n/* äöü */ int x y;</declaration><system>system T;</system></nta>",
    );
    assert_eq!(found, [("global declarations".to_owned(), 2, 17)]);
}

#[test]
fn entities_of_the_file_are_expanded() {
    let text = format!(
        "<!DOCTYPE nta [<!ENTITY bound \"3\">]>{}",
        template("<label kind=\"guard\">x &lt; &bound;</label>")
    );
    let document = document(&text);
    assert_eq!(
        shape_of(document.templates[0].edges[0].guard.as_ref()),
        "(Less x 3)"
    );
}

#[test]
fn a_textual_process() {
    let document = document(
        "clock x; chan c;\n\
         process P(int[0,3] i, int &n) { int k; state A{x <= 3; 5}, B, C{; 1 : 2}; branchpoint X;\n\
         commit B; urgent C; init A;\n\
         trans A -> X { select j : int[0,1]; guard x >= j; sync c!; assign x = 0, n = j; },\n\
         X -> B { probability 3; }, -> C { }, A -u-> B { sync c?; }, -u-> C { guard i == 0; }; }\n\
         P0 = P(0, y); system P0;",
    );
    let template = &document.templates[0];
    assert!(template.parameters[1].reference && !template.parameters[0].reference);
    let marks: Vec<(&str, bool, bool)> = template
        .locations
        .iter()
        .map(|l| (l.id.as_str(), l.urgent, l.committed))
        .collect();
    assert_eq!(
        marks,
        [("A", false, false), ("B", false, true), ("C", true, false)]
    );
    let edges: Vec<(&str, &str, bool)> = template
        .edges
        .iter()
        .map(|e| {
            (
                e.source.text.as_str(),
                e.target.text.as_str(),
                e.controllable,
            )
        })
        .collect();
    assert_eq!(
        edges,
        [
            ("A", "X", true),
            ("X", "B", true),
            ("X", "C", true),
            ("A", "B", false),
            ("A", "C", false)
        ]
    );
    assert_eq!(
        shape_of(template.locations[2].exponential_rate.as_ref()),
        "(Divide (Multiply 1.0 1) 2)"
    );
}

#[test]
fn the_old_syntax_is_recognised_by_what_only_it_has() {
    let document = document(
        "const n 3, m -1; const a[2] {1, 2}; int x; chan c;\n\
         process P(clock y, z; const k) { const if 1; state A{y =< n, z <= k}, B; init A;\n\
         trans A -> B { guard y => 1, x == 0; sync c!; assign y := 0, x := if; }; }\n\
         Q := P(y, z, 4); system Q;",
    );
    let constants = document.declarations.iter().filter(|d| {
        matches!(d, Declaration::Variable(v) if v.ty.prefixes.constant && v.initialiser.is_some())
    });
    assert_eq!(constants.count(), 3);
    let template = &document.templates[0];
    let references: Vec<bool> = template.parameters.iter().map(|p| p.reference).collect();
    assert_eq!(references, [true, true, false]);
    assert_eq!(
        shape_of(template.locations[0].invariant.as_ref()),
        "(And (LessEqual y n) (LessEqual z k))"
    );
    assert_eq!(
        shape_of(template.edges[0].guard.as_ref()),
        "(And (GreaterEqual y 1) (Equal x 0))"
    );
}

#[test]
fn declarations_before_a_later_process_are_global() {
    let document = document(
        "process P() { state A; init A; } Q = P(); int x; process R() { state A; init A; } int y; system Q, R;",
    );
    assert_eq!(document.declarations.len(), 1);
    assert_eq!(document.system.items.len(), 2);
}

#[test]
fn priorities_of_processes_and_channels() {
    let document = document("chan priority a, d[0] < default < b; system A, B < C;");
    let levels: Vec<usize> = document.system.processes.iter().map(Vec::len).collect();
    assert_eq!(levels, [2, 1]);
    let Declaration::ChannelPriority { levels, .. } = &document.declarations[0] else {
        panic!("priorities were declared");
    };
    let levels: Vec<Vec<String>> = levels
        .iter()
        .map(|level| level.iter().map(|e| shape_of(e.as_ref())).collect())
        .collect();
    assert_eq!(levels, [vec!["a", "([] d 0)"], vec![""], vec!["b"]]);
}

#[test]
fn the_prelude_declares_ranges_and_constants() {
    let mut sources = SourceMap::default();
    let names: Vec<String> = prelude(&mut sources)
        .iter()
        .map(|declaration| match declaration {
            Declaration::Typedef { name, .. } => name.text.clone(),
            Declaration::Variable(variable) => variable.name.text.clone(),
            other => panic!("the prelude holds {other:?}"),
        })
        .collect();
    assert_eq!(names.len(), 30);
    for name in [
        "INT32_MIN",
        "UINT8_MAX",
        "int8_t",
        "int32_t",
        "DBL_MAX",
        "M_PI",
        "M_SQRT1_2",
    ] {
        assert!(names.iter().any(|n| n == name), "{name}");
    }
}
