// IEC 61966-2-1.
const LINEAR = Uint16Array.from({ length: 256 }, (_, byte) => {
  const s = byte / 255;
  return Math.round(65535 * (s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4));
});

/** Colours of streams are sRGB bytes, four a vertex; those of glTF and of engines are linear, here normalized 16 bits. */
export function linearColors(colors) {
  return Uint16Array.from(colors, (byte, i) => (i % 4 === 3 ? 257 * byte : LINEAR[byte]));
}
