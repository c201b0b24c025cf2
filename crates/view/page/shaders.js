// Shaders that pull vertices from textures by their number: no vertex is stored twice, colours of elements
// are flat, edges have a width in pixels, and picking is the same drawing with numbers for colours.

const PULL = `
precision highp float; precision highp int; precision highp usampler2D; precision highp isampler2D;
uniform usampler2D positions, cells, scalars; uniform isampler2D normals;
uniform vec3 low, unit; uniform int mode; uniform vec2 range; uniform vec2 viewport;
const float NOT_FINITE = -1.0e6;
ivec2 at(int i) { return ivec2(i & 2047, i >> 11); }
vec3 place(int v) { return low + unit * vec3(texelFetch(positions, at(v), 0).xyz); }
float scaled(uint code) {
  if (code == 65535u) return NOT_FINITE;
  return range.y > range.x ? (float(code) - range.x) / (range.y - range.x) : 0.5;
}
float ofVertex(int v) { return mode == 1 ? scaled(texelFetch(positions, at(v), 0).w) : 0.0; }
`;
const PAINT = `
precision highp float; precision highp int;
uniform sampler2D colourMap; uniform vec3 colour; uniform int mode; uniform bool picking;
uniform float bodyCode;
vec3 mapped(float t) {
  if (mode == 0) return colour;
  if (t < -1.0e3) return vec3(0.5);
  return texture(colourMap, vec2((clamp(t, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb;
}
vec4 number(int id) { int k = id; return vec4(k & 255, k >> 8 & 255, k >> 16 & 255, bodyCode) / 255.0; }
`;
const LIGHT = 'const vec3 LIGHT = vec3(0.25, 0.52, 0.82);';

export const TRIANGLE_VERTEX =
  PULL +
  `
out vec3 facing, eye, corner; out float smoothValue; flat out float flatValue; flat out int id;
void main() {
  id = gl_VertexID / 3; int k = gl_VertexID % 3;
  uvec4 cell = texelFetch(cells, at(id), 0);
  int v = int(k == 0 ? cell.x : k == 1 ? cell.y : cell.z);
  corner = vec3(k == 0, k == 1, k == 2);
  vec4 seen = modelViewMatrix * vec4(place(v), 1.0);
  eye = seen.xyz; facing = normalMatrix * vec3(texelFetch(normals, at(v), 0).xyz);
  smoothValue = ofVertex(v);
  flatValue = mode == 2 ? scaled(texelFetch(scalars, at(int(cell.w)), 0).x) : 0.0;
  gl_Position = projectionMatrix * seen;
}`;
export const TRIANGLE_FRAGMENT =
  PAINT +
  LIGHT +
  `
in vec3 facing, eye, corner; in float smoothValue; flat in float flatValue; flat in int id;
uniform float edges; uniform bool facets, flatLight; out vec4 shown;
void main() {
  if (picking) { shown = number(id); return; }
  vec3 facet = normalize(cross(dFdx(eye), dFdy(eye))), n = facets ? facet : normalize(facing);
  facet = dot(facet, eye) > 0.0 ? -facet : facet;
  n = dot(n, facet) < 0.0 ? -n : n;
  // Sharp edges stay sharp: where the two are 20 to 35 degrees apart, one becomes the other.
  n = normalize(mix(facet, n, smoothstep(0.82, 0.94, dot(n, facet))));
  float light = flatLight ? 1.0 : mix(mode == 0 ? 0.36 : 0.6, 1.0, max(0.0, dot(n, normalize(LIGHT))));
  vec3 width = fwidth(corner), distance = corner / width;
  // Triangles of a few pixels would be all edge: it fades between 14 and 4 pixels of height.
  float large = smoothstep(4.0, 14.0, 1.0 / max(max(width.x, width.y), width.z));
  float nearest = min(min(distance.x, distance.y), distance.z);
  float ink = edges * large * (1.0 - smoothstep(0.4, 1.4, nearest));
  shown = vec4(mapped(mode == 2 ? flatValue : smoothValue) * light * (1.0 - ink), 1.0);
}`;
export const LINE_VERTEX =
  PULL +
  `
uniform float thickness; out float smoothValue, light; flat out int id;
` +
  LIGHT +
  `
void main() {
  id = gl_VertexID / 6; int k = gl_VertexID % 6;
  uvec4 cell = texelFetch(cells, at(id), 0);
  bool second = k == 1 || k == 2 || k == 4; float side = k == 0 || k == 1 || k == 3 ? -1.0 : 1.0;
  vec4 seenA = modelViewMatrix * vec4(place(int(cell.x)), 1.0);
  vec4 seenB = modelViewMatrix * vec4(place(int(cell.y)), 1.0);
  vec4 a = projectionMatrix * seenA, b = projectionMatrix * seenB;
  vec2 along = (b.xy / b.w - a.xy / a.w) * viewport;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec4 end = second ? b : a;
  end.xy += vec2(-along.y, along.x) * side * thickness / viewport * end.w;
  float tangent = dot(normalize(seenB.xyz - seenA.xyz + vec3(1e-9)), normalize(LIGHT));
  light = 0.5 + 0.5 * sqrt(max(0.0, 1.0 - tangent * tangent));
  smoothValue = ofVertex(int(second ? cell.y : cell.x)); gl_Position = end;
}`;
export const LINE_FRAGMENT =
  PAINT +
  `
in float smoothValue, light; flat in int id; uniform bool flatLight; out vec4 shown;
void main() { shown = picking ? number(id) : vec4(mapped(smoothValue) * (flatLight ? 1.0 : light), 1.0); }`;

// Points and pins: cells.x is the vertex, cells.y eight times the diameter in pixels.
export const POINT_VERTEX =
  PULL +
  `
uniform float pixelRatio; out float smoothValue; flat out int id;
void main() {
  uvec4 cell = texelFetch(cells, at(gl_VertexID), 0);
  id = int(cell.x); smoothValue = ofVertex(id);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(place(id), 1.0);
  gl_PointSize = float(cell.y) / 8.0 * pixelRatio;
}`;
export const POINT_FRAGMENT =
  PAINT +
  `
in float smoothValue; flat in int id; uniform bool flatLight; out vec4 shown;
void main() {
  vec2 p = gl_PointCoord * 2.0 - 1.0; float r = dot(p, p);
  if (r > 1.0) discard;
  vec3 n = vec3(p.x, -p.y, sqrt(1.0 - r));
  float light = flatLight ? 1.0 : 0.55 + 0.45 * dot(n, normalize(vec3(-0.3, 0.5, 0.8)));
  shown = picking ? number(id) : vec4(mapped(smoothValue) * light, 1.0);
}`;
export const PIN_FRAGMENT =
  PAINT +
  `
in float smoothValue; flat in int id; out vec4 shown;
void main() {
  vec2 p = abs(gl_PointCoord * 2.0 - 1.0); float r = p.x + p.y, pixel = fwidth(r);
  // What is held is picked, not its mark.
  if (picking || r > 1.0) discard;
  // Soft by its own width: in software there is no antialiasing.
  float inside = 1.0 - smoothstep(0.6 - 0.5 * pixel, 0.6 + 0.5 * pixel, r);
  shown = vec4(colour * inside, 1.0 - smoothstep(1.0 - pixel, 1.0, r));
}`;
