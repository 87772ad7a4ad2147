// The picture of a template: parts are chosen with a click, and locations and bends are dragged.
import { drawn, parsed } from "dom.js";
import { state } from "model.js";
import { request } from "server.js";

const HANDLE = 9, STEP = 8;
const KINDS = { location: "locations", "branch-point": "branch_points", edge: "edges" };

export class Drawing {
  // `choose` gets the address of a part, `move` a wish that moves one.
  constructor(box, number, choose, move) {
    Object.assign(this, { box, number, choose, move, zoom: 1, chosen: null, dragged: null, asked: 0 });
    box.addEventListener("pointerdown", (event) => this.#down(event));
    box.addEventListener("pointermove", (event) => this.#moved(event));
    box.addEventListener("pointerup", () => this.#up());
    box.addEventListener("pointercancel", () => { this.dragged = null; this.draw(); });
    box.addEventListener("keydown", (event) => this.#key(event));
  }

  async draw() {
    const own = this.asked += 1;
    const { svg } = await request({ do: "picture", template: this.number });
    if (own !== this.asked || this.dragged) return;
    this.svg = parsed(svg);
    this.svg.setAttribute("class", "template");
    this.size = [this.svg.getAttribute("width"), this.svg.getAttribute("height")].map(Number);
    for (const edge of this.svg.querySelectorAll(".edge")) {
      const path = edge.querySelector("path"), hit = path.cloneNode();
      hit.setAttribute("class", "hit");
      path.before(hit);
    }
    const { scrollLeft, scrollTop } = this.box;
    this.box.replaceChildren(this.svg);
    this.scale(this.zoom);
    this.box.scrollTo(scrollLeft, scrollTop);
    this.light(this.chosen);
  }

  scale(zoom) {
    this.zoom = Math.min(4, Math.max(0.2, zoom));
    if (!this.svg) return;
    this.svg.setAttribute("width", this.size[0] * this.zoom);
    this.svg.setAttribute("height", this.size[1] * this.zoom);
  }

  light(address) {
    this.chosen = address;
    if (!this.svg) return;
    for (const one of this.svg.querySelectorAll(".selected")) one.classList.remove("selected");
    for (const one of this.svg.querySelectorAll(".bend")) one.remove();
    const group = address && this.#group(address);
    group?.classList.add("selected");
    if (group?.classList.contains("edge")) {
      const edge = state.parts.templates[this.number].edges[group.dataset.number];
      edge?.nails.forEach((place, n) => {
        if (place) this.svg.append(drawn("rect", { class: "bend", "data-number": n, x: place[0] - HANDLE / 2, y: place[1] - HANDLE / 2, width: HANDLE, height: HANDLE }));
      });
    }
  }

  #group(address) {
    const [, number, kind, inner] = address.split("/");
    if (Number(number) !== this.number) return null;
    const name = Object.keys(KINDS).find((one) => KINDS[one] === kind);
    return name ? this.svg.querySelector(`g.${name}[data-number="${Number(inner)}"]`) : null;
  }

  #address(group) {
    const name = Object.keys(KINDS).find((one) => group.classList.contains(one));
    return `templates/${this.number}/${KINDS[name]}/${group.dataset.number}`;
  }

  #down(event) {
    if (event.button !== 0) return;
    const bend = event.target.closest(".bend"), group = event.target.closest("g.location, g.branch-point, g.edge");
    if (!bend && !group) return;
    if (group && !bend) this.choose(this.#address(group));
    if (!bend && group.classList.contains("edge")) return;
    const address = bend ? this.chosen : this.#address(group), at = bend || group;
    const circle = bend ? null : group.querySelector("circle");
    const from = bend ? [Number(bend.getAttribute("x")) + HANDLE / 2, Number(bend.getAttribute("y")) + HANDLE / 2] : ["cx", "cy"].map((name) => Number(circle.getAttribute(name)));
    this.dragged = { at, address, from, number: bend ? Number(bend.dataset.number) : null, start: [event.clientX, event.clientY], by: [0, 0] };
    this.box.setPointerCapture(event.pointerId);
    event.preventDefault();
    this.box.focus({ preventScroll: true });
  }

  #moved(event) {
    if (!this.dragged) return;
    const { start, at } = this.dragged;
    this.dragged.by = [event.clientX - start[0], event.clientY - start[1]].map((one) => one / this.zoom);
    at.setAttribute("transform", `translate(${this.dragged.by.join(" ")})`);
  }

  #up() {
    if (!this.dragged) return;
    const { address, from, by, number } = this.dragged;
    this.dragged = null;
    if (Math.hypot(...by) < 2) return;
    const [x, y] = from.map((one, n) => Math.round(one + by[n]));
    this.move(number === null ? { do: "move", address, x, y } : { do: "move-bend", address, number, x, y });
  }

  // The arrow keys move what is chosen.
  #key(event) {
    const by = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP] }[event.key];
    const group = this.chosen && this.svg && this.#group(this.chosen);
    if (!by || !group || group.classList.contains("edge")) return;
    event.preventDefault();
    const circle = group.querySelector("circle");
    const [x, y] = ["cx", "cy"].map((name, n) => Math.round(Number(circle.getAttribute(name)) + by[n]));
    this.move({ do: "move", address: this.chosen, x, y, join: true });
  }
}
