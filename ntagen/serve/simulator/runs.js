// Random runs of a `simulate` query. They are asked for in blocks, and each block is drawn at once.
import { $, made, say } from "dom.js";
import { linesPicture } from "lines.js";
import { attempt, request } from "server.js";

const FIRST_BLOCK = 1, LARGEST_BLOCK = 20;

let isRunning = false;

export function begin(model) {
  const known = model.queries.filter((one) => !one.is_game).map((one) => one.text);
  $("simulations").replaceChildren(...known.map((text) => made("option", { value: text })));
  $("runs-query").value = known[0] || "";
  suggest();
  $("runs-query").onchange = suggest;
  $("runs-start").onclick = () => (isRunning ? stop() : attempt(run));
}

// The number of runs that the query itself asks for.
function suggest() {
  const found = /^\s*simulate\s*(?:\[[^\]]*;\s*(\d+)\s*\]|(\d+))/.exec($("runs-query").value);
  if (found) $("runs-count").value = found[1] || found[2];
}

function stop() {
  isRunning = false;
  say($("runs-start"), "Start");
}

async function run() {
  const query = $("runs-query").value.trim(), all = Number($("runs-count").value) || 1, seed = Number($("runs-seed").value) || 0;
  isRunning = true;
  say($("runs-start"), "Stop");
  const curves = [];
  let done = 0, block = FIRST_BLOCK, number = 0;
  try {
    while (isRunning && done < all) {
      const count = Math.min(block, all - done);
      // Blocks have seeds of their own: those of one start are far from those of the next.
      const found = await request({ do: "runs", query, seed: seed * 100003 + number, count });
      for (const one of found.runs) found.expressions.forEach((name, i) => curves.push({ name, points: one[i] }));
      done += count;
      number += 1;
      block = Math.min(2 * block, LARGEST_BLOCK);
      say($("runs-done"), `${done} of ${all} runs`);
      $("runs-picture").replaceChildren(linesPicture(curves, { unit: "time in the model's unit", label: `${done} random runs of ${query}` }));
    }
  } finally { stop(); }
}
