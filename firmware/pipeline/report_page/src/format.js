// Numbers and words as the reader sees them.

export const DASH = '\u2013';

const grouped = new Intl.NumberFormat('en', { maximumFractionDigits: 0 });

export function count(value) {
  return value === null || value === undefined ? DASH : grouped.format(value);
}

/** A number with a fixed count of digits; a dash when there is none. */
export function fixed(value, digits) {
  return Number.isFinite(value) ? value.toFixed(digits) : DASH;
}

/** Three significant digits, without an exponent for everyday sizes. */
export function short(value) {
  if (!Number.isFinite(value)) return DASH;
  if (value === 0) return '0';
  const size = Math.abs(value);
  return size >= 1000 || size < 1e-4 ? value.toExponential(2) : String(Number(value.toPrecision(3)));
}

export function plural(number, one, many = `${one}s`) {
  return `${count(number)} ${number === 1 ? one : many}`;
}

/** "no_overlap" -> "no overlap". */
export function words(identifier) {
  return identifier.replaceAll('_', ' ');
}

/** The last part of a path, for tight places. */
export function baseName(path) {
  return path.slice(path.lastIndexOf('/') + 1);
}
