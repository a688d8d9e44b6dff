// Puts FILE.br and FILE.gz beside each file of the page that gets smaller by it: the gateway serves them to browsers that
// take them. Browsers take Brotli over HTTPS and from this machine alone. Part of `npm run build`.
import { readFile, readdir, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { brotliCompress, constants, gzip } from "node:zlib";

const folder = process.argv[2] ?? fileURLToPath(new URL("../dist/", import.meta.url));
const ways = [
  [
    ".br",
    (plain) => promisify(brotliCompress)(plain, { params: { [constants.BROTLI_PARAM_SIZE_HINT]: plain.length } }),
  ],
  [".gz", (plain) => promisify(gzip)(plain, { level: constants.Z_BEST_COMPRESSION })],
];

async function compress(file) {
  const plain = await readFile(file);
  for (const [ending, pack] of ways) {
    const packed = await pack(plain);
    if (packed.length < plain.length) await writeFile(file + ending, packed);
  }
}

const entries = await readdir(folder, { recursive: true, withFileTypes: true });
const files = entries.filter((entry) => entry.isFile() && !/\.(br|gz)$/.test(entry.name));
await Promise.all(files.map((entry) => compress(`${entry.parentPath ?? entry.path}/${entry.name}`)));
