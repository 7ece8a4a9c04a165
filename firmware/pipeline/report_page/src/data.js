// Reads the two data blocks of the page.

function readJson(id) {
  const element = document.getElementById(id);
  return element ? JSON.parse(element.textContent) : null;
}

function bytesOf(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** Little-endian floats whatever the machine. */
function floatsOf(bytes) {
  const view = new DataView(bytes.buffer);
  const floats = new Float32Array(bytes.length / 4);
  for (let i = 0; i < floats.length; ++i) floats[i] = view.getFloat32(4 * i, true);
  return floats;
}

/** Hands out unsigned LEB128 numbers one after the other. */
function leb128Reader(bytes) {
  let at = 0;
  return () => {
    let value = 0;
    for (let shift = 0; ; shift += 7) {
      const byte = bytes[at++];
      value += (byte & 0x7f) * 2 ** shift;
      if (byte < 0x80) return value;
    }
  };
}

function readSeenPoints(next) {
  const seen = new Uint32Array(next());
  let point = 0;
  for (let i = 0; i < seen.length; ++i) {
    point += next();
    seen[i] = point;
  }
  return seen;
}

/** The GLB: { name, bytes, limitBytes, glb: ArrayBuffer, or null when it is too large for the page }; or null. */
function readModelFile() {
  const file = readJson('model-data');
  return file && { name: file.name, bytes: file.bytes, limitBytes: file.limit_bytes, glb: file.glb === null ? null : bytesOf(file.glb).buffer };
}

/**
 * { report, components, modelFile, depthMaps }: the report as in report.json, and per component
 * { points, pointsTotal, positions: Float32Array, colors: Uint8Array, poses: [{ image, camera, center, rotation, seen }] };
 * the mesh's file or null; depth maps as report_html.cpp writes them.
 */
export function readData() {
  const report = readJson('report-data');
  const geometry = readJson('geometry-data');
  const positions = floatsOf(bytesOf(geometry.positions));
  const colors = bytesOf(geometry.colors);
  const next = leb128Reader(bytesOf(geometry.visibility));
  let start = 0;
  const components = geometry.components.map((component) => {
    const end = start + component.points;
    const result = {
      points: component.points,
      pointsTotal: component.points_total,
      positions: positions.slice(3 * start, 3 * end),
      colors: colors.slice(3 * start, 3 * end),
      poses: component.poses.map((pose) => ({ ...pose, seen: readSeenPoints(next) })),
    };
    start = end;
    return result;
  });
  return { report, components, modelFile: readModelFile(), depthMaps: readJson('depth-data') ?? [] };
}
