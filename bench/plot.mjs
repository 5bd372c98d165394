// An SVG plot of error against bytes, or something else, both logarithmic: all points, and a line through them.
const COLORS = { Relief: '#c2410c', Draco: '#2563eb', 'simplify + Draco': '#0f766e', gltfpack: '#9333ea', 'gltfpack + gzip': '#c084fc' };
const WIDTH = 900, HEIGHT = 600, LEFT = 80, RIGHT = 24, TOP = 50, BOTTOM = 62;

// The points that are better than all smaller ones, by rising bytes: no other of the same peer beats them in both.
export function frontier(points) {
  let best = Infinity;
  return [...points].sort((a, b) => a.bytes - b.bytes || a.rms - b.rms).filter(({ rms }) => rms < best && ((best = rms), true));
}

function ticks(low, high) {
  const values = [], digits = high / low < 5 ? [1, 2, 3, 4, 5, 6, 7, 8, 9] : [1, 2, 5];
  for (let decade = 10 ** Math.floor(Math.log10(low)); decade <= high; decade *= 10) {
    for (const digit of digits) if (digit * decade >= low && digit * decade <= high) values.push(digit * decade);
  }
  return values;
}

const bytesText = value => (value >= 1e6 ? `${value / 1e6} MB` : value >= 1e3 ? `${value / 1e3} kB` : `${value} B`);

const BYTES = { key: 'bytes', label: 'bytes', text: bytesText, colors: COLORS, line: frontier, thick: 'Relief' };

// What lies along the x axis: { key, label, text } of the points' values, the colour of each peer, how to choose the points on its
// line, and the peer whose line is thicker.
export function plot(title, points, axis = BYTES) {
  const range = key => {
    const values = points.map(point => point[key]);
    return [Math.min(...values) / 1.25, Math.max(...values) * 1.25];
  };
  const [x0, x1] = range(axis.key), [y0, y1] = range('rms');
  const place = (value, low, high, from, to) => from + (to - from) * Math.log(value / low) / Math.log(high / low);
  const x = value => place(value, x0, x1, LEFT, WIDTH - RIGHT).toFixed(1);
  const y = value => place(value, y0, y1, HEIGHT - BOTTOM, TOP).toFixed(1);
  const parts = [];
  for (const value of ticks(x0, x1)) {
    parts.push(`<path class="grid" d="M${x(value)} ${TOP}V${HEIGHT - BOTTOM}"/>`,
      `<text x="${x(value)}" y="${HEIGHT - BOTTOM + 20}" text-anchor="middle">${axis.text(value)}</text>`);
  }
  for (const value of ticks(y0, y1)) {
    parts.push(`<path class="grid" d="M${LEFT} ${y(value)}H${WIDTH - RIGHT}"/>`,
      `<text x="${LEFT - 9}" y="${+y(value) + 4}" text-anchor="end">${+value.toPrecision(1)}</text>`);
  }
  const peers = Object.keys(axis.colors).filter(peer => points.some(point => point.peer === peer));
  for (const [i, peer] of peers.entries()) {
    const own = points.filter(point => point.peer === peer), color = axis.colors[peer];
    const line = axis.line(own).map(point => `${x(point[axis.key])} ${y(point.rms)}`).join('L');
    parts.push(`<path d="M${line}" fill="none" stroke="${color}" stroke-width="${peer === axis.thick ? 3 : 1.8}"/>`);
    parts.push(...own.map(point => `<circle cx="${x(point[axis.key])}" cy="${y(point.rms)}" r="3.4" fill="${color}"><title>${peer} ${point.settings}: ${point[axis.key]} ${axis.label}, E ${point.rms.toFixed(3)}</title></circle>`));
    const legendY = TOP + 18 + 20 * i;
    parts.push(`<path d="M${WIDTH - 190} ${legendY}h26" stroke="${color}" stroke-width="3"/>`,
      `<text x="${WIDTH - 156}" y="${legendY + 4}">${peer}</text>`);
  }
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${WIDTH} ${HEIGHT}" width="${WIDTH}" height="${HEIGHT}" font-family="DejaVu Sans, sans-serif" font-size="13">
<style>.grid{stroke:#e3e3e3;fill:none}</style><rect width="100%" height="100%" fill="#fff"/>
<text x="${LEFT}" y="28" font-size="17" font-weight="bold">${title}</text>
${parts.join('\n')}
<text x="${(LEFT + WIDTH - RIGHT) / 2}" y="${HEIGHT - 14}" text-anchor="middle">${axis.label}</text>
<text transform="translate(22 ${(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)" text-anchor="middle">E: symmetric rms error, 1e-4 of the diagonal</text>
</svg>
`;
}
