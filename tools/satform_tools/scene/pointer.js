// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Pointer and keys of the scene: what is under the pointer, clicks on satellites and links, turning by the arrow keys.
const scenePointer = (() => {
  const REACH = 16;
  const EDGE_REACH = 7;
  const STEP = 0.12;

  function nearest(space, x, y) {
    let found = null, least = REACH;
    for (const point of space.points) {
      const away = Math.hypot(point.x - x, point.y - y);
      if (away < least) [found, least] = [point, away];
    }
    return found;
  }

  function nearestEdge(space, x, y) {
    let found = null, least = EDGE_REACH;
    for (const edge of space.edges) {
      if (!edge.from || !edge.to) continue;
      const along = [edge.to[0] - edge.from[0], edge.to[1] - edge.from[1]];
      const length = along[0] ** 2 + along[1] ** 2 || 1;
      const part = Math.max(0, Math.min(1, ((x - edge.from[0]) * along[0] + (y - edge.from[1]) * along[1]) / length));
      const away = Math.hypot(edge.from[0] + part * along[0] - x, edge.from[1] + part * along[1] - y);
      if (away < least) [found, least] = [{ ...edge, middle: [x, y] }, away];
    }
    return found;
  }

  function attach(space, { request, turn, zoom }) {
    const canvas = space.renderer.domElement, { container } = space;
    const place = (event) => {
      const { left, top } = canvas.getBoundingClientRect();
      return [event.clientX - left, event.clientY - top];
    };
    let pressed = null;
    canvas.addEventListener("pointerdown", (event) => { pressed = place(event); });
    canvas.addEventListener("pointermove", (event) => {
      const at = place(event);
      const before = [space.hover, space.hoveredEdge];
      space.hover = nearest(space, ...at);
      space.hoveredEdge = space.hover ? null : nearestEdge(space, ...at);
      canvas.style.cursor = space.hover || (space.hoveredEdge && space.listeners.edge) ? "pointer" : "grab";
      if (before[0] !== space.hover || before[1] !== space.hoveredEdge) request(space);
    });
    canvas.addEventListener("pointerleave", () => { space.hover = space.hoveredEdge = null; request(space); });
    canvas.addEventListener("click", (event) => {
      const at = place(event);
      if (pressed && Math.hypot(at[0] - pressed[0], at[1] - pressed[1]) > 4) return;
      const point = nearest(space, ...at), edge = point ? null : nearestEdge(space, ...at);
      if (point) space.listeners.pick(point.satellite, event);
      else if (edge && space.listeners.edge) space.listeners.edge(edge.pair);
    });
    container.addEventListener("keydown", (event) => {
      const moves = {
        ArrowLeft: () => turn(-STEP, 0), ArrowRight: () => turn(STEP, 0), ArrowUp: () => turn(0, STEP), ArrowDown: () => turn(0, -STEP),
        "+": () => zoom(0.8), "=": () => zoom(0.8), "-": () => zoom(1.25),
      };
      const move = moves[event.key];
      if (!move || event.target !== container || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      move();
    });
  }

  return { attach };
})();
