// Asks the server. One request of this page runs at a time. Steps come before pictures, of which only
// the newest of each kind is asked for, and only when no more steps come.
import { $ } from "dom.js";

const token = new URLSearchParams(location.search).get("token");
const BUSY_MS = 250, QUIET_MS = 60;

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

let last = Promise.resolve(), waiting = 0, timer = null;
const pictures = new Map();

export const isIdle = () => waiting === 0;

// Asks the simulation something; gives its answer.
export function request(what) {
  waiting += 1;
  const own = last.then(() => asked(what)).finally(() => { waiting -= 1; schedule(); });
  last = own.catch(() => {});
  return own;
}

// Asks for a picture of this kind when there is time; `show` gets the answer, `fail` an error.
export function later(kind, what, show, fail) {
  pictures.set(kind, { what, show, fail });
  schedule();
}

// Asks for no picture of this kind any more.
export const forget = (kind) => pictures.delete(kind);

function schedule() {
  clearTimeout(timer);
  if (isIdle() && pictures.size) timer = setTimeout(next, QUIET_MS);
}

function next() {
  const [[kind, { what, show, fail }]] = pictures;
  pictures.delete(kind);
  // If a newer one has come meanwhile, this one is out of date.
  request(what).then((answer) => { if (!pictures.has(kind)) show(answer); }, fail);
}

async function asked(what) {
  const busy = setTimeout(() => { $("busy").hidden = false; }, BUSY_MS);
  try {
    const answer = await ask("POST", `/api/simulations/${identity()}`, JSON.stringify(what));
    if (answer.resumed) tell("The process of this simulation had ended. Another one has taken it up; nothing is lost.");
    return answer;
  } finally {
    clearTimeout(busy);
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
