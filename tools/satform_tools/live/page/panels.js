// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// Tables beside the scene: satellites with their state, and events.
const livePanels = (() => {
  const MOST_SATELLITES = 40;
  const { element } = page;
  const shown = (value) => (Number.isFinite(value) ? (value !== 0 && Math.abs(value) < 1e-3 ? value.toExponential(2) : String(Number(value.toPrecision(4)))) : "–");

  // One row for each satellite; of very many only those that are lost, stale, followed or measured.
  function health(store, row, alive, { colour, follow, chosen }) {
    const { names } = store.formation;
    const body = element("health").tBodies[0];
    const states = names.map((_, index) => state(store, row, alive, index));
    const crowd = names.length > MOST_SATELLITES;
    const rows = names.map((_, index) => index).filter((index) => !crowd || states[index] !== "flying" || chosen.includes(index)).slice(0, MOST_SATELLITES);
    if (body.dataset.rows !== rows.join()) {
      body.replaceChildren(...rows.map((index) => healthRow(names[index], colour(index), () => follow(index))));
      body.dataset.rows = rows.join();
    }
    element("health").hidden = !rows.length;
    rows.forEach((index, place) => {
      const cells = body.rows[place].cells;
      cells[0].querySelector("i").style.background = colour(index);
      cells[1].textContent = states[index];
      cells[1].className = states[index];
      ["error", "control", "delta_v"].forEach((name, column) => {
        cells[2 + column].textContent = store.rows ? shown(store.values(name, row)[index]) : "–";
      });
    });
    const flying = states.filter((one) => one === "flying").length;
    element("health-note").textContent = `${flying} of ${names.length} satellites fly${crowd ? "; of so many only those are listed that are lost, stale, followed or measured" : ""}.`;
    return states;
  }

  function state(store, row, alive, index) {
    if (alive[index] === false) return "lost";
    if (!store.rows) return "flying";
    const value = store.values("health", row)[index];
    return value === 0 ? "lost" : value < 1 ? "stale" : "flying";
  }

  function healthRow(name, css, follow) {
    const row = document.createElement("tr");
    const first = document.createElement("td");
    const dot = document.createElement("i");
    const button = document.createElement("button");
    dot.style.background = css;
    button.type = "button";
    button.textContent = name;
    button.title = `Follow ${name}`;
    button.addEventListener("click", follow);
    first.append(dot, button);
    row.append(first, document.createElement("td"));
    for (let k = 0; k < 3; k++) {
      const cell = document.createElement("td");
      cell.className = "number";
      row.append(cell);
    }
    return row;
  }

  function events(store, clock, seek) {
    const list = element("events");
    if (list.dataset.last === String(store.events.length) && list.dataset.first === String(store.events[0]?.time)) return;
    list.dataset.last = String(store.events.length);
    list.dataset.first = String(store.events[0]?.time);
    list.replaceChildren(...[...store.events].reverse().map((event) => {
      const item = document.createElement("li");
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = clock.text(event.time);
      button.addEventListener("click", () => seek(event.time));
      const words = document.createElement("span");
      words.textContent = event.text;
      item.append(button, words);
      return item;
    }));
    if (!store.events.length) {
      const item = document.createElement("li");
      item.textContent = "None so far";
      list.append(item);
    }
  }

  function facts(pairs) {
    element("facts").replaceChildren(...pairs.map(([name, value]) => {
      const box = document.createElement("div");
      const [term, text] = [document.createElement("dt"), document.createElement("dd")];
      [term.textContent, text.textContent] = [name, value];
      box.append(term, text);
      return box;
    }));
  }

  return { health, events, facts, shown };
})();
