// The editor: shows the parts of the model of the address, and goes to places in them.
import { dialog } from "dialogs.js";
import { $, made, say } from "dom.js";
import * as fields from "fields.js";
import { showMistakes } from "mistakes.js";
import { accept, change, lookForMistakes, ofWhole, on, state } from "model.js";
import { showOutline, viewOf } from "outline.js";
import { ask, attempt, complain, identity, page, request, tell } from "server.js";
import { choose, refreshTemplate, showTemplate, signature } from "template.js";

let shown = null, shape = "", place = null;

const TITLES = { declaration: "Declarations", instantiation: "Instantiations", system: "System" };

const shapeOf = (view) => {
  const [kind, number] = view.split("/");
  if (kind === "templates") return signature(state.parts.templates[number]);
  return kind === "queries" ? String(state.parts.queries.length) : "";
};
const isThere = (view) => {
  if (view === "text") return true;
  const [kind, number] = view.split("/");
  return Boolean(state.parts) && (kind !== "templates" || Number(number) < state.parts.templates.length) && (kind !== "instantiation" || state.parts.instantiation !== null);
};

// Shows a part, and goes to a place in it.
async function show(at) {
  let view = viewOf(at.address || "declaration");
  if (!isThere(view)) view = isThere("declaration") ? "declaration" : "text";
  if (view !== shown || shape !== shapeOf(view)) await build(view, at.address);
  else if (view.startsWith("templates/")) choose(at.address);
  if (at.address.split("/").length > 1 || at.from !== undefined) {
    if (!fields.focus(at)) $("view").focus();
  }
  place = at.address;
  sessionStorage.setItem(`ntagen-edit-${identity()}`, at.address);
}

let wholeText = "";
async function readWhole() {
  const bytes = await (await ask("GET", `/api/edits/${identity()}/text`)).arrayBuffer();
  wholeText = new TextDecoder("utf-8", { ignoreBOM: true }).decode(bytes).replace(/\r\n?/g, "\n");
}

async function build(view, address) {
  fields.clear();
  if (view === "text") await readWhole();
  shown = view;
  shape = shapeOf(view);
  const box = $("view");
  box.replaceChildren();
  const [kind, number] = view.split("/");
  if (kind === "templates") showTemplate(Number(number), box, address ?? view);
  else if (kind === "queries") showQueries(box);
  else box.append(fields.fieldFor(view, TITLES[view] ?? "Whole file", { large: true, text: view === "text" ? wholeText : null }));
  ofWhole(view === "text");
  if (state.problem) tell(`Only the whole text can be edited now: ${state.problem}`);
  showOutline(shown, go);
  lookForMistakes();
}

function showQueries(box) {
  state.parts.queries.forEach((one, n) => box.append(made("div", { class: "query" },
    fields.fieldFor(`queries/${n}/formula`, `Query ${n + 1}`), fields.fieldFor(`queries/${n}/comment`, "Comment"),
    made("button", { type: "button", click: () => attempt(() => change({ do: "remove", address: `queries/${n}` })) }, `Remove query ${n + 1}`))));
  const add = () => dialog("New query", [{ name: "formula", label: "Formula", example: "E<> Gate.Open" }, { name: "comment", label: "Comment" }], "Add", (values) => change({ do: "add-query", ...values }));
  box.append(made("div", {}, made("button", { type: "button", click: add }, "New query")));
}

const go = (at) => attempt(() => show(at));

async function modelChanged(told) {
  $("undo").disabled = !state.undo;
  $("redo").disabled = !state.redo;
  $("save").hidden = !state.savable;
  $("save").disabled = !state.changed;
  say($("state"), state.changed ? (state.savable ? "not saved" : "changed") : "");
  $("state").className = state.changed ? "note changed" : "note";
  document.title = `${state.changed ? "* " : ""}${state.name}: edit`;
  // A text that was typed here is shown already.
  if (told.wish === "text") return settle();
  if (told.address === undefined) return;
  if (shown === "text" && (told.address === "text" || !state.parts)) {
    await readWhole();
    fields.refresh(() => wholeText);
    return showOutline(shown, go);
  }
  const view = viewOf(told.address || shown);
  if (view === shown && isThere(view) && shape === shapeOf(view)) {
    fields.refresh();
    if (view.startsWith("templates/")) {
      refreshTemplate();
      choose(told.address);
    }
    showOutline(shown, go);
    if (told.wish === "undo" || told.wish === "redo") fields.focus({ address: told.address });
    return;
  }
  await show({ address: told.address || (isThere(shown) ? shown : "") });
}

let settling = null;
// The picture and the lists follow what is typed, a little later.
function settle() {
  clearTimeout(settling);
  settling = setTimeout(() => { if (shown.startsWith("templates/") && isThere(shown)) refreshTemplate(); showOutline(shown, go); }, 300);
}

const wishes = {
  undo: () => fields.giveUp(() => change({ do: "undo" })),
  redo: () => change({ do: "redo" }),
  save: () => save(false),
};

async function save(anyway) {
  try {
    await change({ do: "save", anyway });
    tell("saved");
  } catch (error) {
    complain(error);
    $("anyway").hidden = error.status !== 409 || !/Save anyway/.test(error.message);
  }
}

async function download() {
  await fields.flush();
  const blob = await ask("GET", `/api/edits/${identity()}/file`);
  const link = made("a", { href: URL.createObjectURL(blob), download: state.name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// The other pages get the model as it is now, as a file of its own.
async function asFile() {
  await fields.flush();
  return (await ask("POST", `/api/edits/${identity()}/files`, "")).file;
}

async function begin() {
  if (!identity()) throw new Error("no model is edited here\nhint: open the page of queries, and press Edit");
  const told = await request({ do: "open" });
  say($("name"), told.name);
  $("queries").hash = told.file;
  state.isXml = told.xml;
  fields.begin(go, wishes);
  on("model", (news) => attempt(() => modelChanged(news)));
  on("mistakes", (error) => { showMistakes(go, error); showOutline(shown, go); });
  accept(told);
  $("work").hidden = false;
  await show({ address: sessionStorage.getItem(`ntagen-edit-${identity()}`) || (state.parts ? "declaration" : "text") });
}

$("undo").onclick = () => attempt(wishes.undo);
$("redo").onclick = () => attempt(wishes.redo);
$("save").onclick = () => attempt(wishes.save);
$("anyway").onclick = () => attempt(() => save(true));
$("download").onclick = () => attempt(download);
$("check").onclick = () => attempt(async () => location.assign(page("/", await asFile())));
$("simulate").onclick = () => attempt(async () => {
  const { simulation } = await ask("POST", `/api/files/${await asFile()}/simulations`, "");
  location.assign(page("/simulator", simulation));
});
$("add-template").onclick = () => dialog("New template", [{ name: "name", label: "Name", example: "Gate" }], "Add", (values) => change({ do: "add-template", ...values }));
$("close").onclick = () => complain(null);
addEventListener("pagehide", fields.sendAtOnce);
addEventListener("hashchange", () => location.reload());
addEventListener("keydown", (event) => {
  const isTyping = event.target.closest?.(".cm-editor, input, select, dialog");
  if (!(event.ctrlKey || event.metaKey) || isTyping) return;
  const work = { z: event.shiftKey ? wishes.redo : wishes.undo, y: wishes.redo, s: wishes.save }[event.key.toLowerCase()];
  if (work) { event.preventDefault(); attempt(work); }
});
attempt(begin);
