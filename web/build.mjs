/** Makes src/saltus/explore/page from web/src: `npm ci && npm run build`. The same sources give the same bytes.
 *  `node build.mjs FOLDER` writes elsewhere (the test that compares does). */
import { build } from "esbuild";
import { copyFile, mkdir } from "node:fs/promises";
import { fileURLToPath } from "node:url";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const out = process.argv[2] ?? here("../src/saltus/explore/page");
await mkdir(out, { recursive: true });
await build({
  absWorkingDir: here("."),
  entryPoints: ["src/main.ts", "src/style.css"],
  bundle: true, minify: true, format: "esm", target: "es2022", legalComments: "none", charset: "utf8",
  outdir: out, logLevel: "warning",
});
for (const name of ["index.html", "favicon.svg"]) await copyFile(here(`src/${name}`), `${out}/${name}`);
