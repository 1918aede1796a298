// Builds the page: node build_page.mjs FOLDER. Scenes are put into FOLDER/scenes by whoever calls.

import { build } from 'esbuild';
import { copyFileSync, mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';

const out = process.argv[2];
const page = fileURLToPath(new URL('page', import.meta.url));

mkdirSync(join(out, 'scenes'), { recursive: true });
for (const name of ['index.html', 'style.css']) copyFileSync(join(page, name), join(out, name));
await build({
  entryPoints: [join(page, 'page.js')], outfile: join(out, 'page.js'),
  bundle: true, minify: true, format: 'esm', target: 'es2022', legalComments: 'eof',
});
