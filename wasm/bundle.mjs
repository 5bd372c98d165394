// node bundle.mjs SOURCE.mjs PLAIN.wasm SIMD.wasm OUT.mjs ZOPFLI: writes the ES module with both WebAssembly modules inside, the one
// with vectors as what differs from the other. Fails unless both import nothing and all keep to their budgets (budget.json).
//
// They are compressed by zopfli, which browsers undo themselves, and then in base64, which gzip undoes when the module is
// sent: so it is small on disk, too.
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import { createRequire } from 'node:module';
import zlib from 'node:zlib';

const esbuild = createRequire(new URL('../web/package.json', import.meta.url))('esbuild');
const BUDGET = JSON.parse(fs.readFileSync(new URL('budget.json', import.meta.url)));  // bytes; of the ES module as gzip -9 makes it
const [sourceFile, plainFile, simdFile, outFile, zopfli] = process.argv.slice(2);

const varint = value => (value < 128 ? [value] : [(value % 128) + 128, ...varint(Math.floor(value / 128))]);

// Bytes of `fresh`, in turns literally and copied from `old`: the number of literal bytes and they themselves; then how far
// the copy begins from where it would if they stood for as many of the old ones (zigzag), and its length. Literal bytes come
// last.
function deltaOf(old, fresh) {
  const KEY = 6, NEAR = 4;
  const key = (bytes, at) => bytes.toString('latin1', at, at + KEY);
  const places = new Map();
  for (let at = 0; at + KEY <= old.length; at++) places.set(key(old, at), [...(places.get(key(old, at)) ?? []), at]);
  const common = (from, at) => {
    let length = 0;
    while (at + length < fresh.length && old[from + length] === fresh[at + length]) length++;
    return length;
  };
  const delta = [];
  let at = 0, begin = 0, end = 0;  // literal bytes since `begin`; the copy before ended at `end`
  while (at < fresh.length) {
    const straight = end + at - begin;
    let from = straight, length = common(straight, at), worth = length < 3 ? 0 : length + NEAR;
    for (const place of places.get(key(fresh, at)) ?? []) {
      const here = common(place, at);
      if (here > worth) from = place, length = here, worth = here;
    }
    if (worth === 0) {
      at++;
      continue;
    }
    const shift = from - straight;
    delta.push(...varint(at - begin), ...fresh.subarray(begin, at), ...varint(shift < 0 ? -2 * shift - 1 : 2 * shift), ...varint(length));
    at += length;
    begin = at, end = from + length;
  }
  delta.push(...varint(at - begin), ...fresh.subarray(begin, at));
  return Buffer.from(delta);
}

// zlib's format.
function compressed(bytes) {
  const file = `${outFile}.unpacked`;
  fs.writeFileSync(file, bytes);
  const packed = execFileSync(zopfli, ['--i50', '--zlib', '-c', file], { maxBuffer: 1 << 24 });
  fs.rmSync(file);
  return packed;
}

// No comments but the first line and one that is for bundlers, short names.
function minified(source) {
  const { code } = esbuild.transformSync(source, { minify: true, format: 'esm', target: 'es2022' });
  return `${source.split('\n', 1)[0]}\n${code.replace('import([', 'import(/* @vite-ignore */[')}`;
}

const plain = fs.readFileSync(plainFile), simd = fs.readFileSync(simdFile);
const unpacked = Buffer.concat([plain, deltaOf(plain, simd)]);
const filledIn = { PACKED: compressed(unpacked).toString('base64'), UNPACKED_BYTES: unpacked.length, PLAIN_BYTES: plain.length, SIMD_BYTES: simd.length };
const source = Object.entries(filledIn).reduce(
  (text, [name, value]) => text.replace(new RegExp(`\\b${name} = (''|0)`), `${name} = ${JSON.stringify(value)}`), fs.readFileSync(sourceFile, 'utf8'));
const code = minified(source);
fs.writeFileSync(outFile, code);

const gzip = zlib.gzipSync(code, { level: 9 }).length;
console.log(`relief.mjs: ${Buffer.byteLength(code)} bytes, ${gzip} gzipped, ${zlib.brotliCompressSync(code).length} brotli; ` +
  `in it ${plain.length} bytes without vectors, ${simd.length} with`);
const sizes = { plain: plain.length, simd: simd.length, gzip };
for (const [name, budget] of Object.entries(BUDGET)) {
  if (sizes[name] > budget) fail(`${name}: ${sizes[name]} bytes; the budget is ${budget}`);
}
for (const bytes of [plain, simd]) {
  const imports = WebAssembly.Module.imports(new WebAssembly.Module(bytes));
  for (const { module, name } of imports) fail(`it imports ${module}.${name}; it must import nothing`);
}

function fail(text) {
  console.error(`relief.mjs: ${text}`);
  fs.rmSync(outFile, { force: true });
  process.exitCode = 1;
}
