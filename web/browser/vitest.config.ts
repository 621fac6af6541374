import { defineConfig } from "vitest/config";

// One browser and one server at a time: they share two cores with the tests.
export default defineConfig({
  test: { include: ["browser/**/*.test.ts"], setupFiles: ["browser/setup.ts"], testTimeout: 240_000, hookTimeout: 120_000, fileParallelism: false },
});
