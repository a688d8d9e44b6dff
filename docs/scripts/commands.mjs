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
  const overview = help();
  const names = [...overview.matchAll(/^ +(?:rrgate )?([a-z][a-z-]*)(?= |$)/gm)].map(([, name]) => name);
  const commands = [...new Set(names)].filter((name) => name !== "rrgate");
  if (commands.length === 0) throw new Error(`${program} --help lists no commands`);
  const block = (text) => `\`\`\`txt\n${text}\n\`\`\`\n`;
  return [intro, block(overview), ...commands.map((name) => `## rrgate ${name}\n\n${block(help(name))}`)].join("\n");
}
