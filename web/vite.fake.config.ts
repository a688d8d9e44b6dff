import base from "./vite.config";
export default { ...base, build: { ...(base as any).build, outDir: "/tmp/web-fake-dist", emptyOutDir: true }, resolve: { alias: { "rrgate-client": new URL("src/dev/fake_client.ts", import.meta.url).pathname } } };
