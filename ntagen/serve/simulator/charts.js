// What stands below the processes: tabs, the charts of the history, and values over time.
import { $, made, parsed } from "dom.js";
import { linesPicture } from "lines.js";
import { later } from "server.js";
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

export function redraw() {
  if (!view) return;
  if (selected === "series") drawSeries();
  else if (["gantt", "sequence"].includes(selected)) drawChart(selected);
}

const warning = (error) => made("p", { class: "warning" }, error.message);

function drawChart(kind) {
  const caption = view.mode === "symbolic" ? made("p", { class: "note" }, "Symbolic states have no times, so the steps are counted. Concrete shows a run with times.") : "";
  const put = (one) => $("panel-chart").replaceChildren(caption, one);
  later("chart", { do: "chart", kind }, ({ svg }) => {
    const chart = parsed(svg);
    chart.classList.add("chart");
    put(chart);
  }, (error) => put(warning(error)));
}

function drawSeries() {
  const names = chosen(), put = (one) => $("panel-series").replaceChildren(one);
  if (!names.length) {
    put(made("p", { class: "note" }, "Tick clocks or variables in the tables at the right; they are drawn here along the steps."));
    return;
  }
  later("series", { do: "series", names }, (found) => {
    const curves = names.map((name) => ({ name, points: found.series[name] }));
    const unit = found.timed ? "time in the model's unit" : "step";
    const here = found.timed ? numberOf(view.time) : view.position;
    put(linesPicture(curves, { unit, here, label: `Values over time of ${names.join(", ")}` }));
  }, (error) => put(warning(error)));
}
