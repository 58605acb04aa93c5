// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// What is in the scene: orbits, flown paths, trails, links, satellites, grid, the Earth with the chief's orbit.
const sceneObjects = (() => {
  const CIRCLE = 0, CROSS = 1, DIAMOND = 2;
  const BODY_PIXELS = 15;
  const MOST_PATH_POINTS = 40000;
  const MOST_TRAIL_POINTS = 8000;
  const vertexShader = `
    #include <common>
    #include <logdepthbuf_pars_vertex>
    attribute vec3 tint; attribute float symbol; attribute float size;
    uniform float ratio; varying vec3 vTint; varying float vSymbol; varying float vSize;
    void main() {
      vTint = tint; vSymbol = symbol; vSize = size * ratio;
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      gl_PointSize = vSize;
      #include <logdepthbuf_vertex>
    }`;
  const fragmentShader = `
    #include <common>
    #include <logdepthbuf_pars_fragment>
    uniform vec3 rim; varying vec3 vTint; varying float vSymbol; varying float vSize;
    void main() {
      #include <logdepthbuf_fragment>
      vec2 p = 2.0 * gl_PointCoord - 1.0;
      float edge = 2.5 / vSize;
      float round = length(p), square = abs(p.x) + abs(p.y);
      float far = vSymbol > 1.5 ? square : vSymbol > 0.5 ? max(abs(abs(p.x) - abs(p.y)) * 2.2, round * 1.05) : round;
      float cover = 1.0 - smoothstep(1.0 - edge, 1.0, far);
      if (cover < 0.02) discard;
      float inner = vSymbol > 0.5 && vSymbol < 1.5 ? 1.0 : 1.0 - smoothstep(0.74 - edge, 0.74, far);
      gl_FragColor = vec4(mix(rim, vTint, inner), cover);
      #include <colorspace_fragment>
    }`;

  function materials({ three }) {
    const line = (linewidth, options = {}) => new three.LineMaterial({
      linewidth, vertexColors: true, transparent: true, depthWrite: false, ...options });
    const dashes = { dashed: true, dashSize: 0.012, gapSize: 0.012, opacity: 0.9 };
    const found = {
      grid: line(1, { opacity: 0.8 }), path: line(1.3, { opacity: 0.42 }), secondPath: line(1.3, { ...dashes, opacity: 0.5 }),
      orbit: line(1.4, dashes), trail: line(3.2), secondTrail: line(2.2), link: line(1.8, { opacity: 0.85 }),
      sphere: line(1, { opacity: 0.5 }), coast: line(1.3, { opacity: 0.9 }), chief: line(1.5, dashes),
      points: new three.ShaderMaterial({
        vertexShader, fragmentShader, transparent: true, depthWrite: false,
        uniforms: { ratio: { value: 1 }, rim: { value: new three.Color() } } }),
      earth: new three.MeshLambertMaterial(), fill: new three.MeshBasicMaterial({
        transparent: true, opacity: 0.16, side: three.DoubleSide, depthWrite: false }),
    };
    found.lines = Object.values(found).filter((material) => material.isLineMaterial);
    return found;
  }

  function layers(space) {
    const { three, root, materials: known } = space;
    const group = (...members) => { const made = new three.Group(); for (const member of members) made.add(member); root.add(made); return made; };
    const line = (name) => {
      const made = new three.LineSegments2(new three.LineSegmentsGeometry(), known[name]);
      made.frustumCulled = false;
      return made;
    };
    const found = {};
    for (const name of ["grid", "path", "secondPath", "orbit", "trail", "secondTrail", "link", "sphere", "coast", "chief"]) {
      found[name] = line(name);
    }
    found.rotating = group(found.grid, found.path, found.secondPath, found.orbit);
    found.ball = new three.Mesh(new three.SphereGeometry(1, 96, 48), known.earth);
    found.globe = group(found.ball, found.sphere, found.coast);
    found.orbitAround = group(found.chief);
    found.light = new three.DirectionalLight(0xffffff, 2.2);
    root.add(found.trail, found.secondTrail, found.link, found.light, new three.AmbientLight(0xffffff, 1.1));
    found.points = new three.Points(new three.BufferGeometry(), known.points);
    found.points.frustumCulled = false;
    found.points.renderOrder = 5;
    found.fill = new three.Mesh(new three.BufferGeometry(), known.fill);
    found.fill.frustumCulled = false;
    found.bodies = group();
    root.add(found.fill, found.points);
    space.layers = found;
    drawGlobe(space);
    return found;
  }

  function setLines(space, name, positions, colours) {
    const line = space.layers[name];
    line.geometry.dispose();
    line.geometry = new space.three.LineSegmentsGeometry();
    line.visible = positions.length > 0;
    if (!positions.length) return;
    line.geometry.setPositions(positions);
    line.geometry.setColors(colours);
    if (line.material.dashed) line.computeLineDistances();
  }

  // Collects segments of lines; places that are not numbers leave gaps.
  function segments() {
    const positions = [], colours = [];
    const add = (from, to, first, last = first) => {
      if (![...from, ...to].every(Number.isFinite)) return;
      positions.push(...from, ...to);
      colours.push(first.r, first.g, first.b, last.r, last.g, last.b);
    };
    return { positions, colours, add };
  }

  const tint = (space, css) => new space.three.Color(css);

  function still(space, worldOf) {
    const { flights, style } = space;
    const before = space.focus;
    // Turned about the origin of the frame; the group is moved to the focus.
    space.focus = [0, 0, 0];
    const paths = { path: segments(), secondPath: segments() }, orbits = segments();
    const soft = tint(space, style("--soft"));
    flights.forEach((flight, number) => {
      const world = worldOf({ ...space, frame: "lvlh" }, flight, 0);
      flight.orbits.forEach((orbit, index) => {
        if (!orbit || space.hidden.has(index) || (number && flight.sameOrbits)) return;
        const own = soft.clone().lerp(tint(space, space.colour(index)), 0.6);
        for (let k = 0; k + 5 < orbit.length; k += 3) {
          orbits.add(world([orbit[k], orbit[k + 1], orbit[k + 2]]), world([orbit[k + 3], orbit[k + 4], orbit[k + 5]]), own);
        }
      });
      drawPaths(space, flight, world, flight.secondary ? paths.secondPath : paths.path);
    });
    for (const [name, found] of Object.entries(paths)) setLines(space, name, found.positions, found.colours);
    setLines(space, "orbit", orbits.positions, orbits.colours);
    drawGrid(space);
    drawChief(space);
    space.focus = before;
  }

  function drawPaths(space, flight, world, found) {
    const stride = Math.max(1, Math.ceil((flight.moments * flight.count) / MOST_PATH_POINTS));
    for (let index = 0; index < flight.count; index++) {
      if (space.hidden.has(index)) continue;
      const own = tint(space, space.colour(index));
      let before = flight.moments ? world(flight.place(0, index)) : null;
      for (let row = 0; row < flight.moments - 1;) {
        row = Math.min(row + stride, flight.moments - 1);
        const next = world(flight.place(row, index));
        found.add(before, next, own);
        before = next;
      }
    }
  }

  function drawGrid(space) {
    const found = segments(), grey = tint(space, space.style("--rule"));
    const [[x0, x1], [y0, y1], [z0]] = space.bounds;
    const world = (...place) => place.map((value) => value * space.scale);
    space.marks = space.bounds.map(([low, high]) => geometry.ticks(low / space.unit().size, high / space.unit().size, 5)
      .map((value) => value * space.unit().size));
    for (const x of [x0, ...space.marks[0], x1]) found.add(world(x, y0, z0), world(x, y1, z0), grey);
    for (const y of [y0, ...space.marks[1], y1]) found.add(world(x0, y, z0), world(x1, y, z0), grey);
    setLines(space, "grid", found.positions, found.colours);
  }

  function drawChief(space) {
    const flight = space.flights[0], found = segments(), soft = tint(space, space.style("--soft"));
    const orbit = flight && flight.chiefOrbit;
    for (let k = 0; orbit && k + 5 < orbit.length; k += 3) {
      found.add([...orbit.subarray(k, k + 3)].map((v) => v * space.scale), [...orbit.subarray(k + 3, k + 6)].map((v) => v * space.scale), soft);
    }
    setLines(space, "chief", found.positions, found.colours);
  }

  function drawGlobe(space) {
    const sphere = segments(), coast = segments();
    const { dark, three } = space;
    space.materials.earth.color = tint(space, dark() ? "#16304d" : "#bcd9f2");
    const net = tint(space, dark() ? "#33587f" : "#8fb9dd"), land = tint(space, dark() ? "#8fd0a6" : "#2c6e49");
    const at = (longitude, latitude, radius) => {
      const [a, b] = [(longitude * Math.PI) / 180, (latitude * Math.PI) / 180];
      return [radius * Math.cos(b) * Math.cos(a), radius * Math.cos(b) * Math.sin(a), radius * Math.sin(b)];
    };
    for (let a = 0; a < 360; a += 30) for (let b = -90; b < 90; b += 5) sphere.add(at(a, b, 1.001), at(a, b + 5, 1.001), net);
    for (let b = -60; b <= 60; b += 30) for (let a = 0; a < 360; a += 5) sphere.add(at(a, b, 1.001), at(a + 5, b, 1.001), net);
    for (const arc of geometry.coastlines(three.land)) {
      for (let k = 1; k < arc.length; k++) coast.add(at(...arc[k - 1], 1.002), at(...arc[k], 1.002), land);
    }
    setLines(space, "sphere", sphere.positions, sphere.colours);
    setLines(space, "coast", coast.positions, coast.colours);
  }

  function restyle(space) {
    drawGlobe(space);
  }

  // Moves what does not change with time to where it is about the focus.
  function placeStill(space, chief, earthRadius) {
    const { layers: found, focus, scale, frame } = space;
    const back = focus.map((value) => -value * scale);
    found.rotating.visible = frame === "lvlh";
    found.globe.visible = found.orbitAround.visible = frame === "inertial" && chief !== null;
    found.rotating.position.set(...back);
    found.orbitAround.position.set(...back);
    found.globe.position.set(...back);
    found.globe.scale.setScalar(earthRadius * scale);
    const flight = space.flights[0];
    found.globe.rotation.z = flight && flight.moments ? space.earthAngle(flight.time(space.shown[0].moment)) : 0;
    space.materials.points.depthTest = frame === "inertial";
  }

  function moving(space, worldOf, rotated) {
    const trails = { trail: segments(), secondTrail: segments() }, links = segments();
    const paper = tint(space, space.style("--panel"));
    space.points = [];
    space.edges = [];
    space.bodies = [];
    space.flights.forEach((flight, number) => {
      const shown = space.shown[number];
      if (!flight.moments || !shown) return;
      drawTrails(space, flight, shown, worldOf, flight.secondary ? trails.secondTrail : trails.trail, paper);
      const world = worldOf(space, flight, shown.moment);
      addSatellites(space, flight, number, shown, world, rotated);
      for (const link of shown.links) drawLink(space, flight, shown, link, world, links);
    });
    for (const [name, found] of Object.entries(trails)) setLines(space, name, found.positions, found.colours);
    setLines(space, "link", links.positions, links.colours);
    drawPoints(space);
    drawFill(space);
    drawBodies(space);
  }

  function drawTrails(space, flight, shown, worldOf, found, paper) {
    const first = Math.max(0, shown.moment - flight.trail);
    const stride = Math.max(1, Math.ceil(((shown.moment - first) * flight.count) / MOST_TRAIL_POINTS));
    const rows = [];
    // From the newest back, so that a trail ends at its satellite.
    for (let row = shown.moment; row >= first; row -= stride) rows.unshift(row);
    const worlds = space.frame === "lvlh" ? null : rows.map((row) => worldOf(space, flight, row));
    const fixed = worldOf(space, flight, shown.moment);
    for (let index = 0; index < flight.count; index++) {
      if (space.hidden.has(index)) continue;
      const own = tint(space, shown.alive[index] === false ? space.style("--soft") : space.colour(index));
      const shade = (row) => own.clone().lerp(paper, 0.85 * (1 - (row - first) / Math.max(1, shown.moment - first)));
      let before = null, colourBefore = null;
      rows.forEach((row, k) => {
        const place = (worlds ? worlds[k] : fixed)(flight.place(row, index)), colour = shade(row);
        if (before) found.add(before, place, colourBefore, colour);
        [before, colourBefore] = [place, colour];
      });
    }
  }

  function addSatellites(space, flight, number, shown, world, rotated) {
    for (let index = 0; index < flight.count; index++) {
      const place = flight.place(shown.moment, index);
      if (space.hidden.has(index) || !place.every(Number.isFinite)) continue;
      const lost = shown.alive[index] === false;
      const css = lost ? space.style("--soft") : space.colour(index);
      const attitude = flight.attitude ? flight.attitude(shown.moment, index) : null;
      const at = world(place);
      const turned = attitude !== null && !lost && attitude.every(Number.isFinite);
      const symbol = lost ? CROSS : flight.secondary ? DIAMOND : CIRCLE;
      space.points.push({ flight: number, satellite: index, name: flight.names[index] + flight.suffix, lost, place, at, css, symbol, size: turned ? 6 : flight.count > 60 ? 8 : 15 });
      if (turned) {
        const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => world(rotated(attitude, axis), true));
        const boresight = flight.boresights && flight.boresights[index];
        space.bodies.push({ at, axes, css, boresight: boresight && world(rotated(attitude, boresight), true) });
      }
    }
  }

  function drawLink(space, flight, shown, link, world, found) {
    const [receiver, sender] = link.pair;
    if (space.hidden.has(receiver) || space.hidden.has(sender)) return;
    const a = world(flight.place(shown.moment, receiver)), b = world(flight.place(shown.moment, sender));
    const colour = tint(space, link.css || space.style("--soft"));
    // An edge in one direction only is drawn at its receiver's half.
    const end = link.half ? a.map((value, k) => 0.5 * (value + b[k])) : b;
    found.add(a, end, colour);
    space.edges.push({ pair: link.pair, a, b, text: link.text });
  }

  function drawPoints(space) {
    const { three, layers: found, points } = space;
    found.points.geometry.dispose();
    const shape = new three.BufferGeometry();
    const set = (name, width, values) => shape.setAttribute(name, new three.BufferAttribute(new Float32Array(values), width));
    set("position", 3, points.flatMap((point) => point.at));
    set("tint", 3, points.flatMap((point) => tint(space, point.css).toArray()));
    set("symbol", 1, points.map((point) => point.symbol));
    set("size", 1, points.map((point) => point.size));
    found.points.geometry = shape;
    found.points.visible = points.length > 0;
    space.materials.points.uniforms.rim.value = tint(space, space.style("--panel"));
  }

  function drawFill(space) {
    const { three, layers: found, points } = space;
    const triangles = space.flights.map((flight, number) => (flight.triangle ? points.filter((point) => point.flight === number) : []));
    const corners = triangles.filter((own) => own.length === 3).flat().flatMap((point) => point.at);
    found.fill.geometry.dispose();
    found.fill.geometry = new three.BufferGeometry();
    found.fill.geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(corners), 3));
    found.fill.visible = corners.length > 0;
    space.materials.fill.color = tint(space, space.dark() ? "#F2B933" : "#E69F00");
  }

  // A small satellite with two panels, and the cone of its boresight, in the colour of the satellite.
  function drawBodies(space) {
    const { three, layers: found } = space;
    for (const child of [...found.bodies.children]) {
      child.traverse((part) => { if (part.isMesh) { part.geometry.dispose(); part.material.dispose(); } });
      found.bodies.remove(child);
    }
    for (const { at, axes, css, boresight } of space.bodies) {
      const own = new three.Group();
      const paint = (options) => new three.MeshLambertMaterial({ color: tint(space, css), ...options });
      own.add(new three.Mesh(new three.BoxGeometry(0.8, 0.8, 1.1), paint({})));
      for (const side of [-1, 1]) {
        const panel = new three.Mesh(new three.BoxGeometry(0.7, 1.5, 0.08), paint({ color: tint(space, "#27548a") }));
        panel.position.set(0, 1.3 * side, 0);
        own.add(panel);
      }
      const vector = (values) => new three.Vector3(...values);
      own.quaternion.setFromRotationMatrix(own.matrix.makeBasis(...axes.map(vector)));
      own.position.set(...at);
      found.bodies.add(own);
      if (boresight) found.bodies.add(beam(space, at, vector(boresight), paint({ transparent: true, opacity: 0.3, depthWrite: false })));
    }
  }

  function beam(space, at, direction, material) {
    const { three } = space;
    const shape = new three.ConeGeometry(0.75, 4.5, 24, 1, true);
    shape.translate(0, -2.25, 0);
    const cone = new three.Mesh(shape, material);
    material.side = three.DoubleSide;
    cone.quaternion.setFromUnitVectors(new three.Vector3(0, -1, 0), direction.normalize());
    cone.position.set(...at);
    return cone;
  }

  // Satellites have the same size on the screen at any distance; the light comes from beside the eye.
  function keepSize(space) {
    const { camera, layers: found, sizes } = space;
    const perPixel = (2 * Math.tan((camera.fov * Math.PI) / 360)) / sizes[1];
    for (const child of found.bodies.children) child.scale.setScalar(BODY_PIXELS * perPixel * camera.position.distanceTo(child.position));
    found.light.position.copy(camera.position).add(new space.three.Vector3(0.3, 0.2, 0.8).multiplyScalar(camera.position.length()));
  }

  return { materials, layers, still, moving, placeStill, restyle, keepSize };
})();
