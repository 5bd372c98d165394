// node check.mjs FILE.wasm: fails unless the module imports nothing and keeps to its size budget.
import fs from 'node:fs';
import path from 'node:path';

const BUDGET = 40_000;
const name = path.basename(process.argv[2]);
const bytes = fs.readFileSync(process.argv[2]);
const imports = WebAssembly.Module.imports(new WebAssembly.Module(bytes));
for (const { module, name } of imports) console.error(`${name} imports ${module}.${name}; it must import nothing`);
if (bytes.length > BUDGET) console.error(`${name} has ${bytes.length} bytes; the budget is ${BUDGET}`);
process.exitCode = imports.length > 0 || bytes.length > BUDGET ? 1 : 0;
if (process.exitCode === 0) console.log(`${name}: ${bytes.length} bytes, no imports`);
