// node wasm_time.mjs STREAM [MODULE.wasm]... [--rounds N]: milliseconds of a whole decode in WebAssembly, positions,
// normals and indices, the least and the median of all rounds, the modules in turns. By default those in wasm/dist. It is
// processor time: other programs on the machine disturb it little.
import fs from 'node:fs';

import { createReliefDecoder } from '../web/dist/relief.mjs';

const args = process.argv.slice(2);
const at = args.indexOf('--rounds');
const rounds = at < 0 ? 50 : Number(args.splice(at, 2)[1]);
const [file, ...modules] = args;
if (modules.length === 0) for (const name of ['relief', 'relief-simd']) modules.push(new URL(`../wasm/dist/${name}.wasm`, import.meta.url));

const stream = fs.readFileSync(file);
const contestants = await Promise.all(modules.map(async name =>
  ({ name: String(name), decoder: await createReliefDecoder({ module: fs.readFileSync(name) }), times: [] })));
for (let round = 0; round < rounds; round++) {
  for (const { decoder, times } of contestants) {
    const begin = process.cpuUsage();
    decoder.decode(stream);
    const { user, system } = process.cpuUsage(begin);
    times.push((user + system) / 1000);
  }
}
for (const { name, times } of contestants) {
  times.sort((a, b) => a - b);
  console.log(`${name}: ${times[0].toFixed(2)} ms, median ${times[rounds >> 1].toFixed(2)} ms`);
}
