// Traces: loaded from a file, and saved to one.
import { $, made } from "dom.js";
import { attempt, request } from "server.js";

export function begin(act) {
  $("load").onchange = async () => {
    const [file] = $("load").files;
    if (file) await act({ do: "load", text: await file.text() });
    $("load").value = "";
  };
  $("save").onclick = () => attempt(async () => {
    const { text } = await request({ do: "save" });
    const address = URL.createObjectURL(new Blob([text, "\n"], { type: "application/json" }));
    made("a", { href: address, download: `${$("name").textContent}-trace.json` }).click();
    URL.revokeObjectURL(address);
  });
}
