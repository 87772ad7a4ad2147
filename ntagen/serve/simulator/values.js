// Variables, clocks and the constraints of a zone.
import { $, made, say } from "dom.js";
import { recalled, remember } from "store.js";

const MOST_ROWS = 400;

let drawnNames = new Set(), changed = null, rows = new Map(), clockRows = new Map(), before = {};

export function begin(changing) {
  changed = changing;
  drawnNames = new Set(recalled("drawn", []));
  $("find-value").oninput = filter;
}

// What is drawn over time: of the names that the state has.
export const chosen = () => [...drawnNames].filter((name) => name in before);

export function show(view) {
  const { variables, clocks, zone, more } = view.state;
  fill($("variables").tBodies[0], rows, variables);
  $("clocks").hidden = !clocks;
  $("constraints").hidden = !zone;
  say($("clocks-title"), zone ? "Zone" : "Clocks");
  if (clocks) fill($("clocks").tBodies[0], clockRows, clocks);
  if (zone) {
    const texts = zone.length ? zone : ["every clock has any value"];
    $("constraints").replaceChildren(...texts.map((text) => made("li", {}, text)), more ? made("li", { class: "note" }, `… and ${more} more; the picture shows any two clocks`) : "");
  }
  $("more-values").hidden = !view.state.more_values;
  say($("more-values"), `… and ${view.state.more_values} more`);
  before = { ...variables, ...clocks };
}

// Only what changes is written.
function fill(body, known, values) {
  const names = Object.keys(values);
  if (names.length !== known.size || names.some((name) => !known.has(name))) {
    known.clear();
    body.replaceChildren(...names.map((name) => rowOf(known, name)));
    filter();
  }
  for (const name of names) {
    const { row, cell } = known.get(name), text = String(values[name]);
    say(cell, text);
    row.classList.toggle("changed", known === rows && name in before && String(before[name]) !== text);
  }
}

function rowOf(known, name) {
  const cell = made("td"), row = made("tr");
  const box = made("input", { type: "checkbox", "aria-label": `draw ${name} over time` });
  box.checked = drawnNames.has(name);
  box.onchange = () => {
    if (box.checked) drawnNames.add(name);
    else drawnNames.delete(name);
    remember("drawn", chosen());
    changed();
  };
  row.append(made("td", {}, box));
  row.append(made("td", {}, name), cell);
  known.set(name, { row, cell });
  return row;
}

function filter() {
  const wanted = $("find-value").value.trim().toLowerCase();
  for (const known of [rows, clockRows]) {
    let shown = 0;
    for (const [name, { row }] of known) {
      row.hidden = !name.toLowerCase().includes(wanted) || shown >= MOST_ROWS;
      if (!row.hidden) shown += 1;
    }
  }
}
