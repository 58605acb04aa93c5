// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Draws a report's figures from the numbers in the page, and moves the satellites with the slider.
(() => {
  const { data, element, dark, config, style, numbers, axis, base, addCards, start } = page;
  const hidden = new Set();
  let now = data.end;
  let drawn = false;

  const colour = (index) => page.colour(index, data.satellites);

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
    const clock = numbers(flight.time), at = numbers(flight.position), count = flight.names.length;
    Object.assign(flight, {
      count, moments: clock.length, secondary: flight !== data.space[0], sameOrbits: data.sameOrbits,
      time: (moment) => clock[moment],
      place: (moment, satellite) => [...at.subarray((moment * count + satellite) * 3, (moment * count + satellite) * 3 + 3)],
      orbits: flight.orbits.map((orbit) => orbit && numbers(orbit)),
      chief: () => null, attitude: null,
    });
  }

  function nearest(flight) {
    const last = flight.moments - 1;
    if (flight.time(last) <= 0) return 0;
    return Math.max(0, Math.min(last, Math.round((now / flight.time(last)) * last)));
  }
  function linksAt(flight, moment) {
    let found = flight.links[0];
    for (const links of flight.links) if (links.moment <= moment) found = links;
    return found;
  }
  const shown = () => data.space.map((flight) => {
    const moment = nearest(flight);
    const { pairs, alive } = linksAt(flight, moment);
    return { moment, alive, links: pairs.map((pair) => ({ pair, text: pair.map((index) => flight.names[index]).join(" and ") })) };
  });

  let scene = null;
  function drawScene() {
    if (!data.space.length) return;
    if (!scene) {
      scene = formationScene.create(element("scene"), {
        three: libraries, colour, style, unit: () => ({ name: data.length, size: 1 }), dark: () => dark.matches,
      });
      page.scene = scene;
      scene.setFlights(data.space);
      measureByClicks(scene, data.space[0]);
    }
    scene.hidden.clear();
    for (const index of hidden) scene.hidden.add(index);
    scene.restyle();
    scene.show(shown());
    scene.draw();
  }

  // Two clicks on satellites measure their distance, one more ends that.
  function measureByClicks(scene) {
    let picked = [];
    scene.on("pick", (satellite) => {
      picked = picked.length === 2 || picked.includes(satellite) ? [] : [...picked, satellite];
      scene.measure(picked.length === 2 ? picked : []);
    });
    element("reset").addEventListener("click", () => scene.reset());
    element("picture").addEventListener("click", () => {
      const link = document.createElement("a");
      link.href = scene.picture();
      link.download = "formation.png";
      link.click();
    });
  }

  // ---- the slider

  let waiting = null;
  function show(time) {
    now = Math.max(0, Math.min(data.end, time));
    element("slider").value = String(Math.round((now / data.end) * 1000));
    element("moment").textContent = `${now.toFixed(data.end < 20 ? 2 : data.end < 200 ? 1 : 0)} ${data.clock}`;
    if (!drawn || waiting) return waiting;
    waiting = new Promise((done) => requestAnimationFrame(done)).then(() => {
      if (scene) scene.show(shown());
      const work = [];
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
    drawScene();
    return Promise.all(work);
  }

  addCards(data.charts, "charts");
  addCards(data.graphs, "graphs");
  element("graph").hidden = data.graphs.length === 0 && data.events.length === 0;
  show(now);
  start(draw, () => { drawn = true; });
})();
