// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// The live page: receives a flight over a WebSocket, and shows the time that the slider is at.
const live = (() => {
  const { element, dark, style } = page;
  const TRAIL = 0.25;
  const FIGURES_EVERY = 400;
  const store = liveStore.create();
  const state = { scene: null, charts: null, hands: null, connection: null, now: 0, following: true, playing: false, measured: [], dueFigures: 0, grown: 0 };
  const colour = (index, count = store.formation.names.length) => page.colour(index, count);

  function take(message) {
    if (message.kind === "formation") begin(message.formation);
    else store.take(message);
  }

  function begin(formation) {
    const same = store.formation && store.formation.name === formation.name && store.formation.names.join() === formation.names.join();
    store.begin(formation);
    element("title").textContent = formation.title;
    element("subtitle").textContent = formation.subtitle || formation.name;
    document.title = `${formation.name} · satform`;
    fillSelects();
    state.charts?.destroy();
    state.charts = liveCharts.create(element("charts"), { store, colour, style, clock: clock(), seek, hidden: new Set() });
    if (formation.control) state.hands = liveHands.create({ send: (request) => state.connection.send(request), names: formation.names });
    element("hands").hidden = !formation.control;
    if (!same) Object.assign(state, { following: true, begun: false });
    state.restart = true;
  }

  // ---- time

  function clock() {
    const { step, last_step: last } = store.formation, duration = step * last;
    const [name, size] = duration <= 300 ? ["s", 1] : duration <= 6 * 3600 ? ["min", 60] : duration <= 4 * 86400 ? ["h", 3600] : ["d", 86400];
    const digits = Math.max(0, Math.min(3, Math.ceil(-Math.log10(duration / size / 1000))));
    return { name, size, text: (time) => `${(time / size).toFixed(digits)} ${name}` };
  }

  function seek(time) {
    pause();
    state.following = false;
    show(time);
  }

  function show(time) {
    const last = store.lastTime();
    state.now = Math.max(store.rows ? store.time(0) : 0, Math.min(last, time));
    element("slider").value = String(last > 0 ? Math.round((state.now / last) * 1000) : 1000);
    element("slider").setAttribute("aria-valuetext", clock().text(state.now));
    element("moment").textContent = clock().text(state.now);
    element("now").setAttribute("aria-pressed", String(state.following));
    drawMoment();
  }

  function tick(stamp) {
    if (!state.playing) return;
    // What was flown so far is shown in twenty seconds.
    const next = state.now + ((stamp - state.before) / 20000) * store.lastTime();
    state.before = stamp;
    show(next);
    if (next >= store.lastTime()) { pause(); now(); } else requestAnimationFrame(tick);
  }

  function pause() {
    state.playing = false;
    element("play").textContent = "▶";
    element("play").setAttribute("aria-label", "Play");
  }

  function play() {
    if (state.playing) return pause();
    state.playing = true;
    state.following = false;
    if (state.now >= store.lastTime()) state.now = store.rows ? store.time(0) : 0;
    element("play").textContent = "❚❚";
    element("play").setAttribute("aria-label", "Pause");
    state.before = performance.now();
    requestAnimationFrame(tick);
  }

  function now() {
    pause();
    state.following = true;
    show(store.lastTime());
  }

  // ---- what is shown

  function flight() {
    const { formation, columns } = store, count = formation.names.length;
    const chiefKnown = columns.chief && Number.isFinite(columns.chief.data[0]);
    const period = formation.period || store.lastTime();
    const span = TRAIL * Math.min(period, Math.max(store.lastTime(), 1e-9));
    return {
      names: formation.names, suffix: "", count, secondary: false, sameOrbits: true, triangle: count === 3,
      get moments() { return store.rows; },
      time: (row) => store.time(row),
      place: (row, index) => [...store.values("position", row).subarray(3 * index, 3 * index + 3)],
      orbits: formation.orbits, boresights: formation.boresights,
      attitude: columns.attitude ? (row, index) => [...store.values("attitude", row).subarray(4 * index, 4 * index + 4)] : null,
      chief: (row) => (chiefKnown ? store.values("chief", row) : null),
      chiefOrbit: formation.chiefOrbit,
      get trail() { return Math.max(2, state.row - store.rowAt(store.time(state.row) - Math.max(span, TRAIL * Math.min(period, store.lastTime())))); },
    };
  }

  function setScene() {
    if (!state.scene) {
      state.scene = formationScene.create(element("scene"), { three: libraries, colour, style, unit: lengthUnit, dark: () => dark.matches });
      state.scene.on("pick", picked);
      if (store.formation.control) state.scene.on("edge", (pair) => state.hands.edge(pair, false));
    }
    state.row = store.rows - 1;
    state.scene.setEarthAngle((time) => store.formation.earth_angle + store.formation.earth_rate * time);
    state.scene.setFlights([flight()]);
    state.grown = performance.now();
  }

  function lengthUnit() {
    const { formation, columns, rows } = store;
    let most = 0;
    for (const orbit of formation.orbits) for (const value of orbit || []) most = Math.max(most, Math.abs(value));
    if (!most && columns.position) for (const value of columns.position.data.subarray(0, rows * columns.position.width)) if (Math.abs(value) > most) most = Math.abs(value);
    return most >= 2000 ? { name: "km", size: 1000 } : { name: "m", size: 1 };
  }

  function arrived() {
    if (!store.rows) return describe();
    if (state.restart || !state.begun) {
      setScene();
      state.restart = false;
      state.begun = true;
    }
    if (performance.now() - state.grown > 2000 && !store.status.over) {
      state.grown = performance.now();
      state.scene.grow();
    }
    if (state.following) show(store.lastTime());
    else show(state.now);
    figures();
  }

  // Charts and tables, a few times a second.
  function figures() {
    if (state.dueFigures) return;
    state.dueFigures = setTimeout(() => {
      state.dueFigures = 0;
      state.charts.update();
      state.charts.mark(state.now);
      describe();
      livePanels.events(store, clock(), seek);
      document.documentElement.dataset.drawn = "yes";
    }, document.documentElement.dataset.drawn ? FIGURES_EVERY : 0);
  }

  function drawMoment() {
    if (!store.rows || !state.scene) return;
    state.row = store.rowAt(state.now);
    const graph = store.graphAt(state.now);
    const chosen = [state.scene.followed(), ...state.measured].filter((index) => index !== null);
    const states = livePanels.health(store, state.row, graph.alive, { colour, follow, chosen });
    state.scene.show([{ moment: state.row, alive: states.map((one) => one !== "lost"), links: graph.pairs.map((pair) => link(pair, states)) }]);
    state.hands?.graph((store.graphs.at(-1) || graph).pairs);
    distance();
    if (!state.following) state.charts.mark(state.now);
  }

  // A link by the age of the newest message in steps, by lost messages, and by lost satellites.
  function link(pair, states) {
    const { formation } = store, index = formation.edgeIndex.get(pair.join());
    const value = (name) => (index === undefined ? NaN : store.values(name, state.row)[index]);
    const age = value("age"), loss = value("loss");
    const names = `${formation.names[pair[0]]} receives from ${formation.names[pair[1]]}`;
    const parts = [Number.isFinite(age) ? `newest message ${livePanels.shown(age)} s old` : "", Number.isFinite(loss) ? `${(100 * loss).toFixed(1)} % lost` : ""];
    const stale = Math.max(Number.isFinite(age) ? (age / formation.step - 2) / 18 : 0, Number.isFinite(loss) ? loss : 0);
    const css = states[pair[0]] === "lost" ? style("--soft") : states[pair[1]] === "lost" ? style("--dead") : mixed(Math.max(0, Math.min(1, stale)));
    return { pair, half: true, css, text: [names, ...parts.filter(Boolean)].join(", ") };
  }

  function mixed(part) {
    const [a, b] = ["--fresh", "--stale"].map((name) => style(name).match(/[0-9a-f]{2}/gi).map((hex) => parseInt(hex, 16)));
    return `rgb(${a.map((value, k) => Math.round(value + part * (b[k] - value))).join(",")})`;
  }

  function describe() {
    const { status, formation } = store;
    const kind = status.conclusion?.kind || (status.phase === "aborted" ? "missed" : status.phase === "paused" ? "partial" : status.phase === "finished" ? "met" : "plain");
    element("phase").className = `status ${kind}`;
    element("phase").textContent = status.conclusion?.text || status.phase || "connecting";
    const speed = status.steps_per_second;
    livePanels.facts([
      ["Step", `${status.step ?? 0} of ${formation.last_step}`],
      ["Time", clock().text(status.time ?? 0)],
      ...(Number.isFinite(speed) ? [["Speed", `${speed.toFixed(speed < 10 ? 1 : 0)} steps/s, ${livePanels.shown(speed * formation.step)} × real time`]] : []),
    ]);
  }

  // ---- choices

  function fillSelects() {
    for (const id of ["follow", "measure-from", "measure-to"]) {
      const select = element(id), first = select.options[0].text;
      select.replaceChildren(new Option(first, ""), ...store.formation.names.map((name, index) => new Option(name, String(index))));
    }
  }

  function follow(index) {
    element("follow").value = index === null ? "" : String(index);
    const followed = index === null ? null : Number(index);
    state.scene.follow(followed);
    if (state.scene.frame() === "inertial") state.scene.reaim();
  }

  function picked(satellite) {
    const chosen = state.measured.length === 2 || state.measured.includes(satellite) ? [] : [...state.measured, satellite];
    measure(chosen);
  }

  function measure(pair) {
    state.measured = pair;
    [element("measure-from").value, element("measure-to").value] = [pair[0] ?? "", pair[1] ?? ""];
    state.scene.measure(pair.length === 2 ? pair : []);
    distance();
  }

  function distance() {
    const [first, second] = state.measured;
    if (second === undefined) { element("distance").textContent = ""; return; }
    const place = (index) => [...store.values("position", state.row).subarray(3 * index, 3 * index + 3)];
    const { size, name } = lengthUnit();
    element("distance").textContent = `${Number((geometry.norm(geometry.subtract(place(first), place(second))) / size).toPrecision(6))} ${name}`;
  }

  function setFrame(name) {
    state.scene?.setFrame(name);
    for (const other of ["lvlh", "inertial"]) element(`frame-${other}`).setAttribute("aria-pressed", String(other === name));
    legend(name);
  }

  function legend(name = "lvlh") {
    const entry = (css, words) => {
      const item = document.createElement("span"), line = document.createElement("i");
      line.style.borderColor = css;
      item.append(line, words);
      return item;
    };
    const notes = document.createElement("span");
    notes.textContent = name === "inertial" ? `Earth to scale. ${store.formation?.chief_note || ""}` : "Equal scale on all axes; click two satellites for their distance.";
    element("legend").replaceChildren(entry(style("--fresh"), "fresh link"), entry(style("--stale"), "stale or lossy"), entry(style("--dead"), "sender lost"), notes);
  }

  function wire() {
    element("frame-lvlh").onclick = () => setFrame("lvlh");
    element("frame-inertial").onclick = () => setFrame("inertial");
    for (const button of document.querySelectorAll("[data-look]")) {
      const along = { x: [1, 0, 0], y: [0, -1, 0], z: [0, 0, 1] }[button.dataset.look];
      button.onclick = () => state.scene?.look(along || null);
    }
    element("follow").onchange = ({ target }) => follow(target.value === "" ? null : Number(target.value));
    for (const id of ["measure-from", "measure-to"]) {
      element(id).onchange = () => measure(["measure-from", "measure-to"].map((one) => element(one).value).filter((value) => value !== "").map(Number));
    }
    element("reset").onclick = () => { element("follow").value = ""; state.scene?.reset(); };
    element("picture").onclick = () => {
      const anchor = document.createElement("a");
      anchor.href = state.scene.picture();
      anchor.download = `${store.formation.name}.png`;
      anchor.click();
    };
    element("play").onclick = play;
    element("now").onclick = now;
    element("slider").oninput = () => seek((Number(element("slider").value) / 1000) * store.lastTime());
    dark.addEventListener("change", () => { state.scene?.restyle(); state.charts?.rebuild(); legend(state.scene?.frame()); show(state.now); });
    legend();
  }

  wire();
  state.connection = liveConnection.open({
    take, draw: ({ kind }) => { if (kind === "news") arrived(); }, reply: (answer) => state.hands?.reply(answer),
  });
  return { store, state, seek };
})();
