// node demo-report.mjs MODEL COMPRESSED.glb FOLDER: prints the figures that tools/demo collected in FOLDER.
import fs from 'node:fs';
import path from 'node:path';

import { createReliefDecoder } from '../web/dist/relief.mjs';
import { streamsOf } from '../web/test/fixtures.mjs';

const [model, compressed, folder] = process.argv.slice(2);
const read = name => JSON.parse(fs.readFileSync(path.join(folder, `${name}.json`), 'utf8'));
const [encode, decode, compare] = ['encode', 'decode', 'compare'].map(read);
const [stream] = streamsOf(compressed);
const decoder = await createReliefDecoder();
decoder.decode(stream);  // the first decode also compiles the module
const begin = performance.now();
decoder.decode(stream);
const wasmMilliseconds = performance.now() - begin;

const whole = new Intl.NumberFormat('en');
const { a, b } = compare;
const modelBytes = fs.statSync(model).size, bytes = fs.statSync(compressed).size;
const bare = 12 * (a.vertices + a.triangles);  // 32-bit floats and indices
const lines = {
  original: `${whole.format(a.vertices)} vertices, ${whole.format(a.triangles)} triangles, ${whole.format(modelBytes)} bytes (${whole.format(bare)} as binary floats and indices)`,
  compressed: `${whole.format(bytes)} bytes of GLB, ${whole.format(stream.length)} of them the stream (${(8 * stream.length / a.vertices).toFixed(3)} bits a vertex), ${encode.primitives[0].patches} patches`,
  ratio: `1 / ${(modelBytes / bytes).toFixed(0)} of the file, 1 / ${(bare / bytes).toFixed(0)} of the binary size`,
  decoded: `${whole.format(b.vertices)} vertices, ${whole.format(b.triangles)} triangles, ${b.components} component(s), ${b.open_edges} open edges`,
  E_rms: `${compare.e_rms.toFixed(3)} (1e-4 of the bounding box diagonal, both ways; greatest ${compare.e_max.toFixed(1)})`,
  PSNR: `${compare.psnr.toFixed(2)} dB`,
  encoding: `${encode.seconds.toFixed(1)} s`,
  decoding: `${decode.seconds.toFixed(2)} s with reading and writing the files; ${wasmMilliseconds.toFixed(0)} ms in WebAssembly`,
};
for (const [name, text] of Object.entries(lines)) console.log(`${name.padEnd(11)} ${text}`);
