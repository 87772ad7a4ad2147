// The steps so far: back, forward, jump; and the random walk.
import { $, made, say } from "dom.js";
import { isIdle } from "server.js";
import { stepInWords } from "words.js";

const SHOWN = 60;  // So many steps are listed around the one that is shown.

let act = null, view = null, way = [], timer = null;
let aim = 0;  // The step that was last asked for: keys may be faster than answers.

export function begin(acting) {
  act = acting;
  $("first").onclick = () => go(0);
  $("back").onclick = () => go(aim - 1);
  $("forward").onclick = () => go(aim + 1);
  $("last").onclick = () => go(way.length);
  $("slider").onchange = () => go(Number($("slider").value));
  $("walk").onclick = () => (timer === null ? start() : stop());
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, select, textarea, [role=tab]")) return;
    const to = { ArrowLeft: aim - 1, ArrowRight: aim + 1, Home: 0, End: way.length }[event.key];
    if (to === undefined || !view) return;
    event.preventDefault();
    // A key that is held down waits for the answers.
    if (isIdle() || !event.repeat) go(to);
  });
}

function go(to) {
  if (to < 0 || to > way.length) return null;
  aim = to;
  return act({ do: "go", position: to });
}

export function show(now, steps) {
  view = now;
  way = steps;
  aim = now.position;
  $("slider").max = String(way.length);
  $("slider").value = String(view.position);
  $("slider").setAttribute("aria-valuetext", `step ${view.position} of ${way.length}`);
  const time = view.mode === "symbolic" ? "" : `, time ${view.time}`;
  say($("position"), `step ${view.position} of ${way.length}${time}`);
  $("first").disabled = $("back").disabled = view.position === 0;
  $("forward").disabled = $("last").disabled = view.position === way.length;
  list();
}

function list() {
  const hadFocus = $("steps").contains(document.activeElement);
  const from = Math.max(0, view.position - SHOWN), to = Math.min(way.length, view.position + SHOWN);
  const entries = [];
  for (let number = from; number <= to; number += 1) {
    const text = number === 0 ? "start" : `${number}. ${stepInWords(way[number - 1])}`;
    const current = number === view.position ? "step" : null;
    entries.push(made("li", {}, made("button", { type: "button", "aria-current": current, click: () => go(number) }, text)));
  }
  $("steps").replaceChildren(...entries);
  const here = $("steps").querySelector("[aria-current]");
  $("steps").scrollTop = here.offsetTop - $("steps").offsetTop - $("steps").clientHeight / 2;
  if (hadFocus) here.focus();
}

function start() {
  $("walk").setAttribute("aria-pressed", "true");
  say($("walk"), "Stop");
  timer = setTimeout(step, 0);
}

export function stop() {
  clearTimeout(timer);
  timer = null;
  $("walk").setAttribute("aria-pressed", "false");
  say($("walk"), "Random walk");
}

async function step() {
  const before = view.position;
  const found = await act({ do: "random", seed: Number($("seed").value) || 0 });
  if (timer === null) return;
  // Where nothing is possible any more, the walk ends.
  if (!found || found.position === before) stop();
  else timer = setTimeout(step, Number($("speed").value));
}
