// Starts the language server `ntagen lsp` for environments (.nsl).

const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

function activate() {
  const [command, ...args] = workspace.getConfiguration("ntagen").get("command");
  client = new LanguageClient(
    "ntagen",
    "ntagen",
    { command, args },
    { documentSelector: [{ language: "nsl" }] },
  );
  return client.start();
}

function deactivate() {
  return client?.stop();
}

module.exports = { activate, deactivate };
