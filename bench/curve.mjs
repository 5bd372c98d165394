// The rate-distortion curve of Relief alone (called by bench/curve). Encodes every model at many targets and reads off what a
// stream of a given error costs. A single encode lands a little beside its target and the encoder's choices make steps of a
// percent or so; the hull over many encodes is steadier. E is in 1e-4 of the bounding box diagonal.
import { execFileSync, spawnSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

import { hull, valueAt } from './hull.mjs';
import { madeAt } from './made_at.mjs';

const root = fileURLToPath(new URL('..', import.meta.url));
const RELIEF = path.resolve(root, process.env.RELIEF_BUILD ?? 'build/release', 'encoder/relief');
const TARGETS = '4,2.8,2,1.4,1,0.7,0.5,0.35,0.25';
const LEVELS = [4, 2, 1, 0.5, 0.25];
const BEYOND = 1.1;  // encodes stay just below their target: the curve is drawn on by so much

// One encode. Exit status 3, a target that could not be met, leaves a stream and its error all the same.
function encode(model, target, folder) {
  const stream = path.join(folder, 'curve.relief');
  const { status, stdout, stderr, error } = spawnSync(RELIEF, ['encode', model, stream, '--error', String(target * 1e-4), '--no-colors', '--json', '--quiet'],
    { encoding: 'utf8', maxBuffer: 1 << 28 });
  if (error) throw error;
  if (status !== 0 && status !== 3) throw new Error(`${model} at E = ${target}: ${stderr.trim() || `exit status ${status}`}`);
  const { seconds, target_met, primitives: [{ e_rms }] } = JSON.parse(stdout);
  return { target, bytes: fs.statSync(stream).size, e_rms, target_met, seconds };
}

function measure(model, targets, folder) {
  const name = path.basename(model, path.extname(model));
  const points = [];
  for (const target of targets) {
    points.push(encode(model, target, folder));
    const { bytes, e_rms, target_met, seconds } = points.at(-1);
    console.error(`${name}: E ${e_rms.toFixed(4)} for ${target}${target_met ? '' : ' (not met)'}: ${bytes} bytes, ${seconds.toFixed(1)} s`);
  }
  const line = hull(points);
  return { name, points, levels: LEVELS.map(level => ({ e: level, bytes: valueAt(line, level, { beyond: BEYOND }) })) };
}

// Percent of bytes at each level, then the mean over the levels that both runs have.
function changes({ levels }, before) {
  const percents = levels.map(({ e, bytes }) => {
    const old = before.levels.find(level => level.e === e)?.bytes;
    return bytes && old ? 100 * (bytes / old - 1) : null;
  });
  return [...percents, mean(percents)];
}

function mean(values) {
  const known = values.filter(value => value !== null);
  return known.length ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
}

function print(head, rows) {
  const width = Math.max(...rows.map(([name]) => name.length), head[0].length);
  for (const [name, ...cells] of [head, ...rows]) console.log(name.padEnd(width) + cells.map(cell => String(cell).padStart(11)).join(''));
}

function printChanges(models, before) {
  const percent = value => value === null ? '–' : `${value > 0 ? '+' : ''}${value.toFixed(2)}%`;
  const rows = models.flatMap(model => {
    const old = before.models.find(({ name }) => name === model.name);
    return old ? [[model.name, ...changes(model, old)]] : [];
  });
  if (!rows.length) return console.log('\nnone of the models was measured before');
  const means = rows[0].slice(1).map((_, i) => mean(rows.map(row => row[i + 1])));
  console.log(`\nchange since ${before.commit}`);
  print(['E =', ...LEVELS, 'mean'], [...rows, ['mean', ...means]].map(([name, ...values]) => [name, ...values.map(percent)]));
}

function main() {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: {
      before: { type: 'string' },
      targets: { type: 'string', default: TARGETS },
      output: { type: 'string', default: path.join(root, 'build/curve.json') },
    },
  });
  const targets = values.targets.split(',').map(Number);
  if (!targets.every(target => target > 0)) throw new Error('--targets takes errors in 1e-4 of the diagonal, as 4,2,1');
  if (!fs.existsSync(RELIEF)) throw new Error(`${RELIEF} is missing: cmake --build build/release --target relief`);
  const before = values.before && JSON.parse(fs.readFileSync(values.before, 'utf8'));  // now: it may be the output as well
  if (!positionals.length) {
    execFileSync(path.join(root, 'tools/dragon'), { stdio: 'inherit' });
    positionals.push(path.join(root, 'build/models/dragon.ply'));
  }
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'relief-curve-'));
  try {
    const models = positionals.map(model => measure(model, targets, folder));
    fs.mkdirSync(path.dirname(values.output), { recursive: true });
    fs.writeFileSync(values.output, JSON.stringify({ ...madeAt(), models }, null, 1) + '\n');
    console.log('bytes at an error');
    print(['E =', ...LEVELS], models.map(({ name, levels }) => [name, ...levels.map(({ bytes }) => bytes ? Math.round(bytes) : '–')]));
    if (before) printChanges(models, before);
  } finally {
    fs.rmSync(folder, { recursive: true });
  }
}

try {
  main();
} catch (failure) {
  console.error(`curve: ${failure.message}`);
  process.exitCode = 1;
}
