// The list of all that is wrong with the model.
import { $, made } from "dom.js";
import { state } from "model.js";

const MOST = 200;

export function showMistakes(go, error) {
  if (error) {
    $("wrong-title").textContent = "Mistakes";
    $("mistakes").replaceChildren(made("li", { class: "warning" }, error.message));
    return;
  }
  const found = state.mistakes;
  $("wrong-title").textContent = found.length ? `Mistakes (${found.length})` : "No mistakes";
  const rows = found.slice(0, MOST).map((one) => made("li", {}, made("button", { type: "button", disabled: !one.at, click: () => go(one.at) },
    made("span", { class: "where" }, one.place ? `${one.place}: ` : ""), `${one.code} ${one.message}`, one.hint ? made("span", { class: "where" }, ` (${one.hint})`) : null)));
  if (found.length > MOST) rows.push(made("li", { class: "note" }, `and ${found.length - MOST} more`));
  $("mistakes").replaceChildren(...rows);
}
