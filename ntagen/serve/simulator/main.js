// The simulator: asks for the simulation of the address, and shows each view in all its parts.
import * as charts from "charts.js";
import { $, say } from "dom.js";
import * as files from "files.js";
import * as history from "history.js";
import * as moves from "moves.js";
import * as processes from "processes.js";
import * as runs from "runs.js";
import { ask, attempt, cancel, complain, identity, request, tell } from "server.js";
import * as strategy from "strategy.js";
import * as values from "values.js";
import * as words from "words.js";
import * as zone from "zone.js";

const way = [];

// Asks for something that changes the state, and shows the view that comes back.
async function act(what) {
  tell("");
  const view = await attempt(() => request(what));
  // Radio buttons may show what was refused.
  if (view) show(view);
  else showMode();
  return view;
}

let shown = null;

function show(view) {
  shown = view;
  way.length = view.known;
  way.push(...view.steps);
  moves.clearDelay();
  processes.show(view, way);
  moves.show(view);
  history.show(view, way);
  values.show(view);
  zone.show(view);
  charts.show(view);
  strategy.show(view);
  showMode();
  if (view.note) tell(view.note);
  say($("live"), spoken(view));
}

function showMode() {
  if (!shown) return;
  $("game-mode").hidden = shown.mode !== "game";
  for (const one of document.getElementsByName("mode")) one.checked = one.value === shown.mode;
}

// What a reader of the screen says after a step.
function spoken(view) {
  const step = way[view.position - 1];
  const count = view.moves.length === 1 ? "1 move is possible" : `${view.moves.length} moves are possible`;
  return `Step ${view.position}${step ? `: ${words.stepInWords(step)}` : ", the start"}. ${view.end || count}. ${view.problem}`;
}

async function begin() {
  if (!identity()) throw new Error("no model is simulated here\nhint: open the page of queries, and press Simulate");
  const { name, file } = await ask("GET", `/api/simulations/${identity()}`);
  say($("name"), name);
  $("queries").hash = file;
  document.title = `${name}: simulate`;
  const { model, view } = await request({ do: "open" });
  words.begin(model);
  values.begin(() => charts.redraw());
  processes.begin(model, moves.takeOneOf);
  moves.begin(act);
  history.begin(act);
  zone.begin(model);
  strategy.begin(model, act);
  runs.begin(model);
  files.begin(act);
  $("restart").onclick = () => act({ do: "restart" });
  for (const one of document.getElementsByName("mode")) one.onchange = () => act({ do: "mode", mode: one.value });
  // Nothing can be pressed before it works.
  $("tools").hidden = $("work").hidden = false;
  show(view);
  processes.drawOpen();
  charts.begin();
}

$("close").onclick = () => complain(null);
$("cancel").onclick = () => { history.stop(); attempt(cancel); };
addEventListener("hashchange", () => location.reload());
attempt(begin);
