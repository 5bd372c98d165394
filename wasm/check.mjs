// node check.mjs FILE.wasm: fails unless the module imports nothing and keeps to its size budget.
import fs from 'node:fs';
import path from 'node:path';

const BUDGET = { 'relief.wasm': 60_000, 'relief-simd.wasm': 60_000 };
const file = path.basename(process.argv[2]);
const budget = BUDGET[file], bytes = fs.readFileSync(process.argv[2]);
const imports = WebAssembly.Module.imports(new WebAssembly.Module(bytes));
for (const { module, name } of imports) console.error(`${file} imports ${module}.${name}; it must import nothing`);
if (!(bytes.length <= budget)) console.error(`${file} has ${bytes.length} bytes; the budget is ${budget}`);
process.exitCode = imports.length > 0 || !(bytes.length <= budget) ? 1 : 0;
if (process.exitCode === 0) console.log(`${file}: ${bytes.length} bytes, no imports`);
