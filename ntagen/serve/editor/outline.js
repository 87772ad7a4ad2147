// The parts of the model, beside the text.
import { $, made } from "dom.js";
import { state } from "model.js";

const item = (shown, address, title, show) => {
  const count = state.mistakes.filter((one) => one.severity === "error" && belongs(one.at?.address, address)).length;
  return made("li", {}, made("button", { type: "button", "aria-current": String(shown === address), click: () => show({ address }) },
    title, count ? made("span", { class: "wrong" }, ` ${count} ${count === 1 ? "mistake" : "mistakes"}`) : null));
};

const belongs = (place, address) => place !== undefined && (place === address || (address !== "text" && place.startsWith(`${address}/`)));

export const viewOf = (address) => {
  const names = address.split("/");
  return names[0] === "templates" ? names.slice(0, 2).join("/") : names[0] === "queries" ? "queries" : address;
};

export function showOutline(shown, show) {
  const parts = state.parts, rows = [];
  if (parts) {
    rows.push(item(shown, "declaration", "Declarations", show));
    parts.templates.forEach((one, n) => rows.push(item(shown, `templates/${n}`, `Template ${(one.name ?? "").trim() || "without a name"}`, show)));
    if (parts.instantiation !== null) rows.push(item(shown, "instantiation", "Instantiations", show));
    rows.push(item(shown, "system", "System", show), item(shown, "queries", `Queries (${parts.queries.length})`, show));
  }
  rows.push(item(shown, "text", "Whole file", show));
  const focused = document.activeElement?.closest("#outline li");
  const number = focused ? [...$("outline").children].indexOf(focused) : -1;
  $("outline").replaceChildren(...rows);
  if (number >= 0) rows[Math.min(number, rows.length - 1)].querySelector("button").focus();
  $("add-template").hidden = !parts;
}
