// Writes library/wasm.js: the module, packed, as text, so that a page needs no further request.
// Usage: node pack_module.mjs REBOUNCE.wasm

import { readFileSync, writeFileSync } from 'node:fs';
import { gzipSync } from 'node:zlib';

const packed = gzipSync(readFileSync(process.argv[2]), { level: 9 });
const file = new URL('library/wasm.js', import.meta.url);
writeFileSync(file, `// Made by pack_module.mjs.\nexport const wasm =\n    '${packed.toString('base64')}';\n`);
console.log(`module: ${packed.length} bytes packed`);
