// Khronos' validator on files: node validate.mjs FILE.glb ... Any error, warning or hint fails, and a file
// without a morph target or an animation does.
import { readFile } from 'node:fs/promises';
import { validateBytes } from 'gltf-validator';

let failed = false;
for (const file of process.argv.slice(2)) {
  const bytes = new Uint8Array(await readFile(file));
  const { issues, info } = await validateBytes(bytes, { maxIssues: 20 });
  const { numErrors, numWarnings, numHints, messages } = issues;
  for (const { code, message, pointer } of messages) {
    console.error(`${file}: ${code} at ${pointer}: ${message}`);
  }
  const moves = info.hasMorphTargets && info.animationCount > 0;
  if (!moves) console.error(`${file}: nothing moves in it`);
  const valid = numErrors + numWarnings + numHints === 0 && moves;
  failed ||= !valid;
  const { totalVertexCount: vertices, totalTriangleCount: triangles } = info;
  console.log(`${file}: ${vertices} vertices, ${triangles} triangles, valid: ${valid}`);
}
process.exit(failed ? 1 : 0);
