// A template: its texts, its picture, and the part that is chosen.
import { dialog } from "dialogs.js";
import { made } from "dom.js";
import { Drawing } from "drawing.js";
import { clear, fieldFor, focus } from "fields.js";
import { change, state } from "model.js";
import { attempt } from "server.js";

const LABELS = { name: "Name", invariant: "Invariant", exponentialrate: "Exponential rate", comments: "Comment", select: "Select", guard: "Guard", synchronisation: "Synchronisation", assignment: "Update", probability: "Weight" };
const MOST_LISTED = 300;
let drawing = null, number = 0, box = null, list = null, search = "", chosen = null;

const template = () => state.parts.templates[number];
const base = () => `templates/${number}`;
const button = (title, work) => made("button", { type: "button", click: () => attempt(work) }, title);

export const nameOf = (one) => (one.texts?.name ?? "").trim() || one.id;
function ends() {
  const nodes = template().locations.map((one) => [one.id, nameOf(one)]);
  return [...nodes, ...template().branch_points.map((one) => [one.id, `branch point ${one.id}`])];
}
function titleOf(edge) {
  const names = new Map(ends()), { guard, synchronisation } = edge.texts;
  const labels = [guard, synchronisation].map((one) => (one ?? "").trim()).filter(Boolean).join(", ");
  return `${names.get(edge.source) ?? edge.source} → ${names.get(edge.target) ?? edge.target}${labels ? `: ${labels}` : ""}`;
}

// What must be the same for the view to stay: only texts and places differ.
export const signature = (one) => JSON.stringify([one.locations.map(({ id, initial, kind }) => [id, initial, kind]), one.branch_points.map(({ id }) => id), one.edges.map(({ source, target, controllable, nails }) => [source, target, controllable, nails.length])]);

export function showTemplate(which, view, address) {
  number = which;
  chosen = null;
  search = "";
  box = made("div", { id: "drawing", tabindex: "0", role: "group", "aria-label": "Picture; drag locations, or move the chosen one with the arrow keys" });
  drawing = new Drawing(box, which, (one) => choose(one), (wish) => attempt(() => change(wish)));
  list = made("div", { id: "chosen" });
  const named = (event) => { search = event.target.value; showLists(); };
  view.append(
    made("div", { class: "bar", role: "group", "aria-label": "New parts" },
      button("New location", newLocation), button("New edge", newEdge), button("New branch point", () => added({ do: "add-branch-point" })),
      button("Arrange", arrange), button("Remove template", () => remove(base(), "template", (template().name ?? "").trim())),
      made("button", { type: "button", "aria-label": "Smaller", click: () => drawing.scale(drawing.zoom / 1.25) }, "−"),
      made("button", { type: "button", "aria-label": "Larger", click: () => drawing.scale(drawing.zoom * 1.25) }, "+")),
    made("div", { class: "template-view" }, made("div", {}, box, fieldFor(`${base()}/name`, "Name"), fieldFor(`${base()}/parameter`, "Parameters"), fieldFor(`${base()}/declaration`, "Declarations of the template", { large: true })),
      made("div", {}, made("label", {}, "Search parts ", made("input", { type: "search", input: named })), made("ul", { class: "parts", id: "locations", "aria-label": "Locations and branch points" }), made("ul", { class: "parts", id: "edges", "aria-label": "Edges" }), list)));
  showLists();
  attempt(() => drawing.draw());
  if (address !== base()) choose(address);
}

// Shows the newest texts; the parts are the same.
export function refreshTemplate() {
  showLists();
  if (chosen) list.querySelector("h2").textContent = headingOf(chosen);
  attempt(() => drawing.draw());
}

function headingOf(address) {
  const [, , kind, inner] = address.split("/"), part = template()[kind][inner];
  if (kind === "edges") return `Edge ${titleOf(part)}`;
  return kind === "locations" ? `Location ${nameOf(part)}` : `Branch point ${part.id}`;
}

function showLists() {
  const wanted = search.toLowerCase();
  const rows = (kind, parts, title) => parts.map((one, n) => [`${base()}/${kind}/${n}`, title(one)]).filter(([, text]) => text.toLowerCase().includes(wanted)).map(([address, text]) => made("li", {}, made("button", { type: "button", "aria-current": String(chosen === address), "data-part": address, click: () => choose(address) }, text)));
  const fill = (id, all) => {
    const focused = document.activeElement?.dataset?.part;
    const rest = all.length > MOST_LISTED ? [made("li", { class: "note" }, `and ${all.length - MOST_LISTED} more; search for them`)] : [];
    const place = document.getElementById(id);
    place.replaceChildren(...all.slice(0, MOST_LISTED), ...rest);
    if (focused) [...place.querySelectorAll("button")].find((one) => one.dataset.part === focused)?.focus();
  };
  const { locations, branch_points: points, edges } = template();
  fill("locations", [...rows("locations", locations, (one) => `${nameOf(one)}${one.initial ? " (initial)" : ""}${one.kind === "normal" ? "" : ` (${one.kind})`}`), ...rows("branch_points", points, (one) => `branch point ${one.id}`)]);
  fill("edges", rows("edges", edges, titleOf));
}

// Shows the fields of a part; an address of one of its texts goes there.
export function choose(address) {
  const [, , kind, inner, text] = address.split("/"), part = template()[kind]?.[inner];
  if (!part) return;
  const own = `${base()}/${kind}/${inner}`;
  if (chosen !== own) {
    if (chosen) clear(`${chosen}/`);
    chosen = own;
    const parts = [made("h2", {}, headingOf(own))];
    if (kind === "locations") parts.push(...ofLocation(own, part));
    if (kind === "edges") parts.push(...ofEdge(own, part));
    for (const label of Object.keys(part.texts ?? {})) parts.push(fieldFor(`${own}/${label}`, LABELS[label] ?? label));
    parts.push(button("Remove", () => remove(own, { locations: "location", branch_points: "branch point", edges: "edge" }[kind], kind === "edges" ? titleOf(part) : nameOf(part))));
    list.replaceChildren(...parts);
  }
  drawing.light(own);
  for (const one of document.querySelectorAll(".parts button")) one.setAttribute("aria-current", String(one.dataset.part === own));
  if (text) focus({ address });
}

function ofLocation(address, part) {
  const kinds = made("select", { change: (event) => attempt(() => change({ do: "kind", address, kind: event.target.value })) }, ...["normal", "urgent", "committed"].map((one) => made("option", { value: one, selected: part.kind === one }, one)));
  return [made("div", { class: "bar" }, made("label", {}, "Kind ", kinds), part.initial ? made("span", { class: "note" }, "Processes start here.") : button("Start here", () => change({ do: "initial", address })))];
}

function ofEdge(address, part) {
  const owner = made("input", { type: "checkbox", checked: part.controllable, change: (event) => attempt(() => change({ do: "controllable", address, controllable: event.target.checked })) });
  const end = (name, title) => made("label", {}, `${title} `, made("select", { change: (event) => attempt(() => change({ do: "end", address, end: name, to: event.target.value })) },
    ...ends().map(([value, label]) => made("option", { value, selected: part[name] === value }, label))));
  const middle = () => {
    const at = (id) => [...template().locations, ...template().branch_points].find((one) => one.id === id)?.place ?? [0, 0];
    const [a, b] = [part.nails.at(-1) ?? at(part.source), at(part.target)];
    return [Math.round((a[0] + b[0]) / 2), Math.round((a[1] + b[1]) / 2)];
  };
  return [made("div", { class: "bar" }, end("source", "From"), end("target", "To")), made("div", { class: "bar" }, made("label", {}, owner, " controllable"),
    button("Add bend", () => { const [x, y] = middle(); return change({ do: "move-bend", address, number: part.nails.length, x, y }); }),
    part.nails.length ? button("Remove last bend", () => change({ do: "remove-bend", address, number: part.nails.length - 1 })) : null)];
}

const added = (wish) => change({ ...wish, address: base() });

async function arrange() {
  const before = state.version;
  await change({ do: "arrange", address: base() });
  if (state.version === before) throw new Error("every part has a place already\nhint: drag what stands wrong");
}

function newLocation() {
  const kinds = ["normal", "urgent", "committed"].map((one) => [one, one]);
  dialog("New location", [{ name: "name", label: "Name" }, { name: "kind", label: "Kind", choices: kinds }], "Add", (values) => added({ do: "add-location", ...values }));
}

function newEdge() {
  const choices = ends();
  if (!choices.length) throw new Error("the template has no locations yet\nhint: add one first");
  const source = chosen?.includes("/locations/") ? template().locations[chosen.split("/")[3]].id : choices[0][0];
  dialog("New edge", [
    { name: "source", label: "From", choices, value: source }, { name: "target", label: "To", choices },
    ...["select", "guard", "synchronisation", "assignment"].map((name) => ({ name, label: LABELS[name], example: { select: "i : int[0, 2]", guard: "x >= 2", synchronisation: "go!", assignment: "x = 0" }[name] })),
    { name: "controllable", label: "controllable", check: true },
  ], "Add", (values) => added({ do: "add-edge", ...values }));
}

function remove(address, kind, name) {
  const own = state.parts && address.includes("/locations/") ? template().locations[address.split("/")[3]].id : address.includes("/branch_points/") ? template().branch_points[address.split("/")[3]].id : null;
  const count = own === null ? 0 : template().edges.filter((one) => one.source === own || one.target === own).length;
  const text = count ? `Its ${count === 1 ? "edge is" : `${count} edges are`} removed, too. Undo brings all back.` : "Undo brings it back.";
  dialog(`Remove the ${kind} ${name}?`, [{ text }], "Remove", () => change({ do: "remove", address }));
}
