// Relief beside simplify + Draco on any models (called by bench/models). E is the symmetric rms error in 1e-4 of the bounding box
// diagonal; what either takes at an error lies between the settings that no other beats in both. (Their convex hull would cut
// corners: where bytes grow ever slower, as those of Draco alone do, no setting comes near it.)
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';

import { valueAt } from './hull.mjs';
import { madeAt, madeText } from './made_at.mjs';
import { readPly, root, weld, writePly } from './meshes.mjs';
import { draco, measure, relief, RELIEF, run, simplifyDraco } from './peers.mjs';
import { frontier } from './plot.mjs';
import { table, whole } from './report.mjs';

const LEVELS = [4, 2, 1, 0.5];
const BEYOND = 1.1;  // encodes stay just below their target
const ERRORS = [6e-4, 4e-4, 2e-4, 1e-4, 0.5e-4];
// Models of any number of vertices: all ratios with all bits that errors of 4 to 0.5 may want.
const RATIOS = [0.0125, 0.025, 0.05, 0.1, 0.15, 0.25, 0.35, 0.5, 0.7].map(ratio => [ratio, [9, 10, 11, 12, 13]]);

// The geometry of a file.
function read(file, folder) {
  if (path.extname(file) === '.ply') return weld(readPly(file));
  const ply = path.join(folder, 'geometry.ply');
  run(RELIEF, 'decode', file, ply, '--quiet');
  return weld(readPly(ply));
}

async function measureModel(file) {
  const name = path.basename(file, path.extname(file)), made = madeAt();
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'relief-models-'));
  try {
    const mesh = read(file, folder);
    const model = { mesh, folder, quick: false, leftOut: [], ply: path.join(folder, 'model.ply'), errors: ERRORS, ratios: RATIOS };
    writePly(model.ply, mesh);
    const points = { ours: [], peers: [] };
    const record = list => ({ file: decoded, peer, settings, bytes }) => {
      const { rms, normals } = measure(model.ply, decoded);
      list.push({ peer, settings, bytes, e_rms: rms, normals });
      console.error(`${name}: ${peer} ${settings}: ${bytes} bytes, E ${rms.toFixed(3)}, normals ${normals.toFixed(2)} degrees`);
    };
    await relief(model, record(points.ours));
    await simplifyDraco(model, record(points.peers));
    await draco(model, record(points.peers));  // some models are best left as they are
    for (const line of model.leftOut) console.error(`${name}: left out: ${line}`);
    return { name, ...made, vertices: mesh.positions.length / 3, triangles: mesh.indices.length / 3, ...points };
  } finally {
    fs.rmSync(folder, { recursive: true });
  }
}

function rows({ name, vertices, ours, peers }) {
  const lines = [ours, peers].map(points => frontier(points.map(point => ({ ...point, rms: point.e_rms }))).reverse());
  return LEVELS.flatMap(level => {
    const [a, b] = lines.map(line => valueAt(line, level, { beyond: BEYOND }));
    const [m, n] = lines.map(line => valueAt(line, level, { key: 'normals', beyond: BEYOND }));
    const bytes = value => (value ? whole.format(Math.round(value)) : '–');
    const fixed = value => (value ? value.toFixed(2) : '–');
    return [[name, whole.format(vertices), level, bytes(a), bytes(b), fixed(a && b && b / a), fixed(m), fixed(n)]];
  });
}

function report(models) {
  const made = [...new Set(models.map(madeText))];
  return `# Relief beside simplify + Draco on other models

Made by \`bench/models\` ${made.join('; ')}. E is the symmetric rms surface error in 1e-4 of
the bounding box diagonal, measured by \`relief compare\` on the decoded file; bytes are those of the bare streams, between the
settings that no other beats (linear in the logarithms; – where none were measured on both sides). Draco has all settings of \`-cl 10 -qp 8\`
to \`14\`, after \`simplifyWithUpdate\` to ${RATIOS.map(([ratio]) => ratio).join(', ')} of the triangles or without. Normals: mean
deviation from those of the original, degrees. Textured models are welded first, for both, and their geometry alone is coded.

${table(['', 'vertices', 'E', 'Relief, bytes', 'simplify + Draco, bytes', 'ratio', 'Relief, normals', 'simplify + Draco, normals'],
    models.flatMap(rows))}`;
}

const file = path.join(root, 'build/models.json');
const earlier = () => (fs.existsSync(file) ? JSON.parse(fs.readFileSync(file, 'utf8')) : []);
let models = earlier();
for (const argument of process.argv.slice(2)) {
  const model = await measureModel(argument);
  models = earlier();  // another run may have added some
  const at = models.findIndex(({ name }) => name === model.name);
  models.splice(at < 0 ? models.length : at, 1, model);
  fs.writeFileSync(file, JSON.stringify(models, null, 1) + '\n');
}
fs.writeFileSync(path.join(root, 'bench/results/models.md'), report(models));
console.log(report(models));
