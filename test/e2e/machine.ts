// What the machine has of what tests need: asked in one place for all tests, cmake/capabilities.py.
import { spawnSync } from "node:child_process";
import { readFileSync } from "node:fs";
import path from "node:path";
import { repositoryRoot } from "./processes";

/** Why this machine lacks it, null where it has it. */
export function lacks(name: string): string | null {
  const asked = process.env["RR_MACHINE"];
  if (asked !== undefined)
    return (JSON.parse(readFileSync(asked, "utf8")) as Record<string, string | null>)[name] ?? null;
  const program = path.join(repositoryRoot, "cmake/capabilities.py");
  const { status, stdout } = spawnSync("python3", [program, "--lacks", name], { encoding: "utf8" });
  return status === 0 ? stdout.trim() : null;
}
