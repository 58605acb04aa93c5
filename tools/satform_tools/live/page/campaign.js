// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// The page of a campaign under way: success rate over the cases flown, and the distribution of each figure.
const campaignProgress = (() => {
  const { element, dark, style } = page;
  const HEIGHT = 190;
  const state = { about: null, status: { flown: 0 }, rates: [[], [], [], []], cards: new Map() };
  const short = (value) => (Number.isFinite(value) ? (value !== 0 && (Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3) ? value.toExponential(2) : String(Number(value.toPrecision(4)))) : "–");
  const percent = (value) => `${Number((100 * value).toPrecision(4))}`;

  function take(message) {
    if (message.kind === "formation") {
      Object.assign(state, { about: message.formation, rates: [[], [], [], []] });
      return;
    }
    if (message.status) state.status = message.status;
    if (message.rows) append(message.rows);
  }

  function append({ count, columns }) {
    const bytes = (text) => Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0)).buffer;
    const flown = new Float64Array(bytes(columns.time)), rate = new Float32Array(bytes(columns.rate));
    for (let row = 0; row < count; row++) {
      state.rates[0].push(flown[row]);
      // Rate, then the limits of its interval.
      for (let k = 0; k < 3; k++) state.rates[k + 1].push(Number.isFinite(rate[3 * row + k]) ? 100 * rate[3 * row + k] : null);
    }
    // The server thins its rows; so does the page.
    if (state.rates[0].length > state.about.most_rows) state.rates = state.rates.map((values) => values.filter((_, row) => row % 2 === 0));
  }

  function draw() {
    const { about, status } = state;
    if (!about) return;
    element("title").textContent = about.title;
    element("subtitle").textContent = `${about.name}, in ${about.folder}`;
    element("phase").className = `status ${status.over ? (status.expectations.every(({ met }) => met) ? "met" : "missed") : "plain"}`;
    element("phase").textContent = status.over ? (status.flown === about.cases ? "all cases are flown" : "ended early") : "under way";
    element("progress").max = about.cases;
    element("progress").value = status.flown;
    facts();
    if (state.rates[0].length) rateChart();
    for (const found of status.histograms || []) histogram(found);
    table("expectations", (status.expectations || []).map(({ label, allowed, found, met }) => [label, allowed, found, met ? "passed" : "missed"]), [2]);
    table("reasons", status.reasons || [], [0]);
    document.documentElement.dataset.drawn = "yes";
  }

  function facts() {
    const { about, status } = state;
    const rate = status.rate, interval = rate && rate[1] !== null ? ` (${percent(rate[1])} to ${percent(rate[2])} %)` : "";
    const pairs = [["Cases", `${status.flown} of ${about.cases} flown`]];
    if (rate) pairs.push(["Success", `${status.succeeded} of ${status.flown} cases`], ["Success rate", `${percent(rate[0])} %${interval}`]);
    element("facts").replaceChildren(...pairs.map(([name, value]) => {
      const box = document.createElement("div"), term = document.createElement("dt"), text = document.createElement("dd");
      [term.textContent, text.textContent] = [name, value];
      box.append(term, text);
      return box;
    }));
  }

  function table(name, rows, numeric) {
    element(`${name}-section`).hidden = !rows.length;
    element(name).tBodies[0].replaceChildren(...rows.map((row) => {
      const line = document.createElement("tr");
      if (row.at(-1) === "missed") line.className = "missed";
      line.append(...row.map((value, column) => {
        const cell = document.createElement("td");
        cell.textContent = String(value);
        if (numeric.includes(column)) cell.className = "number";
        return cell;
      }));
      return line;
    }));
  }

  // A frame with heading and chart; made once, then filled again.
  function card(key, title, reading, data, options) {
    let found = state.cards.get(key);
    if (!found) {
      const frame = document.createElement("div"), heading = document.createElement("h3"), value = document.createElement("span"), box = document.createElement("div");
      frame.className = "figure";
      box.className = "chart";
      heading.append(title, value);
      frame.append(heading, box);
      element("charts").append(frame);
      found = { value, box, plot: null };
      state.cards.set(key, found);
      new ResizeObserver(() => { if (found.plot && box.clientWidth) found.plot.setSize({ width: box.clientWidth, height: HEIGHT }); }).observe(box);
    }
    found.value.textContent = reading;
    if (found.plot && found.plot.limits === options.limits) return found.plot.setData(data);
    found.plot?.destroy();
    found.plot = new uPlot({ width: found.box.clientWidth || 320, height: HEIGHT, legend: { show: false }, padding: [8, 24, 0, 0], ...options }, data, found.box);
    found.plot.limits = options.limits;
  }

  const axis = (more) => ({
    stroke: () => style("--soft"), grid: { stroke: () => style("--grid"), width: 1 }, ticks: { show: false },
    font: `11px ${getComputedStyle(document.body).fontFamily}`, ...more,
  });
  const faint = (name) => `color-mix(in srgb, ${style(name)} 22%, transparent)`;
  const line = (name, more = {}) => ({ stroke: () => style(name), width: 1.6, points: { show: false }, ...more });

  function rateChart() {
    const last = state.status.rate;
    card("rate", "Success rate over cases flown", last ? `${percent(last[0])} %` : "", state.rates, {
      cursor: { drag: { x: false, y: false }, y: false },
      scales: { x: { time: false }, y: { range: (_, low, high) => [Math.max(0, Math.min(low, 99) - 2), Math.min(100, high + 1)] } },
      axes: [axis({ size: 30, values: (_, ticks) => ticks.map(short) }), axis({ size: 50, values: (_, ticks) => ticks.map((value) => `${short(value)} %`) })],
      series: [{}, line("--accent", { points: { show: (plot) => plot.data[0].length < 20, size: 5 } }), line("--accent", { width: 0.6 }), line("--accent", { width: 0.6 })],
      bands: [{ series: [3, 2], fill: () => faint("--accent") }],
    });
  }

  // Counts between edges as a filled outline; those of failed cases before it.
  function histogram({ name, unit, cases, median, edges, counts, failed, logarithmic, limits }) {
    const steps = (values) => [...values, values.at(-1)];
    const paths = uPlot.paths.stepped({ align: 1 });
    const known = state.cards.get(`figure ${name}`)?.plot?.limits;
    const same = known && JSON.stringify(known) === JSON.stringify([limits, logarithmic]) ? known : [limits, logarithmic];
    card(`figure ${name}`, unit ? `${name} [${unit}]` : name, `median ${short(median)}, ${cases} cases`, [edges, steps(counts), steps(failed)], {
      limits: same,
      cursor: { drag: { x: false, y: false }, y: false },
      scales: { x: { time: false, distr: logarithmic ? 3 : 1 }, y: { range: (_, low, high) => [0, Math.max(1, high * 1.06)] } },
      axes: [axis({ size: 30, space: 60, values: (_, ticks) => ticks.map((value) => (value === null ? "" : short(value))) }), axis({ size: 50, values: (_, ticks) => ticks.map(short) })],
      series: [{}, line("--accent", { paths, fill: () => faint("--accent") }), line("--bad", { paths, fill: () => faint("--bad") })],
      hooks: { draw: [(plot) => drawLimits(plot, limits)] },
    });
  }

  function drawLimits(plot, limits) {
    const { ctx, bbox } = plot;
    for (const { value } of limits) {
      const x = plot.valToPos(value, "x", true);
      if (!(x >= bbox.left && x <= bbox.left + bbox.width)) continue;
      ctx.save();
      ctx.strokeStyle = style("--bad");
      ctx.setLineDash([5, 4]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.restore();
    }
  }

  dark.addEventListener("change", () => state.cards.forEach(({ plot }) => plot?.redraw()));
  liveConnection.open({ take, draw });
  return { state };
})();
