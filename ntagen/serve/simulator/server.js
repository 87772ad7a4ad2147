// Asks the server. One request of this page runs at a time; the others wait in their order.
import { $ } from "dom.js";

const token = new URLSearchParams(location.search).get("token");
const BUSY_MS = 250;

// The id of the simulation stands in the address, so that a reload shows the same one.
export const identity = () => location.hash.slice(1);

export async function ask(method, path, body) {
  let answer;
  try {
    answer = await fetch(path, { method, body, headers: { "X-Ntagen-Token": token } });
  } catch {
    throw new Error("the server does not answer\nhint: start it again: ntagen serve MODEL");
  }
  const value = await answer.json();
  if (!answer.ok) throw new Error(value.error);
  return value;
}

let last = Promise.resolve(), waiting = 0;

export const isIdle = () => waiting === 0;

// Asks the simulation something; gives its answer.
export function request(what) {
  const own = last.then(() => asked(what));
  last = own.catch(() => {});
  return own;
}

async function asked(what) {
  waiting += 1;
  const timer = setTimeout(() => { $("busy").hidden = false; }, BUSY_MS);
  try {
    const answer = await ask("POST", `/api/simulations/${identity()}`, JSON.stringify(what));
    if (answer.resumed) tell("The process of this simulation had ended. Another one has taken it up; nothing is lost.");
    return answer;
  } finally {
    waiting -= 1;
    clearTimeout(timer);
    $("busy").hidden = true;
  }
}

// Ends the process of the simulation; what it was asked is not answered.
export const cancel = () => ask("DELETE", `/api/simulations/${identity()}`);

// Says something to those who see and to those who listen.
export function tell(text) {
  $("note").hidden = !text;
  $("note").textContent = text;
}

export function complain(error) {
  $("trouble").hidden = !error;
  $("error").textContent = error ? error.message || String(error) : "";
}

// Every button goes through here: what goes wrong is said in one place.
export async function attempt(work) {
  complain(null);
  try { return await work(); } catch (error) { complain(error); return null; }
}
