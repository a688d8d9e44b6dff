// Every text that the page passes through t() has a German one, with the same places for values.
import { readdirSync, readFileSync } from "node:fs";
import german from "../../web/src/messages/de";

const source = new URL("../../web/src/", import.meta.url);
const files = readdirSync(source, { recursive: true, encoding: "utf8" }).filter((name) => /\.tsx?$/.test(name));
const texts = new Set(
  files.flatMap((name) =>
    [...readFileSync(new URL(name, source), "utf8").matchAll(/\bt\(\s*"((?:[^"\\]|\\.)*)"/g)].map((match) => match[1] ?? ""),
  ),
);

test("all texts are there in German, with the same values", () => {
  expect(texts.size).toBeGreaterThan(80);
  expect([...texts].filter((text) => !Object.hasOwn(german, text))).toEqual([]);
  for (const [text, other] of Object.entries(german))
    expect(other.match(/\{\d\}/g)?.sort() ?? [], text).toEqual(text.match(/\{\d\}/g)?.sort() ?? []);
});
