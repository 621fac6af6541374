// Child processes and files of tests, which are ended and removed even after a failure.

import { type ChildProcess, spawn, type SpawnOptions } from "node:child_process";

const left = new Set<() => void>();

/** Starts a program that ends with the tests. */
export function start(program: string, args: string[], options: SpawnOptions): ChildProcess {
  const child = spawn(program, args, options);
  const end = leave(() => child.kill("SIGKILL"));
  child.once("exit", () => left.delete(end));
  return child;
}

/** Registers a cleanup for the end of the tests. */
export function leave(end: () => void): () => void {
  left.add(end);
  return end;
}

export function endAll(): void {
  for (const end of [...left].reverse()) {
    left.delete(end);
    end();
  }
}

// A run that is interrupted.
process.once("exit", endAll);
