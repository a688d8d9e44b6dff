// The reference of the command line: what the program answers to --help.
import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import path from "node:path";

export function commandsPage(repository) {
  const program = process.env.RRGATE ?? path.join(repository, "build/release/server/rrgate");
  const intro =
    "# Commands\n\nWhat `rrgate` answers to `--help`. [Devices from the command line](../docs/command-line.md) has examples.\n";
  if (!existsSync(program)) {
    console.warn(`${program} is not built: the page of commands says no more than that`);
    return `${intro}\nThis site was made without the program: \`rrgate --help\` lists the commands.\n`;
  }
  const help = (...words) => execFileSync(program, [...words, "--help"], { encoding: "utf8" }).trimEnd();
  const block = (text) => `\`\`\`txt\n${text}\n\`\`\`\n`;
  const sections = commandsIn(help(), []).flatMap((words) => sectionsOf(words));
  if (sections.length === 0) throw new Error(`${program} --help lists no commands`);
  return [intro, block(help()), ...sections].join("\n");

  /** The command's own help, then that of the commands below it ("cert ca"). */
  function sectionsOf(words) {
    const text = help(...words);
    const heading = `${"#".repeat(1 + words.length)} rrgate ${words.join(" ")}`;
    return [`${heading}\n\n${block(text)}`, ...commandsIn(text, words).flatMap((below) => sectionsOf(below))];
  }
}

/** The commands that a help lists, as the words that call them. */
function commandsIn(text, above) {
  return [...text.matchAll(/^ {2}([a-z][a-z-]*) {2,}[A-Z]/gm)].map(([, name]) => [...above, name]);
}
