// node render-demo.mjs ORIGINAL.ply PATCHES.glb COMPRESSED.glb OUT.png [seam]
// Draws the three side by side with three.js in headless Chromium, whole or, with `seam`, a part of the Dragon where
// patches meet. The compressed file goes through the three.js plugin
// and the WebAssembly decoder, as on any web page.
import fs from 'node:fs';
import http from 'node:http';
import { createRequire } from 'node:module';
import path from 'node:path';
import { fileURLToPath } from 'node:url';

import { CHROMIUM } from '../web/test/chromium.mjs';

const web = fileURLToPath(new URL('../web', import.meta.url));
const { chromium } = createRequire(path.join(web, 'package.json'))('playwright-core');
const [original, patches, compressed, picture, view = 'whole'] = process.argv.slice(2);
if (!picture) throw new Error('usage: node render-demo.mjs ORIGINAL.ply PATCHES.glb COMPRESSED.glb OUT.png [seam]');

const models = { '/original.ply': original, '/patches.glb': patches, '/compressed.glb': compressed };
const folders = { '/three/': path.join(web, 'node_modules/three'), '/web/': web };
const TYPES = { '.js': 'text/javascript', '.mjs': 'text/javascript', '.html': 'text/html' };
const megabytes = file => `${(fs.statSync(file).size / 1e6).toFixed(2)} MB`;
const captions = [`Original, ${megabytes(original)}`, 'Patches', `Reconstruction from ${fs.statSync(compressed).size.toLocaleString('en')} bytes`];

const server = http.createServer((request, response) => {
  const { pathname } = new URL(request.url, 'http://localhost');
  const folder = Object.keys(folders).find(prefix => pathname.startsWith(prefix));
  const file = models[pathname] ?? (folder ? path.join(folders[folder], pathname.slice(folder.length))
    : pathname === '/' ? fileURLToPath(new URL('render-demo.html', import.meta.url)) : null);
  if (!file || !fs.existsSync(file)) return response.writeHead(404).end();
  response.setHeader('content-type', TYPES[path.extname(file)] ?? 'application/octet-stream');
  fs.createReadStream(file).pipe(response);
});
await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));

const browser = await chromium.launch(CHROMIUM);
try {
  const page = await browser.newPage({ viewport: { width: 2460, height: 720 } });
  const failed = new Promise((_, reject) => page.on('pageerror', reject));
  failed.catch(() => {});
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await Promise.race([page.evaluate(([texts, name]) => window.draw(texts, name), [captions, view]), failed]);
  await page.locator('main').screenshot({ path: picture });
} finally {
  await browser.close();
  server.close();
}
