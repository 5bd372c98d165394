// node bench.mjs [--quick] [--relief] MODEL.ply...: measures everything and writes bench/results (called by bench/run).
// --relief: measures Relief and the times of decoding; the bytes and errors of the others, whose programs do not change, are
// those of the results that are there.
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';

import { decodeTimes } from './decode_times.mjs';
import { madeAt } from './made_at.mjs';
import { readPly, root, writePly } from './meshes.mjs';
import { draco, gltfpack, measure, relief, simplifyDraco } from './peers.mjs';
import { plot } from './plot.mjs';
import { figures, report } from './report.mjs';

const quick = process.argv.includes('--quick');
const peers = process.argv.includes('--relief') ? [relief] : [relief, draco, simplifyDraco, gltfpack];
const files = process.argv.slice(2).filter(argument => !argument.startsWith('--'));

// What the results that are there say of the peers that are not measured.
function others(name) {
  if (peers.length > 1) return { points: [], leftOut: [] };
  const { points, leftOut } = JSON.parse(fs.readFileSync(path.join(root, 'bench/results/results.json'), 'utf8')).models.find(model => model.name === name);
  return { points: points.filter(({ peer }) => peer !== 'Relief'), leftOut: leftOut.filter(line => !line.startsWith('Relief')) };
}

async function measureModel(file) {
  const name = path.basename(file, path.extname(file));
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'relief-bench-'));
  try {
    const mesh = readPly(file);
    const model = { mesh, folder, quick, leftOut: [], ply: path.join(folder, 'model.ply') };
    writePly(model.ply, mesh);
    const points = [];
    const record = ({ file: decoded, ...point }) => {
      points.push({ ...point, ...measure(model.ply, decoded) });
      const { peer, settings, bytes, rms } = points.at(-1);
      console.log(`${name}: ${peer} ${settings}: ${bytes} bytes, E ${rms.toFixed(3)}`);
    };
    for (const peer of peers) await peer(model, record);
    const kept = others(name);
    points.push(...kept.points);
    model.leftOut.push(...kept.leftOut);
    const decoding = await decodeTimes(model);
    for (const [who, time] of Object.entries(decoding.times)) console.log(`${name}: ${who}: ${time.median.toFixed(1)} ms`);
    for (const line of model.leftOut) console.log(`${name}: left out: ${line}`);
    return { name, leftOut: model.leftOut, vertices: mesh.positions.length / 3, triangles: mesh.indices.length / 3, points, decoding };
  } finally {
    fs.rmSync(folder, { recursive: true });
  }
}

const made = madeAt();
const models = [];
for (const file of files) models.push(await measureModel(file));
const results = { ...made, models };
const output = path.join(root, quick ? 'build/bench-quick' : 'bench/results');
fs.mkdirSync(output, { recursive: true });
fs.writeFileSync(path.join(output, 'results.json'), JSON.stringify(results, null, 1) + '\n');
fs.writeFileSync(path.join(output, 'results.md'), report(results));
for (const { name, points } of models) fs.writeFileSync(path.join(output, `${name}.svg`), plot(name, points));
if (!quick) {
  const readme = path.join(root, 'README.md');
  const [begin, end] = ['<!-- figures: written by bench/run -->\n', '<!-- end of figures -->'];
  const text = fs.readFileSync(readme, 'utf8');
  const [before, after] = [text.indexOf(begin) + begin.length, text.indexOf(end)];
  if (after >= before) fs.writeFileSync(readme, text.slice(0, before) + figures(results) + text.slice(after));
}
console.log(`written: ${path.relative(process.cwd(), output)}`);
