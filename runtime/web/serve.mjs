// Serves a folder on localhost: node serve.mjs FOLDER [PORT]. For pages that are tried, not for the
// world.

import { createReadStream, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { pathToFileURL } from 'node:url';

const types = {
  '.html': 'text/html; charset=utf-8', '.css': 'text/css', '.js': 'text/javascript',
  '.safetensors': 'application/octet-stream',
};

/** Starts a server; `url` of the result is where it answers. */
export function serve(folder, port = 0) {
  const server = createServer((request, response) => {
    const refuse = (status, text) => response.writeHead(status).end(`${text}\n`);
    let path;
    try {
      path = decodeURIComponent(new URL(request.url, 'http://localhost').pathname);
    } catch {
      refuse(400, 'The address cannot be read.');
      return;
    }
    const file = join(folder, normalize(path.endsWith('/') ? `${path}index.html` : path));
    let size;
    try {
      const found = statSync(file);
      if (!found.isFile()) throw new Error('not a file');
      size = found.size;
    } catch {
      refuse(404, 'There is no such file.');
      return;
    }
    const stream = createReadStream(file);
    stream.on('open', () => response.writeHead(200, {
      'content-type': types[extname(file)] ?? 'application/octet-stream', 'content-length': size,
      'cache-control': 'no-cache',
    }));
    stream.on('error', () => {
      if (response.headersSent) response.destroy();
      else refuse(403, 'The file cannot be read.');
    });
    response.on('close', () => stream.destroy());  // whoever asked may have gone
    stream.pipe(response);
  });
  return new Promise((resolve, reject) => {
    server.on('error', (error) => {
      if (error.code === 'EADDRINUSE') server.listen(0, '127.0.0.1');  // any that is free
      else reject(error);
    });
    server.on('listening', () => {
      server.url = `http://localhost:${server.address().port}/`;
      resolve(server);
    });
    server.listen(port, '127.0.0.1');
  });
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? '').href) {
  const server = await serve(process.argv[2], Number(process.argv[3] ?? 8000));
  console.log(`The page is at ${server.url} until you press Ctrl-C.`);
}
