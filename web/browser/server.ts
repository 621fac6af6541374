// A `palpate serve` of a test.

import type { ChildProcess } from "node:child_process";
import { createServer } from "node:net";
import { fileURLToPath } from "node:url";
import { start } from "./children";

export const ROOT = fileURLToPath(new URL("../..", import.meta.url));

export const BINARY = process.env.PALPATE_BINARY ?? `${ROOT}/target/debug/palpate`;
/** Longest time to the first answer, which includes a fit to simulated readings. */
const START_MS = 40_000;

export class Server {
  private constructor(
    private child: ChildProcess,
    readonly url: string,
  ) {}

  static async start(args: string[], port?: number, folder = ROOT): Promise<Server> {
    const listen = `127.0.0.1:${port ?? (await freePort())}`;
    const child = start(BINARY, ["serve", ...args, "--listen", listen], { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
    const said: string[] = [];
    child.stdout!.on("data", (bytes: Buffer) => said.push(bytes.toString()));
    child.stderr!.on("data", (bytes: Buffer) => said.push(bytes.toString()));
    child.on("error", (error) => said.push(String(error)));
    const server = new Server(child, `http://${listen}/`);
    const end = Date.now() + START_MS;
    while (Date.now() < end && child.exitCode === null) {
      const answers = await fetch(`${server.url}api/session`).then((response) => response.ok, () => false);
      if (answers) return server;
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
    child.kill("SIGKILL");
    throw new Error(`palpate serve ${args.join(" ")} does not answer; it said:\n${said.join("")}`);
  }

  get port(): number {
    return Number(new URL(this.url).port);
  }

  /** Kills the server, like a power cut. */
  async kill(): Promise<void> {
    const gone = new Promise((resolve) => this.child.once("exit", resolve));
    this.child.kill("SIGKILL");
    await gone;
  }

  async stop(): Promise<void> {
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    const gone = new Promise((resolve) => this.child.once("exit", resolve));
    this.child.kill("SIGTERM");
    await gone;
  }
}

export async function freePort(): Promise<number> {
  const probe = createServer();
  await new Promise<void>((resolve) => probe.listen(0, "127.0.0.1", resolve));
  const address = probe.address();
  await new Promise((resolve) => probe.close(resolve));
  if (address === null || typeof address === "string") throw new Error("no port is free");
  return address.port;
}
