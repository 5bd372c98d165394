// The npm package as a stranger gets it: packed, installed into an empty folder, imported; its types checked strictly.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import test from 'node:test';
import { fileURLToPath } from 'node:url';

import { scratch, sphereGlb, streamsOf } from './fixtures.mjs';

const web = fileURLToPath(new URL('..', import.meta.url));

// npm in a folder, without the network.
const npm = (folder, ...args) => execFileSync('npm', [...args, '--offline', '--no-audit', '--no-fund', '--no-update-notifier'],
  { cwd: folder, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });

test('packed, and installed in an empty folder, it decodes, also in workers', () => {
  const folder = scratch('stranger');
  fs.mkdirSync(folder, { recursive: true });
  const [{ filename, files }] = JSON.parse(npm(web, 'pack', '--json', '--pack-destination', folder));
  const names = files.map(file => file.path).sort();
  assert.deepEqual(names, ['README.md', 'babylon.d.ts', 'babylon.mjs', 'dist/relief.d.ts', 'dist/relief.mjs', 'gltf-transform.d.ts', 'gltf-transform.mjs',
    'linear.mjs', 'package.json', 'three.d.ts', 'three.mjs']);
  npm(folder, 'init', '--yes');
  npm(folder, 'install', `./${filename}`);
  const { dependencies } = JSON.parse(npm(folder, 'ls', '--json'));
  assert.deepEqual(Object.keys(dependencies), ['relief-gltf'], 'it brings nothing along');
  fs.writeFileSync(path.join(folder, 's.relief'), streamsOf(sphereGlb())[0]);
  fs.writeFileSync(path.join(folder, 'main.mjs'), `
    import fs from 'node:fs';
    import { createReliefDecoder } from 'relief-gltf';
    import { ReliefPatchCompression } from 'relief-gltf/three';
    const decoder = await createReliefDecoder({ workers: 1 }), stream = fs.readFileSync('s.relief');
    const mesh = decoder.decode(stream), other = await decoder.decodeAsync(stream);
    console.log(mesh.vertexCount > 0, mesh.vertexCount === other.vertexCount, typeof ReliefPatchCompression);`);
  assert.equal(execFileSync('node', ['main.mjs'], { cwd: folder, encoding: 'utf8' }), 'true true function\n');
});

test('the types describe the interface (tsc --strict)', () => {
  const options = ['--strict', '--noEmit', '--module', 'nodenext', '--target', 'es2022', '--lib', 'es2022,dom', '--skipLibCheck'];
  execFileSync('node', ['node_modules/typescript/bin/tsc', ...options, 'test/types.mts'], { cwd: web, encoding: 'utf8' });
});
