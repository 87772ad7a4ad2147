// Games: playing against the winner's strategy, and showing which moves a strategy allows.
import { $, made } from "dom.js";

export function begin(model, act) {
  const games = model.queries.filter((one) => one.is_game).map((one) => one.text);
  $("games").replaceChildren(...games.map((text) => made("option", { value: text })));
  $("game-query").value = games[0] || "";
  $("play").onclick = () => act({ do: "play", query: $("game-query").value.trim() });
  $("advise").onclick = () => act({ do: "advise", query: $("game-query").value.trim() });
  $("no-advice").onclick = () => act({ do: "advise", query: "" });
}

export function show(view) {
  $("no-advice").hidden = !view.advice;
  if (view.game) $("game-query").value = view.game.query;
}
