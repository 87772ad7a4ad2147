// What this tab remembers over a reload beside the simulation itself: folds, clocks, zoom and so on.
import { identity } from "server.js";

const key = () => `ntagen-${identity()}`;

function all() {
  try { return JSON.parse(sessionStorage.getItem(key())) || {}; } catch { return {}; }
}

export const recalled = (name, otherwise) => {
  const found = all()[name];
  return found === undefined ? otherwise : found;
};

export function remember(name, value) {
  try { sessionStorage.setItem(key(), JSON.stringify({ ...all(), [name]: value })); } catch { /* A full store loses nothing of the simulation. */ }
}
