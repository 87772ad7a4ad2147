// The processes side by side: their pictures, with current locations, enabled and taken edges lit.
// A step changes only the classes of what it lights.
import { $, made, parsed, say } from "dom.js";
import { recalled, remember } from "store.js";
import { arrowsOf, locationOf } from "words.js";

const FOLDED_FROM = 25;  // With so many processes, all are folded at first.
const ZOOMS = [25, 33, 50, 67, 80, 100, 125, 150, 200, 300];

let model = null, cards = [], take = null, lit = [], marked = [], pictures = [], zoom = 100;
let movesOf = new Map();

export function begin(described, taking) {
  model = described;
  take = taking;
  pictures = model.templates.map(() => null);
  const isLarge = model.processes.length >= FOLDED_FROM;
  const open = new Set(recalled("open", isLarge ? [] : model.processes.map((_, i) => i)));
  cards = model.processes.map((process, i) => cardOf(process, i, open.has(i)));
  $("processes").replaceChildren(...cards.map((card) => card.root));
  zoomTo(recalled("zoom", 100));
  $("find").oninput = filter;
  $("moving").onchange = filter;
  $("fold").onclick = () => foldAll(true);
  $("unfold").onclick = () => foldAll(false);
  $("smaller").onclick = () => zoomBy(-1);
  $("larger").onclick = () => zoomBy(1);
  beginPanning($("processes"));
}

function cardOf(process, number, isOpen) {
  const place = made("span", { class: "place" }), count = made("span", { class: "count" });
  const head = made("button", { type: "button", "aria-expanded": String(isOpen) }, made("strong", {}, process.name), "  ", place, " ", count);
  const body = made("div", { hidden: !isOpen });
  const root = made("article", { "aria-label": process.name }, head, body);
  const card = { number, root, head, body, place, count, location: null, svg: null, locations: [], edges: [], picture: null };
  head.onclick = () => { fold(card, !body.hidden); keepFolds(); };
  return card;
}

function keepFolds() { remember("open", cards.filter((card) => !card.body.hidden).map((card) => card.number)); }

function fold(card, isFolded) {
  card.body.hidden = isFolded;
  card.head.setAttribute("aria-expanded", String(!isFolded));
  if (!isFolded && !card.svg) drawIn(card);
}

// Templates are parsed once; each process has a copy, which is made when it is unfolded.
function drawIn(card) {
  const number = model.processes[card.number].template;
  pictures[number] = pictures[number] || prepared(model.templates[number].svg);
  const svg = pictures[number].cloneNode(true);
  svg.classList.add("template");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", `Template ${model.templates[number].name}`);
  for (const kind of ["location", "edge"]) {
    for (const one of svg.querySelectorAll(`.${kind}`)) card[`${kind}s`][Number(one.dataset.number)] = one;
  }
  svg.addEventListener("click", (event) => clicked(card, event));
  card.svg = svg;
  size(card);
  card.body.replaceChildren(svg);
  if (card.location !== null) card.locations[card.location]?.classList.add("current");
  light();
}

// A picture with a wide line around each edge, which a mouse can hit.
function prepared(text) {
  const svg = parsed(text);
  for (const path of svg.querySelectorAll(".edge path")) {
    const hit = path.cloneNode();
    hit.setAttribute("class", "hit");
    path.after(hit);
  }
  return svg;
}

function clicked(card, event) {
  const edge = event.target.closest(".edge.enabled");
  if (!edge) return;
  const number = Number(edge.dataset.number);
  take(movesOf.get(card.number).filter((one) => one.arrows.includes(number)).map((one) => one.move));
}

let last = null;

export function show(view, way) {
  last = { view, way };
  view.state.locations.forEach((location, i) => {
    const card = cards[i];
    if (card.location === location) return;
    card.locations[card.location]?.classList.remove("current");
    card.locations[location]?.classList.add("current");
    card.location = location;
    say(card.place, locationOf(i, location));
  });
  movesOf = new Map();
  view.moves.forEach((one, move) => {
    for (const part of one.parts) {
      if (!movesOf.has(part[0])) movesOf.set(part[0], []);
      movesOf.get(part[0]).push({ move, arrows: arrowsOf(part) });
    }
  });
  for (const card of cards) {
    const count = movesOf.get(card.number)?.length || 0;
    say(card.count, count ? `▸ ${count}` : "");
    card.root.classList.toggle("can-move", count > 0);
  }
  light();
  if ($("moving").checked) filter();
}

// Lights the edges of the moves, and those of the last step.
function light() {
  for (const [element, name] of lit) element.classList.remove(name);
  lit = [];
  if (!last) return;
  const mark = (process, arrow, name) => {
    const element = cards[process].edges[arrow];
    if (element) { element.classList.add(name); lit.push([element, name]); }
  };
  for (const [process, moves] of movesOf) for (const one of moves) for (const arrow of one.arrows) mark(process, arrow, "enabled");
  const step = last.way[last.view.position - 1];
  for (const part of step ? step.parts : []) for (const arrow of arrowsOf(part)) mark(part[0], arrow, "taken");
}

// Shows which edges a move takes, while it is chosen; nothing for no move.
export function point(parts) {
  for (const element of marked) element.classList.remove("chosen");
  marked = parts.flatMap((part) => arrowsOf(part).map((arrow) => cards[part[0]].edges[arrow])).filter(Boolean);
  for (const element of marked) element.classList.add("chosen");
}

function filter() {
  const wanted = $("find").value.trim().toLowerCase(), isMoving = $("moving").checked;
  let shown = 0;
  for (const card of cards) {
    const place = card.location === null ? "" : locationOf(card.number, card.location);
    const isFound = !wanted || model.processes[card.number].name.toLowerCase().includes(wanted) || place.toLowerCase().includes(wanted);
    card.root.hidden = !isFound || (isMoving && !movesOf.has(card.number));
    if (!card.root.hidden) shown += 1;
  }
  say($("counted"), shown === cards.length ? "" : `${shown} of ${cards.length} processes are shown`);
}

function foldAll(isFolded) {
  for (const card of cards) if (!card.root.hidden) fold(card, isFolded);
  keepFolds();
}

function size(card) {
  const [, , width, height] = card.svg.getAttribute("viewBox").split(" ").map(Number);
  card.svg.setAttribute("width", (width * zoom) / 100);
  card.svg.setAttribute("height", (height * zoom) / 100);
}

function zoomTo(percent) {
  zoom = percent;
  say($("zoom"), `${percent} %`);
  for (const card of cards) if (card.svg) size(card);
  remember("zoom", percent);
}

function zoomBy(steps) {
  const at = ZOOMS.findIndex((one) => one >= zoom);
  zoomTo(ZOOMS[Math.min(Math.max(at + steps, 0), ZOOMS.length - 1)]);
}

function beginPanning(area) {
  let from = null;
  area.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    zoomBy(event.deltaY < 0 ? 1 : -1);
  }, { passive: false });
  area.addEventListener("pointerdown", (event) => {
    if (event.button === 0 && !event.target.closest("button, .enabled")) from = { x: event.clientX + area.scrollLeft, y: event.clientY + area.scrollTop };
  });
  addEventListener("pointermove", (event) => {
    if (!from) return;
    area.classList.add("dragged");
    area.scrollLeft = from.x - event.clientX;
    area.scrollTop = from.y - event.clientY;
  });
  addEventListener("pointerup", () => { from = null; area.classList.remove("dragged"); });
  area.addEventListener("keydown", (event) => {
    if (event.key === "+" || event.key === "-") zoomBy(event.key === "+" ? 1 : -1);
  });
}

// Draws what was unfolded before a reload.
export function drawOpen() {
  for (const card of cards) if (!card.body.hidden && !card.svg) drawIn(card);
}
