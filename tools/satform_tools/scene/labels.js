// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Text over the scene: tick marks and axes of the LVLH frame, names of satellites, the pointer's satellite, a measured distance.
const sceneLabels = (() => {
  const FEW_NAMES = 3;
  const AXES = ["radial x", "along-track y", "cross-track z"];

  function projector(space) {
    const { three, camera, sizes } = space;
    const vector = new three.Vector3();
    return (at) => {
      vector.set(...at).project(camera);
      return vector.z > 1 || !Number.isFinite(vector.x) ? null
        : [0.5 * (vector.x + 1) * sizes[0], 0.5 * (1 - vector.y) * sizes[1]];
    };
  }

  function draw(space, { mostNames, chief }) {
    const { overlay, sizes } = space;
    const context = overlay.getContext("2d");
    const ratio = overlay.width / sizes[0];
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, ...sizes);
    context.font = `12px ${getComputedStyle(document.body).fontFamily}`;
    context.lineJoin = "round";
    const project = projector(space);
    if (space.frame === "lvlh" && space.flights.length) {
      marks(space, context, project);
      cross(space, context, project);
    } else if (chief && space.followed === null) {
      earthText(space, context, project);
    }
    for (const point of space.points) [point.x, point.y] = project(point.at) || [NaN, NaN];
    for (const edge of space.edges) [edge.from, edge.to] = [project(edge.a), project(edge.b)];
    names(space, context, mostNames);
    distance(space, context);
    hovered(space, context);
  }

  function text(space, context, words, x, y, { align = "left", colour = "--ink", bold = false } = {}) {
    context.textAlign = align;
    context.textBaseline = "middle";
    context.font = context.font.replace(/^(600 )?/, bold ? "600 " : "");
    context.lineWidth = 3;
    context.strokeStyle = space.style("--panel");
    context.strokeText(words, x, y);
    context.fillStyle = space.style(colour);
    context.fillText(words, x, y);
  }

  const about = (space) => (place) => place.map((value, k) => (value - space.focus[k]) * space.scale);

  // Tick marks on the edges of the grid that are nearest to the eye, and on the leftmost upright edge.
  function marks(space, context, project) {
    const { bounds, camera, controls } = space;
    const world = about(space), { size, name } = space.unit();
    const near = [0, 1].map((k) => {
      const middle = 0.5 * (bounds[k][0] + bounds[k][1]);
      const axis = "xy"[k];
      return bounds[k][(camera.position[axis] - world([middle, middle, middle])[k] + 0 * controls.target[axis]) > 0 ? 1 : 0];
    });
    const [x, y, z] = [near[0], near[1], bounds[2][0]];
    const centre = project(world([0.5 * (bounds[0][0] + bounds[0][1]), 0.5 * (bounds[1][0] + bounds[1][1]), z]));
    const edge = (k, place) => label(space, context, project, { k, place, world, size, name, centre });
    edge(0, (value) => [value, y, z]);
    edge(1, (value) => [x, value, z]);
    upright(space, context, project, { world, size, name });
  }

  function label(space, context, project, { k, place, world, size, name, centre }) {
    const [low, high] = space.bounds[k];
    const ends = [project(world(place(low))), project(world(place(high)))];
    if (ends.includes(null) || !centre) return;
    const span = Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
    const out = [0.5 * (ends[0][0] + ends[1][0]) - centre[0], 0.5 * (ends[0][1] + ends[1][1]) - centre[1]];
    const length = Math.hypot(...out) || 1;
    const shift = (pixels) => [(out[0] / length) * pixels, (out[1] / length) * pixels];
    const every = Math.max(1, Math.ceil((space.marks[k].length * 46) / Math.max(1, span)));
    if (span < 60) return;
    space.marks[k].forEach((value, row) => {
      if (row % every) return;
      const at = project(world(place(value)));
      if (at) text(space, context, geometry.short(value / size), at[0] + shift(16)[0], at[1] + shift(12)[1], { align: "center", colour: "--soft" });
    });
    const middle = [0.5 * (ends[0][0] + ends[1][0]) + shift(52)[0], 0.5 * (ends[0][1] + ends[1][1]) + shift(34)[1]];
    text(space, context, `${AXES[k]} [${name}]`, ...middle, { align: "center", colour: "--soft", bold: true });
  }

  function upright(space, context, project, { world, size, name }) {
    const [[x0, x1], [y0, y1], [low, high]] = space.bounds;
    const corners = [[x0, y0], [x0, y1], [x1, y0], [x1, y1]]
      .map((corner) => ({ corner, at: project(world([...corner, low])), top: project(world([...corner, high])) }))
      .filter(({ at, top }) => at && top);
    if (!corners.length) return;
    const { corner, at, top } = corners.reduce((best, other) => (other.at[0] < best.at[0] ? other : best));
    const span = Math.hypot(top[0] - at[0], top[1] - at[1]);
    if (span < 60) return;
    context.strokeStyle = space.style("--rule");
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(...at);
    context.lineTo(...top);
    context.stroke();
    const every = Math.max(1, Math.ceil((space.marks[2].length * 18) / span));
    space.marks[2].forEach((value, row) => {
      const place = row % every ? null : project(world([...corner, value]));
      if (place) text(space, context, geometry.short(value / size), place[0] - 8, place[1], { align: "right", colour: "--soft" });
    });
    text(space, context, `${AXES[2]} [${name}]`, top[0] - 8, top[1] - 14, { align: top[0] > 130 ? "right" : "left", colour: "--soft", bold: true });
  }

  function cross(space, context, project) {
    const at = project(about(space)([0, 0, 0]));
    if (!at) return;
    context.strokeStyle = space.style("--ink");
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(at[0] - 5, at[1]);
    context.lineTo(at[0] + 5, at[1]);
    context.moveTo(at[0], at[1] - 5);
    context.lineTo(at[0], at[1] + 5);
    context.stroke();
    text(space, context, "chief", at[0] + 8, at[1] + 9, { colour: "--soft" });
  }

  function earthText(space, context, project) {
    const point = space.points[0];
    const at = point && project(point.at);
    if (!at) return;
    const hidden = behindEarth(space, point.at);
    const words = `${space.points.length} ${space.points.length === 1 ? "satellite" : "satellites"}${hidden ? ", behind the Earth" : ""}`;
    text(space, context, words, at[0] + 12, at[1] - 12, { bold: true, colour: hidden ? "--soft" : "--ink" });
  }

  // Whether the line from the eye to a place passes through the Earth.
  function behindEarth(space, place) {
    const { globe } = space.layers, { x, y, z } = space.camera.position;
    const { dot, subtract } = geometry;
    const centre = [globe.position.x, globe.position.y, globe.position.z], eye = [x, y, z];
    const along = subtract(place, eye), out = subtract(centre, eye);
    const part = dot(out, along) / dot(along, along);
    const nearest = subtract(out, along.map((value) => part * value));
    return part > 0 && part < 1 && Math.sqrt(dot(nearest, nearest)) < globe.scale.x;
  }

  function names(space, context, mostNames) {
    const { points } = space, taken = [];
    space.labelled = [];
    const far = space.frame === "inertial" && space.followed === null;
    // Those that are asked for, then lost ones, then the others; of a crowd three, to show which is where.
    const chosen = (point) => point.satellite === space.followed || space.measured.includes(point.satellite);
    const rank = (point) => (chosen(point) ? 0 : point.lost ? 1 : 2);
    const few = points.length > mostNames ? points.filter((_, index) => index % Math.ceil(points.length / FEW_NAMES) === 0) : points;
    const wanted = new Set([...points.filter((point) => rank(point) < 2), ...(far ? [] : few)]);
    for (const point of [...wanted].sort((one, other) => rank(one) - rank(other)).slice(0, mostNames)) {
      const words = point.lost ? `${point.name}, lost` : point.name;
      const place = { x: point.x + 11, y: point.y - 11, width: context.measureText(words).width };
      if (!Number.isFinite(point.x) || (rank(point) > 0 && taken.some((other) => overlap(place, other)))) continue;
      taken.push(place);
      space.labelled.push(point.satellite);
      text(space, context, words, place.x, place.y, { bold: true });
    }
  }

  function overlap(one, other) {
    return Math.abs(one.y - other.y) < 14 && one.x < other.x + other.width + 4 && other.x < one.x + one.width + 4;
  }

  function distance(space, context) {
    const [first, second] = space.measured.map((index) => space.points.find((point) => point.flight === 0 && point.satellite === index));
    if (!first || !second || !Number.isFinite(first.x + second.x)) return;
    context.strokeStyle = space.style("--ink");
    context.lineWidth = 1.5;
    context.setLineDash([5, 4]);
    context.beginPath();
    context.moveTo(first.x, first.y);
    context.lineTo(second.x, second.y);
    context.stroke();
    context.setLineDash([]);
    const apart = geometry.norm(geometry.subtract(first.place, second.place));
    const { size, name } = space.unit();
    text(space, context, `${Number((apart / size).toPrecision(6))} ${name}`, 0.5 * (first.x + second.x), 0.5 * (first.y + second.y) - 10, { align: "center", bold: true });
  }

  function hovered(space, context) {
    const point = space.hover !== null ? space.points.find((other) => other.flight === space.hover.flight && other.satellite === space.hover.satellite) : null;
    const edge = point ? null : space.hoveredEdge;
    if (!point && !edge) return;
    const { size, name } = space.unit();
    const lines = point
      ? [point.lost ? `${point.name}, lost` : point.name, ...["x", "y", "z"].map((axis, k) => `${axis} ${Number((point.place[k] / size).toPrecision(6))} ${name}`)]
      : [edge.text];
    const at = point ? [point.x, point.y] : edge.middle;
    const width = Math.max(...lines.map((words) => context.measureText(words).width)) + 16;
    const height = 16 * lines.length + 8;
    const x = Math.max(4, Math.min(at[0] + 14, space.sizes[0] - width - 4));
    const y = Math.max(4, Math.min(at[1] + 14, space.sizes[1] - height - 4));
    context.fillStyle = space.style("--panel");
    context.strokeStyle = space.style("--rule");
    context.lineWidth = 1;
    context.beginPath();
    context.roundRect(x, y, width, height, 6);
    context.fill();
    context.stroke();
    lines.forEach((words, row) => text(space, context, words, x + 8, y + 12 + 16 * row, { bold: row === 0 }));
  }

  return { draw };
})();
