// What the page costs on the way to a browser.
import { get } from "node:http";
import type { IncomingMessage } from "node:http";
import { brotliDecompressSync, gunzipSync } from "node:zlib";
import type { Page } from "@playwright/test";
import { expect, test } from "../lab_test";

interface Answer {
  status: number | undefined;
  headers: IncomingMessage["headers"];
  body: Buffer;
}

/** As it comes over the wire: fetch() would unpack it. */
function ask(url: string, headers: Record<string, string>): Promise<Answer> {
  return new Promise((resolve, reject) => {
    get(url, { headers }, (response) => {
      const chunks: Buffer[] = [];
      response.on("data", (chunk: Buffer) => chunks.push(chunk));
      response.on("end", () =>
        resolve({ status: response.statusCode, headers: response.headers, body: Buffer.concat(chunks) }),
      );
      response.on("error", reject);
    }).on("error", reject);
  });
}

/** The page and all that it loads at once, by what its browser asked for. */
async function filesOfPage(page: Page, url: string, view: string, isThere: string): Promise<string[]> {
  const files = new Set<string>();
  page.on("request", (request) => {
    if (request.url().startsWith(url) && !request.url().includes("/api/")) files.add(request.url());
  });
  await page.goto(`${url}#/devices/create/Create${view}`);
  await expect(page.locator('[data-link="online"]')).toBeVisible();
  await expect(page.locator(isThere).first()).toBeVisible();
  await expect(page.locator(".panel-body:empty")).toHaveCount(0);
  return [...files].filter((file) => !file.includes("/devices/"));
}

test("the page comes compressed, with tags of its own, and in less than half of its bytes", async ({ page, lab }) => {
  const files = await filesOfPage(page, lab.url, "", "[data-pose]");
  expect(files.some((file) => file.endsWith(".wasm"))).toBe(true);
  const sizes = { identity: 0, gzip: 0, br: 0 };
  for (const file of files) {
    const plain = await ask(file, { "accept-encoding": "identity" });
    expect(plain.status).toBe(200);
    expect(plain.headers["content-encoding"]).toBeUndefined();
    sizes.identity += plain.body.length;
    for (const [encoding, unpack] of [
      ["br", brotliDecompressSync],
      ["gzip", gunzipSync],
    ] as const) {
      const packed = await ask(file, { "accept-encoding": encoding });
      sizes[encoding] += packed.body.length;
      expect(packed.headers["vary"]).toBe("Accept-Encoding");
      expect(packed.headers["content-type"]).toBe(plain.headers["content-type"]);
      if (packed.headers["content-encoding"] === undefined) continue; // it would not get smaller
      expect(packed.headers["content-encoding"]).toBe(encoding);
      expect(unpack(packed.body).equals(plain.body)).toBe(true);
      expect(packed.headers["etag"]).not.toBe(plain.headers["etag"]);
      const again = await ask(file, { "accept-encoding": encoding, "if-none-match": packed.headers["etag"] ?? "" });
      expect([again.status, again.body.length]).toEqual([304, 0]);
    }
  }
  expect(sizes.br).toBeLessThan(177_000);
  expect(sizes.br).toBeLessThan(sizes.identity * 0.4);
  expect(sizes.gzip).toBeLessThan(sizes.identity * 0.5);
});

const views = [
  // 23 kB of it are the plots.
  { view: "?view=board", shows: '[data-panel="plot"] .freshness', never: /robot_page|scene_panel/, most: 200_000 },
  { view: "?view=members", shows: '[data-member="Drive"]', never: /robot_page|board_page|_panel/, most: 164_000 },
];
for (const { view, shows, never, most } of views)
  test(`${view} loads no part of another view, and less than ${most / 1000} kB`, async ({ page, lab }) => {
    const files = await filesOfPage(page, lab.url, view, shows);
    expect(files.filter((file) => never.test(file))).toEqual([]);
    let size = 0;
    for (const file of files) size += (await ask(file, { "accept-encoding": "br" })).body.length;
    expect(size).toBeLessThan(most);
  });

test("the list of devices comes without the pages of boards and robots, in less than 60 kB of files that are no WebAssembly", async ({
  page,
  lab,
}) => {
  const files = new Set<string>();
  page.on("request", (request) => {
    const { pathname } = new URL(request.url());
    if (/\.(js|css)$/.test(pathname)) files.add(request.url());
  });
  await page.goto(lab.url);
  await expect(page.locator('[data-device="create"] [data-state="online"]')).toBeVisible();
  expect([...files].filter((file) => /board_page|robot_page|panel/.test(file))).toEqual([]);
  let size = 0;
  for (const file of files) size += (await ask(file, { "accept-encoding": "br" })).body.length;
  expect(size).toBeLessThan(60_000);
});
