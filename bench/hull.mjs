// The lower convex hull of bytes over error, both logarithmic, which evens out what single encodes happen to take. Points are
// { e_rms, bytes, ... }.

const x = ({ e_rms }) => Math.log(e_rms);
const y = ({ bytes }) => Math.log(bytes);

// The points on it by rising error, without an end where bytes rise with the error.
export function hull(points) {
  const sorted = [...points].sort((a, b) => a.e_rms - b.e_rms || a.bytes - b.bytes);
  const line = [];
  for (const point of sorted) {
    if (line.length && point.e_rms === line.at(-1).e_rms) continue;  // the same error for more bytes
    const above = (a, b) => (y(b) - y(a)) * (x(point) - x(a)) >= (y(point) - y(a)) * (x(b) - x(a));
    while (line.length > 1 && above(line.at(-2), line.at(-1))) line.pop();
    line.push(point);
  }
  while (line.length > 1 && line.at(-1).bytes >= line.at(-2).bytes) line.pop();
  return line;
}

// A property at an error on a line of points by rising error, linear in the logarithms; null outside. beyond: the last edge is drawn on to so
// many times the largest error.
export function valueAt(line, level, { key = 'bytes', beyond = 1 } = {}) {
  const last = line.length - 2;
  for (let i = 0; i <= last; i++) {
    const [a, b] = [line[i], line[i + 1]];
    if (level < a.e_rms || level > b.e_rms * (i === last ? beyond : 1)) continue;
    return a[key] * (b[key] / a[key]) ** ((Math.log(level) - x(a)) / (x(b) - x(a)));
  }
  return null;
}
