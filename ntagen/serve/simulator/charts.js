// What stands below the processes: tabs, the charts of the history, and values over time.
import { $, made, parsed } from "dom.js";
import { linesPicture } from "lines.js";
import { attempt, request } from "server.js";
import { recalled, remember } from "store.js";
import { chosen } from "values.js";
import { numberOf } from "words.js";

const TABS = ["gantt", "sequence", "series", "strategy", "runs"];
const panelOf = (tab) => $(`tab-${tab}`).getAttribute("aria-controls");

let selected = "gantt", view = null;

export function begin() {
  for (const tab of TABS) {
    $(`tab-${tab}`).onclick = () => select(tab);
    $(`tab-${tab}`).onkeydown = (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = TABS[(TABS.indexOf(tab) + step + TABS.length) % TABS.length];
      select(next);
      $(`tab-${next}`).focus();
    };
  }
  select(recalled("tab", "gantt"));
}

function select(tab) {
  selected = tab;
  remember("tab", tab);
  for (const one of TABS) {
    $(`tab-${one}`).setAttribute("aria-selected", String(one === tab));
    $(`tab-${one}`).tabIndex = one === tab ? 0 : -1;
    $(panelOf(one)).hidden = true;
  }
  $(panelOf(tab)).hidden = false;
  redraw();
}

export function show(now) {
  view = now;
  redraw();
}

let isDrawing = false, isStale = false;

// While a picture is made, only one more waits: that of the newest state.
export async function redraw() {
  if (!view || !["gantt", "sequence", "series"].includes(selected)) return;
  if (isDrawing) { isStale = true; return; }
  isDrawing = true;
  try { await (selected === "series" ? drawSeries() : drawChart(selected)); } finally { isDrawing = false; }
  if (isStale) { isStale = false; await redraw(); }
}

async function drawChart(kind) {
  let found;
  try { found = parsed((await request({ do: "chart", kind })).svg); } catch (error) { found = made("p", { class: "warning" }, error.message); }
  if (found.classList && found.localName === "svg") found.classList.add("chart");
  const caption = view.mode === "symbolic" ? made("p", { class: "note" }, "Symbolic states have no times, so the steps are counted. Concrete shows a run with times.") : "";
  $("panel-chart").replaceChildren(caption, found);
}

async function drawSeries() {
  const names = chosen();
  if (!names.length) {
    $("panel-series").replaceChildren(made("p", { class: "note" }, "Tick variables in the table at the right; they are drawn here along the steps."));
    return;
  }
  const found = await attempt(() => request({ do: "series", names }));
  if (!found) return;
  const curves = names.map((name) => ({ name, points: found.series[name] }));
  const unit = found.timed ? "time in the model's unit" : "step";
  const here = found.timed ? numberOf(view.time) : view.position;
  $("panel-series").replaceChildren(linesPicture(curves, { unit, here, label: `Values over time of ${names.join(", ")}` }));
}
