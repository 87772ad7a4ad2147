// Starts the language server `ntagen lsp` for environments (.nsl), models (.xta, .ta, and .xml whose
// root is <nta>) and queries (.q). It starts with the first of them: other XML starts nothing.

const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

const OWN = ["nsl", "xta", "uppaalquery"];
const ROOT = /^\uFEFF?(?:\s|<\?[\s\S]*?\?>|<!--[\s\S]*?-->|<!DOCTYPE[^>]*>)*<nta\b/;

let client;

function isServed(document) {
  if (document.languageId === "xml") {
    return ROOT.test(document.getText());
  }
  return OWN.includes(document.languageId);
}

function start() {
  const [command, ...args] = workspace.getConfiguration("ntagen").get("command");
  client = new LanguageClient(
    "ntagen",
    "ntagen",
    { command, args },
    {
      documentSelector: [
        ...OWN.map((language) => ({ language })),
        // The server has no answers about XML of other kinds.
        { language: "xml", pattern: "**/*.xml" },
      ],
    },
  );
  return client.start();
}

function activate(context) {
  if (workspace.textDocuments.some(isServed)) {
    return start();
  }
  const waiting = workspace.onDidOpenTextDocument((document) => {
    if (client === undefined && isServed(document)) {
      waiting.dispose();
      start();
    }
  });
  context.subscriptions.push(waiting);
}

function deactivate() {
  return client?.stop();
}

module.exports = { activate, deactivate };
