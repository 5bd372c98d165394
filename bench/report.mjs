// The results as Markdown.
import { frontier } from './plot.mjs';

const LEVELS = [4, 2, 1, 0.5, 0.25];
export const whole = new Intl.NumberFormat('en');

// Bytes at error `level`, between two measured points of the frontier (linear in the logarithms); null outside.
export function bytesAt(points, level) {
  const line = frontier(points);
  for (let i = 0; i + 1 < line.length; i++) {
    const [a, b] = [line[i], line[i + 1]];
    if (a.rms >= level && b.rms <= level) {
      const t = Math.log(a.rms / level) / Math.log(a.rms / b.rms);
      return Math.exp(Math.log(a.bytes) + t * Math.log(b.bytes / a.bytes));
    }
  }
  return null;
}

export const table = (head, rows) => [head, head.map((_, i) => (i ? '---:' : ':---')), ...rows].map(row => `| ${row.join(' | ')} |\n`).join('');

function bytesByLevel(points) {
  const peers = [...new Set(points.map(point => point.peer))];
  return table(['E =', ...LEVELS], peers.map(peer => [peer, ...LEVELS.map(level => {
    const bytes = bytesAt(points.filter(point => point.peer === peer), level);
    return bytes === null ? '–' : whole.format(Math.round(bytes));
  })]));
}

function modelReport({ name, vertices, triangles, points, decoding, leftOut }) {
  const peers = [...new Set(points.map(point => point.peer))];
  const times = Object.entries(decoding.times).map(([who, t]) => [who, t.median.toFixed(1), t.min.toFixed(1), t.max.toFixed(1)]);
  const all = [...points].sort((a, b) => peers.indexOf(a.peer) - peers.indexOf(b.peer) || a.bytes - b.bytes)
    .map(p => [p.peer, `\`${p.settings}\``, whole.format(p.bytes), (8 * p.bytes / vertices).toFixed(3), p.rms.toFixed(3), p.max.toFixed(1)]);
  return `## ${name}: ${whole.format(vertices)} vertices, ${whole.format(triangles)} triangles

![${name}](${name}.svg)

Bytes at E (interpolated between measured points; – where none lie on both sides):

${bytesByLevel(points)}
Decoding: Relief at E = 1 (${whole.format(decoding.reliefBytes)} bytes, ${whole.format(decoding.vertexCount)} vertices, ${whole.format(decoding.triangleCount)} triangles) and Draco
\`-cl 10 -qp 12\` (${whole.format(decoding.dracoBytes)} bytes), meshopt on the unsimplified model with 12 bits; one thread, run in turns, milliseconds:

${table(['decoder', 'median', 'least', 'most'], times)}
All measurements:

${table(['peer', 'settings', 'bytes', 'bits per vertex', 'E', 'E_max'], all)}${leftOut.map(line => `\nLeft out: ${line}.\n`).join('')}`;
}

export function report({ commit, date, machine, models }) {
  return `# Relief and its peers

Made by \`bench/run\` at commit ${commit} on ${date}; ${machine}. E is the symmetric rms surface error in 1e-4 of the bounding
box diagonal, measured by \`relief compare\` on the decoded file. Bytes are those of the bare stream for Relief and Draco, and of
the GLB for gltfpack.

${models.map(modelReport).join('\n')}`;
}

// The section of README.md.
export function figures({ commit, date, machine, models }) {
  const parts = models.map(({ name, vertices, points, decoding }) => {
    const ms = who => decoding.times[who].median.toFixed(0);
    return `**${name}**, ${whole.format(vertices)} vertices: bytes at an error E (symmetric rms, 1e-4 of the bounding box diagonal)

${bytesByLevel(points)}
Decoding to E = 1, ${whole.format(decoding.vertexCount)} vertices, takes ${ms('Relief, native')} ms natively and ${ms('Relief, WebAssembly')} ms in WebAssembly; Draco (\`-cl 10 -qp 12\`, not simplified)
takes ${ms('Draco, native')} and ${ms('Draco, WebAssembly')} ms, meshopt ${ms('meshopt, WebAssembly')} ms in WebAssembly (one thread, run in turns). With large
pages (\`GLIBC_TUNABLES=glibc.malloc.hugetlb=1\`) natively ${ms('Relief, native, large pages')} and ${ms('Draco, native, large pages')} ms.
`;
  });
  return `Measured at commit ${commit} on ${date} (${machine}); all points and plots: [bench/results](bench/results/results.md).

${parts.join('\n')}`;
}
