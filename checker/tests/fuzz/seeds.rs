//! What mutation begins from: the files of the corpus, and the texts that stand in them.

use std::fs;
use std::path::Path;

use checker::diagnostics::SourceMap;
use checker::syntax;

use crate::corpus;
use crate::evidence::Evidence;
use crate::targets::Kind;

/// Larger files take too long to be worth it.
const MOST_BYTES: usize = 20_000;

/// The seeds of every kind, and the words that mutation inserts.
pub(crate) struct Seeds {
    by_kind: Vec<Vec<Vec<u8>>>,
    pub(crate) words: Vec<Vec<u8>>,
    pub(crate) evidence: Evidence,
}

impl Seeds {
    pub(crate) fn read() -> Seeds {
        let mut seeds = Seeds {
            by_kind: vec![Vec::new(); Kind::ALL.len()],
            words: words(),
            evidence: Evidence::default(),
        };
        for file in corpus::files_and_more("FUZZ_SEEDS") {
            // Models at the limits take as long as the limits allow.
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with("limits") {
                continue;
            }
            let bytes = fs::read(&file).unwrap_or_default();
            if bytes.len() <= MOST_BYTES {
                seeds.add_file(&file, bytes);
            }
        }
        seeds.by_kind[Kind::Evidence as usize].clone_from(&seeds.evidence.inputs);
        for texts in &mut seeds.by_kind {
            texts.sort();
            texts.dedup();
            assert!(!texts.is_empty(), "every kind has a seed");
        }
        seeds
    }

    pub(crate) fn of(&self, kind: Kind) -> &[Vec<u8>] {
        &self.by_kind[kind as usize]
    }

    fn add(&mut self, kind: Kind, text: &[u8]) {
        if !text.is_empty() {
            self.by_kind[kind as usize].push(text.to_vec());
        }
    }

    /// Adds a file and its parts, each to its kind.
    fn add_file(&mut self, path: &Path, bytes: Vec<u8>) {
        let kind = match path.extension().and_then(|extension| extension.to_str()) {
            Some("xml") => Kind::Xml,
            Some("xta" | "ta") => Kind::Xta,
            Some("q") => Kind::QueryFile,
            _ => return,
        };
        if kind == Kind::QueryFile {
            for line in bytes.split(|&byte| byte == b'\n') {
                self.add(Kind::Query, line);
            }
        } else {
            let mut sources = SourceMap::default();
            let parsed = syntax::read_model("seed", bytes.as_slice(), &mut sources);
            for query in &parsed.document.queries {
                self.add(Kind::Query, query.text.as_bytes());
            }
        }
        if kind == Kind::Xml {
            self.add_parts(&String::from_utf8_lossy(&bytes));
        } else if kind == Kind::Xta {
            // The declarations stand before the first process, and those of the corpus name their
            // queries in comments.
            let text = String::from_utf8_lossy(&bytes);
            let declarations = text.split("process").next().unwrap_or("");
            self.add(Kind::Declarations, declarations.as_bytes());
            self.evidence.add_model(&bytes, &corpus::queries(&text));
            for line in text.lines() {
                if let Some((_, query)) = line.split_once(": ") {
                    self.add(Kind::Query, query.as_bytes());
                    self.add(Kind::Expression, query.as_bytes());
                }
                for part in line.split([';', '{', '}']) {
                    self.add(Kind::Expression, part.as_bytes());
                }
            }
        }
        self.by_kind[kind as usize].push(bytes);
    }

    fn add_parts(&mut self, text: &str) {
        for (element, kind) in [
            ("declaration", Kind::Declarations),
            ("label", Kind::Expression),
            ("formula", Kind::Query),
        ] {
            for part in text.split(&format!("<{element}")).skip(1) {
                let part = part.split_once('>').map_or("", |(_, part)| part);
                let part = part.split("</").next().unwrap_or("");
                let part = part.replace("&lt;", "<").replace("&gt;", ">");
                self.add(kind, part.replace("&amp;", "&").as_bytes());
            }
        }
    }
}

/// Words of the language and numbers at its limits.
fn words() -> Vec<Vec<u8>> {
    let words = "int bool clock chan double scalar struct typedef const meta broadcast urgent hybrid void return for while do \
        if else assert forall exists sum true false not and or imply xor process state init trans guard sync assign select \
        commit branchpoint system priority default progress before_update after_update deadlock A[] E<> E[] A<> --> sup: inf: \
        bounds: control: strategy under saveStrategy simulate Pr[<=1] && || == != <= >= <? >? << >> ++ -- ** += -= *= /= %= := ' \
        ( ) [ ] { } , ; : . ? ! & | ^ ~ # $ \" \\ // /* */ 0 1 -1 2147483647 2147483648 -2147483648 65536 1e308 1e-308 0.5 \
        int[0,2147483647] int[-2147483648,2147483647] scalar[65536] a[1000000] fint( abs( pow( sqrt( random( x y i v t P T \
        <![CDATA[ ]]> &lt; &#0; &#x10ffff; <label> </label> <template> <!-- --> <?a?> <query> <formula>";
    words
        .split(' ')
        .filter(|word| !word.is_empty())
        .map(|word| word.as_bytes().to_vec())
        .collect()
}
