// Khronos' glTF validator finds no error in any GLB that the tests wrote. Runs last (see package.json).
import assert from 'node:assert/strict';
import fs from 'node:fs';
import path from 'node:path';
import test from 'node:test';
import validator from 'gltf-validator';

import { outputs, root } from './fixtures.mjs';

const files = [outputs, path.join(root, 'build/test-outputs'), path.join(root, 'demo')]
  .filter(folder => fs.existsSync(folder)).flatMap(folder => fs.readdirSync(folder).map(name => path.join(folder, name)))
  .filter(name => name.endsWith('.glb'));

test('there are files to validate', () => assert.ok(files.length > 0));

for (const file of files) {
  test(`${path.relative(root, file)} is valid`, async t => {
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { uri: path.basename(file), maxIssues: 20 });
    assert.deepEqual(issues.messages.filter(message => message.severity === 0), []);
    if (issues.numWarnings) t.diagnostic(`${issues.numWarnings} warnings: ${issues.messages.map(m => m.code).join(' ')}`);
  });
}
