// The paper's tables, its figures beside ours (called by bench/paper). E is the symmetric rms error in 1e-4 of the bounding box
// diagonal (equation 2), by `relief compare`. Every measurement is kept with the commit that it was made at.
import { spawnSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';

import { madeAt } from './made_at.mjs';
import { readPly, writePly } from './meshes.mjs';
import { plot } from './plot.mjs';

const root = fileURLToPath(new URL('..', import.meta.url));
const build = path.resolve(root, process.env.RELIEF_BUILD ?? 'build/release');
const RELIEF = path.join(build, 'encoder/relief');
const DENSITIES = [0.6, 1, 1.4];  // 1/mu
const APERTURES = [20, 30, 45, 60, 70, 80, 85, 89];
const DECODES = 5;

const CURVE = [0.25, 0.5, 1, 1.51, 3];  // bits a point of figures 11 and 12, a vertex of 14

// What the paper says. Table 1: E fitted and, in brackets there, sampled. Table 2: patches and cost. Tables 3 and 4: bits per
// vertex (Igea: per point, as the paper has it as points only) or point, E, share of the masks, seconds of decoding. Table 5: seconds.
const PAPER = {
  venus: { table1: [[1.97, 2.35], [0.86, 1.12], [0.56, 0.7]] },
  rabbit: { table1: [[1.15, 1.37], [0.53, 0.63], [0.32, 0.37]] },
  sphere: { table1: [[1.8, 2.27], [0.72, 0.98], [0.53, 0.66]] },
  igea: {
    table2: { 'split-merge': [14, 0.42], gla: [7, 0.32] },
    rates: [[0.5, 2.35, 17, 0.3], [1.51, 0.76, 7.5, 0.3], [3.01, 0.44, 4.7, 0.5]],
  },
  dragon: {
    table2: { 'split-merge': [367, 0.56], gla: [150, 0.22] },
    rates: [[0.35, 3.86, 31.1, 8], [0.95, 0.91, 17.6, 12], [2.05, 0.46, 10.7, 15]],
    points: [[0.29, 13.3, 58.4, 0.8], [1.55, 1.03, 21.5, 1.2], [3.05, 0.62, 16.6, 1.7]],
    table5: { clustering: 12, sampling: 10.3, allocation: 132.9 },
  },
};
const RATES = [0.5, 1, 2];  // of other models

const rates = name => PAPER[name]?.rates ?? RATES.map(rate => [rate]);
const pointRates = name => PAPER[name]?.points ?? rates(name);

// Output of a program; exit status 3 of relief, a target that could not be met, counts as well.
function run(program, ...args) {
  const { status, stdout, stderr, error } = spawnSync(program, args, { encoding: 'utf8', maxBuffer: 1 << 28 });
  if (error) throw error;
  if (status !== 0 && status !== 3) throw new Error(`${path.basename(program)} ${args.join(' ')}: ${stderr.trim() || `status ${status}`}`);
  return stdout;
}
const json = (program, ...args) => JSON.parse(run(program, ...args, '--json'));

// One encode, and what became of it.
function encode(model, folder, ...options) {
  const stream = path.join(folder, 'paper.relief');
  const { seconds, primitives: [report] } = json(RELIEF, 'encode', model, stream, '--no-colors', '--quiet', ...options);
  const { streams: [info] } = json(RELIEF, 'info', stream);
  const { e_rms, psnr, b } = json(RELIEF, 'compare', model, stream);
  const times = Array.from({ length: DECODES }, () => parseFloat(run(path.join(build, 'bench/decode_time'), stream)));
  return {
    rate: 8 * info.bytes / report.vertices, e_rms, psnr, patches: report.patches, target_met: report.target_met,
    vertices: info.vertex_count, side_bits: 8 * (info.bytes_header + info.bytes_side), masks: info.bytes_masks / info.bytes,
    seams: info.bytes_seams / info.bytes, genus: b.genus, open_edges: b.open_edges, decode_ms: Math.min(...times), seconds, stages: report.seconds,
  };
}

// The same of a cloud. Its error is the symmetric one, to the surface of the points that the encoder works on; and that of the points
// from what comes back, one way.
function encodePoints(cloud, folder, ...options) {
  const stream = path.join(folder, 'paper.relief');
  const { seconds, primitives: [report] } = json(RELIEF, 'encode', cloud, stream, '--no-colors', '--quiet', ...options);
  const { streams: [info] } = json(RELIEF, 'info', stream);
  const times = Array.from({ length: DECODES }, () => parseFloat(run(path.join(build, 'bench/decode_time'), stream)));
  return {
    rate: 8 * info.bytes / report.vertices, e_rms: report.e_rms, one_way: json(RELIEF, 'compare', cloud, stream).e_rms, patches: report.patches,
    target_met: report.target_met, vertices: info.vertex_count, side_bits: 8 * (info.bytes_header + info.bytes_side),
    masks: info.bytes_masks / info.bytes, decode_ms: Math.min(...times), seconds, stages: report.seconds,
  };
}

// A model's vertices alone.
function cloudOf(model, folder) {
  const cloud = path.join(folder, 'points.ply');
  writePly(cloud, { positions: readPly(model).positions, indices: new Uint32Array() });
  return cloud;
}

// Approximation with and without fitting: the finest step, so that sampling alone errs. And pixels per vertex that it took.
function table1(model) {
  return DENSITIES.map(density => {
    const ledger = (...options) => json(path.join(build, 'bench/ledger'), model, '--error', '5e-3', '--density', String(1 / density), ...options);
    const { error_unquantised, patches, vertices } = ledger();
    const pixels = patches.reduce((sum, patch) => sum + patch.pixels, 0);
    return { density, fitted: error_unquantised.e_rms, sampled: ledger('--no-fit').error_unquantised.e_rms, pixels: pixels / vertices };
  });
}

const table2 = model => JSON.parse(run(path.join(build, 'bench/clusterings'), model));

function table3(model, folder, name) {
  const cloud = cloudOf(model, folder);
  return pointRates(name).map(([rate]) => encodePoints(cloud, folder, '--bpv', String(rate)));
}

const table4 = (model, folder, name) => rates(name).map(([rate]) => encode(model, folder, '--bpv', String(rate)));

// More patches by narrower apertures, all at 1 bit a vertex.
const figure13 = (model, folder) => APERTURES.map(aperture =>
  ({ aperture, ...encode(model, folder, '--bpv', '1', '--aperture', String(aperture)) }));

// Error over rate, of meshes, by coder.
const figure14 = (model, folder) => Object.entries(CODERS).flatMap(([way, options]) =>
  CURVE.map(rate => ({ way, ...encode(model, folder, '--bpv', String(rate), ...options) })));

// Error over rate, of points, with each of these sets of options.
const curves = ways => (model, folder) => {
  const cloud = cloudOf(model, folder);
  return Object.entries(ways).flatMap(([way, options]) =>
    CURVE.map(rate => ({ way, ...encodePoints(cloud, folder, '--bpv', String(rate), ...options) })));
};
const PARTITIONS = { GLA: ['--partition', 'gla'], 'split-merge': ['--partition', 'split-merge'] };
const CODERS = { subband: [], bisk: ['--coder', 'bisk'] };
const ALLOCATIONS = { 'rate-distortion': ['--coder', 'bisk'], even: ['--coder', 'bisk', '--allocation', 'even'] };

const MEASURES = { 1: table1, 2: table2, 3: table3, 4: table4, 11: curves(PARTITIONS), 12: curves(ALLOCATIONS), 13: figure13, 14: figure14 };

// An icosahedron's triangles split six times: 40,962 vertices.
function writeSphere(file) {
  const g = (1 + Math.sqrt(5)) / 2;
  const unit = p => p.map(x => x / Math.hypot(...p));
  const vertices = [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g], [0, 1, -g],
    [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]].map(unit);
  let faces = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8],
    [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]];
  for (let level = 0; level < 6; level++) {
    const middles = new Map();
    const middle = (a, b) => {
      const key = a < b ? `${a} ${b}` : `${b} ${a}`;
      if (!middles.has(key)) middles.set(key, vertices.push(unit(vertices[a].map((x, k) => x + vertices[b][k]))) - 1);
      return middles.get(key);
    };
    faces = faces.flatMap(([a, b, c]) => {
      const [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
      return [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    });
  }
  fs.writeFileSync(file, [...vertices.map(v => `v ${v.join(' ')}`), ...faces.map(f => `f ${f.map(i => i + 1).join(' ')}`), ''].join('\n'));
}

// --- The tables as Markdown

const table = (head, rows) => [head, head.map((_, i) => (i ? '---:' : ':---')), ...rows].map(row => `| ${row.join(' | ')} |\n`).join('');
const fixed = (value, digits = 2) => (value === undefined ? '–' : value.toFixed(digits));
const whole = value => new Intl.NumberFormat('en').format(value);
const beside = (ours, paper) => [ours, paper ?? '–'];
const rowsOf = (results, number, row) => Object.entries(results).flatMap(([name, tables]) => (tables[number] ? row(name, tables[number].values) : []));

const figure = (name, number) => `${name}-figure-${number}.svg`;

const curveTables = (results, number, of) => rowsOf(results, number, (name, values) => {
  const ways = [...new Set(values.map(v => v.way))];
  const columns = ways.map(way => values.filter(v => v.way === way));
  return [`![${figure(name, number)}](paper/${figure(name, number)})\n\n${table([`${name}, bits a ${of}`, ...ways.flatMap(way => [`E_rms, ${way}`, 'patches'])],
    CURVE.map((rate, i) => [rate, ...columns.flatMap(column => [fixed(column[i].e_rms, 3), column[i].patches])]))}`];
}).join('\n');

// The plots of a model's figures: lines run in the order of measuring.
const AXIS = { text: String, colors: { GLA: '#c2410c', 'split-merge': '#0f766e', 'rate-distortion': '#c2410c', even: '#0f766e', subband: '#c2410c', bisk: '#0f766e' }, line: own => own };
const PLOTS = {
  11: values => [values.map(v => ({ peer: v.way, settings: `${v.patches} patches`, rate: v.rate, rms: v.e_rms })), { ...AXIS, key: 'rate', label: 'bits a point' }],
  12: values => [values.map(v => ({ peer: v.way, settings: '', rate: v.rate, rms: v.e_rms })), { ...AXIS, key: 'rate', label: 'bits a point' }],
  13: values => [values.map(v => ({ peer: 'GLA', settings: `${v.aperture}°`, patches: v.patches, rms: v.e_rms })),
    { ...AXIS, key: 'patches', label: 'patches' }],
  14: values => [values.map(v => ({ peer: v.way, settings: `${v.patches} patches`, rate: v.rate, rms: v.e_rms })), { ...AXIS, key: 'rate', label: 'bits a vertex' }],
};
function writePlots(results, folder) {
  fs.mkdirSync(folder, { recursive: true });
  for (const [name, tables] of Object.entries(results)) {
    for (const [number, of] of Object.entries(PLOTS)) {
      if (tables[number]) fs.writeFileSync(path.join(folder, figure(name, number)), plot(`${name}: ${TITLES[number]}`, ...of(tables[number].values)));
    }
  }
}

const SHOW = {
  1: results => table(['', ...DENSITIES.map(d => `1/μ = ${d}`)], [
    ...rowsOf(results, 1, (name, values) => [[`${name}, ours`, ...values.map(v => `${fixed(v.fitted, 3)} (${fixed(v.sampled, 3)})`)],
      ['pixels a vertex', ...values.map(v => fixed(v.pixels))], ['pixels a vertex if as asked', ...values.map(v => fixed(v.density ** 2))]]),
    ...Object.entries(PAPER).flatMap(([name, { table1: e }]) =>
      (e ? [[`${name}, paper`, ...e.map(([fitted, sampled]) => `${fixed(fitted)} (${fixed(sampled)})`)]] : [])),
  ]),
  2: results => table(['', 'split-merge: patches', 'paper', 'cost', 'paper', 'GLA: patches', 'paper', 'cost', 'paper'],
    rowsOf(results, 2, (name, values) => [[name, ...['split-merge', 'gla'].flatMap(way => {
      const paper = PAPER[name]?.table2?.[way];
      return [...beside(values[way].patches, paper?.[0]), ...beside(fixed(values[way].cost, 3), paper?.[1])];
    })]])),
  3: results => table(
    ['', 'bits a point', 'vertices', 'patches', 'r0, bits', 'masks, %', 'paper', 'E_rms', 'paper', 'of the points, one way', 'PSNR, dB', 'decoding, ms', 'paper, s'],
    rowsOf(results, 3, (name, values) => values.map((v, i) => {
      const [, e, masks, seconds] = pointRates(name)[i];
      return [name, fixed(v.rate, 3), whole(v.vertices), v.patches, whole(v.side_bits), ...beside(fixed(100 * v.masks, 1), masks),
        ...beside(fixed(v.e_rms, 3), e), fixed(v.one_way, 3), fixed(-20 * Math.log10(1e-4 * v.e_rms), 1), ...beside(fixed(v.decode_ms, 1), seconds)];
    }))),
  4: results => table(
    ['', 'bits a vertex', 'vertices', 'patches', 'r0, bits', 'masks, %', 'paper', 'seams, %', 'E_rms', 'paper', 'PSNR, dB', 'decoding, ms', 'paper, s'],
    rowsOf(results, 4, (name, values) => values.map((v, i) => {
      const [, e, masks, seconds] = rates(name)[i];
      return [name, fixed(v.rate, 3), whole(v.vertices), v.patches, whole(v.side_bits), ...beside(fixed(100 * v.masks, 1), masks), fixed(100 * v.seams, 1),
        ...beside(fixed(v.e_rms, 3), e), fixed(v.psnr, 1), ...beside(fixed(v.decode_ms, 1), seconds)];
    }))),
  5: results => table(['seconds', 'clustering', 'sampling', 'allocation and coding', 'of that measuring'], [
    ...rowsOf(results, 4, (name, [, { stages: s }]) => {
      const rest = Object.entries(s).filter(([stage]) => !['surface', 'partition', 'resample'].includes(stage)).reduce((sum, [, t]) => sum + t, 0);
      return [[`${name}, ours`, fixed(s.partition, 1), fixed(s.resample, 1), fixed(rest, 1), fixed(s.measure, 1)]];
    }),
    ...Object.entries(PAPER).flatMap(([name, { table5: s }]) => (s ? [[`${name}, paper`, s.clustering, s.sampling, s.allocation, '–']] : [])),
  ]),
  11: results => curveTables(results, 11, 'point'),
  12: results => curveTables(results, 12, 'point'),
  13: results => rowsOf(results, 13, (name, values) => [
    `![${figure(name, 13)}](paper/${figure(name, 13)})\n\n` +
    `${name} at 1 bit a vertex\n\n${table(['aperture', ...values.map(v => `${v.aperture}°`)], [
      ['patches', ...values.map(v => v.patches)], ['E_rms', ...values.map(v => fixed(v.e_rms, 3))],
      ['masks, %', ...values.map(v => fixed(100 * v.masks, 1))]])}`]).join('\n'),
  14: results => curveTables(results, 14, 'vertex'),
};
const TITLES = {
  1: 'Table 1: error of approximation, fitted (sampled)', 2: 'Table 2: patches and cost', 3: 'Table 3: points', 4: 'Table 4: meshes',
  5: 'Table 5: seconds by stage, at the middle rate', 11: 'Figure 11: points, by partition', 12: 'Figure 12: points, by allocation of bits (bisk)', 13: 'Figure 13: patches against error',
  14: 'Figures 14 and 15: meshes, error over rate',
};

function page(results) {
  const from = number => (number === '5' ? 4 : number);  // the stages at the middle rate
  return Object.keys(SHOW).filter(number => Object.values(results).some(tables => tables[from(number)])).map(number => {
    const made = Object.values(results).map(tables => tables[from(number)]).filter(Boolean).map(({ commit, date }) => `${commit} on ${date}`);
    return `### ${TITLES[number]}\n\nCommit ${[...new Set(made)].join('; ')}.\n\n${SHOW[number](results)}`;
  }).join('\n');
}

function writePage(tables) {
  const file = path.join(root, 'docs/paper.md');
  const [before, rest] = fs.readFileSync(file, 'utf8').split('<!-- tables: written by bench/paper --page -->\n');
  const [, after] = rest.split('<!-- end of tables -->');
  fs.writeFileSync(file, `${before}<!-- tables: written by bench/paper --page -->\n\n${tables}\n<!-- end of tables -->${after}`);
}

// --- Main

function main() {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: { tables: { type: 'string', default: Object.keys(MEASURES).join() }, output: { type: 'string', default: path.join(root, 'build/paper') }, page: { type: 'boolean' } },
  });
  const numbers = values.tables.split(',').filter(Boolean);  // none: only shows what was measured
  if (!numbers.every(number => MEASURES[number])) throw new Error(`--tables takes some of ${Object.keys(MEASURES)}`);
  const file = path.join(values.output, 'paper.json');
  const results = fs.existsSync(file) ? JSON.parse(fs.readFileSync(file, 'utf8')) : {};  // of earlier runs, of other tables or models
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'relief-paper-'));
  const measure = (name, model, number) => {
    console.error(`${name}: ${TITLES[number]}`);
    (results[name] ??= {})[number] = { ...madeAt(), values: MEASURES[number](model, folder, name) };
    fs.mkdirSync(values.output, { recursive: true });
    fs.writeFileSync(file, JSON.stringify(results, null, 1) + '\n');
    fs.writeFileSync(path.join(values.output, 'paper.md'), page(results));
  };
  try {
    if (numbers.includes('1')) {
      const sphere = path.join(folder, 'sphere.obj');
      writeSphere(sphere);
      measure('sphere', sphere, 1);
    }
    for (const model of positionals)
      for (const number of numbers) measure(path.basename(model, path.extname(model)).toLowerCase(), model, number);
    console.log(page(results));
    if (values.page) {
      writePage(page(results));
      writePlots(results, path.join(root, 'docs/paper'));
    }
  } finally {
    fs.rmSync(folder, { recursive: true });
  }
}

try {
  main();
} catch (failure) {
  console.error(`paper: ${failure.message}`);
  process.exitCode = 1;
}
