// Takes away what an earlier build left: files that are no longer built would be published and counted.
import { rm } from "node:fs/promises";

await rm(new URL("../dist/", import.meta.url), { recursive: true, force: true });
