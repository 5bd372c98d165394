// Time and memory of encoding a large surface beside those of the model that it is made of (called by bench/huge).
import { execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

import { madeAt, madeText } from './made_at.mjs';
import { table, whole } from './report.mjs';

const root = fileURLToPath(new URL('..', import.meta.url));
const build = path.resolve(root, process.env.RELIEF_BUILD ?? 'build/release');
const POLL = 50;  // milliseconds
const TICK = +execFileSync('getconf', ['CLK_TCK'], { encoding: 'utf8' });

// What Linux tells of a process so far: the most memory that it held, in bytes, and the processor time of all its threads.
function usageOf(pid) {
  try {
    const status = fs.readFileSync(`/proc/${pid}/status`, 'utf8');
    const [, stat] = fs.readFileSync(`/proc/${pid}/stat`, 'utf8').split(') ');
    const [user, system] = stat.split(' ').slice(11);
    const peak = /VmHWM:\s+(\d+)/.exec(status);
    return peak && { memory: 1024 * +peak[1], processor: (+user + +system) / TICK };
  } catch {
    return null;  // it has just ended
  }
}

// Exit status 3, a target that could not be met, counts as well.
function encode(model, error, folder) {
  return new Promise((resolve, reject) => {
    const stream = path.join(folder, 'huge.relief');
    const begin = performance.now();
    const child = spawn(path.join(build, 'encoder/relief'), ['encode', model, stream, '--error', String(error * 1e-4), '--json', '--quiet']);
    let usage = { memory: 0, processor: 0 };
    const timer = setInterval(() => { usage = usageOf(child.pid) ?? usage; }, POLL);
    const text = { stdout: '', stderr: '' };
    for (const name of ['stdout', 'stderr']) child[name].on('data', data => { text[name] += data; });
    child.on('error', reject);
    child.on('close', status => {
      clearInterval(timer);
      if (status !== 0 && status !== 3) return reject(new Error(`relief encode ${model}: ${text.stderr.trim() || `status ${status}`}`));
      const { primitives: [report] } = JSON.parse(text.stdout);
      resolve({ ...usage, error, seconds: (performance.now() - begin) / 1000, bytes: fs.statSync(stream).size, report });
    });
  });
}

function text(runs, made) {
  const [small, large] = runs;
  const perVertex = ({ report, ...run }, key) => 1e6 * run[key] / report.vertices;
  const ratio = key => (perVertex(large, key) / perVertex(small, key)).toFixed(2);
  const stages = Object.keys(large.report.seconds);
  return `# A large surface

Made by \`bench/huge\` ${madeText(made)}. ${large.name}: every edge of ${small.name} cut into ${large.parts} parts, every vertex
displaced along its normal by noise whose wavelengths go down to a few of the new edges. Time includes reading and writing the files; processor
time is that of all threads.

${table(['', 'vertices', 'target E', 'E', 'bytes', 'bits a vertex', 'patches', 'seconds', 'processor, s', 'µs a vertex', 'processor, µs a vertex', 'peak memory, MB', 'bytes a vertex'],
    runs.map(run => [run.name, whole.format(run.report.vertices), run.error.toPrecision(3), run.report.e_rms.toFixed(4), whole.format(run.bytes),
      (8 * run.bytes / run.report.vertices).toFixed(3), run.report.patches, run.seconds.toFixed(1), run.processor.toFixed(1),
      perVertex(run, 'seconds').toFixed(1), perVertex(run, 'processor').toFixed(1), whole.format(Math.round(run.memory / 1e6)),
      whole.format(Math.round(run.memory / run.report.vertices))]))}
Time a vertex, large over small: ${ratio('seconds')}; processor time: ${ratio('processor')}.

Seconds by stage:

${table(['', ...stages], runs.map(({ name, report: { seconds } }) => [name, ...stages.map(stage => (seconds[stage] ?? 0).toFixed(1))]))}`;
}

async function main() {
  const { values, positionals: [model] } = parseArgs({
    allowPositionals: true,
    options: { parts: { type: 'string', default: '4' }, error: { type: 'string', default: '1' } },
  });
  const parts = +values.parts;
  if (!Number.isInteger(parts) || parts < 1 || parts > 16) throw new Error('--parts takes 1 to 16');
  const folder = path.join(root, 'build/huge');
  fs.mkdirSync(folder, { recursive: true });
  const name = path.basename(model, path.extname(model));
  const made = path.join(folder, `${name}-${parts}.ply`);
  if (!fs.existsSync(made)) execFileSync(path.join(build, 'bench/roughen'), [model, made, '--parts', String(parts)], { stdio: 'inherit' });
  const runs = [], begun = madeAt();
  for (const run of [{ name, file: model, error: 1 }, { name: `${name} × ${parts}²`, file: made, parts, error: +values.error }]) {
    runs.push({ ...run, ...await encode(run.file, run.error, folder) });
    const { report, seconds, memory } = runs.at(-1);
    console.error(`${run.name}: ${report.vertices} vertices, ${seconds.toFixed(1)} s, ${Math.round(memory / 1e6)} MB`);
  }
  const page = text(runs, begun);
  fs.writeFileSync(path.join(root, 'bench/results/huge.md'), page);
  console.log(page);
}

try {
  await main();
} catch (failure) {
  console.error(`huge: ${failure.message}`);
  process.exitCode = 1;
}
