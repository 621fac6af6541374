import { defineConfig } from "vitest/config";

// One browser and one server after another: the tests share two cores with them.
export default defineConfig({
  test: { include: ["browser/**/*.test.ts"], setupFiles: ["browser/setup.ts"], testTimeout: 240_000, hookTimeout: 120_000, fileParallelism: false },
});
