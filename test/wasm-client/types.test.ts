// `rrgate generate ts`: what it writes is what rrgate-client takes. types/usage.ts says what must compile and what not.
// The README's examples do without generated types.
import { execFile } from "node:child_process";
import { mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";

const root = fileURLToPath(new URL("../..", import.meta.url));
const run = (program: string, parameters: string[]) => promisify(execFile)(root + program, parameters, { cwd: root });
const folder = `${root}build/generated-types`;
const tsc = "wasm-client/node_modules/.bin/tsc";

async function generate(definition: string, out: string): Promise<void> {
  await run("build/release/server/rrgate", ["generate", "ts", definition, "-o", `${folder}/${out}`]);
}

/** Each example as a module of its own. */
async function takeExamples(): Promise<void> {
  const text = await readFile(`${root}wasm-client/README.md`, "utf8");
  const examples = [...text.matchAll(/^```js\n([^]*?)^```$/gm)];
  expect(examples.length).toBeGreaterThan(9);
  for (const [index, [, code]] of examples.entries())
    await writeFile(`${folder}/readme_${index}.ts`, `${code}export {};\n`);
}

/** What tsc says about the project below `types`; "" where it is content. */
async function compile(...options: string[]): Promise<string> {
  return run(tsc, ["-p", "test/wasm-client/types", ...options]).then(
    () => "",
    (error: { stdout: string }) => error.stdout,
  );
}

test("generated types and the README's examples compile, and refuse what the definition does not allow", async () => {
  await rm(folder, { recursive: true, force: true });
  await mkdir(folder, { recursive: true });
  await generate("robdef/modern/experimental.simulatedcreate.robdef", "create.d.ts");
  await generate("robdef/modern/experimental.createwebcam2.robdef", "webcam.ts");
  await generate("test/interop/experimental.interop.robdef", "interop.d.ts");
  await generate("test/interop/experimental.interop.robdef", "interop_module.ts");
  await generate("test/definitions/test.words.robdef", "words.d.ts");
  await generate("test/definitions/test.words.robdef", "words_module.ts");
  await takeExamples();
  expect(await compile()).toBe("");
  expect(await compile("--noUncheckedIndexedAccess", "false")).toBe("");
}, 120_000);

test("documentation is kept, with nothing that ends a comment", async () => {
  const text = await readFile(`${folder}/words.d.ts`, "utf8");
  expect(text).toContain("  /**\n   * A function.\n   * With two lines.\n   */\n  readonly operator: ");
  expect(text).toContain("/** Refers to itself. */\nexport interface switch_ {");
  expect(text).toContain("  /** The end of a comment: *\\/ \\ */\n  readonly long: ");
  expect(text).toContain("  /** Not there. */\n  | 0 // none\n");
});
