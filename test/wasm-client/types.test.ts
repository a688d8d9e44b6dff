// `rrgate generate ts`: what it writes is what rrgate-client takes. types/usage.ts says what must compile and what not.
import { execFile } from "node:child_process";
import { mkdir, readFile, rm } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";

const root = fileURLToPath(new URL("../..", import.meta.url));
const run = (program: string, parameters: string[]) => promisify(execFile)(root + program, parameters, { cwd: root });
const folder = `${root}build/generated-types`;
const tsc = "wasm-client/node_modules/.bin/tsc";

async function generate(definition: string, out: string): Promise<void> {
  await run("build/release/server/rrgate", ["generate", "ts", definition, "-o", `${folder}/${out}`]);
}

/** What tsc says about the project below `types`; "" where it is content. */
async function compile(): Promise<string> {
  return run(tsc, ["-p", "test/wasm-client/types"]).then(
    () => "",
    (error: { stdout: string }) => error.stdout,
  );
}

test("generated types compile, and refuse what the definition does not allow", async () => {
  await rm(folder, { recursive: true, force: true });
  await mkdir(folder, { recursive: true });
  await generate("robdef/modern/experimental.simulatedcreate.robdef", "create.d.ts");
  await generate("robdef/modern/experimental.createwebcam2.robdef", "webcam.ts");
  await generate("test/interop/experimental.interop.robdef", "interop.d.ts");
  await generate("test/interop/experimental.interop.robdef", "interop_module.ts");
  await generate("test/definitions/test.words.robdef", "words.d.ts");
  await generate("test/definitions/test.words.robdef", "words_module.ts");
  expect(await compile()).toBe("");
}, 120_000);

test("documentation is kept, with nothing that ends a comment", async () => {
  const text = await readFile(`${folder}/words.d.ts`, "utf8");
  expect(text).toContain("  /**\n   * A function.\n   * With two lines.\n   */\n  readonly operator: ");
  expect(text).toContain("/** Refers to itself. */\nexport interface switch_ {");
  expect(text).toContain("  /** The end of a comment: *\\/ \\ */\n  readonly long: ");
  expect(text).toContain("  /** Not there. */\n  | 0 // none\n");
});
