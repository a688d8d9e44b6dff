// Every text that the page passes through t() has a German one, with the same places for values.
import german from "../../web/src/messages/de";

const files = import.meta.glob<string>("../../web/src/**/*.{ts,tsx}", {
  query: "?raw",
  import: "default",
  eager: true,
});
const texts = new Set(
  Object.values(files).flatMap((source) =>
    [...source.matchAll(/\bt\(\s*"((?:[^"\\]|\\.)*)"/g)].map((match) => match[1] ?? ""),
  ),
);

test("all texts are there in German, with the same values", () => {
  expect(texts.size).toBeGreaterThan(80);
  expect([...texts].filter((text) => !Object.hasOwn(german, text))).toEqual([]);
  for (const [text, other] of Object.entries(german))
    expect(other.match(/\{\d\}/g)?.sort() ?? [], text).toEqual(text.match(/\{\d\}/g)?.sort() ?? []);
});
