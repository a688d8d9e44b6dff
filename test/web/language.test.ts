// Every text of the page goes through t(), and has a German one, with the same places for values.
import { STANDARD } from "../../web/src/board/presets";
import german from "../../web/src/messages/de";

const files = import.meta.glob<string>("../../web/src/**/*.{ts,tsx}", {
  query: "?raw",
  import: "default",
  eager: true,
});
const texts = new Set(
  Object.values(files).flatMap((source) =>
    [...source.matchAll(/\bt\(\s*(?:"((?:[^"\\]|\\.)*)"|'([^']*)')/g)].map((match) => match[1] ?? match[2] ?? ""),
  ),
);

test("all texts are there in German, with the same values", () => {
  expect(texts.size).toBeGreaterThan(80);
  expect([...texts].filter((text) => !Object.hasOwn(german, text))).toEqual([]);
  for (const [text, other] of Object.entries(german))
    expect(other.match(/\{\d\}/g)?.sort() ?? [], text).toEqual(text.match(/\{\d\}/g)?.sort() ?? []);
});

test("titles of the panels that boards begin with are there in German", () => {
  const titles = Object.values(STANDARD).flatMap(({ panels }) =>
    panels.flatMap(([, , , , , , title]) => (title === undefined ? [] : [title])),
  );
  expect(titles.length).toBeGreaterThan(25);
  expect(titles.filter((title) => !Object.hasOwn(german, title))).toEqual([]);
});

test("no text between tags, and none that is read aloud, goes past t()", () => {
  const past = Object.entries(files).flatMap(([file, source]) =>
    file.endsWith(".tsx")
      ? [
          ...source.matchAll(/\b(?:aria-label|title|alt)="[^"]*[A-Za-z]{3}[^"]*"/g),
          ...source.matchAll(/<(?:p|h\d|button|span|a|td|th|dt|summary|label|option)\b[^<>]*>\s*[A-Z][a-z]+[^<>{}]*</g),
        ].map(([text]) => `${file}: ${text}`)
      : [],
  );
  expect(past).toEqual([]);
});
