// The list of moves, the delay before one, and what a strategy says.
import { $, made, say } from "dom.js";
import { point } from "processes.js";
import { labelsInWords, moveInWords, numberOf } from "words.js";

const MOST_SHOWN = 150;

let act = null, view = null, buttons = [];

export function begin(acting) {
  act = acting;
  $("delay").oninput = dim;
  $("find-move").oninput = draw;
  $("wait").onclick = () => act({ do: "take", wait: true, delay: $("delay").value.trim() || null });
  $("moves").addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key], at = buttons.indexOf(document.activeElement);
    if (!step) return;
    event.preventDefault();
    buttons[Math.min(Math.max(at + step, 0), buttons.length - 1)]?.focus();
  });
}

export function show(now) {
  view = now;
  const isTimed = now.mode !== "symbolic";
  $("delay-line").hidden = !isTimed;
  const why = [now.problem, now.end].filter(Boolean).join("\n");
  $("end").hidden = !why;
  say($("end"), why);
  $("game").hidden = !now.game;
  if (now.game) {
    say($("forecast"), `You are the ${now.game.rival}. ${now.game.is_over ? "Play is over." : sentence(now.game.forecast)}`);
    $("wait").disabled = !now.game.can_wait;
  }
  $("advice").hidden = !now.advice;
  if (now.advice) say($("advice"), `The ${now.advice.owner}'s strategy: ${now.advice.text}.`);
  $("many").hidden = now.moves.length <= 10;
  if (now.moves.length <= 10) $("find-move").value = "";
  draw();
}

const sentence = (text) => `${text[0].toUpperCase()}${text.slice(1)}.`;

function draw() {
  const hadFocus = $("moves").contains(document.activeElement), wanted = $("find-move").value.trim().toLowerCase();
  const all = view.moves.map((move, index) => ({ move, index, words: moveInWords(move.parts) }));
  const same = new Map();
  for (const one of all) same.set(one.words, (same.get(one.words) || 0) + 1);
  const found = all.filter((one) => one.words.toLowerCase().includes(wanted)), shown = found.slice(0, MOST_SHOWN);
  buttons = shown.map(({ move, index, words }) => buttonOf(move, index, same.get(words) > 1 ? `${words}  { ${labelsInWords(move.parts)} }` : words));
  const rest = found.length - shown.length;
  $("moves").replaceChildren(...buttons.map((one) => made("li", {}, one)), rest ? made("li", { class: "note" }, `… and ${rest} more: search for them`) : "");
  point([]);
  dim();
  if (hadFocus) (buttons[0] || $("moves")).focus();
}

function buttonOf(move, index, words) {
  const mark = view.advice ? view.advice.moves[index] : "";
  const button = made(
    "button",
    { type: "button", class: move.who === "strategy" ? "strategy" : null, click: () => take(index) },
    move.who === "strategy" ? "strategy may: " : "",
    words,
    move.windows ? made("span", { class: "when" }, move.windows.join(", or ")) : "",
    mark ? made("span", { class: "allowed" }, `✓ the strategy takes it ${mark}`) : "",
  );
  button.addEventListener("focus", () => point(move.parts));
  button.addEventListener("mouseenter", () => point(move.parts));
  button.addEventListener("mouseleave", () => point([]));
  button.dataset.index = index;
  return button;
}

function take(index) { return act({ do: "take", move: index, delay: $("delay").value.trim() || null }); }

// Takes a move of an edge that was clicked; of several, the user chooses one in the list.
export function takeOneOf(moves) {
  if (moves.length === 1) return take(moves[0]);
  $("find-move").value = "";
  draw();
  buttons.find((one) => moves.includes(Number(one.dataset.index)))?.focus();
  return null;
}

// Moves that are not possible after the delay that was typed are dimmed.
function dim() {
  const delay = $("delay").value.trim(), number = delay && view.mode !== "symbolic" ? numberOf(delay) : null;
  for (const button of buttons) {
    const { spans } = view.moves[Number(button.dataset.index)];
    button.classList.toggle("not-now", number !== null && !(spans || []).some((span) => isWithin(number, span)));
  }
}

function isWithin(delay, [first, afterFirst, last, beforeLast]) {
  const low = numberOf(first), high = last === null ? Infinity : numberOf(last);
  return (afterFirst ? delay > low : delay >= low) && (beforeLast ? delay < high : delay <= high);
}

export const clearDelay = () => { $("delay").value = ""; };
