// Copyright 2026 satform contributors
// SPDX-License-Identifier: Apache-2.0
"use strict";

// The connection of a page to its server: it is made again when it is lost, and each message is acknowledged when it is drawn.
const liveConnection = (() => {
  const { element } = page;

  // take: stores a message; draw: shows what is stored; reply: takes the reply to a request.
  function open({ take, draw, reply = () => {} }) {
    let socket = null, tries = 0;

    function connect() {
      socket = new WebSocket(`ws://${location.host}/live${location.search}`);
      const own = socket;
      own.onmessage = ({ data }) => received(own, JSON.parse(data));
      own.onopen = () => { tries = 0; trouble(""); };
      own.onclose = () => {
        tries++;
        trouble("The connection to the server is lost; the page tries again. What was received stays.");
        setTimeout(connect, Math.min(5000, 250 * 2 ** tries));
      };
    }

    // The next message comes when this one is drawn: neither a slow nor a hidden page has any that wait.
    function received(own, message) {
      if (message.kind === "reply") return reply(message);
      take(message);
      requestAnimationFrame(() => {
        draw(message);
        requestAnimationFrame(() => { if (own.readyState === WebSocket.OPEN) own.send("drawn"); });
      });
    }

    connect();
    return { send: (request) => socket.send(JSON.stringify(request)) };
  }

  function trouble(text) {
    element("trouble").textContent = text;
    element("trouble").hidden = !text;
  }

  return { open };
})();
