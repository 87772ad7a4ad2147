//! Functions of libraries that a C compiler makes here.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use checker::engine::{Answer, CodeEngine, LoadedModel, Options, Rejection};
use checker::exec::Libraries;
use checker::stochastic::Precision;

use super::joint;

/// A folder that is gone when the test ends.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("externals-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("the folder can be made");
        Folder(path)
    }

    /// Compiles a library into the folder.
    fn library(&self, name: &str, text: &str) -> PathBuf {
        let (source, library) = (self.0.join("library.c"), self.0.join(name));
        fs::write(&source, text).expect("the folder can be written");
        let output = Command::new("cc")
            .args(["-std=c99", "-Wall", "-Werror", "-O1", "-shared", "-fPIC"])
            .arg("-o")
            .args([&library, &source])
            .output()
            .expect("there is a C compiler");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        library
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What is left in a temporary folder does no harm.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn load(model: &str, allowed: &[&Path]) -> Result<LoadedModel, Rejection> {
    let allowed = allowed.iter().map(|path| path.to_path_buf()).collect();
    LoadedModel::load_with("model.xta", model.as_bytes(), &Libraries::new(allowed))
}

fn ask(model: &mut LoadedModel, query: &str, code: CodeEngine) -> Result<Answer, Rejection> {
    let query = model.add_query(query);
    let options = Options {
        code,
        precision: Precision {
            runs: Some(40),
            ..Precision::default()
        },
        ..Options::default()
    };
    model.check(&query, &options)
}

/// Checks the value of a query, by both engines.
#[track_caller]
fn expect(model: &str, allowed: &[&Path], query: &str, value: f64) {
    let mut model = match load(model, allowed) {
        Ok(model) => model,
        Err(rejection) => panic!("{}", rejection.rendered.join("\n")),
    };
    for code in [CodeEngine::Interpreter, CodeEngine::Jit] {
        let answer = match ask(&mut model, query, code) {
            Ok(answer) => answer,
            Err(rejection) => panic!("{}", rejection.rendered.join("\n")),
        };
        let estimate = answer.estimate.expect("there is an estimate");
        assert!(
            (estimate.value - value).abs() < 1e-12,
            "{query}: {} instead of {value}",
            estimate.value
        );
    }
}

/// Checks that loading or asking is refused, with these words.
#[track_caller]
fn refused(model: &str, allowed: &[&Path], query: &str, words: &[&str]) {
    for code in [CodeEngine::Interpreter, CodeEngine::Jit] {
        let answer = load(model, allowed).and_then(|mut model| ask(&mut model, query, code));
        let text = match answer {
            Ok(answer) => panic!("answered: {:?}", answer.estimate),
            Err(rejection) => rejection.rendered.join("\n"),
        };
        for word in words {
            assert!(text.contains(word), "no {word} in\n{text}");
        }
    }
}

/// A process that does this after a time unit, and then nothing any more.
fn once(declarations: &str, update: &str) -> String {
    format!(
        "{declarations}
         clock t;
         process P() {{
             state a {{ t <= 1 }}, b;
             init a;
             trans a -> b {{ guard t >= 1; assign {update}; }};
         }}
         system P;"
    )
}

#[test]
fn values_are_passed_and_returned() {
    let folder = Folder::new("values");
    let library = folder.library(
        "libvalues.so",
        "#include <stdbool.h>
         #include <stdint.h>
         int32_t weighed(int32_t a, bool b, double c, int32_t d, double e, bool f, int32_t g, \
                         int32_t h, int32_t i) {
             return a + 10 * b + (int32_t)c + 1000 * d + (int32_t)e + 100000 * f + g + h + i;
         }
         double half(int32_t n) { return n / 2.0; }
         bool is_odd(int32_t n) { return n & 1; }
         bool turned(bool b) { return !b; }",
    );
    let declarations = r#"import "libvalues.so" {
            int32_t weighed(int32_t a, bool b, double c, int d, double e, bool f, int g, int h,
                            int i);
            double half(int n);
            odd = bool is_odd(int n);
            bool turned(bool b);
        };
        int32_t n; double d; bool isOdd, isEven;"#;
    let update = "n = weighed(-7, true, 200.9, 3, -40000.5, true, 1, 2, 3), d = half(-5),
                  isOdd = odd(7), isEven = turned(isOdd)";
    let model = once(declarations, update);
    let of = |query: &str| format!("E[<=2;40](max: t >= 1.5 ? {query} : -1e9)");
    expect(
        &model,
        &[&library],
        &of("n + 0.0"),
        f64::from(-7 + 10 + 200 + 3000 - 40000 + 100_000 + 6),
    );
    expect(&model, &[&library], &of("d"), -2.5);
    expect(&model, &[&library], &of("isOdd * 2 + isEven + 0.0"), 2.0);
}

#[test]
fn arrays_and_references_are_changed_in_place() {
    let folder = Folder::new("arrays");
    let library = folder.library(
        "libarrays.so",
        "#include <stdbool.h>
         void turn(int *v, int n) {
             for (int i = 0; i < n / 2; ++i) { int k = v[i]; v[i] = v[n-1-i]; v[n-1-i] = k; }
         }
         double mix(double *v, const double *w, bool *seen) {
             double sum = 0;
             for (int i = 0; i < 3; ++i) { v[i] += 2 * w[i]; sum += v[i]; seen[i] = v[i] > 4; }
             return sum;
         }
         void twice(int *n) { *n *= 2; }
         void move(double *x) { *x += 5; }
         void halve(double *all) { all[0] /= 2; all[1] /= 2; }",
    );
    let declarations = r#"import "arrays" {
            void turn(int& v[4], int n);
            double mix(double& v[3], const double& w[3], bool& seen[3]);
            void twice(int& n);
            void move(clock& x);
            void halve(clock& all[2]);
        };
        int values[4] = {1, 2, 3, 4};
        const double weights[3] = {0.5, 1.0, 1.5};
        bool odd; double sums[3] = {1.0, 2.0, 3.0}, total; bool seen[3];
        clock x, two[2]; int n = 21;"#;
    let update = "turn(values, 4), total = mix(sums, weights, seen), twice(n), move(x), halve(two)";
    let model = once(declarations, update);
    let of = |query: &str| format!("E[<=1;40](max: P.b ? {query} : -1e9)");
    let query = "values[0] * 1000 + values[1] * 100 + values[2] * 10 + values[3] + 0.0";
    // The bare name `arrays` stands for libarrays.so, found in the folder.
    expect(&model, &[&folder.0], &of(query), 4321.0);
    expect(&model, &[&library], &of("total + 0.0"), 12.0);
    expect(&model, &[&library], &of("sums[1]"), 4.0);
    expect(
        &model,
        &[&library],
        &of("seen[0] * 4 + seen[1] * 2 + seen[2] + 0.0"),
        1.0,
    );
    expect(&model, &[&library], &of("n + 0.0"), 42.0);
    expect(&model, &[&library], &of("x"), 6.0);
    expect(&model, &[&library], &of("two[0] + two[1]"), 1.0);
}

#[test]
fn what_a_function_leaves_is_within_its_range() {
    let folder = Folder::new("ranges");
    let library = folder.library(
        "libranges.so",
        "int seven(void) { return 7; }
         void nine(int *v) { v[1] = 9; }",
    );
    let model = |update: &str| {
        let declarations = r#"typedef int[0,6] few_t;
            import "libranges.so" { few_t seven(); void nine(few_t& v[2]); };
            few_t n, v[2];"#;
        once(declarations, update)
    };
    for update in ["n = seven()", "nine(v)"] {
        let query = "Pr[<=2](<> n > 0)";
        refused(
            &model(update),
            &[&library],
            query,
            &["E0806", "value out of range"],
        );
    }
}

#[test]
fn texts_come_with_their_end() {
    let folder = Folder::new("texts");
    let library = folder.library(
        "libtexts.so",
        "int length(const char *text) { int n = 0; while (text[n]) ++n; return n; }
         int first(const char *text) { return text[0]; }",
    );
    let declarations = r#"import "libtexts.so" {
            int length(const string& text); int first(string text);
        };
        const string name = "a\\b";
        int n;"#;
    for (call, value) in [
        (r#"length("")"#, 0.0),
        (r#"length("abc")"#, 3.0),
        (r#"length("abcd")"#, 4.0),
        (r#"length("äöü")"#, 6.0),
        ("length(name)", 3.0),
        ("first(name)", 97.0),
    ] {
        let model = once(declarations, &format!("n = {call}"));
        expect(&model, &[&library], "E[<=2;40](max: n + 0.0)", value);
    }
    let model = once(declarations, "n = length(n)");
    refused(
        &model,
        &[&library],
        "Pr[<=2](<> n > 0)",
        &["E0224", "a text is needed"],
    );
}

#[test]
fn constants_and_hooks_call_libraries() {
    let folder = Folder::new("constants");
    let library = folder.library(
        "libconstants.so",
        "static int table, begun, ended;
         void __ON_CONSTRUCT__(void) { table = 5; }
         void __ON_BEGIN__(void) { ++begun; }
         void __ON_END__(void) { ++ended; }
         int size(int n) { return table + n; }
         int queries(void) { return 10 * begun + ended; }",
    );
    let model = r#"import "libconstants.so" { int size(int n); int queries(); };
        const int N = size(2);
        int values[N], last, asked;
        void __ON_BEGIN__() { last = size(90); }
        process P() {
            state a { ; 1000 }, b;
            init a;
            trans a -> b { assign asked = queries(); };
        }
        system P;"#;
    let mut loaded = load(model, &[&library]).unwrap_or_else(|error| {
        panic!("{}", error.rendered.join("\n"));
    });
    let mut value = |query: &str| {
        let answer = ask(&mut loaded, query, CodeEngine::Jit);
        let answer = answer.unwrap_or_else(|error| panic!("{}", error.rendered.join("\n")));
        answer.estimate.expect("there is an estimate").value
    };
    let count = "E[<=1;40](max: sum(i : int[0,N-1]) 1 + 0.0)";
    assert!((value(count) - 7.0).abs() < 1e-12);
    assert!((value("E[<=1;40](max: last + 0.0)") - 95.0).abs() < 1e-12);
    assert!((value("E[<=1;40](max: asked + 0.0)") - 32.0).abs() < 1e-12);
    // Queries that are answered together begin and end once.
    let queries = ["E[<=1;40](max: asked + 0.0)", "E[<=1;40](min: 1 - asked)"];
    let queries = queries.map(|query| joint(&mut loaded, query));
    let answers = loaded.check_jointly(&queries, &Options::default());
    let answers = answers.unwrap_or_else(|error| panic!("{}", error.rendered.join("\n")));
    let values = answers
        .iter()
        .map(|one| one.estimate.as_ref().map(|estimate| estimate.value));
    let values: Vec<Option<f64>> = values.collect();
    assert_eq!(values, [Some(43.0), Some(-42.0)]);
}

#[test]
fn nothing_is_loaded_that_is_not_allowed() {
    let folder = Folder::new("allowed");
    let library = folder.library("liballowed.so", "int f(int n) { return n; }");
    let declarations = format!(
        "import \"{}\" {{ int f(int n); }}; int n;",
        library.display()
    );
    let model = once(&declarations, "n = n > 100 ? f(n) : 3");
    // What does not call the function is answered.
    expect(&model, &[], "E[<=2;40](max: n + 0.0)", 3.0);
    let symbolic = load(&model, &[]).expect("the model is right");
    assert!(
        symbolic.expect_symbolic().is_err(),
        "an update needs the function"
    );
    let model = once(&declarations, "n = f(3)");
    let help = [
        "E0806",
        "n allowed",
        "--allow-external",
        "liballowed.so",
        "runs the code",
    ];
    refused(
        &model,
        &[],
        "Pr[<=2](<> n > 0)",
        &[&["not allowed"], &help[2..]].concat(),
    );
    let other = folder.0.join("libother.so");
    refused(
        &model,
        &[&other],
        "Pr[<=2](<> n > 0)",
        &["none of what is allowed holds it"],
    );
    let constant =
        format!("{declarations} const int N = f(3); process P() {{ state a; init a; }} system P;");
    refused(
        &constant,
        &[],
        "Pr[<=2](<> n > 0)",
        &["E0216", "--allow-external"],
    );
    let unused = once(&declarations, "n = 3");
    let symbolic = load(&unused, &[]).expect("the model is right");
    assert!(
        symbolic.expect_symbolic().is_ok(),
        "nothing needs the function"
    );
}

#[test]
fn libraries_that_are_not_as_the_model_says_are_refused() {
    let folder = Folder::new("wrong");
    let library = folder.library("libwrong.so", "int f(int n) { return n; }");
    let model = once(
        r#"import "libwrong.so" { int g(int n); }; int n;"#,
        "n = g(3)",
    );
    refused(
        &model,
        &[&library],
        "Pr[<=2](<> n > 0)",
        &["E0295", "no function 'g'"],
    );
    let text = folder.0.join("libtext.so");
    fs::write(&text, "no library").expect("the folder can be written");
    let model = once(
        r#"import "libtext.so" { int f(int n); }; int n;"#,
        "n = f(3)",
    );
    refused(
        &model,
        &[&text],
        "Pr[<=2](<> n > 0)",
        &["E0294", "no library that can be loaded"],
    );
    // The same library for another processor: the field e_machine of its header.
    let mut bytes = fs::read(&library).expect("the library is there");
    bytes[18..20].copy_from_slice(&0x2a_u16.to_le_bytes());
    let other = folder.0.join("libother.so");
    fs::write(&other, bytes).expect("the folder can be written");
    let model = once(
        r#"import "libother.so" { int f(int n); }; int n;"#,
        "n = f(3)",
    );
    refused(
        &model,
        &[&other],
        "Pr[<=2](<> n > 0)",
        &["E0294", "this system and processor"],
    );
}

#[test]
fn a_library_that_changes_is_not_taken_for_the_old_one() {
    let folder = Folder::new("changed");
    let library = folder.library("libchanged.so", "int f(int n) { return n; }");
    let model = once(
        r#"import "libchanged.so" { int f(int n); }; int n;"#,
        "n = f(3)",
    );
    expect(&model, &[&library], "E[<=2;40](max: n + 0.0)", 3.0);
    fs::remove_file(&library).expect("the library is there");
    folder.library(
        "libchanged.so",
        "int f(int n) { return n + 1; } int more(void) { return 1; }",
    );
    refused(
        &model,
        &[&library],
        "Pr[<=2](<> n > 0)",
        &["E0294", "has changed"],
    );
}

#[test]
fn a_function_that_is_not_deterministic_is_found() {
    let folder = Folder::new("counter");
    let library = folder.library(
        "libcounter.so",
        "static int calls; int next(void) { return ++calls; }",
    );
    let model = once(
        r#"import "libcounter.so" { int next(); }; int n;"#,
        "n = next()",
    );
    let words = ["E0806", "'next'", "not deterministic"];
    refused(&model, &[&library], "E[<=2;40](max: n + 0.0)", &words);
    refused(&model, &[&library], "simulate[<=2;1]{ n }", &words);
    // Together with others, too.
    for code in [CodeEngine::Interpreter, CodeEngine::Jit] {
        let mut model = load(&model, &[&library]).expect("the model is accepted");
        let queries = ["Pr[<=2](<> P.b)", "E[<=2;40](max: n)"];
        let queries = queries.map(|query| joint(&mut model, query));
        let options = Options {
            code,
            ..Options::default()
        };
        let text = match model.check_jointly(&queries, &options) {
            Ok(_) => panic!("answered"),
            Err(rejection) => rejection.rendered.join("\n"),
        };
        for word in words {
            assert!(text.contains(word), "no {word} in\n{text}");
        }
    }
}

#[test]
fn signatures_without_a_meaning_in_c_are_refused() {
    for (declaration, word) in [
        ("int f(int values[3]);", "write & before the name"),
        ("int f(int& values[3][2]);", "one dimension"),
        ("int f(scalar[3]& n);", "an integer, a truth value"),
        ("int f(chan& c);", "cannot be given to an imported function"),
    ] {
        let model = once(
            &format!("import \"libnone.so\" {{ {declaration} }}; int n;"),
            "n = 1",
        );
        refused(&model, &[], "Pr[<=2](<> n > 0)", &["E0293", word]);
    }
    let model = once(
        r#"typedef struct { int a; } pair_t; import "libnone.so" { pair_t f(); }; int n;"#,
        "n = 1",
    );
    refused(
        &model,
        &[],
        "Pr[<=2](<> n > 0)",
        &["E0293", "cannot return"],
    );
}

#[test]
fn conditions_on_clocks_that_a_library_computes_need_the_library() {
    let model = r#"import "libnone.so" { bool f(double x); }; clock x;
        process P() { state a { ; 1 }, b; init a; trans a -> b { guard f(x); }; } system P;"#;
    refused(model, &[], "Pr[<=2](<> P.b)", &["E0806", "libnone.so"]);
}
