// PSNR of pictures: Relief beside simplify + Draco (called by bench/rendered).
import fs from 'node:fs';
import http from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

import { CHROMIUM } from '../web/test/chromium.mjs';
import { madeAt, madeText } from './made_at.mjs';
import { readPly, root, writePly } from './meshes.mjs';
import { dracoRoundTrip, encode, measure, simplify } from './peers.mjs';
import { table, whole } from './report.mjs';

const web = path.join(root, 'web');
const { chromium } = createRequire(path.join(web, 'package.json'))('playwright-core');
const ERROR = 0.5e-4;
const BITS = [10, 11, 12, 13, 14];  // of Draco
const MODES = ['shaded', 'normals'];
const output = path.join(root, 'build/rendered');

// --- The page that draws

const FOLDERS = { '/three/': path.join(web, 'node_modules/three'), '/web/': web, '/models/': output };
const TYPES = { '.js': 'text/javascript', '.mjs': 'text/javascript', '.html': 'text/html' };

async function serve() {
  const server = http.createServer((request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    const folder = Object.keys(FOLDERS).find(prefix => pathname.startsWith(prefix));
    const file = folder ? path.join(FOLDERS[folder], pathname.slice(folder.length)) : fileURLToPath(new URL('rendered.html', import.meta.url));
    if (!fs.existsSync(file)) return response.writeHead(404).end();
    response.setHeader('content-type', TYPES[path.extname(file)] ?? 'application/octet-stream');
    fs.createReadStream(file).pipe(response);
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  return server;
}

// PSNR by mode of the pictures of a file in build/rendered; its pictures lie beside it.
async function draw(page, file, { anew = false } = {}) {
  await page.evaluate(([url, normals]) => window.load(url, normals), [`/models/${file}`, anew]);
  const psnr = {};
  for (const mode of MODES) {
    const pictures = await page.evaluate(name => window.draw(name), mode);
    const sum = key => pictures.reduce((total, picture) => total + picture[key], 0);
    psnr[mode] = 10 * Math.log10(255 ** 2 / (sum('squares') / sum('count')));
    for (const [view, { picture }] of pictures.entries()) {
      const png = `${file.replace(/\.\w+$/, '')}${anew ? '-anew' : ''}-${mode}-${view}.png`;
      fs.writeFileSync(path.join(output, png), Buffer.from(picture.split(',')[1], 'base64'));
    }
  }
  return psnr;
}

// --- Models at a number of bytes

// The mesh simplified so far that Draco with these bits takes at most `bytes`, but hardly less.
async function dracoOf(mesh, bytes, bits, folder) {
  const ply = path.join(folder, 'simplified.ply');
  let low = 0, high = 1, best = null;
  for (let i = 0, ratio = bytes / (mesh.positions.length / 3) / 2; i < 8; i++) {
    ratio = Math.min(ratio, 1);
    writePly(ply, ratio < 1 ? await simplify(mesh, ratio) : mesh);
    const made = { ratio, bits, ...dracoRoundTrip(ply, bits, folder) };
    if (made.bytes <= bytes && made.bytes > (best?.bytes ?? 0)) {
      best = { ...made, file: path.join(folder, `best-${bits}.ply`) };
      fs.renameSync(made.file, best.file);
    }
    if (made.bytes <= bytes) low = ratio;
    else high = ratio;
    if (best?.bytes > 0.99 * bytes || low === 1) break;
    const guess = ratio * 0.997 * bytes / made.bytes;
    ratio = guess > low && guess < high ? guess : (low + high) / 2;
  }
  return best;
}

async function peersAt(name, factor, bytes, mesh, page) {
  const rows = [];
  for (const bits of BITS) {
    const made = await dracoOf(mesh, factor * bytes, bits, output);
    if (!made) continue;
    const file = `${name}-draco-x${factor}-${bits}.ply`;
    fs.renameSync(made.file, path.join(output, file));
    rows.push(await row(name, `simplify ${made.ratio.toFixed(4)} + Draco -qp ${bits}`, made.bytes, file, page));
  }
  return rows;
}

async function row(name, what, bytes, file, page, options) {
  const { rms, normals } = measure(path.join(output, `${name}.ply`), path.join(output, file));
  const psnr = await draw(page, file, options);
  console.error(`${name}: ${what}: ${bytes} bytes, E ${rms.toFixed(3)}, ${MODES.map(mode => `${mode} ${psnr[mode].toFixed(2)} dB`).join(', ')}`);
  return { what, bytes, rms, normals, psnr };
}

async function measureModel(model, browser, address) {
  const name = path.basename(model, path.extname(model)), made = madeAt();
  const page = await browser.newPage();
  page.on('pageerror', error => { throw error; });
  await page.goto(address);
  await page.waitForFunction('window.ready');
  const mesh = readPly(model);
  const ply = path.join(output, `${name}.ply`);
  writePly(ply, mesh);
  await draw(page, `${name}.ply`);
  const stream = `${name}-relief.relief`;
  if (!encode(ply, path.join(output, stream), ERROR)) throw new Error(`${model}: no stream`);
  const bytes = fs.statSync(path.join(output, stream)).size;
  const rows = [await row(name, 'Relief', bytes, stream, page),
    await row(name, 'Relief, normals of its triangles', bytes, stream, page, { anew: true })];
  for (const factor of [1, 4]) rows.push(...await peersAt(name, factor, bytes, mesh, page));
  await page.close();
  return { name, ...made, bytes, rows };
}

// --- Report

function report(models) {
  return `# Pictures beside those of simplify + Draco

Made by \`bench/rendered\`; PSNR in dB of pictures of 640 × 640 from four cameras against those of the original, over the pixels that
show either; shaded, and coloured by normals. Relief has the decoder's normals, everything else those of its triangles, weighted
by area. simplify + Draco: for every number of position bits the ratio at which it takes the bytes of Relief, or four times as many.
E and the mean deviation of normals (degrees) by \`relief compare\`.

${models.map(({ name, rows, ...made }) => `## ${name}, ${madeText(made)}

${table(['', 'bytes', 'E', 'normals', ...MODES.map(mode => `${mode}, dB`)], rows.map(({ what, bytes, rms, normals, psnr }) =>
    [what, whole.format(bytes), rms.toFixed(3), normals.toFixed(2), ...MODES.map(mode => psnr[mode].toFixed(2))]))}`).join('\n')}`;
}

fs.mkdirSync(output, { recursive: true });
const server = await serve();
const browser = await chromium.launch(CHROMIUM);
try {
  const file = path.join(output, 'rendered.json');
  const models = fs.existsSync(file) ? JSON.parse(fs.readFileSync(file, 'utf8')) : [];  // of earlier runs
  for (const argument of process.argv.slice(2)) {
    const model = await measureModel(argument, browser, `http://127.0.0.1:${server.address().port}/`);
    const at = models.findIndex(({ name }) => name === model.name);
    models.splice(at < 0 ? models.length : at, 1, model);
    fs.writeFileSync(file, JSON.stringify(models, null, 1) + '\n');
  }
  fs.writeFileSync(path.join(root, 'bench/results/rendered.md'), report(models));
  console.log(report(models));
} finally {
  await browser.close();
  server.close();
}
