// Small dialogs: some fields, and what is done with them.
import { $, made } from "dom.js";
import { attempt, complain } from "server.js";

function inputFor(field) {
  if (field.choices) return made("select", { name: field.name }, ...field.choices.map(([value, label]) => made("option", { value }, label)));
  if (field.check !== undefined) return made("input", { name: field.name, type: "checkbox", checked: field.check });
  return made("input", { name: field.name, type: "text", autocomplete: "off", spellcheck: "false", placeholder: field.example ?? "" });
}

// Asks for some fields; `done` gets their values. What it refuses is said in the dialog's page, and the dialog stays.
export function dialog(title, fields, yes, done) {
  $("dialog-title").textContent = title;
  $("dialog-fields").replaceChildren(...fields.map((field) => (field.text ? made("p", {}, field.text)
    : field.check !== undefined ? made("label", {}, inputFor(field), ` ${field.label}`) : made("label", {}, field.label, inputFor(field)))));
  for (const field of fields) if (field.value) $("dialog-fields").querySelector(`[name="${field.name}"]`).value = field.value;
  $("dialog-yes").textContent = yes;
  const form = $("dialog").querySelector("form");
  form.onsubmit = async (event) => {
    event.preventDefault();
    const values = {};
    for (const input of form.querySelectorAll("[name]")) values[input.name] = input.type === "checkbox" ? input.checked : input.value;
    if (await attempt(async () => { await done(values); return true; })) $("dialog").close();
    else $("dialog").append($("trouble"));
  };
  $("dialog-no").onclick = () => { complain(null); $("dialog").close(); };
  $("dialog").onclose = () => document.querySelector("header").after($("trouble"));
  $("dialog").showModal();
}
