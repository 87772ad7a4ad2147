// The zone of a symbolic state over two clocks that the user picks.
import { $, drawn, made } from "dom.js";
import { ticksUpTo } from "lines.js";
import { forget, later } from "server.js";
import { recalled, remember } from "store.js";

const SIDE = 190, LEFT = 34, BOTTOM = 24;

let clocks = [], last = null;

export function begin(model) {
  clocks = model.clocks;
  for (const [id, other] of [["zone-x", 0], ["zone-y", 1]]) {
    $(id).replaceChildren(...clocks.map((name) => made("option", { value: name }, name)));
    const before = recalled(id, clocks[other]);
    $(id).value = clocks.includes(before) ? before : clocks[other];
    $(id).onchange = () => { remember(id, $(id).value); if (last) show(last); };
  }
}

export function show(view) {
  last = view;
  forget("zone");
  $("zone").hidden = !view.state.zone || clocks.length < 2;
  if ($("zone").hidden) return;
  const x = $("zone-x").value, y = $("zone-y").value;
  if (x === y) {
    $("zone-picture").replaceChildren(made("p", { class: "note" }, "Pick two different clocks."));
    return;
  }
  const put = (one) => $("zone-picture").replaceChildren(one);
  later("zone", { do: "zone", x, y }, (zone) => put(picture(zone)), (error) => put(made("p", { class: "warning" }, error.message)));
}

function picture(zone) {
  const right = (value) => LEFT + (value / zone.x_end) * SIDE, up = (value) => 6 + SIDE - (value / zone.y_end) * SIDE;
  const corners = zone.corners.map(([a, b]) => [right(a), up(b)]);
  const parts = [];
  for (const tick of ticksUpTo(zone.x_end, 5)) parts.push(drawn("line", { class: "grid", x1: right(tick), x2: right(tick), y1: 6, y2: 6 + SIDE }), drawn("text", { x: right(tick), y: 20 + SIDE, "text-anchor": "middle" }, String(tick)));
  for (const tick of ticksUpTo(zone.y_end, 5)) parts.push(drawn("line", { class: "grid", x1: LEFT, x2: LEFT + SIDE, y1: up(tick), y2: up(tick) }), drawn("text", { x: LEFT - 5, y: up(tick) + 4, "text-anchor": "end" }, String(tick)));
  parts.push(drawn("rect", { class: "axis", x: LEFT, y: 6, width: SIDE, height: SIDE }));
  if (corners.length > 2) parts.push(drawn("polygon", { class: "zone", points: corners.map((one) => one.join(",")).join(" ") }));
  if (corners.length > 1) {
    corners.forEach(([x1, y1], i) => {
      const [x2, y2] = corners[(i + 1) % corners.length];
      parts.push(drawn("line", { class: zone.open[i] ? "side open" : "side", x1, y1, x2, y2 }));
    });
  }
  if (corners.length === 1) parts.push(drawn("circle", { class: "dot", cx: corners[0][0], cy: corners[0][1], r: 5 }));
  const said = `The zone over ${zone.x} (to the right) and ${zone.y} (upwards)`;
  return drawn("svg", { class: "plot", role: "img", "aria-label": said, width: LEFT + SIDE + 14, height: SIDE + BOTTOM + 8 }, drawn("title", {}, said), ...parts);
}
