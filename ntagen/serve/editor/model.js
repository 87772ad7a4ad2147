// The model as the server knows it: its parts, its version, its mistakes. Others hear when it changes.
import { inTurn, request } from "server.js";

export const state = { version: 0, parts: null, mistakes: [], undo: 0, redo: 0, changed: false, problem: "", savable: false, name: "" };

const MISTAKES_MS = 80;
const listeners = { model: [], mistakes: [] };
export const on = (event, work) => listeners[event].push(work);
const emit = (event, value) => { for (const work of listeners[event]) work(value); };

let flushing = async () => {};
// Sends what was typed last; the module of fields does it.
export const flushWith = (work) => { flushing = work; };

export function accept(told) {
  const { wish, address, ...news } = told;
  Object.assign(state, news);
  if (state.problem) state.parts = null;
  emit("model", told);
  lookForMistakes();
}

// Changes the model, and shows where.
export async function change(wish) {
  await flushing();
  return sent(wish);
}

export function sent(wish) {
  return inTurn(async () => {
    const told = await request({ ...wish, version: state.version });
    accept({ ...told, wish: wish.do });
    return told;
  });
}

// Asks something about the newest text.
export async function inquire(wish) {
  await flushing();
  return inTurn(() => request(wish));
}

// A text by its address; null if the file has none.
export function textAt(address) {
  const names = address.split("/"), last = names.pop();
  let at = state.parts;
  for (const name of names) at = at?.[name];
  if (!at) return null;
  return (at.texts && last in at.texts ? at.texts[last] : at[last]) ?? null;
}

export function keepText(address, text) {
  const names = address.split("/"), last = names.pop();
  let at = state.parts;
  for (const name of names) at = at?.[name];
  if (at) (at.texts && last in at.texts ? at.texts : at)[last] = text;
}

let timer = null, whole = false, isAsking = false;
export const ofWhole = (value) => { whole = value; };

export function lookForMistakes() {
  clearTimeout(timer);
  timer = setTimeout(find, MISTAKES_MS);
}

async function find() {
  if (isAsking) return lookForMistakes();
  isAsking = true;
  try {
    const found = await request({ do: "mistakes", whole });
    if (found.late || found.version !== state.version) return lookForMistakes();
    state.mistakes = found.mistakes;
    emit("mistakes", null);
  } catch (error) {
    emit("mistakes", error);
  } finally {
    isAsking = false;
  }
}
