// The viewer page in Debian's Chromium: opens a Relief GLB, draws it, and shows the figures that the native program gives.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

import { largeModels, modelGlb, root, run, sphereGlb } from '../fixtures.mjs';
import { CHROMIUM } from '../chromium.mjs';

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm' };
const pageFolder = path.join(root, 'build/viewer');
const [modelName, modelFile] = largeModels().filter(([, file]) => file).pop() ?? ['sphere', null];
const glb = modelFile ? modelGlb(modelName, modelFile) : sphereGlb();
let server, browser, address;

before(async () => {
  server = http.createServer((request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    const file = pathname === '/model.glb' ? glb : path.join(pageFolder, pathname === '/' ? 'index.html' : pathname);
    if (!fs.existsSync(file)) return response.writeHead(404).end();
    response.setHeader('content-type', TYPES[path.extname(file)] ?? 'application/octet-stream');
    fs.createReadStream(file).pipe(response);
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  address = `http://127.0.0.1:${server.address().port}`;
  browser = await chromium.launch(CHROMIUM);
});

after(async () => {
  await browser?.close();
  server?.close();
});

// Opens the page and returns it with the list of what went wrong on it.
async function open(query) {
  const page = await browser.newPage({ viewport: { width: 1200, height: 800 } });
  const errors = [];
  page.on('pageerror', error => errors.push(error.message));
  await page.goto(`${address}/${query}`);
  return { page, errors };
}

const settled = page => page.waitForFunction(() => ['ready', 'error'].includes(document.body.dataset.state), null, { timeout: 120_000 });
const value = (page, id) => page.$eval(`#${id}`, node => Number(node.dataset.value));

// The share of a PNG's pixels that differ from the one in its middle top row, counted by the browser.
async function drawnShare(page) {
  const png = (await page.locator('#canvas').screenshot()).toString('base64');
  return page.evaluate(async data => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const x0 = 0.3 * image.width, width = 0.4 * image.width, y0 = 0.2 * image.height, height = 0.6 * image.height;
    const { data: p } = context.getImageData(x0, y0, width, height);  // the middle: no header, no figures
    let drawn = 0;
    for (let i = 0; i < p.length; i += 4) drawn += Math.abs(p[i] - 0x17) + Math.abs(p[i + 1] - 0x18) + Math.abs(p[i + 2] - 0x1a) > 30;
    return drawn / (p.length / 4);
  }, png);
}

test(`draws ${modelName} and shows its figures`, async t => {
  const { page, errors } = await open('?src=model.glb');
  await settled(page);
  const share = await drawnShare(page);
  await page.screenshot({ path: path.join(root, 'build/viewer.png') });
  assert.deepEqual(errors, []);
  assert.equal(await page.$eval('body', body => body.dataset.state), 'ready', await page.textContent('#error'));
  assert.ok(share > 0.2 && share < 0.999, `${share} of the middle was drawn on`);

  const info = JSON.parse(run('relief', 'info', glb, '--json'));
  const sum = key => info.streams.reduce((total, stream) => total + stream[key], 0);
  assert.equal(await value(page, 'vertices'), sum('vertex_count'));
  assert.equal(await value(page, 'triangles'), sum('triangle_count'));
  assert.equal(await value(page, 'stream-bytes'), sum('bytes'));
  assert.equal(await value(page, 'file-bytes'), fs.statSync(glb).size);
  assert.ok(await value(page, 'decode-ms') > 0);
  t.diagnostic(`${(100 * share).toFixed(1)}% of the middle drawn, decoded in ${(await value(page, 'decode-ms')).toFixed(1)} ms`);

  for (const mode of ['wireframe', 'normals']) {
    await page.click(`button[data-mode=${mode}]`);
    assert.ok(await drawnShare(page) > 0.05, `nothing is drawn in mode ${mode}`);
  }
  await page.close();
});

test('opens a dropped file, and says what is wrong with a bad one before opening the next', async () => {
  const { page, errors } = await open('');
  const choose = async (name, buffer) => {
    await page.evaluate(() => { delete document.body.dataset.state; });
    await page.setInputFiles('#file', { name, mimeType: 'model/gltf-binary', buffer });
    await settled(page);
    return page.$eval('body', body => body.dataset.state);
  };
  const bytes = fs.readFileSync(sphereGlb());
  assert.equal(await choose('noise.glb', Buffer.from('this is no model')), 'error');
  assert.match(await page.textContent('#error'), /noise\.glb: neither glTF nor a Relief stream/);
  assert.equal(await choose('cut.glb', bytes.subarray(0, bytes.length / 2)), 'error');
  assert.match(await page.textContent('#error'), /cut\.glb: ./);
  assert.equal(await choose('sphere.glb', bytes), 'ready');
  assert.ok(await page.isHidden('#error'));
  assert.ok(await drawnShare(page) > 0.2);

  await page.evaluate(data => {  // a real drop event
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(atob(data), c => c.charCodeAt(0))], 'dropped.glb'));
    delete document.body.dataset.state;
    window.dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, cancelable: true }));
  }, bytes.toString('base64'));
  await settled(page);
  assert.equal(await page.textContent('#name'), 'dropped.glb');
  assert.deepEqual(errors, []);
  await page.close();
});

test('says so when the address leads nowhere', async () => {
  const { page } = await open('?src=nowhere.glb');
  await settled(page);
  assert.match(await page.textContent('#error'), /nowhere\.glb: HTTP status 404/);
  await page.close();
});
