// Prints what the Khronos validator says about GLB files; exit code 1 when one has errors or warnings.
//
//   node validate.mjs FILE..      (in a folder with node_modules/)

import { readFileSync } from 'node:fs';

import validator from 'gltf-validator';

const SEVERITIES = ['error', 'warning', 'information', 'hint'];

let sound = true;
for (const file of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { format: 'glb', writeTimestamp: false });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  const { drawCallCount, materialCount, totalTriangleCount, totalVertexCount } = report.info;
  console.log(
    `${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints; ` +
      `${drawCallCount} primitives, ${materialCount} materials, ${totalVertexCount} vertices, ${totalTriangleCount} triangles`,
  );
  for (const { severity, code, message, pointer } of messages) {
    console.log(`  ${SEVERITIES[severity]} ${code} ${pointer ?? ''}: ${message}`);
  }
  sound &&= numErrors === 0 && numWarnings === 0;
}
process.exitCode = sound ? 0 : 1;
