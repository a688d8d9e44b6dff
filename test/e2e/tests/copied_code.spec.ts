// What a form gives as code, run as it is copied: by Node with rrgate-client, by a shell, and by Python with Robot Raconteur.
import { execFile } from "node:child_process";
import path from "node:path";
import { promisify } from "node:util";
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";
import { addPanel } from "../board";
import { python } from "../peers";
import { repositoryRoot, startTestService, webRoot } from "../processes";

let service: Awaited<ReturnType<typeof startTestService>>;

test.beforeAll(async () => {
  service = await startTestService(webRoot);
});

test.afterAll(() => service?.stop());

const run = promisify(execFile);
const hasTheClient = { cwd: path.join(repositoryRoot, "web"), env: { ...process.env, ["FORCE_COLOR"]: "0" } };

interface Way {
  language: string;
  execute: (code: string) => Promise<{ stdout: string }>;
  resultOf: (stdout: string) => number;
}

const ways: readonly Way[] = [
  {
    language: "JavaScript",
    // A page ends with its connection, a program by closing it.
    execute: (code) =>
      run(process.execPath, ["--input-type=module", "-e", `${code}\nawait robot.$.close();`], hasTheClient),
    resultOf: Number,
  },
  {
    language: "curl",
    execute: (code) => run("sh", ["-c", code.replace(/^curl /, "curl --fail --silent --show-error ")]),
    resultOf: (stdout) => (JSON.parse(stdout) as { result: number }).result,
  },
  { language: "Python", execute: (code) => run(python(), ["-c", code]), resultOf: Number },
];

/** @returns the code of a form whose fields have these texts. */
async function copied(page: Page, language: string, member: string, texts: Record<string, string>): Promise<string> {
  await page.goto(`${service.url}#/devices/big/interop?view=board`);
  await addPanel(page, "form");
  const form = page.locator('[data-panel="form"]').last();
  await form.getByLabel("Member").selectOption(member);
  for (const [name, text] of Object.entries(texts))
    await form.getByRole("textbox", { name: new RegExp(`^${name}`) }).fill(text);
  await form.getByText("Copy as code").click();
  await form.getByRole("button", { name: language }).click();
  return form.locator("pre.json").innerText();
}

for (const { language, execute, resultOf } of ways) {
  test(`${language} that is copied from a form calls what the form calls`, async ({ page }) => {
    const code = await copied(page, language, "add", { left: "2", right: "0.5" });
    expect(resultOf((await execute(code)).stdout)).toBe(2.5);
  });

  test(`${language} that is copied from a form sets what the form sets`, async ({ page }) => {
    const text = `it's "wide" $HOME \\n für`;
    const code = await copied(page, language, "p_string", { p_string: text });
    const property = `${service.url}api/v1/devices/big/interop/p_string`;
    await page.request.put(property, {
      data: JSON.stringify(language),
      headers: { ["Content-Type"]: "application/json" },
    });
    await execute(code);
    expect(await (await page.request.get(property)).json()).toBe(text);
  });
}
