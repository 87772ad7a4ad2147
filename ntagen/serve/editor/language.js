// How UPPAAL's language is coloured. What it means is asked of the server.
import { EditorView, HighlightStyle, StreamLanguage, syntaxHighlighting, tags } from "codemirror.js";

const KEYWORDS = new Set(("and assert before_update after_update branchpoint broadcast chan commit const control deadlock default do dynamic else exists exit false for forall foreach gantt guard hybrid if import imply inf init maxE maxPr meta minE minPr not or priority probability process progress query rate return select simulate spawn state strategy sum sup sync system assign trans true typedef under urgent location while xor").split(" "));
const TYPES = new Set(["bool", "clock", "double", "int", "scalar", "string", "struct", "void"]);

const uppaal = StreamLanguage.define({
  startState: () => ({ inComment: false }),
  token(stream, state) {
    if (state.inComment || stream.match("/*")) {
      state.inComment = !stream.match(/^.*?\*\//);
      if (state.inComment) stream.skipToEnd();
      return "comment";
    }
    if (stream.match("//")) { stream.skipToEnd(); return "comment"; }
    if (stream.match(/^"(?:[^"\\]|\\.)*"?/)) return "string";
    if (stream.match(/^\d+(?:\.\d+)?(?:[eE][+-]?\d+)?/)) return "number";
    const word = stream.match(/^[A-Za-z_]\w*/);
    if (word) return TYPES.has(word[0]) ? "typeName" : KEYWORDS.has(word[0]) ? "keyword" : "variableName";
    stream.next();
    return null;
  },
  languageData: { commentTokens: { line: "//", block: { open: "/*", close: "*/" } }, closeBrackets: { brackets: ["(", "[", "{", '"'] } },
});

const xml = StreamLanguage.define({
  startState: () => ({ inside: "" }),
  token(stream, state) {
    if (state.inside === "comment" || stream.match("<!--")) {
      state.inside = stream.match(/^.*?-->/) ? "" : (stream.skipToEnd(), "comment");
      return "comment";
    }
    if (state.inside === "tag") {
      if (stream.match(/^"[^"]*"?|^'[^']*'?/)) return "string";
      if (stream.match(/^[/?]?>/)) { state.inside = ""; return "keyword"; }
      if (stream.match(/^[\w:.-]+/)) return "typeName";
      stream.next();
      return null;
    }
    if (stream.match(/^<[/?!]?[\w:.-]+/)) { state.inside = "tag"; return "keyword"; }
    if (stream.match(/^&[^;\s]*;/)) return "number";
    if (!stream.match(/^[^<&]+/)) stream.next();
    return null;
  },
});

const colors = HighlightStyle.define([
  { tag: tags.comment, color: "var(--soft)", fontStyle: "italic" },
  { tag: tags.keyword, color: "var(--update)", fontWeight: "600" },
  { tag: tags.typeName, color: "var(--sync)" },
  { tag: tags.number, color: "var(--weight)" },
  { tag: tags.string, color: "var(--guard)" },
]);

const theme = EditorView.theme({
  "&": { color: "var(--text)", backgroundColor: "var(--field)", border: "1px solid var(--line)", borderRadius: "4px", fontSize: "13px" },
  "&.cm-focused": { outline: "3px solid var(--accent)", outlineOffset: "1px" },
  ".cm-scroller": { fontFamily: "ui-monospace, monospace", lineHeight: "1.5" },
  ".cm-content": { caretColor: "var(--text)" },
  ".cm-cursor": { borderLeftColor: "var(--text)", borderLeftWidth: "2px" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { backgroundColor: "var(--faint)" },
  ".cm-gutters": { color: "var(--soft)", backgroundColor: "var(--panel)", border: "0" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "transparent" },
  ".cm-selectionMatch": { backgroundColor: "transparent", outline: "1px dotted var(--line)" },
  "&.cm-focused .cm-matchingBracket": { backgroundColor: "var(--faint)", outline: "1px solid var(--line)" },
  "&.cm-focused .cm-nonmatchingBracket": { backgroundColor: "var(--warning-page)" },
  ".cm-tooltip, .cm-panels": { color: "var(--text)", backgroundColor: "var(--panel)", border: "1px solid var(--line)" },
  ".cm-tooltip.cm-tooltip-autocomplete > ul > li[aria-selected]": { color: "var(--on-accent)", backgroundColor: "var(--accent)" },
  ".cm-tooltip-autocomplete li[aria-selected] .cm-completionDetail": { color: "var(--on-accent)" },
  ".cm-completionDetail": { color: "var(--soft)" },
  ".cm-completionMatchedText": { textDecoration: "none", fontWeight: "700" },
  ".cm-panel input, .cm-panel button": { color: "var(--text)", backgroundColor: "var(--field)", backgroundImage: "none" },
  ".cm-diagnostic": { color: "var(--text)", whiteSpace: "pre-wrap" },
  ".cm-lintRange-error": { backgroundImage: "none", textDecoration: "underline wavy var(--warning) 1.5px", textUnderlineOffset: "3px" },
  ".cm-lintRange-warning": { backgroundImage: "none", textDecoration: "underline dotted var(--weight) 2px", textUnderlineOffset: "3px" },
  ".cm-searchMatch": { backgroundColor: "var(--faint)", outline: "1px solid var(--line)" },
  ".cm-hover": { padding: "4px 8px", maxWidth: "480px", whiteSpace: "pre-wrap", fontFamily: "ui-monospace, monospace", fontSize: "12px" },
});

export const lookOf = (isXml) => [isXml ? xml : uppaal, syntaxHighlighting(colors), theme];
