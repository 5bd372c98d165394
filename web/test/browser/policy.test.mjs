// The decoder on a page with a strict Content-Security-Policy, in Debian's Chromium: in the page's thread and in workers.
import assert from 'node:assert/strict';
import fs from 'node:fs';
import http from 'node:http';
import { after, before, test } from 'node:test';
import { createReliefDecoder } from 'relief-gltf';
import { chromium } from 'playwright-core';

import { sphereGlb, streamsOf } from '../fixtures.mjs';
import { CHROMIUM } from '../chromium.mjs';

const stream = streamsOf(sphereGlb())[0];
const page = '<!doctype html><title>policy</title><script type="module" src="main.mjs"></script>';
const main = `import * as relief from './relief.mjs'; window.relief = relief;
  document.addEventListener('securitypolicyviolation', event => { (window.violations ??= []).push(event.violatedDirective); });
  window.stream = new Uint8Array(await (await fetch('s.relief')).arrayBuffer());`;
let server, browser, address;

before(async () => {
  const files = {
    '/main.mjs': ['text/javascript', main],
    '/relief.mjs': ['text/javascript', fs.readFileSync(new URL('../../dist/relief.mjs', import.meta.url))],
    '/s.relief': ['application/octet-stream', Buffer.from(stream)],
  };
  server = http.createServer((request, response) => {
    const { pathname, searchParams } = new URL(request.url, 'http://localhost');
    const [type, body] = files[pathname] ?? ['text/html', page];
    const wasm = searchParams.has('no-wasm') ? '' : " 'wasm-unsafe-eval'";
    response.setHeader('content-security-policy', `default-src 'none'; script-src 'self'${wasm}; worker-src 'self'; connect-src 'self'`);
    response.setHeader('content-type', type);
    response.end(body);
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  address = `http://127.0.0.1:${server.address().port}/`;
  browser = await chromium.launch(CHROMIUM);
});

after(async () => {
  await browser?.close();
  server?.close();
});

async function open(query = '') {
  const opened = await browser.newPage();
  await opened.goto(address + query);
  await opened.waitForFunction(() => window.stream);
  return opened;
}

test('it decodes under a policy with wasm-unsafe-eval, here and in workers, bad streams among good ones', async () => {
  const opened = await open();
  const got = await opened.evaluate(async () => {
    const sum = mesh => [mesh.vertexCount, mesh.positions.reduce((a, b) => a + b, 0), mesh.indices.reduce((a, b) => a + b, 0)];
    const decoder = await window.relief.createReliefDecoder({ workers: 3 });
    const here = sum(decoder.decode(window.stream));
    let turns = 0;  // of the page's own thread while the workers work
    const timer = setInterval(() => turns++, 0);
    const cut = window.stream.slice(0, 30);
    const all = await Promise.all([window.stream, cut, window.stream, window.stream, cut, window.stream, window.stream]
      .map(bytes => decoder.decodeAsync(bytes).then(sum, error => error.code)));
    clearInterval(timer);
    decoder.dispose();
    return { here, all, turns, violations: window.violations ?? [] };
  });
  const mesh = (await createReliefDecoder()).decode(stream);
  assert.equal(got.here[0], mesh.vertexCount);
  assert.equal(got.here[1], mesh.positions.reduce((a, b) => a + b, 0));
  const { here } = got;
  assert.deepEqual(got.all, [here, 'TRUNCATED', here, here, 'TRUNCATED', here, here]);
  assert.deepEqual(got.violations, []);
  assert.ok(got.turns > 0, 'the page stood still');
  await opened.close();
});

test('without wasm-unsafe-eval the policy forbids it, and that is said', async () => {
  const opened = await open('?no-wasm');
  const name = await opened.evaluate(() => window.relief.createReliefDecoder().then(() => 'OK', error => error.name));
  assert.equal(name, 'CompileError');
  await opened.close();
});
