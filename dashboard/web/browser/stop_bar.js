// Stop bar of the page. It runs before and without viser: it has its own WebSocket, and sees every
// key first.
"use strict";
(() => {
  const STATUS_TIMEOUT = 1500; // ms without a status after which the connection counts as lost
  const HOLD_TIMEOUT = 1500; // ms that one request to hold may take
  const HOLD_ATTEMPTS = 5; // of a hold that the dashboard answers
  const HOLD_PERSISTENCE = 30000; // ms for which a hold that no dashboard answers is sent again
  const RECONNECT_DELAY = 200; // ms
  const MAX_QUEUED = 256; // bytes of signs of life that may wait for the network
  const SIGN_PERIOD = 20; // ms between two signs of life of an approach
  const CONNECT_TIME = 20000; // ms that the first status may take until the connection counts as lost
  const EMERGENCY = "Use the hard-wired emergency stop.";

  const elements = {};
  let socket = null;
  let status = null;
  let acts = false; // whether this window has the controls
  let statusTime = -Infinity;
  let reachable = false; // whether the dashboard has opened the socket and sent no status yet
  let holdText = ""; // outcome of the last hold until the arms are known to stand
  let holding = false;
  let attempts = 0; // that are left
  let pressTime = 0; // of the last press of HOLD
  let lastRequest = 0; // of a hold
  const answers = new Map(); // functions that take the answer to a request of the socket, by number
  let offer = null;
  let press = null; // of the approach's button: {number, offer, timer}

  function show() {
    if (!elements.bar) return;
    const connected = performance.now() - statusTime < STATUS_TIMEOUT;
    const connecting = !status && performance.now() < CONNECT_TIME;
    let text = connecting ? "Connecting …" : "No connection to the dashboard";
    let detail = "A hold may not arrive. " + EMERGENCY;
    let color = connecting ? "#8a93a0" : "#f05454";
    if (connected) ({ text, detail, color } = status);
    else if (reachable && status) [text, detail] = ["The dashboard starts anew", "HOLD works; the arms' state comes soon."];
    if (!connected && status) window.dispatchEvent(new CustomEvent("lariat-lost"));
    if (holdText && !(connected && status.stopped)) {
      text = holdText;
    }
    const alarms = !connected && !connecting;
    elements.bar.classList.toggle("alarm", alarms || (holdText !== "" && !status?.stopped));
    elements.bar.dataset.state = !connected ? "lost" : status.stopped ? "stopped" : "live";
    elements.dot.style.background = color;
    elements.headline.textContent = text;
    elements.detail.textContent = detail;
    elements.bar.title = connected && status.rule ? `rule ${status.rule}` : "";
    elements.hold.classList.toggle("sent", holding);
    // A pressed button keeps its name and place until it is released.
    offer = press ? press.offer : connected && acts ? status.approach : null;
    elements.approach.hidden = !offer;
    if (offer) elements.approach.textContent = offer.label + " (keep pressed)";
    elements.approach.classList.toggle("pressed", press !== null);
  }

  // Ask over the socket that is open already, and by a request of its own where that gave no answer.
  async function askToHold(number, bySocket) {
    if (bySocket && socket?.readyState === WebSocket.OPEN) {
      return new Promise((resolve, reject) => {
        answers.set(number, resolve);
        setTimeout(() => answers.delete(number) && reject(new Error("no answer")), HOLD_TIMEOUT);
        socket.send(JSON.stringify({ type: "hold", number }));
      });
    }
    const answer = await fetch("hold", {
      method: "POST",
      keepalive: true,
      signal: AbortSignal.timeout(HOLD_TIMEOUT),
    });
    return answer.ok ? answer.json() : { confirmed: false, text: "no answer from the dashboard" };
  }

  // Ask once; whether the gateway has confirmed the last request of this page. A confirmation of an
  // earlier one says nothing about a later press.
  async function requestHold(bySocket) {
    const number = ++lastRequest;
    let text = "no answer from the dashboard";
    try {
      const outcome = await askToHold(number, bySocket);
      if (outcome.confirmed && number === lastRequest) holdText = "";
      text = outcome.text;
    } catch {
      if (performance.now() - pressTime < HOLD_PERSISTENCE) attempts = HOLD_ATTEMPTS;
      await new Promise((resolve) => setTimeout(resolve, RECONNECT_DELAY));
    }
    if (holdText) holdText = `HOLD NOT CONFIRMED: ${text}. ${EMERGENCY}`;
    show();
    return holdText === "";
  }

  async function hold() {
    release();
    attempts = HOLD_ATTEMPTS;
    pressTime = performance.now();
    if (holding) {
      requestHold(true);
      return;
    }
    holding = true;
    holdText = "Hold sent …";
    show();
    for (let bySocket = true; attempts-- > 0; bySocket = !bySocket) {
      if (await requestHold(bySocket)) break;
    }
    holding = false;
    show();
  }

  function sign() {
    // Signs that wait for the network would arrive when nobody presses any more.
    if (!socket || socket.readyState !== WebSocket.OPEN || socket.bufferedAmount > MAX_QUEUED) {
      release();
      return;
    }
    const { number, offer } = press;
    const { distance, angle } = offer;
    socket.send(JSON.stringify({ type: "approach", press: number, distance, angle }));
  }

  function begin(event) {
    event.preventDefault();
    if (press || !offer || event.button !== 0) return;
    const number = 1 + Math.floor(Math.random() * 2 ** 31);
    press = { number, offer, timer: setInterval(sign, SIGN_PERIOD) };
    sign();
    show();
  }

  function release() {
    if (!press) return;
    clearInterval(press.timer);
    if (socket && socket.readyState === WebSocket.OPEN) {
      socket.send(JSON.stringify({ type: "release", press: press.number }));
    }
    press = null;
    show();
  }

  function connect() {
    const url = new URL("cell", location.href);
    url.protocol = url.protocol.replace("http", "ws");
    socket = new WebSocket(url);
    socket.onopen = () => {
      reachable = true;
      show();
    };
    socket.onmessage = (message) => {
      const news = JSON.parse(message.data);
      if (news.hold !== undefined) {
        answers.get(news.hold)?.(news.answer);
        answers.delete(news.hold);
        return;
      }
      reachable = false;
      status = news.cell;
      acts = news.controls.role === "holder";
      statusTime = performance.now();
      window.dispatchEvent(new CustomEvent("lariat-news", { detail: news }));
      if (status.stopped && !holding) holdText = "";
      if (press && press.number === status.ended) release();
      show();
      // The next one is sent after this, so that none waits for a slow browser.
      message.target.send('{"type":"seen"}');
    };
    socket.onclose = () => {
      reachable = false;
      statusTime = -Infinity;
      release();
      for (const take of answers.values()) take({ confirmed: false, text: "the connection was lost" });
      answers.clear();
      window.dispatchEvent(new CustomEvent("lariat-lost", { detail: { closed: true } }));
      show();
      setTimeout(reconnect, RECONNECT_DELAY);
    };
  }

  // Browsers delay WebSockets the longer the more of them fail: a request asks for the server first.
  function reconnect() {
    const signal = AbortSignal.timeout(HOLD_TIMEOUT);
    fetch("keys.js", { cache: "no-store", signal }).then(connect, () => setTimeout(reconnect, RECONNECT_DELAY));
  }

  function element(tag, name, parent) {
    const made = document.createElement(tag);
    made.className = name;
    parent.append(made);
    return made;
  }

  function build() {
    const bar = document.createElement("section");
    bar.id = "stop-bar";
    bar.setAttribute("aria-label", "Stop");
    const line = element("div", "status", bar);
    line.setAttribute("role", "status");
    elements.dot = element("span", "dot", line);
    const text = element("div", "text", line);
    elements.headline = element("div", "headline", text);
    elements.detail = element("div", "detail", text);
    elements.approach = element("button", "approach", bar);
    elements.approach.addEventListener("pointerdown", begin);
    for (const end of ["pointerup", "pointercancel", "pointerleave", "lostpointercapture"]) {
      elements.approach.addEventListener(end, release);
    }
    elements.approach.addEventListener("contextmenu", (event) => event.preventDefault());
    elements.hold = element("button", "hold", bar);
    elements.hold.textContent = "HOLD";
    elements.hold.title = "Brake now. This is software: the emergency stop is the hard-wired one";
    element("small", "", elements.hold).textContent = "or Space, Esc";
    elements.hold.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      hold();
    });
    // Of a keyboard or an assistive tool; a click of a pointer has held already.
    elements.hold.addEventListener("click", (event) => event.detail === 0 && hold());
    document.body.append(bar);
    elements.bar = bar;
    show();
  }

  // Lists and menus that open stay above the bar: the page's libraries read from here how high the
  // window is.
  function endViewportAtBar() {
    const viewport = window.visualViewport;
    const read = (target, name) => {
      const value = Reflect.get(target, name, target);
      if (name === "height") return value - (elements.bar?.offsetHeight ?? 0);
      return typeof value === "function" ? value.bind(target) : value;
    };
    Object.defineProperty(window, "visualViewport", { value: new Proxy(viewport, { get: read }) });
  }

  function key(event) {
    if (event.key !== " " && event.code !== "Space" && event.key !== "Escape") return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (event.type === "keydown" && !event.repeat) hold();
  }

  for (const type of ["keydown", "keypress", "keyup"]) {
    window.addEventListener(type, key, { capture: true });
  }
  window.addEventListener("lariat-say", (event) => {
    if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(event.detail));
  });
  window.addEventListener("blur", release);
  window.addEventListener("pagehide", release);
  document.addEventListener("visibilitychange", release);
  document.addEventListener("DOMContentLoaded", build);
  setInterval(show, STATUS_TIMEOUT / 3);
  connect();
  endViewportAtBar();
})();
