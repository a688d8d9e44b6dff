// The client package in a page, at a gateway that asks who one is: tokens, and tickets through a restart of the gateway.
import { cpSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import { GuardedLab } from "../guarded_lab";
import { repositoryRoot } from "../processes";

let lab: GuardedLab;

test.beforeAll(async () => {
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-site-"));
  cpSync(path.join(repositoryRoot, "wasm-client/dist"), site, { recursive: true });
  writeFileSync(path.join(site, "index.html"), "<!doctype html><title>client</title>");
  lab = await GuardedLab.start(site);
});

test.afterAll(() => lab?.stop());

test("subscriptions with tickets and with a token survive a restart of the gateway", async ({ page }) => {
  await page.goto(lab.url);
  await page.evaluate(async (token) => {
    const { subscribe } = await import(new URL("index.js", location.href).href);
    const options = { firstRetry: 100, longestRetry: 500 };
    const url = "/devices/create?service=Create";
    const ticketed = async (): Promise<string> => {
      const headers = { ["Authorization"]: `Bearer ${token}` };
      const { ticket } = await (await fetch("/api/v1/tickets", { method: "POST", headers })).json();
      return `${url}&ticket=${ticket}`;
    };
    const counts: Record<string, number> = { ticketed: 0, token: 0, bare: 0 };
    for (const [name, way, more] of [
      ["ticketed", ticketed, {}],
      ["token", url, { token }],
      ["bare", url, {}],
    ] as const)
      subscribe(way, { ...options, ...more }).onConnected(() => (counts[name] = (counts[name] ?? 0) + 1));
    Object.assign(window, { counts });
  }, lab.token);
  const counts = () => page.evaluate(() => (window as unknown as { counts: unknown }).counts);
  await expect.poll(counts).toEqual({ ticketed: 1, token: 1, bare: 0 });
  await lab.gateway.kill();
  lab.gateway.start();
  await lab.waitUntilOnline();
  await expect.poll(counts).toEqual({ ticketed: 2, token: 2, bare: 0 });
});
