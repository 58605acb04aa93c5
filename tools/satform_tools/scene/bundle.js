// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// Writes vendor/ from the packages of package-lock.json: `npm ci && npm run bundle`. Users need neither npm nor Node.
import { build } from "esbuild";
import { readFileSync, writeFileSync } from "node:fs";

const version = (name) => JSON.parse(readFileSync(`node_modules/${name}/package.json`)).version;
const licence = (name, file, why) =>
  `${name} ${version(name)}: ${why}\n\n${readFileSync(`node_modules/${name}/${file}`, "utf8").trim()}\n`;

await build({
  entryPoints: ["libraries.js"],
  bundle: true,
  minify: true,
  format: "iife",
  globalName: "libraries",
  target: "es2022",
  legalComments: "none",
  banner: { js: `/* three.js ${version("three")}, MIT; coastlines of world-atlas ${version("world-atlas")}, ISC: LICENSES.txt */` },
  outfile: "vendor/three.js",
});
const uplot = readFileSync("node_modules/uplot/dist/uPlot.iife.min.js", "utf8").trim();
writeFileSync("vendor/uplot.js", `/* uPlot ${version("uplot")}, MIT: LICENSES.txt */\n${uplot}\n`);
writeFileSync("vendor/uplot.css", readFileSync("node_modules/uplot/dist/uPlot.min.css", "utf8"));
writeFileSync("vendor/LICENSES.txt", [
  licence("three", "LICENSE", "scene of reports and of the live page"),
  licence("uplot", "LICENSE", "charts of the live page"),
  licence("world-atlas", "LICENSE", "coastlines; made from Natural Earth, which is in the public domain"),
].join("\n\n"));
