// nginx as gateway-config/proxies/ describes it, with TLS: https://.../ and, below a path, https://.../robots/.
import { existsSync, mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { connect } from "node:net";
import { tmpdir } from "node:os";
import path from "node:path";
import { freePort, makeCertificate, Program, repositoryRoot } from "./processes";

const found = [
  process.env["NGINX"] ?? "",
  "/usr/sbin/nginx",
  path.join(repositoryRoot, "build/deps/proxies/usr/sbin/nginx"),
];

export interface Nginx {
  root: string;
  below: string;
  stop(): Promise<void>;
}

/** `gateway`: the port of one that trusts 127.0.0.1. */
export async function startNginx(gateway: number): Promise<Nginx> {
  const file = found.find((each) => each !== "" && existsSync(each));
  if (file === undefined) throw new Error("nginx is missing: ./dev test e2e unpacks it, or name one in NGINX");
  const folder = mkdtempSync(path.join(tmpdir(), "rrgate-nginx-"));
  const { cert, key } = makeCertificate();
  const [root, below] = [await freePort(), await freePort()];
  const listen = (port: number): string => `listen ${port} ssl; ssl_certificate ${cert}; ssl_certificate_key ${key};`;
  const sites = readFileSync(path.join(repositoryRoot, "gateway-config/proxies/nginx.conf"), "utf8")
    .replace("listen 8081;", listen(root))
    .replace("listen 8082;", listen(below))
    .replaceAll(/\b8080\b/g, String(gateway));
  const temporary = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"]
    .map((each) => `${each}_temp_path ${folder}/${each};`)
    .join(" ");
  const config = path.join(folder, "nginx.conf");
  writeFileSync(
    config,
    `daemon off; ${process.getuid?.() === 0 ? "user root;" : ""} pid ${folder}/pid; error_log stderr; worker_processes 1;
     events { worker_connections 256; }
     http { access_log off; ${temporary}
     ${sites} }`,
  );
  const program = new Program(file, ["-p", folder, "-c", config]);
  program.start();
  await untilOpen(root, program);
  return {
    root: `https://127.0.0.1:${root}/`,
    below: `https://127.0.0.1:${below}/robots/`,
    stop: () => program.kill("SIGTERM"),
  };
}

async function untilOpen(port: number, program: Program): Promise<void> {
  const giveUp = Date.now() + 10_000;
  for (;;) {
    const isOpen = await new Promise<boolean>((resolve) => {
      const socket = connect(port, "127.0.0.1", () => resolve(true));
      socket.once("error", () => resolve(false));
      socket.once("connect", () => socket.end());
    });
    if (isOpen) return;
    if (Date.now() > giveUp) throw new Error(`nginx does not listen on ${port}:\n${program.output}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}
