// The test client by rrgate-client, in a page: Chromium without a window, one for the whole run.
//
//   node chromium.mjs PORT     serves the page at PORT of the loopback, and says {"origin": "http://..."} when it is ready;
//                              then, for each line {"url", "steps"} of standard input, prints {"results": [...]}
//
// With "page" in the line, the page is loaded from that origin instead; an error in the page is told as {"page_error"}.
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { createInterface } from "node:readline";
import { launchChromium } from "./browser.mjs";

const repository = new URL("../../../", import.meta.url);

// The package as it is published, and the steps; with the strictest policy that its README promises to live with.
const files = /^\/(wasm-client\/dist\/[\w./-]+|test\/interop\/js\/steps\.mjs)$/;
const types = { js: "text/javascript", mjs: "text/javascript", wasm: "application/wasm" };
const server = createServer(async (request, response) => {
  const [, path] = files.exec(request.url) ?? [];
  if (request.url === "/") {
    const policy = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; connect-src *";
    response.writeHead(200, { "Content-Type": "text/html", "Content-Security-Policy": policy });
    response.end("<!doctype html><title>interop</title>");
    return;
  }
  try {
    const content = await readFile(new URL(path, repository));
    response
      .writeHead(200, { "Content-Type": types[path.split(".").at(-1)], "Cache-Control": "max-age=3600" })
      .end(content);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((resolve) => server.listen(Number(process.argv[2]), "127.0.0.1", resolve));
const origin = `http://127.0.0.1:${server.address().port}`;

const browser = await launchChromium();
const page = await browser.newPage();
let errors = [];
page.on("pageerror", (error) => errors.push(String(error)));
console.log(JSON.stringify({ origin }));

for await (const line of createInterface({ input: process.stdin })) {
  console.log(JSON.stringify(await in_page(JSON.parse(line))));
}
await browser.close();
server.close();

/** Loaded anew for each scenario: what one leaves behind is not the next one's. */
async function in_page({ url, steps, page: from = origin }) {
  errors = [];
  try {
    await page.goto(from);
    const work = async ([url, steps]) => (await import("/test/interop/js/steps.mjs")).carry_out(url, steps);
    const answer = await page.evaluate(work, [url, steps]);
    return errors.length > 0 ? { page_error: errors } : answer;
  } catch (error) {
    return { page_error: [String(error), ...errors] };
  }
}
