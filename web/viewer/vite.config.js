import { fileURLToPath } from 'node:url';

const here = path => fileURLToPath(new URL(path, import.meta.url));

export default {
  base: './',
  resolve: {
    alias: [
      { find: /^relief-gltf$/, replacement: here('../dist/relief.mjs') },
      { find: /^relief-gltf\/three$/, replacement: here('../three.mjs') },
    ],
  },
  build: { outDir: here('../../build/viewer'), emptyOutDir: true, target: 'es2022', chunkSizeWarningLimit: 1000 },
};
