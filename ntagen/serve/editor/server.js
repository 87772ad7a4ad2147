// Asks the server. Changes go one after another, each with the version of the model that it is about.
import { $ } from "dom.js";

const token = new URLSearchParams(location.search).get("token");

// The id of what is edited stands in the address, so that a reload shows the same.
export const identity = () => location.hash.slice(1);
export const page = (path, hash) => `${path}?token=${encodeURIComponent(token)}#${hash}`;

export class Refused extends Error {
  constructor(message, status) { super(message); this.status = status; }
}

export async function ask(method, path, body) {
  let answer;
  try {
    answer = await fetch(path, { method, body, headers: { "X-Ntagen-Token": token } });
  } catch {
    throw new Error("the server does not answer; what you typed last may not be kept\nhint: copy it, and start the server again: ntagen serve MODEL");
  }
  if (answer.headers.get("Content-Type") === "application/octet-stream") return answer.blob();
  const value = await answer.json();
  if (!answer.ok) throw new Refused(value.error, answer.status);
  return value;
}

export const request = (wish) => ask("POST", `/api/edits/${identity()}`, JSON.stringify(wish));

// Asks for something without waiting for the answer, also when the page goes away.
export function post(wish) {
  const headers = { "X-Ntagen-Token": token };
  fetch(`/api/edits/${identity()}`, { method: "POST", body: JSON.stringify(wish), headers, keepalive: true }).catch(() => {});
}

let last = Promise.resolve();

// Does something when all that was asked for before is done.
export function inTurn(work) {
  const own = last.then(work);
  last = own.catch(() => {});
  return own;
}

export function tell(text) {
  $("note").hidden = !text;
  $("note").textContent = text;
}

export function complain(error) {
  $("trouble").hidden = !error;
  $("anyway").hidden = true;
  $("error").textContent = error ? error.message || String(error) : "";
}

// Every button goes through here: what goes wrong is said in one place.
export async function attempt(work) {
  complain(null);
  tell("");
  try { return await work(); } catch (error) { complain(error); return null; }
}
