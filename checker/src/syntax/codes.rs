//! The mistakes that the readers report: `E01…` and `W01…`, each named by the defect.

use crate::diagnostics::codes;

codes! {
    /// A character that no token begins with.
    UNKNOWN_SYMBOL = "E0101" "unknown-symbol";
    /// `/*` without `*/`.
    UNCLOSED_COMMENT = "E0102" "unclosed-comment";
    /// `"` without a second one.
    UNCLOSED_STRING = "E0103" "unclosed-string";
    /// A literal that does not fit into its type.
    NUMBER_TOO_LARGE = "E0104" "number-too-large";
    /// The grammar asks for something else here.
    UNEXPECTED_TOKEN = "E0105" "unexpected-token";
    /// Brackets, operators or blocks nested deeper than any model needs.
    NESTING_TOO_DEEP = "E0106" "nesting-too-deep";
    /// A reserved word where a name is declared or used.
    KEYWORD_AS_NAME = "E0107" "keyword-as-name";
    /// A synchronisation without `!` or `?`.
    MISSING_DIRECTION = "E0108" "missing-direction";
    /// `=<` and `=>`, which only the old syntax knows.
    OLD_COMPARISON = "E0109" "old-comparison";
    /// `switch`, `break`, `continue`: reserved for a future UPPAAL.
    RESERVED_STATEMENT = "E0110" "reserved-statement";
    /// More mistakes than anybody reads.
    TOO_MANY_MISTAKES = "E0111" "too-many-mistakes";
    /// The file is not well-formed XML.
    MALFORMED_XML = "E0120" "malformed-xml";
    /// A file that is something else than a UPPAAL model.
    NOT_A_MODEL = "E0121" "not-a-model";
    /// A file without text.
    EMPTY_FILE = "E0122" "empty-file";
    /// An encoding that is unknown, or bytes that do not follow it.
    WRONG_ENCODING = "E0123" "wrong-encoding";
    /// An XML attribute or element that must be there.
    MISSING_PART = "E0124" "missing-part";
    /// A template with locations and without an initial one.
    MISSING_INITIAL_LOCATION = "E0125" "missing-initial-location";
    /// A location with both marks.
    URGENT_AND_COMMITTED = "E0126" "urgent-and-committed";
    /// A name in the XML that is not an identifier.
    INVALID_NAME = "E0127" "invalid-name";
    /// A model without a `system` line.
    MISSING_SYSTEM = "E0128" "missing-system";
    /// More bytes than positions can count.
    FILE_TOO_LARGE = "E0129" "file-too-large";
    /// `commit` or `urgent` with a name that is not a location.
    UNKNOWN_LOCATION = "E0130" "unknown-location";
    /// A query that is an expression only.
    MISSING_PATH_QUANTIFIER = "E0140" "missing-path-quantifier";
    /// A path quantifier inside another one.
    NESTED_PATH_QUANTIFIERS = "E0141" "nested-path-quantifiers";
    /// `control:` with a path formula that is not an objective.
    INVALID_OBJECTIVE = "E0142" "invalid-objective";
    /// `strategy S =` followed by a query that yields no strategy.
    NOT_A_STRATEGY = "E0143" "not-a-strategy";
    /// A query text without a query.
    EMPTY_QUERY = "E0144" "empty-query";
    /// `minPr` or `maxPr` with an expression.
    OPTIMUM_EXPRESSION = "E0145" "optimum-expression";
    /// A query for the best strategy with another path quantifier than `<>`, or without a goal that
    /// it needs.
    OPTIMUM_GOAL = "E0146" "optimum-goal";
    /// Two locations of a template with one `id`.
    DUPLICATE_ID = "W0101" "duplicate-id";
    /// A location that no query can name, because its name is a word of the query language.
    QUERY_WORD_AS_NAME = "W0102" "query-word-as-name";
    /// A declaration with the name of a built-in function, which UPPAAL 5 reserves.
    BUILT_IN_AS_NAME = "W0103" "built-in-as-name";
    /// Two labels of one kind on one edge or location; the last one counts.
    DUPLICATE_LABEL = "W0104" "duplicate-label";
    /// An `IO` line, which only queries look at that are not supported.
    INTERFACE_IGNORED = "W0107" "interface-ignored";
    /// Bytes that are not UTF-8 in a file that names no other encoding; they are read as Latin-1.
    NOT_UTF8 = "W0106" "not-utf8";
    /// `minE` or `maxE` without an expression.
    OPTIMUM_WITHOUT_PRICE = "W0108" "optimum-without-price";
    /// `minE` or `maxE` without a goal.
    OPTIMUM_WITHOUT_GOAL = "W0109" "optimum-without-goal";
    /// An expected verdict that is written in no known way.
    UNKNOWN_EXPECTATION = "W0105" "unknown-expectation";
}

/// After this many mistakes the rest of a text is left unread.
pub const MOST_MISTAKES: usize = 100;
