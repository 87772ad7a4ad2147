// Curves over time, in one frame: values along the history, and random runs while they come in.
import { drawn, made } from "dom.js";

const WIDTH = 760, HEIGHT = 240, LEFT = 56, TOP = 10;

// Round numbers from 0 to an end.
export function ticksUpTo(end, most = 8) { return ticksWithin(0, end, most); }

function ticksWithin(low, high, most) {
  const rough = (high - low) / most;
  if (!(rough > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= rough * (1 - 1e-9));
  const found = [];
  for (let at = Math.ceil(low / step - 1e-9); at * step <= high + 1e-9 * step; at += 1) found.push(Number((at * step).toPrecision(12)));
  return found;
}

// A picture of curves: each has a name and points, pairs of a moment and a value. Curves with the
// same name have the same colour, and one line in the legend.
export function linesPicture(curves, { unit, here = null, label }) {
  const points = curves.flatMap((one) => one.points);
  if (!points.length) return made("p", { class: "note" }, "There is nothing to draw yet.");
  const names = [...new Set(curves.map((one) => one.name))];
  const end = Math.max(...points.map(([moment]) => moment), 1e-9);
  let low = Math.min(0, ...points.map(([, value]) => value)), high = Math.max(...points.map(([, value]) => value));
  if (high <= low) high = low + 1;
  const x = (moment) => LEFT + (moment / end) * WIDTH, y = (value) => TOP + HEIGHT - ((value - low) / (high - low)) * HEIGHT;
  const parts = [];
  for (const tick of ticksUpTo(end)) parts.push(drawn("line", { class: "grid", x1: x(tick), x2: x(tick), y1: TOP, y2: TOP + HEIGHT }), drawn("text", { x: x(tick), y: TOP + HEIGHT + 16, "text-anchor": "middle" }, String(tick)));
  for (const tick of ticksWithin(low, high, 6)) parts.push(drawn("line", { class: "grid", x1: LEFT, x2: LEFT + WIDTH, y1: y(tick), y2: y(tick) }), drawn("text", { x: LEFT - 6, y: y(tick) + 4, "text-anchor": "end" }, String(tick)));
  parts.push(drawn("rect", { class: "axis", x: LEFT, y: TOP, width: WIDTH, height: HEIGHT }));
  const many = curves.length > names.length ? " many" : "";
  for (const one of curves) parts.push(drawn("polyline", { class: `curve${many} c${1 + (names.indexOf(one.name) % 6)}`, points: one.points.map(([a, b]) => `${x(a).toFixed(1)},${y(b).toFixed(1)}`).join(" ") }));
  if (here !== null) parts.push(drawn("line", { class: "here", x1: x(here), x2: x(here), y1: TOP, y2: TOP + HEIGHT }));
  parts.push(drawn("text", { x: LEFT + WIDTH / 2, y: TOP + HEIGHT + 34, "text-anchor": "middle" }, unit));
  names.forEach((name, i) => {
    const at = TOP + HEIGHT + 52 + 18 * i;
    parts.push(drawn("line", { class: `curve c${1 + (i % 6)}`, x1: LEFT, x2: LEFT + 22, y1: at - 4, y2: at - 4 }), drawn("text", { x: LEFT + 30, y: at }, name));
  });
  return drawn("svg", { class: "plot", role: "img", "aria-label": label, width: LEFT + WIDTH + 20, height: TOP + HEIGHT + 50 + 18 * names.length }, ...parts);
}
