// Writes library/wasm.js: the module, packed, as text, so that a page needs no further request.
// Usage: node pack_module.mjs REBOUNCE.wasm

import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';

// The gzip of the system packs tighter than node's.
const packed = execFileSync('gzip', ['-9', '-n', '-c', process.argv[2]], { maxBuffer: 1 << 26 });
const file = new URL('library/wasm.js', import.meta.url);
writeFileSync(file, `// Made by pack_module.mjs.\nexport const wasm =\n    '${packed.toString('base64')}';\n`);
console.log(`module: ${packed.length} bytes packed`);
