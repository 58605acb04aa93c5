// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Numbers of the scene: frames, rotations, shape of a formation, tick marks. Vectors are arrays of three numbers.
const geometry = (() => {
  const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const norm = (a) => Math.hypot(a[0], a[1], a[2]);
  const unit = (a) => { const length = norm(a) || 1; return [a[0] / length, a[1] / length, a[2] / length]; };

  // Origin and axes (radial, along-track, normal) of the LVLH frame of a chief by its inertial position and velocity.
  function lvlh(state) {
    const origin = [state[0], state[1], state[2]];
    const radial = unit(origin);
    const normal = unit(cross(origin, [state[3], state[4], state[5]]));
    return { origin, axes: [radial, cross(normal, radial), normal] };
  }

  // LVLH coordinates in inertial ones: of a place with the frame's origin, of a direction without.
  function inertial(frame, place, { direction = false } = {}) {
    const { axes, origin } = frame;
    return [0, 1, 2].map((k) => (direction ? 0 : origin[k]) + place[0] * axes[0][k] + place[1] * axes[1][k] + place[2] * axes[2][k]);
  }

  // A vector in body components, in the components to which a quaternion (x, y, z, w) takes it.
  function rotated(q, v) {
    const t = cross(q, v).map((value) => 2 * value);
    const u = cross(q, t);
    return [v[0] + q[3] * t[0] + u[0], v[1] + q[3] * t[1] + u[1], v[2] + q[3] * t[2] + u[2]];
  }

  // Eigenvectors of a symmetric 3 x 3 matrix by Jacobi rotations, those of the smallest eigenvalue first.
  function principal(matrix) {
    const a = matrix.map((row) => [...row]);
    const v = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    for (let sweep = 0; sweep < 30; sweep++) {
      for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
        if (Math.abs(a[p][q]) < 1e-300) continue;
        const angle = 0.5 * Math.atan2(2 * a[p][q], a[q][q] - a[p][p]);
        const c = Math.cos(angle), s = Math.sin(angle);
        for (let k = 0; k < 3; k++) [a[k][p], a[k][q]] = [c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]];
        for (let k = 0; k < 3; k++) [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
        for (let k = 0; k < 3; k++) [v[k][p], v[k][q]] = [c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]];
      }
    }
    return [0, 1, 2].map((k) => ({ value: a[k][k], axis: [v[0][k], v[1][k], v[2][k]] })).sort((one, other) => one.value - other.value);
  }

  // Direction from which points are seen best: of a planar formation nearly along the normal of its plane.
  function viewDirection(points) {
    const usual = unit([1.25, 0.8, 0.62]);
    if (points.length < 3) return usual;
    const mean = [0, 1, 2].map((k) => points.reduce((sum, point) => sum + point[k], 0) / points.length);
    const covariance = [0, 1, 2].map((i) => [0, 1, 2].map((j) =>
      points.reduce((sum, point) => sum + (point[i] - mean[i]) * (point[j] - mean[j]), 0) / points.length));
    const [least, middle, most] = principal(covariance);
    if (most.value <= 0) return usual;
    let along = least.axis;
    if (middle.value < 1e-3 * most.value) {
      // On one line: from the side.
      const off = subtract(usual, most.axis.map((value) => value * dot(usual, most.axis)));
      return unit(off);
    }
    if (dot(along, usual) < 0) along = along.map((value) => -value);
    const flat = Math.sqrt(Math.max(least.value, 0) / most.value);
    if (flat > 0.12) return usual;
    const aside = subtract(usual, along.map((value) => value * dot(usual, along)));
    return unit([0, 1, 2].map((k) => along[k] + 0.5 * unit(aside)[k]));
  }

  // Round numbers within a range, about as many as wanted.
  function ticks(low, high, wanted) {
    const raw = (high - low) / Math.max(1, wanted);
    if (!(raw > 0)) return [];
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999);
    const found = [];
    for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) found.push(n === 0 ? 0 : n * step);
    return found;
  }

  // Range of all points on each axis, none much flatter than the longest.
  function box(points) {
    const low = [0, 0, 0], high = [0, 0, 0];
    for (const point of points) {
      for (let k = 0; k < 3; k++) {
        if (point[k] < low[k]) low[k] = point[k];
        if (point[k] > high[k]) high[k] = point[k];
      }
    }
    const longest = Math.max(...[0, 1, 2].map((k) => high[k] - low[k])) || 1;
    return [0, 1, 2].map((k) => {
      const middle = 0.5 * (low[k] + high[k]);
      const half = 0.55 * Math.max(high[k] - low[k], 0.25 * longest);
      return [middle - half, middle + half];
    });
  }

  // Lines of TopoJSON as longitude and latitude in degrees.
  function coastlines(topology) {
    const { scale, translate } = topology.transform;
    return topology.arcs.map((arc) => {
      let x = 0, y = 0;
      return arc.map(([dx, dy]) => {
        x += dx;
        y += dy;
        return [x * scale[0] + translate[0], y * scale[1] + translate[1]];
      });
    });
  }

  const short = (value) => String(Number(value.toPrecision(4)));

  return { subtract, dot, cross, norm, unit, lvlh, inertial, rotated, viewDirection, ticks, box, coastlines, short };
})();
