// A simulated board whose finger a test moves, by the machine that stands beside it.

import { type ChildProcess, spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { connect, type Socket } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { BINARY, freePort, ROOT } from "./server";

const STAGE = `
[stage]
origin = ["0 mm", "0 mm"]
touch = "10 mm"
depths = ["1 mm"]
`;

export class Bench {
  private constructor(
    private child: ChildProcess,
    private machine: Socket,
    readonly folder: string,
    readonly from: string,
  ) {}

  /** A board on the bench of a rig of the examples, of which parts are replaced. */
  static async start(example: string, replaced: [string, string][]): Promise<Bench> {
    const folder = mkdtempSync(join(tmpdir(), "palpate-bench-"));
    let text = readFileSync(`${ROOT}/examples/${example}`, "utf8");
    for (const [what, by] of replaced) text = text.replace(what, by);
    writeFileSync(join(folder, "rig.toml"), text + STAGE);
    const [board, stage] = [await freePort(), await freePort()];
    const args = ["simulated-board", "rig.toml", "--rate", "200 Hz", "--to", `tcp://:${board}`, "--stage", `tcp://:${stage}`];
    const child = spawn(BINARY, args, { cwd: folder, stdio: "ignore" });
    const machine = await connected(stage);
    machine.write("G28\n");
    return new Bench(child, machine, folder, `tcp://127.0.0.1:${board}`);
  }

  path(name: string): string {
    return join(this.folder, name);
  }

  /** Presses at a place with the rig's force. */
  press(x_mm: number): void {
    this.machine.write(`G1 Z15\nG1 X${x_mm} Y0\nG1 Z9\n`);
  }

  lift(): void {
    this.machine.write("G1 Z15\n");
  }

  stop(): void {
    this.machine.destroy();
    this.child.kill("SIGKILL");
    rmSync(this.folder, { recursive: true });
  }
}

async function connected(port: number): Promise<Socket> {
  for (let attempt = 0; attempt < 100; attempt++) {
    const socket = await new Promise<Socket | null>((resolve) => {
      const socket = connect(port, "127.0.0.1", () => resolve(socket));
      socket.once("error", () => resolve(null));
    });
    if (socket !== null) {
      socket.on("error", () => {});
      socket.resume();
      return socket;
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error("the simulated machine does not answer");
}
