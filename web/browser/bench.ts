// A simulated board with a finger that a test moves.

import type { ChildProcess } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { connect, type Socket } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { leave, start } from "./children";
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

  /** Starts a board on the bench of an example rig, with replaced parts and further options. */
  static async start(example: string, replaced: [string, string][], options: string[] = []): Promise<Bench> {
    const folder = written(example, replaced, STAGE);
    const [board, stage] = [await freePort(), await freePort()];
    const args = ["simulated-board", "rig.toml", "--rate", "200 Hz", "--to", `tcp://:${board}`, "--stage", `tcp://:${stage}`, ...options];
    const child = start(BINARY, args, { cwd: folder, stdio: "ignore" });
    const machine = await connected(stage);
    machine.write("G28\n");
    return new Bench(child, machine, folder, `tcp://127.0.0.1:${board}`);
  }

  path(name: string): string {
    return join(this.folder, name);
  }

  press(x_mm: number): void {
    this.machine.write(`G1 Z15\nG1 X${x_mm} Y0\nG1 Z9\n`);
  }

  tap(x_mm: number, taps: number): void {
    this.machine.write(`G1 Z15\nG1 X${x_mm} Y0\n${"G1 Z9\nG1 Z15\n".repeat(taps)}G1 Z9\n`);
  }

  lift(): void {
    this.machine.write("G1 Z15\n");
  }

  stop(): void {
    this.machine.destroy();
    this.child.kill("SIGKILL");
  }
}

/** Factor by which the clocks of a machine's bench and server run fast. */
export const CLOCK_SPEED = ["--clock-speed", "4"];

/** A board, a load cell and a machine that only the server moves. */
export class MachineBench {
  private constructor(
    private machine_port: number,
    readonly folder: string,
    readonly from: string,
    public stage: string,
  ) {}

  /** Starts the bench of an example rig, with replaced parts. */
  static async start(example: string, replaced: [string, string][]): Promise<MachineBench> {
    const folder = written(example, replaced, "");
    const [board, stage] = [await freePort(), await freePort()];
    const args = ["simulated-board", "rig.toml", "--rate", "200 Hz", "--load-cell", "2 mN", "--to", `tcp://:${board}`, "--stage", `tcp://:${stage}`, ...CLOCK_SPEED];
    start(BINARY, args, { cwd: folder, stdio: "ignore" });
    (await connected(stage)).destroy();
    return new MachineBench(stage, folder, `tcp://127.0.0.1:${board}`, `gcode:tcp://127.0.0.1:${stage}`);
  }

  path(name: string): string {
    return join(this.folder, name);
  }

  /** Presses 1 N at a place of the strip, once the server has released the machine. */
  async press(x_mm: number): Promise<void> {
    const machine = await connected(this.machine_port);
    leave(() => machine.destroy());
    machine.write(`G28\nG1 Z27\nG1 X${60 + x_mm} Y110\nG1 Z20\n`);
  }
}

function written(example: string, replaced: [string, string][], added: string): string {
  const folder = mkdtempSync(join(tmpdir(), "palpate-bench-"));
  leave(() => rmSync(folder, { recursive: true, force: true }));
  let text = readFileSync(`${ROOT}/examples/${example}`, "utf8");
  for (const [what, by] of replaced) text = text.replace(what, by);
  writeFileSync(join(folder, "rig.toml"), text + added);
  return folder;
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
