// The texts that are shown: each is a field of CodeMirror. What is typed goes to the server, which keeps
// the list of edits, so undo and redo are asked of it.
import {
  Annotation, autocompletion, bracketMatching, closeBrackets, closeBracketsKeymap, completionKeymap, defaultKeymap, drawSelection, EditorState, EditorView,
  highlightSelectionMatches, hoverTooltip, indentUnit, keymap, lineNumbers, lintKeymap, search, searchKeymap, setDiagnostics,
} from "codemirror.js";
import { made } from "dom.js";
import { lookOf } from "language.js";
import { flushWith, inquire, keepText, on, sent, state, textAt } from "model.js";
import { attempt, complain, post, tell } from "server.js";

const TYPED_MS = 120, JOIN_MS = 900, GROUP_MS = 6000;
const nonce = document.querySelector("script").nonce;
const fromServer = Annotation.define();
const fields = new Map();

let go = () => {}, wishes = {};
// `show` goes to a place; `doing` has what undo, redo and save do.
export function begin(show, doing) { go = show; wishes = doing; }

let timer = null;
const waiting = new Set();
const group = { address: null, sent: 0, begun: 0 };

// Sends what was typed and not sent yet.
export async function flush() {
  clearTimeout(timer);
  for (const field of [...waiting]) await send(field);
}

flushWith(flush);

// The page goes away: what was typed last is sent without waiting.
export function sendAtOnce() {
  for (const { address, view } of waiting) post({ do: "text", address, text: view.state.doc.toString(), version: state.version });
}

// Does something; if what was typed last is refused, that is given up instead.
export async function giveUp(work) {
  try { await flush(); } catch (error) {
    if (!error.status) throw error;
    waiting.clear();
    refresh();
    return null;
  }
  return work();
}

async function send(field) {
  waiting.delete(field);
  const now = performance.now(), { address } = field;
  const join = group.address === address && now - group.sent < JOIN_MS && now - group.begun < GROUP_MS;
  Object.assign(group, { address, sent: now, begun: join ? group.begun : now });
  const text = field.view.state.doc.toString();
  try {
    await sent({ do: "text", address, text, join });
    complain(null);
    keepText(address, text);
  } catch (error) {
    waiting.add(field);
    throw error;
  }
}

const isTyped = (update) => update.docChanged && !update.transactions.some((one) => one.annotation(fromServer));

function typed(field) {
  tell("");
  waiting.add(field);
  clearTimeout(timer);
  timer = setTimeout(() => send(field).catch(complain), TYPED_MS);
}

// The next edit does not join the last one.
export const closeGroup = () => { group.address = null; };

async function completed(address, context) {
  const word = context.matchBefore(/[A-Za-z_]\w*|\./);
  if (!word && !context.explicit) return null;
  const found = await inquire({ do: "complete", address, at: context.pos }).catch(() => null);
  if (!found?.options || context.aborted) return null;
  const kinds = { clock: "variable", channel: "interface", process: "class", template: "class", location: "enum", bound: "variable", field: "property", parameter: "variable", strategy: "namespace" };
  const options = found.options.map(({ label, kind, detail, info }) => ({ label, type: kinds[kind] || kind, detail: detail === label ? kind : detail.slice(0, 60) || kind, ...(info ? { info } : {}) }));
  return { from: found.from, options, validFor: /^\w*$/ };
}

async function defined(field, at) {
  const found = await inquire({ do: "define", address: field.address, at });
  if (!found.name) return tell("No name with a declaration stands here.");
  if (!found.at) return tell(`${found.name} is declared by the language: ${found.detail}`);
  go(found.at);
}

const hovers = (field) => hoverTooltip(async (view, at) => {
  if (!/\w/.test(view.state.sliceDoc(at, at + 1))) return null;
  const found = await inquire({ do: "define", address: field.address, at }).catch(() => null);
  if (!found?.name) return null;
  return { pos: at, create: () => ({ dom: made("div", { class: "cm-hover" }, found.detail || found.name, found.comment ? `\n${found.comment}` : "") }) };
}, { hoverTime: 500 });

function keysOf(field) {
  const wish = (work) => () => { attempt(work); return true; };
  return keymap.of([
    { key: "Mod-z", run: wish(() => wishes.undo()), preventDefault: true },
    { key: "Mod-y", mac: "Mod-Shift-z", run: wish(() => wishes.redo()), preventDefault: true },
    { key: "Mod-Shift-z", run: wish(() => wishes.redo()), preventDefault: true },
    { key: "Mod-s", run: wish(() => wishes.save()), preventDefault: true },
    { key: "F12", run: (view) => { attempt(() => defined(field, view.state.selection.main.head)); return true; }, preventDefault: true },
    ...closeBracketsKeymap, ...completionKeymap, ...lintKeymap, ...searchKeymap, ...defaultKeymap,
  ]);
}

// A field for the text at an address. A large one has line numbers and takes the room that there is.
export function fieldFor(address, title, { large = false, text = null } = {}) {
  const field = { address, view: null };
  const isXml = address === "text" && state.isXml;
  const clicked = (event, view) => {
    if (!(event.ctrlKey || event.metaKey) || event.button !== 0) return false;
    const at = view.posAtCoords({ x: event.clientX, y: event.clientY });
    if (at === null) return false;
    event.preventDefault();
    attempt(() => defined(field, at));
    return true;
  };
  field.view = new EditorView({
    doc: text ?? textAt(address) ?? "",
    extensions: [
      EditorView.cspNonce.of(nonce), keysOf(field), ...lookOf(isXml), ...(large ? [lineNumbers(), search({ top: true }), highlightSelectionMatches()] : []),
      drawSelection(), bracketMatching(), closeBrackets(), indentUnit.of("    "), EditorState.tabSize.of(4), EditorView.lineWrapping, hovers(field),
      autocompletion({ override: [(context) => completed(address, context)] }),
      EditorView.contentAttributes.of({ "aria-label": title, spellcheck: "false" }),
      EditorView.domEventHandlers({ mousedown: clicked, blur: () => { if (waiting.has(field)) send(field).catch(complain); closeGroup(); } }),
      EditorView.updateListener.of((update) => { if (isTyped(update)) typed(field); }),
    ],
  });
  fields.set(address, field);
  mark(field);
  return made("div", { class: large ? "field whole" : "field", "data-address": address }, made("span", { class: "title" }, title), field.view.dom);
}

// Forgets the fields whose addresses begin so; something else is shown in their place.
export function clear(beginning = "") {
  for (const [address, field] of fields) {
    if (!address.startsWith(beginning)) continue;
    field.view.destroy();
    fields.delete(address);
  }
}

// Puts the cursor at a place of a field that is shown; whether it is.
export function focus({ address, from, to }) {
  const field = fields.get(address);
  if (!field) return false;
  const most = field.view.state.doc.length;
  field.view.focus();
  if (from !== undefined) field.view.dispatch({ selection: { anchor: Math.min(from, most), head: Math.min(to ?? from, most) }, scrollIntoView: true });
  return true;
}

// Shows the texts of the model in all fields that nobody has typed in since; the cursor goes to what has changed.
export function refresh(textOf = textAt) {
  for (const field of fields.values()) {
    if (waiting.has(field)) continue;
    const fresh = textOf(field.address) ?? "", old = field.view.state.doc.toString();
    if (fresh === old) continue;
    let start = 0, end = 0;
    const most = Math.min(fresh.length, old.length);
    while (start < most && fresh[start] === old[start]) start += 1;
    while (end < most - start && fresh[fresh.length - 1 - end] === old[old.length - 1 - end]) end += 1;
    const insert = fresh.slice(start, fresh.length - end);
    field.view.dispatch({ changes: { from: start, to: old.length - end, insert }, selection: { anchor: start + insert.length }, annotations: fromServer.of(true) });
  }
}

function mark(field) {
  const most = field.view.state.doc.length;
  const own = state.mistakes.filter((one) => one.at?.address === field.address).map((one) => ({
    from: Math.min(one.at.from, most), to: Math.min(Math.max(one.at.to, one.at.from + 1), most), severity: one.severity, source: one.code,
    message: [one.message, ...one.notes, one.hint && `hint: ${one.hint}`].filter(Boolean).join("\n"),
  }));
  field.view.dispatch(setDiagnostics(field.view.state, own));
}

on("mistakes", () => { for (const field of fields.values()) mark(field); });
