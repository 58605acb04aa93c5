// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// The formation in space, drawn with three.js; one implementation for reports and the live page.
//
// A flight is an object with
//   names, suffix, count: of its satellites
//   moments, time(moment), place(moment, satellite): positions in the LVLH frame of the chief, any unit of length
//   orbits: of each satellite its desired orbit as a Float32Array of x, y, z, or null
//   trail: moments that a trail goes back; secondary: whether it is drawn as the other of two; triangle: whether it is filled
//   chief(moment): inertial position and velocity; null where they are not known; chiefOrbit: the same at moments of one revolution
//   attitude(moment, satellite): quaternion from body to LVLH, or null; boresights: of each satellite in body axes, or null
// All vectors are turned about `focus`, in double precision, before they go to the graphics card in single precision.
const formationScene = (() => {
  const { subtract, lvlh, inertial, rotated, viewDirection, box, unit: unitVector } = geometry;
  const FIELD_OF_VIEW = 28;
  const MOST_NAMES = 24;
  const EARTH_RADIUS = 6378136.3;

  function create(container, { three, colour, style, unit, dark }) {
    const renderer = new three.WebGLRenderer({ antialias: true, alpha: true, logarithmicDepthBuffer: true });
    renderer.setClearColor(0x000000, 0);
    const overlay = document.createElement("canvas");
    overlay.className = "scene-labels";
    renderer.domElement.className = "scene-canvas";
    container.append(renderer.domElement, overlay);
    const camera = new three.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 1e7);
    camera.up.set(0, 0, 1);
    camera.position.set(2, 1, 1);
    const controls = new three.OrbitControls(camera, renderer.domElement);
    controls.enableDamping = false;
    controls.zoomToCursor = false;
    const space = {
      three, renderer, overlay, camera, controls, container, colour, style, unit, dark,
      root: new three.Scene(), flights: [], shown: [], hidden: new Set(), frame: "lvlh", followed: null, measured: [],
      bounds: [[-1, 1], [-1, 1], [-1, 1]], scale: 1, focus: [0, 0, 0], points: [], labelled: [], hover: null, edges: [], sizes: [1, 1], earthAngle: () => 0,
      listeners: { pick: () => {}, edge: null },
    };
    space.materials = sceneObjects.materials(space);
    space.layers = sceneObjects.layers(space);
    controls.addEventListener("change", () => request(space));
    new ResizeObserver(() => resize(space)).observe(container);
    scenePointer.attach(space, { request, turn: (...angles) => turn(space, ...angles), zoom: (factor) => zoom(space, factor) });
    resize(space);
    return api(space);
  }

  const api = (space) => ({
    setFlights: (flights) => setFlights(space, flights),
    show: (shown) => { space.shown = shown; update(space); },
    restyle: () => { sceneObjects.restyle(space); rebuild(space); update(space); },
    grow: () => { fit(space, { grow: true }); rebuild(space); },
    follow: (satellite) => { space.followed = satellite; rebuild(space); update(space); },
    followed: () => space.followed,
    setFrame: (name) => setFrame(space, name),
    frame: () => space.frame,
    look: (direction) => look(space, direction),
    reaim: () => aim(space),
    reset: () => { space.followed = null; fit(space, {}); rebuild(space); aim(space); update(space); },
    setEarthAngle: (angle) => { space.earthAngle = angle; },
    measure: (pair) => { space.measured = pair; update(space); },
    hidden: space.hidden,
    on: (name, listener) => { space.listeners[name] = listener; },
    positions: () => space.points.filter((point) => point.satellite !== null).map(({ flight, satellite, place, symbol }) => ({ flight, satellite, place, symbol })),
    screen: () => space.points.map(({ satellite, x, y }) => ({ satellite, x, y })),
    labelled: () => space.labelled,
    picture: () => picture(space),
    draw: () => draw(space),
  });

  function setFlights(space, flights) {
    space.flights = flights;
    space.shown = flights.map((flight) => ({ moment: Math.max(0, flight.moments - 1), alive: [], links: [] }));
    fit(space, {});
    rebuild(space);
    aim(space);
  }

  // Points that show the extent and the shape of all flights: desired orbits and flown paths, thinned.
  function samples(space) {
    const points = [];
    for (const flight of space.flights) {
      for (const orbit of flight.orbits) {
        for (let k = 0; orbit && k + 2 < orbit.length; k += 12) points.push([orbit[k], orbit[k + 1], orbit[k + 2]]);
      }
      const stride = Math.max(1, Math.ceil((flight.moments * flight.count) / 4000));
      for (let row = 0; row < flight.moments; row += stride) {
        for (let index = 0; index < flight.count; index++) points.push(flight.place(row, index));
      }
      for (let index = 0; flight.moments && index < flight.count; index++) points.push(flight.place(flight.moments - 1, index));
    }
    return points.filter((point) => point.every(Number.isFinite));
  }

  function fit(space, { grow = false }) {
    const points = samples(space);
    let bounds = box(points);
    if (grow) bounds = bounds.map(([low, high], k) => [Math.min(low, space.bounds[k][0]), Math.max(high, space.bounds[k][1])]);
    space.bounds = bounds;
    space.scale = 1 / Math.max(...bounds.map(([low, high]) => high - low));
    space.shape = viewDirection(points);
  }

  // How far the camera has to be for all of a length in world units to be seen.
  function distanceFor(space, length) {
    const half = (0.5 * FIELD_OF_VIEW * Math.PI) / 180;
    const narrow = Math.min(1, space.camera.aspect);
    return (0.5 * length) / (Math.tan(half) * narrow);
  }

  function aim(space) {
    const { controls, camera } = space;
    const earth = space.frame === "inertial";
    const chief = earth ? chiefNow(space) : null;
    const length = earth && space.followed === null && chief ? 2.6 * Math.hypot(...chief.origin) * space.scale : 1.35;
    const direction = earth ? unitVector([1, -0.9, 0.55]) : space.shape || [1, 0.6, 0.5];
    controls.target.set(0, 0, 0);
    controls.minDistance = 1e-4;
    controls.maxDistance = 4 * distanceFor(space, Math.max(length, 4));
    let distance = distanceFor(space, length);
    for (let round = 0; round < 4; round++) {
      camera.position.set(...direction.map((value) => value * distance));
      controls.update();
      if (earth || space.followed !== null) break;
      distance *= Math.max(0.2, Math.min(5, filled(space)));
    }
    request(space);
  }

  // Part of the window that the corners of the box take up, 1 where they just fit with their labels.
  function filled(space) {
    const { camera, bounds, focus, scale, three, sizes } = space;
    camera.updateMatrixWorld();
    const room = [Math.max(0.45, 1 - 190 / sizes[0]), Math.max(0.5, 1 - 110 / sizes[1])];
    let most = 0;
    for (let corner = 0; corner < 8; corner++) {
      const place = [0, 1, 2].map((k) => (bounds[k][(corner >> k) & 1] - focus[k]) * scale);
      const at = new three.Vector3(...place).project(camera);
      most = Math.max(most, Math.abs(at.x) / room[0], Math.abs(at.y) / room[1]);
    }
    return most;
  }

  function look(space, direction) {
    const { camera, controls } = space;
    const distance = camera.position.distanceTo(controls.target);
    const wanted = direction || space.shape;
    // Straight along the vertical the camera would have no upright.
    const off = Math.abs(wanted[2]) > 0.999 ? [0.02, 0, wanted[2]] : wanted;
    camera.position.copy(controls.target).add(new space.three.Vector3(...unitVector(off).map((value) => value * distance)));
    controls.update();
    request(space);
  }

  function turn(space, sideways, upwards) {
    const { camera, controls } = space;
    const offset = camera.position.clone().sub(controls.target);
    const around = Math.atan2(offset.y, offset.x) + sideways;
    const length = offset.length();
    const above = Math.max(-1.5, Math.min(1.5, Math.asin(offset.z / length) + upwards));
    camera.position.copy(controls.target).add(new space.three.Vector3(
      length * Math.cos(above) * Math.cos(around), length * Math.cos(above) * Math.sin(around), length * Math.sin(above)));
    controls.update();
    request(space);
  }

  function zoom(space, factor) {
    const { camera, controls } = space;
    const length = camera.position.distanceTo(controls.target) * factor;
    const bounded = Math.max(controls.minDistance, Math.min(controls.maxDistance, length));
    camera.position.sub(controls.target).setLength(bounded).add(controls.target);
    controls.update();
    request(space);
  }

  function setFrame(space, name) {
    if (name === space.frame) return;
    space.frame = name;
    rebuild(space);
    update(space);
    aim(space);
  }

  const chiefNow = (space) => {
    const flight = space.flights[0];
    const state = flight && flight.moments ? flight.chief(space.shown[0].moment) : null;
    return state ? lvlh(state) : null;
  };

  // The place about which everything is turned: the followed satellite, the middle of the box, or the Earth.
  function focusOf(space) {
    const flight = space.flights[0];
    const followed = space.followed === null || !flight ? null : flight.place(space.shown[0].moment, space.followed);
    const middle = space.bounds.map(([low, high]) => 0.5 * (low + high));
    if (space.frame === "lvlh") return followed && followed.every(Number.isFinite) ? followed : middle;
    const chief = chiefNow(space);
    return followed && chief ? inertial(chief, followed) : [0, 0, 0];
  }

  // From LVLH coordinates of a moment to the world about the focus.
  function worldOf(space, flight, moment) {
    const { focus, scale } = space;
    const state = space.frame === "inertial" ? flight.chief(moment) : null;
    const frame = state && lvlh(state);
    return (place, direction = false) => {
      const turned = frame ? inertial(frame, place, { direction }) : place;
      return direction ? turned : subtract(turned, focus).map((value) => value * scale);
    };
  }

  function rebuild(space) {
    space.focus = focusOf(space);
    sceneObjects.still(space, worldOf);
    request(space);
  }

  function update(space) {
    if (!space.flights.length) return;
    space.focus = focusOf(space);
    sceneObjects.placeStill(space, chiefNow(space), EARTH_RADIUS);
    sceneObjects.moving(space, worldOf, rotated);
    request(space);
  }

  function resize(space) {
    const { clientWidth: width, clientHeight: height } = space.container;
    if (!width || !height) return;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    space.sizes = [width, height];
    space.renderer.setPixelRatio(ratio);
    space.renderer.setSize(width, height);
    space.overlay.width = width * ratio;
    space.overlay.height = height * ratio;
    space.overlay.style.width = `${width}px`;
    space.overlay.style.height = `${height}px`;
    space.camera.aspect = width / height;
    space.camera.updateProjectionMatrix();
    for (const material of space.materials.lines) material.resolution.set(width, height);
    space.materials.points.uniforms.ratio.value = ratio;
    draw(space);
  }

  // One drawing for all changes until the next frame of the screen.
  function request(space) {
    if (space.waiting) return;
    space.waiting = requestAnimationFrame(() => { space.waiting = 0; draw(space); });
  }

  function draw(space) {
    const { camera, controls, root, renderer } = space;
    const distance = camera.position.distanceTo(controls.target);
    camera.near = 1e-3 * distance;
    camera.far = 1e5 * distance + 20 * EARTH_RADIUS * space.scale;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    sceneObjects.keepSize(space);
    renderer.render(root, camera);
    sceneLabels.draw(space, { mostNames: MOST_NAMES, chief: chiefNow(space) });
  }

  function picture(space) {
    draw(space);
    const canvas = document.createElement("canvas");
    canvas.width = space.overlay.width;
    canvas.height = space.overlay.height;
    const context = canvas.getContext("2d");
    context.fillStyle = space.style("--panel");
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(space.renderer.domElement, 0, 0, canvas.width, canvas.height);
    context.drawImage(space.overlay, 0, 0);
    return canvas.toDataURL("image/png");
  }

  return { create, MOST_NAMES };
})();
