// Bundles the page into the Python package: one script, one style sheet, the page, the icon and three's licence.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { copyFile, mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { fileURLToPath } from "node:url";

const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const target = here("../src/tendonrod/navigate/web/");
const { version } = JSON.parse(await readFile(here("node_modules/three/package.json"), "utf8"));
const options = { bundle: true, minify: true, target: ["es2022"], legalComments: "none", logLevel: "warning" };

/** SHA-256 over all sources in the order of their names; a test compares it, so that no stale page is shipped. */
async function fingerprint() {
  const listed = await Promise.all(["src", "style"].map((folder) => readdir(here(folder), { recursive: true, withFileTypes: true })));
  const files = listed.flat().filter((entry) => entry.isFile()).map((entry) => `${entry.parentPath}/${entry.name}`);
  const hash = createHash("sha256");
  for (const path of [...files, here("index.html"), here("icon.svg"), here("package.json")].sort()) hash.update(await readFile(path));
  return hash.digest("hex");
}

await mkdir(target, { recursive: true });
await build({
  ...options,
  entryPoints: [here("src/main.js")],
  outfile: `${target}app.js`,
  format: "esm",
  banner: {
    js: `/* Built from web/ by "make web"; holds three.js ${version} (MIT, see LICENSE-three.txt). Sources: ${await fingerprint()} */`,
  },
});
await build({ ...options, entryPoints: [here("style/page.css")], outfile: `${target}style.css` });
await copyFile(here("index.html"), `${target}index.html`);
await copyFile(here("icon.svg"), `${target}icon.svg`);
await writeFile(
  `${target}LICENSE-three.txt`,
  `three.js ${version}, part of app.js, is used under this licence:\n\n${await readFile(here("node_modules/three/LICENSE"), "utf8")}`,
);
