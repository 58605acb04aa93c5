// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Draws a report's figures from the numbers in the page, and moves the satellites with the slider.
(() => {
  const { data, element, dark, config, palettes, style, numbers, axis, base, addCards, start } = page;
  const hidden = new Set();
  let now = data.end;
  let drawn = false;

  const colour = (index) => {
    const palette = palettes[dark.matches ? "dark" : "light"];
    if (index === null) return style("--ink");
    if (data.satellites <= palette.length) return palette[index % palette.length];
    return `hsl(${Math.round((330 * index) / data.satellites)}, 65%, ${dark.matches ? 65 : 42}%)`;
  };

  // ---- over time

  // Whole decades where there are several, so that their labels have room.
  function decades(chart) {
    let low = Infinity;
    let high = 0;
    for (const line of chart.lines) {
      for (const value of numbers(line.values)) {
        if (value > 0) [low, high] = [Math.min(low, value), Math.max(high, value)];
      }
    }
    const count = Math.log10(high / low);
    return count > 1.7 ? { dtick: Math.ceil(count / 7) } : {};
  }

  const bars = (chart) => chart.key === "alive" || chart.key === "timeline";

  function traces(chart) {
    return chart.lines.map((line, index) => ({
      type: "scatter",
      mode: "lines",
      name: line.name,
      x: numbers(line.time),
      y: numbers(line.values),
      connectgaps: false,
      visible: !hidden.has(line.satellite),
      meta: { satellite: line.satellite },
      showlegend: line.satellite === null && chart.lines.length > 1,
      hovertemplate: bars(chart) ? "%{x:.6~g}" : "%{y:.5~g}",
      line: {
        color: line.satellite === null && chart.lines.length > 1
          ? colour(line.colour) : colour(line.satellite),
        width: bars(chart) ? 9 : line.dash === "solid" ? 1.6 : 1.3,
        dash: line.dash,
        shape: chart.steps ? "hv" : "linear",
      },
    }));
  }

  const cursor = () => ({
    type: "line", xref: "x", yref: "paper", x0: now, x1: now, y0: 0, y1: 1,
    line: { color: style("--soft"), width: 1 },
  });
  const marks = () => data.events.map((event, index) => ({
    type: "line", xref: "x", yref: "paper", x0: event.time, x1: event.time, y0: 0, y1: 1,
    line: { color: style(event.kind === "loss" || event.kind === "phase" ? "--bad" : "--partial"), width: 1, dash: "dot" },
    label: { text: String(index + 1), textposition: "end", font: { size: 10, color: style("--soft") } },
  }));

  function layout(chart) {
    const vertical = axis(chart.axis);
    if (chart.logarithmic) Object.assign(vertical, { type: "log", exponentformat: "power" }, decades(chart));
    else vertical.tickformat = ",~g";
    if (bars(chart)) {
      const names = chart.lines.map((line) => line.name);
      Object.assign(vertical, {
        tickvals: names.map((_, row) => row), ticktext: names, automargin: true, range: [names.length - 0.4, -0.6], showgrid: false,
      });
    }
    if (chart.key === "connectivity") vertical.rangemode = "tozero";
    return {
      ...base(),
      margin: { l: 58, r: 14, t: 30, b: 40 },
      xaxis: { ...axis(`time [${data.clock}]`), range: [0, data.end], showspikes: false },
      yaxis: vertical,
      hovermode: "x unified",
      legend: { orientation: "h", x: 0, xanchor: "left", y: 1.01, yanchor: "bottom", font: { size: 11 } },
      shapes: [cursor(), ...marks()],
      uirevision: chart.key,
    };
  }

  const everyChart = () => [...data.charts, ...data.graphs];

  function chips() {
    const names = data.names;
    element("chips").replaceChildren();
    for (const key of data.keys) {
      const span = document.createElement("span");
      span.className = "key";
      span.textContent = key;
      element("chips").append(span);
    }
    if (names.length < 2 || names.length > 24) return;
    names.forEach((name, index) => {
      const button = document.createElement("button");
      const line = document.createElement("i");
      button.type = "button";
      button.setAttribute("aria-pressed", String(!hidden.has(index)));
      line.style.background = colour(index);
      button.append(line, name);
      button.addEventListener("click", () => {
        if (!hidden.delete(index)) hidden.add(index);
        draw();
      });
      element("chips").append(button);
    });
  }

  // ---- in space

  for (const flight of data.space) {
    flight.clock = numbers(flight.time);
    flight.at = numbers(flight.position);
    flight.moments = flight.clock.length;
    flight.count = flight.names.length;
  }

  function column(flight, satellite, component, from, to) {
    const values = new Float32Array(to - from);
    for (let row = from; row < to; row++) values[row - from] = flight.at[(row * flight.count + satellite) * 3 + component];
    return values;
  }
  const path = (flight, satellite, from, to) => ({
    x: column(flight, satellite, 0, from, to),
    y: column(flight, satellite, 1, from, to),
    z: column(flight, satellite, 2, from, to),
  });

  function nearest(flight) {
    const last = flight.moments - 1;
    if (flight.clock[last] <= 0) return 0;
    return Math.max(0, Math.min(last, Math.round((now / flight.clock[last]) * last)));
  }
  function linksAt(flight, moment) {
    let found = flight.links[0];
    for (const links of flight.links) if (links.moment <= moment) found = links;
    return found;
  }

  function links(flight, moment) {
    const all = { x: [], y: [], z: [] };
    for (const pair of linksAt(flight, moment).pairs) {
      if (pair.some((satellite) => hidden.has(satellite))) continue;
      ["x", "y", "z"].forEach((name, component) => {
        for (const satellite of pair) all[name].push(flight.at[(moment * flight.count + satellite) * 3 + component]);
        all[name].push(null);
      });
    }
    return all;
  }

  // Of each flight the traces that move, in the order in which they are drawn.
  function moving(flight, number) {
    const moment = nearest(flight);
    const shown = [...Array(flight.count).keys()];
    const alive = linksAt(flight, moment).alive;
    const parts = shown.map((satellite) => ({
      ...path(flight, satellite, Math.max(0, moment - flight.trail), moment + 1),
      type: "scatter3d", mode: "lines", visible: !hidden.has(satellite), hoverinfo: "skip", showlegend: false,
      line: { color: colour(satellite), width: number ? 3 : 5 },
    }));
    parts.push({
      ...links(flight, moment), type: "scatter3d", mode: "lines", hoverinfo: "skip", showlegend: false,
      connectgaps: false, line: { color: style("--soft"), width: 2.5 },
    });
    const here = path(flight, 0, moment, moment + 1);
    for (const name of ["x", "y", "z"]) here[name] = new Float32Array(flight.count);
    shown.forEach((satellite) => ["x", "y", "z"].forEach((name, component) => {
      here[name][satellite] = hidden.has(satellite) ? NaN : flight.at[(moment * flight.count + satellite) * 3 + component];
    }));
    parts.push({
      ...here, type: "scatter3d", mode: "markers", showlegend: false,
      text: flight.names.map((name, satellite) => name + flight.suffix + (alive[satellite] ? "" : ", lost")),
      hovertemplate: `%{text}<br>x %{x:.6~g} ${data.length}<br>y %{y:.6~g} ${data.length}<br>z %{z:.6~g} ${data.length}<extra></extra>`,
      marker: {
        size: flight.count > 60 ? 3 : 7, symbol: shown.map((satellite) => alive[satellite] ? (number ? "diamond" : "circle") : "x"),
        color: shown.map((satellite) => colour(satellite)), line: { color: style("--panel"), width: 1 },
      },
    });
    if (flight.triangle) {
      parts.push({
        ...here, type: "mesh3d", i: [0], j: [1], k: [2], hoverinfo: "skip", flatshading: true,
        color: dark.matches ? "#F2B933" : "#E69F00", opacity: hidden.size ? 0 : 0.22,
        lighting: { ambient: 1, diffuse: 0, specular: 0 },
      });
    }
    return parts;
  }

  function still(flight, number) {
    const parts = [];
    flight.orbits.forEach((orbit, satellite) => {
      if (!orbit || (number && data.sameOrbits)) return;
      const points = numbers(orbit);
      const part = (component) => points.filter((_, index) => index % 3 === component);
      parts.push({
        x: part(0), y: part(1), z: part(2), type: "scatter3d", mode: "lines", hoverinfo: "skip", showlegend: false,
        visible: !hidden.has(satellite), opacity: 0.75, line: { color: style("--soft"), width: 1.5, dash: "dot" },
      });
    });
    for (let satellite = 0; satellite < flight.count; satellite++) {
      parts.push({
        ...path(flight, satellite, 0, flight.moments), type: "scatter3d", mode: "lines", hoverinfo: "skip",
        showlegend: false, visible: !hidden.has(satellite), opacity: number ? 0.35 : 0.5,
        line: { color: colour(satellite), width: 1.5, dash: number ? "dash" : "solid" },
      });
    }
    return parts;
  }

  // One scale on all axes, as large as the window allows.
  function sides() {
    const lengths = data.box.map(([low, high]) => high - low);
    const room = element("scene").clientWidth / element("scene").clientHeight;
    const scale = Math.min(1.75, 1.2 * room) / Math.max(...lengths);
    return { x: lengths[0] * scale, y: lengths[1] * scale, z: lengths[2] * scale };
  }

  let movable = [];
  function scene() {
    if (!data.space.length) return null;
    const chief = {
      x: [0], y: [0], z: [0], type: "scatter3d", mode: "markers", showlegend: false, text: ["chief"],
      hovertemplate: "%{text}<extra></extra>", marker: { symbol: "cross", size: 4, color: style("--ink") },
    };
    const all = [chief];
    movable = [];
    data.space.forEach((flight, number) => all.push(...still(flight, number)));
    data.space.forEach((flight, number) => {
      const parts = moving(flight, number);
      movable.push(parts.map((_, index) => all.length + index));
      all.push(...parts);
    });
    const side = (title, range) => ({
      title: { text: `${title} [${data.length}]`, font: { size: 12 } }, range, autorange: false, nticks: 6,
      gridcolor: style("--rule"), zerolinecolor: style("--rule"), showbackground: false, color: style("--soft"),
      tickfont: { size: 10 }, showspikes: false,
    });
    return Plotly.react(element("scene"), all, {
      ...base(),
      margin: { l: 0, r: 0, t: 0, b: 0 },
      uirevision: "scene",
      scene: {
        aspectmode: "manual", aspectratio: sides(), dragmode: "orbit", uirevision: "scene",
        camera: { eye: { x: 1.25, y: 0.8, z: 0.62 }, projection: { type: "orthographic" } },
        xaxis: side("radial x", data.box[0]),
        yaxis: side("along-track y", data.box[1]),
        zaxis: side("cross-track z", data.box[2]),
      },
    }, config(["toImage", "resetCameraDefault3d"]));
  }

  // ---- the slider

  let waiting = null;
  function show(time) {
    now = Math.max(0, Math.min(data.end, time));
    element("slider").value = String(Math.round((now / data.end) * 1000));
    element("moment").textContent = `${now.toFixed(data.end < 20 ? 2 : data.end < 200 ? 1 : 0)} ${data.clock}`;
    if (!drawn || waiting) return waiting;
    waiting = new Promise((done) => requestAnimationFrame(done)).then(() => {
      const work = data.space.map((flight, number) => {
        const parts = moving(flight, number);
        const part = (name) => parts.map((trace) => trace[name]);
        const symbols = parts.map((trace) => (trace.marker ? trace.marker.symbol : undefined));
        const change = { x: part("x"), y: part("y"), z: part("z") };
        if (flight.links.length > 1) Object.assign(change, { "marker.symbol": symbols, text: part("text") });
        return Plotly.restyle(element("scene"), change, movable[number]);
      });
      for (const chart of everyChart()) {
        work.push(Plotly.relayout(chart.plot, { "shapes[0].x0": now, "shapes[0].x1": now }));
      }
      return Promise.all(work);
    }).then(() => { waiting = null; });
    return waiting;
  }

  let playing = false;
  let before = 0;
  function tick(stamp) {
    if (!playing) return;
    // A flight is shown in twenty seconds.
    const next = now + ((stamp - before) / 20000) * data.end;
    before = stamp;
    Promise.resolve(show(next)).then(() => (next >= data.end ? pause() : requestAnimationFrame(tick)));
  }
  function pause() {
    playing = false;
    element("play").textContent = "▶";
    element("play").setAttribute("aria-label", "Play");
  }
  element("play").addEventListener("click", () => {
    if (playing) return pause();
    playing = true;
    if (now >= data.end) now = 0;
    element("play").textContent = "❚❚";
    element("play").setAttribute("aria-label", "Pause");
    before = performance.now();
    requestAnimationFrame(tick);
  });
  element("slider").addEventListener("input", () => {
    pause();
    show((Number(element("slider").value) / 1000) * data.end);
  });

  // ---- everything

  function draw() {
    chips();
    const work = everyChart().map((chart) => Plotly.react(chart.plot, traces(chart), layout(chart), config(["toImage", "resetScale2d"])));
    return Promise.all([scene(), ...work]);
  }

  addCards(data.charts, "charts");
  addCards(data.graphs, "graphs");
  element("graph").hidden = data.graphs.length === 0 && data.events.length === 0;
  show(now);
  start(draw, () => { drawn = true; });
})();
