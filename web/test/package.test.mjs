// The npm package as a stranger gets it: packed, installed into an empty folder, imported; its types checked strictly.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import test from 'node:test';
import { fileURLToPath } from 'node:url';

import { scratch, sphereGlb, streamsOf } from './fixtures.mjs';

const web = fileURLToPath(new URL('..', import.meta.url));

test('packed and installed elsewhere, it decodes', () => {
  const folder = scratch('stranger');
  const installed = path.join(folder, 'node_modules/relief-gltf');
  fs.mkdirSync(installed, { recursive: true });
  const [{ filename, files }] = JSON.parse(execFileSync('npm', ['pack', '--json', '--pack-destination', folder], { cwd: web, encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] }));
  execFileSync('tar', ['-xzf', path.join(folder, filename), '-C', installed, '--strip-components=1']);
  const names = files.map(file => file.path).sort();
  assert.deepEqual(names, ['README.md', 'dist/relief-simd.wasm', 'dist/relief.d.ts', 'dist/relief.mjs', 'dist/relief.wasm', 'package.json', 'three.d.ts', 'three.mjs']);
  fs.writeFileSync(path.join(folder, 's.relief'), streamsOf(sphereGlb())[0]);
  fs.writeFileSync(path.join(folder, 'main.mjs'), `
    import fs from 'node:fs';
    import { createReliefDecoder } from 'relief-gltf';
    import { ReliefPatchCompression } from 'relief-gltf/three';
    const mesh = (await createReliefDecoder()).decode(fs.readFileSync('s.relief'));
    console.log(mesh.vertexCount > 0, typeof ReliefPatchCompression);`);
  assert.equal(execFileSync('node', ['main.mjs'], { cwd: folder, encoding: 'utf8' }), 'true function\n');
});

test('the types describe the interface (tsc --strict)', () => {
  const options = ['--strict', '--noEmit', '--module', 'nodenext', '--target', 'es2022', '--lib', 'es2022,dom', '--skipLibCheck'];
  execFileSync('node', ['node_modules/typescript/bin/tsc', ...options, 'test/types.mts'], { cwd: web, encoding: 'utf8' });
});
