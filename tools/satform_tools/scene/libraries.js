// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
// The parts of three.js that the scene uses, and the coastlines of the Earth as TopoJSON.
export {
  AmbientLight, BoxGeometry, BufferAttribute, BufferGeometry, Color, ConeGeometry, DirectionalLight, DoubleSide, Group, Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial, PerspectiveCamera, Points, Quaternion, Scene, ShaderMaterial, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
export { LineMaterial } from "three/addons/lines/LineMaterial.js";
export { LineSegments2 } from "three/addons/lines/LineSegments2.js";
export { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
export { default as land } from "world-atlas/land-110m.json";
