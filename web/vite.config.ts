import { defineConfig } from "vitest/config";

// `npm run dev` shows a server that runs already: PALPATE_SERVER=host:port, by default the address of `palpate serve`.
const server = process.env.PALPATE_SERVER ?? "127.0.0.1:8377";

export default defineConfig({
  base: "./",
  // In the crate that compiles it, so that the archive of the crate has it too.
  build: { outDir: "../crates/palpate-live/dashboard", emptyOutDir: true, target: "es2022", assetsInlineLimit: 0, chunkSizeWarningLimit: 200 },
  server: { proxy: { "/api": { target: `http://${server}`, ws: true, changeOrigin: true, headers: { origin: `http://${server}` } } } },
  test: { include: ["tests/**/*.test.ts"] },
});
