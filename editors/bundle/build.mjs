// Builds ntagen/serve/editor/codemirror.js, with the licences and versions of what is in it.
// Run by `make bundle`: npm ci, then this. The same packages give the same bytes.
import { build } from "esbuild";
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { dirname, join } from "node:path";

const here = dirname(fileURLToPath(import.meta.url));
const target = process.argv[2] ?? join(here, "../../ntagen/serve/editor/codemirror.js");

const { outputFiles, metafile } = await build({
  absWorkingDir: here,
  entryPoints: ["entry.js"],
  bundle: true,
  format: "esm",
  minify: true,
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  metafile: true,
  write: false,
});

const names = new Set();
for (const input of Object.keys(metafile.inputs)) {
  const found = /node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(input);
  if (found) names.add(found[1]);
}
const parts = [...names].sort().map((name) => {
  const folder = join(here, "node_modules", name);
  const { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const text = readFileSync(join(folder, "LICENSE"), "utf8").trim();
  if (license !== "MIT") throw new Error(`${name} has the licence ${license}; look whether it may be bundled`);
  return { name, version, text };
});
// Packages that share a licence word for word are listed above it together.
const texts = new Map();
for (const { name, version, text } of parts) texts.set(text, [...(texts.get(text) ?? []), `${name} ${version}`]);
const listed = [...texts].map(([text, of]) => `${of.join("\n")}\n\n${text}`).join("\n\n----\n\n");
const header = `/*!\nBundled from these packages by editors/bundle/build.mjs; do not edit.\n\n${listed}\n*/\n`;
writeFileSync(target, header + outputFiles[0].text);
