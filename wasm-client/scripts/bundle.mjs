// The scripts of the package from ts/: one file for pages, small ones beside it for what is loaded later or elsewhere.
// Usage: node scripts/bundle.mjs [DIRECTORY [--sourcemap]]. Part of `npm run build`.
import { fileURLToPath } from "node:url";
import { rolldown } from "rolldown";

const [directory = fileURLToPath(new URL("../dist", import.meta.url)), option] = process.argv.slice(2);
const source = (name) => fileURLToPath(new URL(`../ts/${name}.ts`, import.meta.url));
const entries = [
  "index",
  "internal",
  "definition/definition",
  "lease/held_lease",
  "losses/losses",
  "node",
  "react/react",
  "serve/node",
  "serve/serve",
  "services/find_services",
  "stores/stores",
  "svelte/svelte",
  "usb/nodes",
  "vue/vue",
  "worker",
];
/** What a page that is a device loads, whether it is one or Node in its place. */
const served = /\/wasm-client\/ts\/serve\/(?!node\.ts$)/;
/** What a worker does is in a script of its own (below); here, only the tests look at it. */
const host = /\/wasm-client\/ts\/worker\/(?:host|outbox|serve_thread)\.ts$/;
const thread = /\/wasm-client\/ts\/worker\/(?:thread|remote_core)\.ts$/;
const passage = /\/wasm-client\/ts\/worker\/passage\.ts$/;
/** What all entries have in common: one file of it, whoever loads it. */
const shared =
  /\/wasm-client\/ts\/(?!usb\/|lease\/|losses\/|definition\/|react\/|serve\/|services\/|stores\/|svelte\/|vue\/|worker\/|(?:index|internal|node|worker)\.ts$)/;

// Bundlers look for files by `new URL("...", import.meta.url)`; not all take the quotes that the minifier prefers. A plugin
// after it, so that source maps stay right: each quote is one character, too.
const quotes = {
  name: "quotes",
  generateBundle(_, bundle) {
    for (const file of Object.values(bundle)) {
      if (file.type === "chunk")
        file.code = file.code.replace(/\b(new URL|import)\(`([^`$]*)`|\{type:`module`\}/g, (all) =>
          all.replace(/`/g, '"'),
        );
    }
  },
};

const settings = {
  platform: "neutral",
  external: [/^node:/, "react", "vue", "ws"],
  tsconfig: false,
  transform: {
    target: "es2022",
    // Fields are set before they are read: saying at the beginning that they are undefined is only more to load.
    assumptions: { setPublicClassFields: true },
    typescript: { removeClassFieldsWithoutInitializer: true },
  },
  plugins: [quotes],
};

async function build(input, codeSplitting) {
  const bundle = await rolldown({ input: Object.fromEntries(input.map((name) => [name, source(name)])), ...settings });
  await bundle.write({
    dir: directory,
    format: "es",
    minify: true,
    comments: false, // not even hints for bundlers: what they could leave out is none of them
    codeSplitting,
    chunkFileNames: "[name].js",
    sourcemap: option === "--sourcemap",
  });
  await bundle.close();
}

await build(entries, {
  groups: [
    { name: "client", test: shared },
    { name: "serve/device", test: served },
    { name: "worker/passage", test: passage },
    { name: "worker/host", test: host },
    { name: "thread", test: thread },
  ],
});
await build(["worker_thread"], false);
