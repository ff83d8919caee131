// Glass for tissue: clear where it is seen head on, dense at its rim, so that the robot inside stays visible.

import { Color, DoubleSide, ShaderMaterial } from "three";

const VERTEX = `
varying vec3 vNormal; varying vec3 vView;
void main() {
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  vNormal = normalMatrix * normal; vView = -place.xyz;
  gl_Position = projectionMatrix * place;
}`;

const FRAGMENT = `
uniform vec3 colour; uniform float face; uniform float rim;
varying vec3 vNormal; varying vec3 vView;
void main() {
  vec3 n = normalize(vNormal); vec3 v = normalize(vView);
  float facing = abs(dot(n, v));
  float light = 0.72 + 0.28 * abs(dot(n, normalize(vec3(0.35, 0.6, 0.7))));
  gl_FragColor = vec4(colour * light, mix(face, rim, pow(1.0 - facing, 2.2)));
  #include <colorspace_fragment>
}`;

export function glass(look) {
  return new ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    uniforms: { colour: { value: new Color(look.colour) }, face: { value: look.face }, rim: { value: look.rim } },
    transparent: true,
    depthWrite: false,
    side: DoubleSide,
  });
}
