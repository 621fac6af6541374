// Programs that a test started: all are ended and what they left is removed, whether the test passed or not.

import { type ChildProcess, spawn, type SpawnOptions } from "node:child_process";

const left = new Set<() => void>();

/** Starts a program that does not outlive the tests. */
export function start(program: string, args: string[], options: SpawnOptions): ChildProcess {
  const child = spawn(program, args, options);
  const end = leave(() => child.kill("SIGKILL"));
  child.once("exit", () => left.delete(end));
  return child;
}

/** Notes what is to be done when the tests have ended. */
export function leave(end: () => void): () => void {
  left.add(end);
  return end;
}

/** Ends what was started, the last first. */
export function endAll(): void {
  for (const end of [...left].reverse()) {
    left.delete(end);
    end();
  }
}

// A run that is ended before its tests are.
process.once("exit", endAll);
